"""The built-in scenarios by name: their descriptions, and the kinds of core they are for."""

from __future__ import annotations

from typing import NamedTuple

from sosmith.model.errors import SpecificationError
from sosmith.model.suggestion import did_you_mean


class Summary(NamedTuple):
    """A scenario as it is shown to the user.

    Attributes
    ----------
    description : str
        One line of text.
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
        "extreme codes in the sign pattern that maximizes the filter's output",
        ("instrument", "filter"),
    ),
    "worst_case_errors": Summary(
        "the same for the path of each rounding error through the filter, one after another",
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
    "passband_sweep": Summary(
        "sine at 1 dB below full scale, slow where the filter passes and fast elsewhere",
        ("filter",),
    ),
    "tone": Summary(
        "sine at 997 Hz, or in the passband, at 1 dB below full scale, for distortion and noise",
        ("filter",),
    ),
    "multitone": Summary(
        "sines at thirds of an octave with random phases, peaks at 1 dB below full scale",
        ("filter",),
    ),
    "pink_noise": Summary(
        "noise of equal power in each octave, peaks at 1 dB below full scale",
        ("filter",),
    ),
}
"""All scenarios by name, in the order in which they are shown to the user."""


def fitting(kind: str) -> list[str]:
    """Return the names of the scenarios for a kind of core."""
    return [name for name, summary in SUMMARIES.items() if kind in summary.kinds]


def is_scenario_file(source: str) -> bool:
    """Whether `source` is the path of a scenario file, not a built-in scenario or a trace."""
    return source not in SUMMARIES and source.lower().endswith(".toml")


def check_scenario(name: str, kind: str) -> None:
    """Check that a scenario exists for a kind of core.

    Raises
    ------
    SpecificationError
        If it does not; the message lists those that exist.
    """
    known = fitting(kind)
    if name not in known:
        core = "a plain filter" if kind == "filter" else "an instrument"
        hint = did_you_mean(name, known)
        raise SpecificationError(f"scenario for {core} must be one of {', '.join(known)}, not {name!r}{hint}")
