"""Arguments and options shared by several commands, and their defaults."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.interface.choices import BOARDS, CORES, ERROR_FEEDBACK, REALIZATIONS, board_named, did_you_mean

if TYPE_CHECKING:
    from sosmith import Table


class OneOf(click.Choice[str]):
    """A choice of names; an unknown name is refused with a suggestion."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        return f"{super().get_invalid_choice_message(value, ctx)[:-1]}{did_you_mean(str(value), self.choices)}."


def completed_by(names: Iterable[str]) -> Callable[[click.Context, click.Parameter, str], list[str]]:
    """Return what a shell completes an option's value by, where the option checks its value itself."""
    return lambda ctx, parameter, begun: [name for name in names if name.startswith(begun)]


SPEC = click.argument("spec", type=click.Path(path_type=Path))
CORE = click.option("--core", type=OneOf(CORES), help="Part of the specification to build.  [default: all of it]")
REALIZATION = click.option(
    "--realization",
    type=OneOf(REALIZATIONS),
    help="Structure of the filter sections; overrides the specification.",
)
WIDTHS_OF = click.option(
    "--widths-of",
    type=OneOf(ERROR_FEEDBACK),
    help="Use the word lengths chosen for this realization, to compare structures at equal widths.",
)
BOARD = click.option(
    "--board",
    metavar="BOARD",
    callback=lambda ctx, parameter, name: None if name is None else board_named(name),
    shell_complete=completed_by(BOARDS),
    help=f"Target board, whose multipliers an automatic choice of the architecture considers: {', '.join(BOARDS)}.",
)
SEED = click.option(
    "--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Random seed for noise and handshakes."
)
SECONDS = click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    help="Length of a built-in scenario, in seconds of simulated time.",
)
PORT = click.option("--port", metavar="PORT", help="Serial port of a board, real or virtual, that has the core.")
BAUD = click.option(
    "--baud",
    type=click.IntRange(min=1),
    default=1_000_000,
    show_default=True,
    help="Bits per second on the serial port, for which the board was built.",
)


def print_tables(tables: Iterable[Table]) -> None:
    """Print tables on stdout."""
    from sosmith.commands.tables.console import print_all  # and with it rich, which is slow to import

    print_all(tables)
