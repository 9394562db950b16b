"""The paper's vehicle: equation 20, and tables 5 to 8 compared with a run of ours."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from functools import cache

from sosmith.instrument.paper.comparison import Comparison, Part, compare
from sosmith.instrument.paper.figures import PaperFigures
from sosmith.instrument.paper.vehicle_comparison import MIN_RIPPLE, PAPER_SPEED, WHEELSETS, comparison
from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.vehicle_report import VehicleRun, vehicle_run

SAMPLE_RATE = 100.0
"""Hz, of section 5.4."""

_MOTIONS = ("vertical", "lateral", "yaw")


def vehicle_parts(figures: PaperFigures) -> list[Part]:
    """Equation 20 and tables 5 to 8."""
    tables = comparison(run_of_ours().motion, figures)
    return [
        _equation_20(),
        *(_table(figures, number, tables[number]) for number in (5, 6, 7)),
        _table_8(figures, tables[8]),
    ]


@cache
def run_of_ours() -> VehicleRun:
    """Simulate a run over the paper's track at its speed, with only its single irregularity."""
    return vehicle_run(
        built_in(), track="paper", speed=PAPER_SPEED, sample_rate=SAMPLE_RATE, irregularities="none", seed=1
    )


def _equation_20() -> Part:
    limits = run_of_ours().limits
    remarks = (
        "Beside tables 5 to 8 stands a run of `sosmith vehicle` over the paper's track, at its speed and with its "
        "single irregularity, of a six-axle locomotive with parameters from other sources. Friction limits its creep "
        "forces, and its flanges are held by elastic rails: a wheelset goes up to "
        f"{1e3 * float(limits.beyond_flange.max()):.1f} mm beyond first contact, against up to "
        f"{1e-3 * float(limits.flange_force.max()):.0f} kN; wheels use up to {float(limits.friction_used.max()):.2f} "
        f"of the friction there is; the largest Y/Q is {float(limits.derailment_quotient.max()):.2f}, and a flange "
        f"would climb at {limits.nadal:.2f}. No figure is claimed to be the paper's.",
        f"[vehicle.md](vehicle.md) has the model. Attenuations of {-20 * math.log10(MIN_RIPPLE):.0f} dB stand for "
        "no motion at 50 Hz but rounding.",
    )
    return Part(
        title="Equation 20",
        where="section 5.1",
        finding="the general equation of motion, without figures; masses, stiffnesses and dampings are not printed",
        before=remarks,
    )


def _table(figures: PaperFigures, number: int, comparisons: tuple[Comparison, ...]) -> Part:
    ratios = [float(one.ours / one.printed) for one in comparisons if one.ours is not None and one.printed]
    return Part(
        title=f"Table {number}",
        where=figures.where(f"table_{number}"),
        finding="maxima of a multi-body simulation whose parameters are not printed; "
        f"ours are {min(ratios):.2g} to {max(ratios):.2g} times these",
        comparisons=comparisons,
    )


def _table_8(figures: PaperFigures, simulated: tuple[Comparison, ...]) -> Part:
    table = {motion: figures.numbers("table_8", motion) for motion in _MOTIONS}

    def ripples(motion: str, pick: Callable[[tuple[Decimal, ...]], Decimal], name: str, which: int) -> Comparison:
        ripple = figures.numbers("table_8", f"{motion}_wheelsets")[which]
        return _from_ripple(f"{motion}, {name} of the wheelsets", pick(table[motion][:WHEELSETS]), ripple)

    comparisons = [
        comparison
        for motion in _MOTIONS
        for comparison in (ripples(motion, max, "largest", 0), ripples(motion, min, "smallest", 1))
    ]
    comparisons += [
        _from_ripple(f"{motion}, bogies", table[motion][WHEELSETS], figures.number("table_8", f"{motion}_frame"))
        for motion in ("vertical", "lateral")
    ]
    return Part(
        title="Table 8",
        where=figures.where("table_8"),
        finding=r"the attenuations are $-20 \log_{10} \delta$ of the ripples in the text, but for one end of a range",
        comparisons=(*comparisons, *simulated),
    )


def _from_ripple(quantity: str, printed: Decimal, ripple: Decimal) -> Comparison:
    needed = math.pow(10, -float(printed) / 20)
    return compare(
        quantity, printed, -20 * math.log10(ripple), "dB",
        note=f"$\\delta$ = {ripple} in the text; the printed figure is that of {needed:.4f}",
    )  # fmt: skip
