"""The `sosmith` command: data goes to stdout, progress and messages to stderr.

Exit status: 0 good; 1 the result falls short; 2 bad usage or a bad specification; 3 a tool is missing or
failed; 130 interrupted.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import wraps
from importlib import import_module
from io import TextIOWrapper
from tempfile import gettempdir
from types import FrameType
from typing import Any, NamedTuple

import click

import sosmith
from sosmith.commands.standard_streams import StandardStreams
from sosmith.given_paths import check_paths
from sosmith.model.errors import SosmithError, ToolError
from sosmith.model.suggestion import did_you_mean
from sosmith.terminal import be_quiet, note, reader_may_leave, silence_stdout

# Matrices are small here: threads of the linear algebra would mostly wait, at more than twice the processor time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


class _Command(NamedTuple):
    """Where a command is defined, and its line in the list of commands."""

    module: str
    attribute: str
    summary: str


_COMMANDS = {
    "init": _Command("design", "init", "Write a commented example specification to FILE (default: flange_wear.toml)."),
    "import": _Command(
        "import_filter", "import_command", "Write a specification with the filter of another tool's FILE."
    ),
    "combinations": _Command(
        "combinations", "combinations_command", "Show which architectures and options of a specification go together."
    ),
    "design": _Command(
        "design",
        "design_command",
        "Show the design of SPEC: order, realization, architecture, cost and error budget.",
    ),
    "generate": _Command(
        "design",
        "generate_command",
        "Write SystemVerilog, RTLIL, a manifest, a certificate and a bit-true C model for SPEC.",
    ),
    "package": _Command(
        "package",
        "package_command",
        "Pack the core of SPEC for other tools, with a bench that needs none of ours.",
    ),
    "verify": _Command(
        "verify", "verify", "Prove CERTIFICATE by an independent method: the error bound, and no internal overflow."
    ),
    "reload": _Command(
        "reload",
        "reload_command",
        "Prove that a running core can load new coefficients, and save the register writes.",
    ),
    "studio": _Command(
        "studio",
        "studio_command",
        "Design by looking: a page with the design of SPEC, or of the example, live and proven.",
    ),
    "build": _Command(
        "build",
        "build_command",
        "Build a bitstream with the core of SPEC and the serial link of docs/protocol.md for a board.",
    ),
    "simulate": _Command(
        "simulate", "simulate_command", "Simulate the generated hardware of SPEC and report its accuracy."
    ),
    "emulate": _Command(
        "simulate",
        "emulate_command",
        "Write an emulated sensor trace for SPEC as CSV; without SCENARIO, list the scenarios for SPEC.",
    ),
    "board": _Command(
        "board",
        "board_command",
        "Run the board of SPEC behind a pseudo-terminal, whose path is the first line on stdout.",
    ),
    "stream": _Command(
        "stream", "stream_command", "Send the samples of TRACE to the board at PORT, and write its results."
    ),
    "monitor": _Command(
        "monitor",
        "monitor_command",
        "Watch the board at PORT: live values, wear, rate and flags in the terminal, or in a browser.",
    ),
    "compare": _Command("compare", "compare_command", "Compare accuracy reports side by side."),
    "explore": _Command(
        "explore",
        "explore_command",
        "Design every combination of values, or search, and show the Pareto front of proven error against cost.",
    ),
    "calibrate": _Command(
        "instrument.calibrate",
        "calibrate",
        "Store sensor measurements, and refit the calibration with every addition.",
    ),
    "spectrum": _Command(
        "instrument.spectrum",
        "spectrum_command",
        "Show the spectra of traces, and propose a low-pass filter based on them.",
    ),
    "vehicle": _Command("instrument.vehicle", "vehicle", "Simulate the motion of a six-axle locomotive on a track."),
    "wear": _Command(
        "instrument.wear",
        "wear_command",
        "Estimate the wear, wear rate and remaining life of a wheel flange from TRACE.csv.",
    ),
    "paper": _Command(
        "instrument.paper",
        "paper",
        "Recompute the paper's equations and tables, and compare them with the printed figures.",
    ),
    "demo": _Command(
        "simulate", "demo", "Run the complete flow on the built-in example: a locomotive's flange wear at 100 Hz."
    ),
}
"""The commands in the order they are used; the module of each one is imported when the command is called."""

_GROUPS = {
    "Filter": ("init", "import", "design", "combinations", "studio", "explore", "demo"),
    "Hardware": ("generate", "package", "simulate", "emulate", "reload"),
    "Board": ("build", "board", "stream", "monitor"),
    "Instrument": ("calibrate", "spectrum", "vehicle", "wear", "paper"),
    "Evidence": ("verify", "compare"),
}
"""The commands by their subject, as the help lists them."""

_INTERRUPTED = 130


class _Commands(click.Group):
    """Lists commands without importing them."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in _COMMANDS:
            place = _COMMANDS[cmd_name]
            command: click.Command = getattr(import_module(f"sosmith.commands.{place.module}"), place.attribute)
            _prepare(command)
            return command
        if ctx.resilient_parsing:  # during shell completion
            return None
        raise click.UsageError(f"No such command {cmd_name!r}{did_you_mean(cmd_name, _COMMANDS)}.", ctx)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        widest = max(map(len, _COMMANDS))
        for title, names in _GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(f"{name:{widest}}", _COMMANDS[name].summary) for name in names])

    def invoke(self, ctx: click.Context) -> Any:
        with reader_may_leave():
            return super().invoke(ctx)


