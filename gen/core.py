"""From a specification to a core: filter, calibration, realization and architecture chosen, formats fixed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from sosmith.gen.architecture import Architecture, chosen
from sosmith.gen.cost import LUTS_OF_A_BLOCK, cost_of
from sosmith.gen.design import Filter, design
from sosmith.gen.quantize import Plan, Quantized, plan, prove, with_realization
from sosmith.gen.realizations import BEST_KEPT, ERROR_FEEDBACK, REALIZATIONS
from sosmith.gen.specification import Specification
from sosmith.model.calibration import Fit, fit, read_measurements
from sosmith.model.datapath import Datapath
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port

CORES = ("instrument", "filter", "calibration")
"""What can be generated of a specification: all of it, or one part."""

AUTO = "auto"
"""Realization that stands for the cheapest proven one."""

_HOPELESS = 2.5
"""Ratio to the least area beyond which a plan is not trimmed: in no design seen did trimming save a half."""

Progress = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class CoreDesign:
    """A core and how it came about.

    Attributes
    ----------
    spec : Specification
        What was asked for.
    core : str
        One of `CORES`.
    quantized : Quantized
        The datapath, with the ideal filter and polynomial it stands for.
    architecture : Architecture
        How the datapath becomes hardware.
    reasons : dict of str to str
        Why this realization and this architecture, one sentence each.
    fit : Fit or None
        The fit, where the calibration came from measurements.
    """

    spec: Specification
    core: str
    quantized: Quantized
    architecture: Architecture
    reasons: dict[str, str]
    fit: Fit | None

    @property
    def datapath(self) -> Datapath:
        """The frozen datapath."""
        return self.quantized.datapath


def design_core(
    spec: Specification,
    *,
    core: str | None = None,
    realization: str | None = None,
    widths_of: str | None = None,
    progress: Progress = lambda step: None,
) -> CoreDesign:
    """Design a core of a specification.

    Parameters
    ----------
    spec : Specification
        What is asked for.
    core : str or None
        One of `CORES`; None takes all that the specification has.
    realization : str or None
        Overrides the specification's.
    widths_of : str or None
        Choose fraction bits and coefficients for this realization, then use `realization` at these widths; the
        error may then exceed what the specification allows.
    progress : callable
        Told the name of each step.

    Raises
    ------
    SpecificationError
        If the core does not exist in the specification, or its measurements are unfit.
    ShortfallError
        If no formats meet the specification.
    """
    kind = _chosen_core(spec, core)
    wanted = _known(realization or spec.hardware.realization)
    if kind != "filter":
        progress("calibration")
    polynomial, fitted = _polynomial(spec) if kind != "filter" else (None, None)
    progress("filter design")
    ideal = _filter(spec) if kind != "calibration" else None

    def attempt(name: str) -> Plan:
        progress(f"word lengths, {name}" if ideal is not None else "word lengths")
        return plan(
            name=spec.name,
            inputs=_inputs(spec, kind),
            output=spec.output,
            max_error=spec.max_error,
            ideal=ideal,
            polynomial=polynomial,
            realization=name,
        )

    if ideal is None:
        quantized, reason = prove(attempt(next(iter(REALIZATIONS)))), "none: a calibration has no filter sections"
    elif widths_of is not None:
        if wanted not in ERROR_FEEDBACK:
            raise SpecificationError(
                f"the realization at the widths of {widths_of} must be {', '.join(ERROR_FEEDBACK)}, not {wanted}"
            )
        quantized = with_realization(prove(attempt(widths_of).trimmed()), wanted)
        reason = f"{wanted} at the word lengths chosen for {widths_of}, as asked"
    elif wanted == AUTO:
        quantized, reason = _cheapest(attempt, progress)
    else:
        source = "on the command line" if realization is not None else "in the specification"
        quantized, reason = prove(attempt(wanted).trimmed()), f"{wanted}: asked for {source}"
    hardware = spec.hardware
    architecture, why = chosen(
        hardware.architecture, quantized.datapath, clock=hardware.clock, sample_rate=spec.sample_rate
    )
    reasons = {"realization": reason, "architecture": why}
    return CoreDesign(spec=spec, core=kind, quantized=quantized, architecture=architecture, reasons=reasons, fit=fitted)


def _cheapest(attempt: Callable[[str], Plan], progress: Progress) -> tuple[Quantized, str]:
    """Plan every realization; return the proven one of the smallest estimated area, and why.

    Plans that are not far larger than the least are trimmed. Proofs are made in the order of the planned areas, until
    none that is left promises to be smaller.

    Raises
    ------
    ShortfallError
        If none meets the specification; says what stands in the way, where that differs for `BEST_KEPT`.
    """
    plans: list[Plan] = []
    failures: dict[str, str] = {}
    for name in REALIZATIONS:
        try:
            plans.append(attempt(name))
        except ShortfallError as error:
            failures[name] = str(error)
    least = math.inf
    for index, planned in sorted(enumerate(plans), key=lambda entry: entry[1].area):
        if planned.area <= _HOPELESS * least:
            progress(f"trimming, {planned.realization}")
            plans[index] = planned.trimmed()
            least = min(least, plans[index].area)
    plans.sort(key=lambda planned: planned.area)
    best: tuple[float, Quantized] | None = None
    for planned in plans:
        if best is not None and planned.area >= best[0]:
            break
        progress(f"proof, {planned.realization}")
        try:
            quantized = prove(planned)
        except ShortfallError as error:
            failures[planned.realization] = str(error)
            continue
        found = cost_of(quantized.datapath).area
        if best is None or found < best[0]:
            best = found, quantized
    if best is None:
        with_best = "" if len(set(failures.values())) == 1 else f"with {BEST_KEPT}, "
        raise ShortfallError(
            f"none of the {len(failures)} realizations meets the specification: {with_best}{failures[BEST_KEPT]}"
        )
    area, quantized = best
    short = {*failures, *(planned.realization for planned in plans if planned.area == math.inf)}
    left = [planned for planned in plans if planned.realization not in {quantized.realization, *short}]
    why = f"the smallest estimated area of {len(left) + 1}" if left else "the only one proven"
    reason = (
        f"{quantized.realization}: {why}, {round(area):,} LUT4 with a multiplier block counted as {LUTS_OF_A_BLOCK}"
    )
    others = [
        ", ".join(f"{other.realization} {round(other.area):,}" for other in left),
        _falling_short([name for name in REALIZATIONS if name in short]),
    ]
    rest = "; ".join(other for other in others if other)
    return quantized, f"{reason} ({rest})" if rest else reason


def _falling_short(names: list[str]) -> str:
    if not names:
        return ""
    return f"{names[0]} falls short" if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]} fall short"


def _chosen_core(spec: Specification, core: str | None) -> str:
    if spec.calibration is None:
        if core not in {None, "filter"}:
            raise SpecificationError(
                f"{spec.path}: the core must be filter, not {core}: the specification has no [calibration]"
            )
        return "filter"
    return core or "instrument"


def _known(wanted: str) -> str:
    if wanted not in {AUTO, *REALIZATIONS}:
        raise SpecificationError(f"the realization must be {AUTO}, {', '.join(REALIZATIONS)}, not {wanted}")
    return wanted


def _inputs(spec: Specification, core: str) -> tuple[Port, ...]:
    if core == "filter" and spec.calibration is not None:
        # Alone, the filter takes what the calibration would hand it, in the output's format.
        return (replace(spec.output, name=f"{spec.output.name}_in"),)
    return spec.inputs


def _polynomial(spec: Specification) -> tuple[Polynomial, Fit | None]:
    assert spec.calibration is not None
    if spec.calibration.data is not None:
        fitted = fit(read_measurements(spec.calibration.data))
        return fitted.polynomial, fitted
    assert spec.calibration.coefficients is not None
    return Polynomial(spec.calibration.coefficients), None


def _filter(spec: Specification) -> Filter:
    return design(spec.filter, float(spec.sample_rate))
