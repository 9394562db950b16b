"""The [filter] table for a proposal, by itself or inserted into an existing specification."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from decimal import Decimal
from typing import Any

from sosmith.gen.version import __version__
from sosmith.instrument.spectrum.proposal import Proposal
from sosmith.model.errors import SpecificationError

_HEADER = re.compile(r"[ \t]*\[[ \t]*(?:filter|\"filter\"|'filter')[ \t]*\][ \t]*(?:#.*)?")
_NEXT = re.compile(r"[ \t]*\[")


def filter_table(proposal: Proposal, provenance: Sequence[str]) -> str:
    """Text of the table in TOML, with comments on the origin of its numbers.

    Parameters
    ----------
    proposal : Proposal
        The proposal.
    provenance : sequence of str
        Lines that describe its origin.
    """
    made = proposal.filter
    lines = ["[filter]"]
    lines += [f"# {_one_line(text)}" for text in (f"Proposed by sosmith {__version__} from spectra of", *provenance)]
    lines += [f"# {made.describe}; group delay {proposal.delay:.4g} s at zero frequency"]
    lines += ['family = "butterworth"', 'kind = "lowpass"', 'method = "bilinear"']
    for choice in proposal.choices:
        lines += [f"# {_one_line(choice.reason)}", f"{f'{choice.key} = {choice.value!r}':<31} # {choice.unit}"]
    return "\n".join(lines) + "\n"


def _one_line(text: str) -> str:
    """Replace unprintable characters, so that no file name can end a comment."""
    return "".join(char if char.isprintable() else "?" for char in text)


def replace_filter(specification: str, table: str, name: str) -> str:
    """Replace the [filter] table of a specification by `table`; everything else is unchanged.

    To find the end of the old table, each line that could begin the next one is tried until the rest parses as before.

    Parameters
    ----------
    specification : str
        Text of a specification, TOML.
    table : str
        Text of the new table.
    name : str
        The specification's file, for messages.

    Raises
    ------
    SpecificationError
        If there is no line ``[filter]``, or the end of the table cannot be found.
    """
    old, new = _read(specification), _read(table)
    assert old is not None
    assert new is not None
    lines = specification.splitlines(keepends=True)
    for start in (k for k, line in enumerate(lines) if _HEADER.fullmatch(line.rstrip("\r\n"))):
        for stop in [k for k in range(start + 1, len(lines)) if _NEXT.match(lines[k])] + [len(lines)]:
            end = _before_comments(lines, start, stop)
            gap = "" if end == len(lines) or not lines[end].strip() else "\n"
            text = "".join(lines[:start]) + table + gap + "".join(lines[end:])
            if _read(text) == old | new:
                return text
    raise SpecificationError(f"{name}: filter must be a table under a line [filter] of its own, to be replaced")


def _before_comments(lines: Sequence[str], start: int, stop: int) -> int:
    """Step back from `stop` over the comments directly above it and the blank lines before them."""
    end = stop
    while stop < len(lines) and end > start + 1 and lines[end - 1].lstrip().startswith("#"):
        end -= 1
    if end > start + 1 and lines[end - 1].strip():
        end = stop  # without a blank line between, the comments belong to the lines above
    while end > start + 1 and not lines[end - 1].strip():
        end -= 1
    return end


def _read(text: str) -> dict[str, Any] | None:
    try:
        return tomllib.loads(text, parse_float=Decimal)
    except tomllib.TOMLDecodeError:
        return None
