"""The built-in scenarios by name: what each one is, and which kinds of core it fits."""

from __future__ import annotations

from typing import NamedTuple

from sosmith.model.errors import SpecificationError
from sosmith.model.suggestion import did_you_mean


class Summary(NamedTuple):
    """A scenario as it is listed to the user.

    Attributes
    ----------
    description : str
        One line.
    kinds : tuple of str
        Kinds of core it fits: "instrument", "filter".
    """

    description: str
    kinds: tuple[str, ...]


SUMMARIES = {
    "bench_43_50": Summary(
        "clearance in steps of 1 mm from 1 to 10 mm, 43 to 50 degC (the paper's table 1)",
        ("instrument",),
    ),
    "bench_92_96": Summary(
        "clearance in steps of 0.5 or 1 mm from 1 to 10 mm, 92 to 96 degC (the paper's table 2)",
        ("instrument",),
    ),
    "temperature_ramp": Summary(
        "20 to 98 degC at a clearance of 5 mm",
        ("instrument",),
    ),
    "wear_ramp": Summary(
        "wear from 2 to 9 mm under vehicle motion at 1.2, 2 and 8 Hz and broadband vibration",
        ("instrument",),
    ),
    "worst_case": Summary(
        "extreme codes in the sign pattern that drives the filter's output furthest",
        ("instrument", "filter"),
    ),
    "worst_case_errors": Summary(
        "the same for the way of every rounding error through the filter to the output, one after another",
        ("instrument", "filter"),
    ),
    "step": Summary(
        "steps of up to half the range around its middle",
        ("filter",),
    ),
    "sweep": Summary(
        "sine of 90 % of full scale from zero to 0.49 of the sample rate",
        ("filter",),
    ),
    "noise": Summary(
        "white noise, uniform over all codes",
        ("filter",),
    ),
}
"""Every scenario by name, in the order in which they are listed to the user."""


def fitting(kind: str) -> list[str]:
    """Return the names of the scenarios that fit a kind of core."""
    return [name for name, summary in SUMMARIES.items() if kind in summary.kinds]


def check_scenario(name: str, kind: str) -> None:
    """Refuse a scenario that does not exist for a kind of core.

    Raises
    ------
    SpecificationError
        With the names of those that there are.
    """
    known = fitting(kind)
    if name not in known:
        core = "a plain filter" if kind == "filter" else "an instrument"
        hint = did_you_mean(name, known)
        raise SpecificationError(f"scenario for {core} must be one of {', '.join(known)}, not {name!r}{hint}")
