"""The project's own goals for the cost of cores, and what was tried for those that are missed."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from benchmarks.cost_cores import (
    ARCHITECTURES,
    FROM_ZERO,
    ORDER_SIX,
    Core,
    Figures,
    fmax,
    targets_in,
)
from benchmarks.cost_tries import TRIES, smaller_on_an_ecp5
from benchmarks.synthesis import TARGETS, title


@dataclass(frozen=True)
class Goal:
    """A figure to be reached.

    Attributes
    ----------
    core : Core
        The core.
    target : str
        Its target.
    figure : str
        Name of the figure.
    limit : float
        Highest allowed value; for "fmax", the lowest.
    measured : callable
        Extracts the figure from those recorded for the target.
    base : Core or None
        If given, the figure is the increase over this core in per cent.
    """

    core: Core
    target: str
    figure: str
    limit: float
    measured: Callable[[Figures], float]
    base: Core | None = None

    @property
    def is_speed(self) -> bool:
        """Whether higher is better."""
        return self.figure.startswith("fmax")

    def value(self, record: Figures) -> float | None:
        """Return the recorded figure; None if there is none."""
        values = []
        for core in (self.core, self.base or self.core):
            figures = targets_in(record, core).get(self.target)
            if figures is None or figures["cells"] is None:
                return None
            values.append(self.measured(figures))
        own, least = values
        return own if self.base is None else round(100 * (own / least - 1), 1)

    def reached(self, value: float) -> bool:
        """Whether a value reaches the goal."""
        return value >= self.limit if self.is_speed else value <= self.limit


def _area(figure: str) -> Callable[[Figures], float]:
    return lambda figures: figures["area"][figure]


def _cells(figures: Figures) -> float:
    return figures["cells"]


def _clocks(figures: Figures) -> float:
    return figures["cycles"]


AUDIO = {name: Core("audio_lowpass", name) for name in ARCHITECTURES}
EIGHT = Core("audio_lowpass", "parallel", 8)
_AHEAD = Core("audio_lowpass", "parallel", clock=120)
_TWO = Core("audio_lowpass", "folded", multipliers=2)
_SIX = ORDER_SIX[4]
"""Three sections in the hardware of one: what others do with a multiplier for each section."""
_LOCOMOTIVE = {(name, n): Core("flange_wear_locomotive", name, n) for name in ARCHITECTURES for n in (1, 12, 64)}
_FOLDED = {
    ("audio_lowpass", "up5k"): (85, {"LC": 342}),
    ("audio_lowpass", "hx8k"): (85, {"LC": 1110}),
    ("audio_lowpass", "ecp5"): (75, {"LUT4 alone": 192, "all LUT4": 294}),
    ("flange_wear_locomotive", "up5k"): (150, {"LC": 319}),
    ("flange_wear_locomotive", "hx8k"): (150, {"LC": 1171}),
    ("flange_wear_locomotive", "ecp5"): (120, {"LUT4 alone": 268, "all LUT4": 374}),
}
"""Clocks that a folded core may take, and its logic when it took an instruction of its own for each column's end."""
_LOGIC = {"LC": _cells, "LUT4 alone": _area("luts"), "all LUT4": _area("all_luts")}