def _prepare(command: click.Command) -> None:
    """Give a command, and those of a group, the option ``-q`` and the check of its outputs."""
    if isinstance(command, click.Group):
        for one in command.commands.values():
            _prepare(one)
    elif all(parameter.name != "quiet" for parameter in command.params):

        def told(_context: click.Context, _option: click.Parameter, quiet: bool) -> None:
            be_quiet(quiet)

        command.params.append(
            click.Option(
                ["-q", "--quiet"],
                is_flag=True,
                expose_value=False,
                callback=told,
                help="Show no progress.",
            )
        )
        command.callback = _checked(command.callback)


def _checked(callback: Callable[..., Any] | None) -> Callable[..., Any]:
    """Return what a command does, after the check of its outputs."""
    assert callback is not None

    @wraps(callback)
    def run(*values: Any, **options: Any) -> Any:
        check_paths(click.get_current_context())
        return callback(*values, **options)

    return run


_HELP = """Turn a filter specification and calibration data into FPGA hardware that is checked bit for bit.

A specification is a TOML file in physical units: sensor inputs, a calibration polynomial, a filter, the output
format and the allowed error. To get started:

\b
    sosmith init my.toml        write a commented example
    sosmith design my.toml      show the filter, formats, error budget and cost
    sosmith simulate my.toml    simulate the generated hardware and write the report

In Python, all of this is available through import sosmith. To turn on shell completion:

\b
    eval "$(_SOSMITH_COMPLETE=bash_source sosmith)"    bash
    eval "$(_SOSMITH_COMPLETE=zsh_source sosmith)"     zsh
    _SOSMITH_COMPLETE=fish_source sosmith | source     fish
"""


@click.group(
    cls=_Commands, help=_HELP, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(sosmith.__version__, prog_name="sosmith")
def cli() -> None:
    """Group all commands."""


def main() -> None:
    """Run the command line and end the process with its exit status."""
    streams = StandardStreams()
    os.umask(os.umask(0o077) & 0o077)  # what we make we can read and write
    if isinstance(sys.stdout, TextIOWrapper):  # a file's name may be no text, and a terminal may lack our signs
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) is signal.SIG_DFL:  # nohup ignores hang-ups: leave it so
                signal.signal(number, _stop)
        status = cli.main(prog_name="sosmith", standalone_mode=False)
    except SosmithError as error:
        note(f"error: {error}")
        status = error.exit_status
    except click.ClickException as error:
        error.show()
        status = error.exit_code
    except (KeyboardInterrupt, click.Abort):
        status = _interrupted()
    except RuntimeError as error:
        # As Python 3.11 wraps what a signal's handler raises while a library makes a class.
        if isinstance(error.__cause__, SystemExit):
            raise error.__cause__ from None
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        status = _interrupted()
    except OSError as error:
        note(f"error: {_unusable(error)}")
        status = ToolError.exit_status
        silence_stdout()
    with suppress(OSError):  # a reader that has left
        sys.stdout.flush()
    if streams.lost is not None and not status:
        note(f"error: {streams.lost}")
        status = ToolError.exit_status
    sys.exit(status)


def _unusable(error: OSError) -> str:
    if error.errno == errno.ENOSPC and error.filename is None:  # what was written is not known then
        return f"the disks of the output and of {gettempdir()} must have room, not: {error.strerror}"
    return f"{error.filename or 'the output'} must be readable and writable, not: {error.strerror}"


def _interrupted() -> int:
    note("interrupted")
    return _INTERRUPTED


def _stop(number: int, frame: FrameType | None) -> None:
    """Exit in an orderly way, so that no simulator is left running."""
    sys.exit(128 + number)


if __name__ == "__main__":
    main()
