"""Arguments and options that several commands take, and what they stand for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from sosmith.gen.fpga.boards import BOARDS, find_board
from sosmith.gen.specification.choices import CORES, ERROR_FEEDBACK, REALIZATIONS
from sosmith.model.suggestion import did_you_mean


class OneOf(click.Choice[str]):
    """One of some names; an unknown one is refused with the name that was probably meant."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        return f"{super().get_invalid_choice_message(value, ctx)[:-1]}{did_you_mean(str(value), self.choices)}."


SPEC = click.argument("spec", type=click.Path(path_type=Path))
CORE = click.option("--core", type=OneOf(CORES), help="The part to make.  [default: all that the specification has]")
REALIZATION = click.option(
    "--realization",
    type=OneOf(REALIZATIONS),
    help="Use this one, whatever the specification says.",
)
WIDTHS_OF = click.option(
    "--widths-of",
    type=OneOf(ERROR_FEEDBACK),
    help="Keep the word lengths chosen for this realization, to compare structures at equal width.",
)
BOARD = click.option(
    "--board",
    metavar="BOARD",
    callback=lambda ctx, parameter, name: None if name is None else find_board(name).name,
    help=f"What it is meant for: an automatic choice of the architecture heeds its multipliers. {', '.join(BOARDS)}.",
)
SEED = click.option(
    "--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Seed of noise and handshakes."
)
SECONDS = click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    help="Length of a scenario, in seconds of its own time.",
)


def default_folder(name: str) -> Path:
    """Return the folder for what is made of the specification `name`, if none is given."""
    return Path("build") / name