def _folded_goals() -> Iterable[Goal]:
    """Few clocks, without much more logic."""
    for (example, key), (clocks, before) in _FOLDED.items():
        core = Core(example, "folded")
        yield Goal(core, key, "clocks per sample", clocks, _clocks)
        for figure, count in before.items():
            name = f"{figure}, 10 % above the {count:,} of the first version"
            yield Goal(core, key, name, count * 11 // 10, _LOGIC[figure])


GOALS = (
    Goal(AUDIO["parallel"], "ecp5", "MULT18X18D", 5, _area("multipliers")),
    Goal(AUDIO["parallel"], "ecp5", "all LUT4", 640, _area("all_luts")),
    Goal(AUDIO["parallel"], "ecp5", "all LUT4, to beat", 500, _area("all_luts")),
    Goal(AUDIO["parallel"], "ecp5", "FF", 540, _area("flip_flops")),
    Goal(AUDIO["parallel"], "ecp5", "fmax, MHz", 82, fmax),
    Goal(FROM_ZERO, "ecp5", "all LUT4", 600, _area("all_luts")),
    Goal(EIGHT, "ecp5", "fmax, MHz", 175, fmax),
    Goal(_AHEAD, "ecp5", "all LUT4, half of 3,662 without multipliers", 1831, _area("all_luts")),
    Goal(_AHEAD, "ecp5", "fmax, MHz", 135, fmax),
    Goal(Core("audio_lowpass", "parallel", lanes=2, clock=100), "ecp5", "fmax, MHz", 100, fmax),
    Goal(Core("audio_lowpass", "parallel", lanes=4, clock=100), "ecp5_85", "all LUT4", 9000, _area("all_luts")),
    Goal(Core("audio_lowpass", "parallel", lanes=4, clock=100), "ecp5_85", "fmax, MHz", 100, fmax),
    Goal(AUDIO["parallel"], "hx8k", "LC, no multipliers", 1600, _cells),
    Goal(AUDIO["parallel"], "hx8k", "fmax, MHz, no less than with multipliers of LUT4", 49, fmax),
    Goal(AUDIO["folded"], "ecp5", "MULT18X18D", 1, _area("multipliers")),
    Goal(AUDIO["folded"], "ecp5", "LUT4 alone", 400, _area("luts")),
    Goal(AUDIO["folded"], "ecp5", "all LUT4", 400, _area("all_luts")),
    Goal(AUDIO["folded"], "ecp5", "fmax, MHz", 100, fmax),
    *_folded_goals(),
    Goal(_TWO, "ecp5", "clocks per sample", 50, _clocks),
    Goal(_TWO, "ecp5", "all LUT4", 400, _area("all_luts")),
    Goal(_TWO, "ecp5", "fmax, MHz", 150, fmax),
    Goal(_SIX, "ecp5", "clocks per sample", 8, _clocks),
    Goal(_SIX, "ecp5", "all LUT4", 400, _area("all_luts")),
    Goal(_SIX, "ecp5", "MULT18X18D", 3, _area("multipliers")),
    Goal(_SIX, "ecp5", "fmax, MHz", 100, fmax),
    Goal(Core("audio_lowpass", "parallel", freedom="mask"), "hx8k", "LC, no multipliers", 1200, _cells),
    Goal(AUDIO["serial"], "up5k", "MAC16", 0, _area("multipliers")),
    Goal(AUDIO["serial"], "up5k", "LC", 500, _cells),
    Goal(AUDIO["serial"], "hx8k", "LC", 500, _cells),
    Goal(_LOCOMOTIVE["folded", 12], "up5k", "LC", 900, _cells),
    Goal(_LOCOMOTIVE["folded", 12], "up5k", "MAC16", 1, _area("multipliers")),
    Goal(_LOCOMOTIVE["folded", 12], "up5k", "fmax, MHz", 12, fmax),
    Goal(_LOCOMOTIVE["serial", 1], "hx1k", "LC, all of the device", 1280, _cells),
    Goal(_LOCOMOTIVE["serial", 12], "hx1k", "LC, all of the device", 1280, _cells),
    *(
        Goal(_LOCOMOTIVE[name, 64], key, "LC, increase over one channel, %", 10, _cells, _LOCOMOTIVE[name, 1])
        for name, key in (("folded", "up5k"), ("serial", "hx8k"))
    ),
)


def goal_table(record: Figures) -> str:
    """Return a Markdown table of the goals and the measured figures."""
    lines = ["| core | target | figure | goal | measured | |", "|---|---|---|---|---|---|"]
    for goal in GOALS:
        value = goal.value(record)
        shown, verdict = "-", "not measured"
        if value is not None:
            shown = f"{value:,.1f}" if goal.is_speed or goal.base else f"{value:,}"
            verdict = "reached" if goal.reached(value) else "**missed**"
        sign = "at least" if goal.is_speed else "at most"
        lines.append(
            f"| {goal.core.label} | {title(TARGETS[goal.target])} | {goal.figure} | {sign} {goal.limit:,} | {shown} "
            f"| {verdict} |"
        )
    return "\n".join(lines)


def tries(record: Figures) -> str:
    """Return a list of what was tried for missed goals."""
    return "\n".join(
        "\n".join(
            [
                "",
                textwrap.fill(tried.goal, 120),
                "",
                *(textwrap.fill(way, 120, initial_indent="- ", subsequent_indent="  ") for way in tried.ways),
                "",
                textwrap.fill(tried.obstacle, 120),
            ]
        )
        for tried in (smaller_on_an_ecp5(record["tries"]), *TRIES)
    )
