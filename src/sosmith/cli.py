"""The `sosmith` command: data goes to stdout, progress and messages to stderr.

Exit status: 0 good; 1 the result falls short; 2 bad usage or a bad specification; 3 a tool is missing or
failed; 130 interrupted.
"""

from __future__ import annotations

import signal
import sys
from importlib import import_module
from types import FrameType
from typing import Any, NamedTuple

import click

import sosmith
from sosmith.model.errors import SosmithError, ToolError
from sosmith.model.suggestion import did_you_mean
from sosmith.terminal import note, reader_may_leave, silence_stdout


class _Command(NamedTuple):
    """Where a command is, and its line in the list of commands."""

    module: str
    attribute: str
    summary: str


_COMMANDS = {
    "init": _Command(
        "design", "init", "Write a commented example specification to FILE (flange_wear.toml if none is given)."
    ),
    "design": _Command(
        "design",
        "design_command",
        "Show the design of SPEC: order, sections, realization, formats, error budget, cost.",
    ),
    "generate": _Command(
        "design",
        "generate_command",
        "Write SystemVerilog, RTLIL, manifest, certificate and a bit-true C model of SPEC.",
    ),
    "verify": _Command(
        "verify", "verify", "Prove CERTIFICATE again: the error bound, and that nothing inside can overflow."
    ),
    "reload": _Command(
        "reload", "reload_command", "Prove a set of constants for a core that runs, and write what loads it."
    ),
    "simulate": _Command(
        "simulate", "simulate_command", "Run the generated hardware of SPEC in a simulator and report its accuracy."
    ),
    "emulate": _Command(
        "simulate",
        "emulate_command",
        "Write an emulated sensor trace for SPEC as CSV; without SCENARIO, list the scenarios that fit.",
    ),
    "compare": _Command("compare", "compare_command", "Set accuracy reports side by side."),
    "calibrate": _Command(
        "calibrate",
        "calibrate",
        "Keep measurements of sensors, and a calibration that is fitted anew with every addition.",
    ),
    "spectrum": _Command(
        "spectrum",
        "spectrum_command",
        "Show the spectra of each TRACE.csv, and propose the low-pass filter that follows from them.",
    ),
    "vehicle": _Command("vehicle", "vehicle", "Run a six-axle locomotive over a track."),
    "wear": _Command(
        "wear",
        "wear_command",
        "Tell from TRACE.csv how far a wheel flange is worn, how fast it wears, and how long it will last.",
    ),
    "paper": _Command(
        "paper", "paper", "Compute the paper's equations and tables again, and set ours beside the printed figures."
    ),
    "demo": _Command(
        "simulate", "demo", "Walk the whole road on the built-in example: a locomotive's flange wear at 100 Hz."
    ),
}
"""The commands in the order of work; the module of each one loads when the command is called."""

_LATER = ("build", "explore", "monitor", "board")
"""Commands that this version does not have yet."""

_INTERRUPTED = 130


class _Commands(click.Group):
    """Lists commands without loading them, and names those that are still to come."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in _COMMANDS:
            place = _COMMANDS[cmd_name]
            command: click.Command = getattr(import_module(f"sosmith.commands.{place.module}"), place.attribute)
            return command
        if ctx.resilient_parsing:  # while a word is completed
            return None
        if cmd_name in _LATER:
            raise click.UsageError(f"{cmd_name} is not yet available: the commands so far are {', '.join(_COMMANDS)}")
        raise click.UsageError(f"No such command {cmd_name!r}{did_you_mean(cmd_name, _COMMANDS)}.", ctx)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.summary) for name, command in _COMMANDS.items()])

    def invoke(self, ctx: click.Context) -> Any:
        with reader_may_leave():
            return super().invoke(ctx)


_HELP = """From a filter specification and calibration data to FPGA hardware that is checked bit for bit.

A specification is a TOML file in physical units: sensor inputs, a calibration polynomial, a filter, the output's
format and the error allowed. Begin with

\b
    sosmith init my.toml        write a commented example
    sosmith design my.toml      see filter, formats, error budget and cost
    sosmith simulate my.toml    run the generated hardware and read the report

The same from Python: import sosmith. Completion in bash: eval "$(_SOSMITH_COMPLETE=bash_source sosmith)"; zsh_source
and fish_source do it for these shells.
"""


@click.group(
    cls=_Commands, help=_HELP, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(sosmith.__version__, prog_name="sosmith")
def cli() -> None:
    """Hold the commands."""


def main() -> None:
    """Run the command line and end the process with its exit status."""
    try:
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) is signal.SIG_DFL:  # nohup has hang-ups ignored, and that stays
                signal.signal(number, _stop)
        status = cli.main(prog_name="sosmith", standalone_mode=False)
    except SosmithError as error:
        note(f"error: {error}")
        status = error.exit_status
    except click.ClickException as error:
        error.show()
        status = error.exit_code
    except (KeyboardInterrupt, click.Abort):
        note("interrupted")
        status = _INTERRUPTED
    except OSError as error:
        note(f"error: {error.filename or 'the output'} must be readable and writable, not: {error.strerror}")
        status = ToolError.exit_status
        silence_stdout()
    sys.exit(status)


def _stop(number: int, frame: FrameType | None) -> None:
    """End in good order, so that no simulator stays behind."""
    sys.exit(128 + number)


if __name__ == "__main__":
    main()
