"""The `sosmith` command: data goes to stdout, progress and messages to stderr.

Exit status: 0 good; 1 the result falls short; 2 bad usage or a bad specification; 3 a tool is missing or
failed; 130 interrupted.
"""

from __future__ import annotations

import signal
import sys
from types import FrameType
from typing import Any

import click

import sosmith
from sosmith.commands.calibrate import calibrate
from sosmith.commands.compare import compare_command
from sosmith.commands.design import design, generate, init
from sosmith.commands.paper import paper
from sosmith.commands.reload import reload_command
from sosmith.commands.simulate import demo, emulate_command, simulate_command
from sosmith.commands.spectrum import spectrum_command
from sosmith.commands.vehicle import vehicle
from sosmith.commands.verify import verify
from sosmith.commands.wear import wear_command
from sosmith.model.errors import SosmithError, ToolError
from sosmith.terminal import note, reader_may_leave, silence_stdout

_LATER = ("build", "explore", "monitor", "board")
"""Commands that this version does not have yet."""

_INTERRUPTED = 130


class _Commands(click.Group):
    """Lists commands in the order of work and names those that are still to come."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in _LATER:
            have = ", ".join(self.commands)
            raise click.UsageError(f"{cmd_name} is not yet available: the commands so far are {have}")
        return super().get_command(ctx, cmd_name)

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
"""


@click.group(
    cls=_Commands, help=_HELP, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(sosmith.__version__, prog_name="sosmith")
def cli() -> None:
    """Hold the commands."""


for _command in (
    init,
    design,
    generate,
    verify,
    reload_command,
    simulate_command,
    emulate_command,
    compare_command,
    calibrate,
    spectrum_command,
    vehicle,
    wear_command,
    paper,
    demo,
):
    cli.add_command(_command)


def main() -> None:
    """Run the command line and end the process with its exit status."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_DFL:  # nohup has hang-ups ignored, and that stays
            signal.signal(number, _stop)
    try:
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
