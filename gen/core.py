"""From a specification to a core: chooses filter, calibration, realization and architecture, and fixes the formats."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

from sosmith.gen.architecture import (
    Architecture,
    Blocks,
    Budget,
    blocks_for,
    candidates,
    fitting,
    objective_of,
    reason_for,
)
from sosmith.gen.calibration.fit import Fit, fit, read_measurements
from sosmith.gen.filter.design import Filter, design
from sosmith.gen.fpga.boards import Board
from sosmith.gen.realizations.registry import LOOK_AHEAD, REALIZATIONS
from sosmith.gen.specification.choices import CORES, ERROR_FEEDBACK
from sosmith.gen.specification.specification import Specification
from sosmith.gen.word_lengths.decimator import Front, front_of
from sosmith.gen.word_lengths.objective import FEW_ADDERS
from sosmith.gen.word_lengths.other_realization import with_realization
from sosmith.gen.word_lengths.quantize import Plan, least_size, plan, prove
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.gen.word_lengths.selection import Selection
from sosmith.gen.word_lengths.settling import samples_to_settle, with_settling
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.model.suggestion import did_you_mean

AUTO = "auto"
"""Value of the realization that selects the cheapest proven one."""

Progress = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class CoreDesign:
    """A designed core, with the reasons for its choices.

    Attributes
    ----------
    spec : Specification
        The specification.
    core : str
        One of `sosmith.gen.specification.choices.CORES`.
    quantized : Quantized
        The datapath, with the ideal filter and polynomial that it implements.
    architecture : Architecture
        Hardware architecture of the datapath.
    reasons : dict of str to str
        Reasons for this realization and this architecture, one sentence each.
    fit : Fit or None
        The fit, if the calibration comes from measurements.
    options : dict of str to str
        What was asked for beside the specification: parameters of `design_core` by name, a board by its name.
    """

    spec: Specification
    core: str
    quantized: Quantized
    architecture: Architecture
    reasons: dict[str, str]
    fit: Fit | None
    options: dict[str, str]

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
    board: Board | None = None,
    progress: Progress = lambda step: None,
) -> CoreDesign:
    """Design a core for a specification.

    Parameters
    ----------
    spec : Specification
        The specification.
    core : str or None
        One of `sosmith.gen.specification.choices.CORES`; None for everything that the specification contains.
    realization : str or None
        Overrides the specification's.
    widths_of : str or None
        Choose fraction bits and coefficients for this realization, then use `realization` with these widths; the
        error may then exceed the limit in the specification.
    board : Board or None
        Target board; the automatic choice of an architecture considers its multipliers, the folded architecture has
        digits as wide as they take, and the parallel one makes products of adders where they are too few.
    progress : callable
        Called with the name of each step.

    Raises
    ------
    SpecificationError
        If the specification has no such core, or its measurements are unsuitable.
    ShortfallError
        If no formats meet the specification.
    """
    asked = {
        "core": core,
        "realization": realization,
        "widths_of": widths_of,
        "board": None if board is None else board.name,
    }
    kind = _chosen_core(spec, core)
    wanted = _known(realization or spec.hardware.realization)
    if kind != "filter":
        progress("calibration")
    polynomial, fitted = polynomial_of(spec) if kind != "filter" else (None, None)
    progress("filter design")
    front, decimates = front_in(spec, kind, polynomial)
    ideal = None if kind == "calibration" else filter_of(spec) if front is None else front.filter
    inputs = _inputs(spec, kind) if front is None else (front.decimator.output,)
    codes = () if fitted is None else calibrated_codes(_inputs(spec, kind), fitted)

    @cache  # for all architectures that are tried
    def plan_of(name: str) -> Plan:
        progress(f"word lengths, {name}" if ideal is not None else "word lengths")
        return plan(
            name=spec.name,
            inputs=inputs,
            output=spec.output,
            max_error=spec.max_error - (0 if front is None else front.error * spec.output.lsb),
            ideal=ideal,
            polynomial=polynomial if front is None else None,
            realization=name,
            steady=spec.hardware.start == "steady",
        )

    def select(architecture: str) -> tuple[Quantized, str]:
        """Choose the realization and its word lengths for an architecture."""
        if ideal is None:
            return prove(plan_of(next(iter(REALIZATIONS)))), "none: a calibration has no filter sections"
        objective = objective_of(architecture, board, adders=budget.adders or looks_ahead)
        selection = Selection(
            lambda name: plan_of(name).under(objective),
            lambda name: least_size(ideal, name, objective),
            objective,
            progress,
        )
        if widths_of is not None:
            if wanted not in ERROR_FEEDBACK:
                raise SpecificationError(
                    f"the realization at the widths of {widths_of} must be {', '.join(ERROR_FEEDBACK)}, not {wanted}"
                )
            quantized = with_realization(selection.proven(widths_of), wanted)
            return quantized, f"{wanted} at the word lengths chosen for {widths_of}, as asked"
        if wanted == AUTO:
            return selection.cheapest(partial(in_hardware, architecture))
        source = "on the command line" if realization is not None else "in the specification"
        return selection.proven(wanted), f"{wanted}: asked for {source}"

    hardware = spec.hardware
    looks_ahead = hardware.pipeline == "look-ahead"
    _check_realization(spec, wanted, widths_of, front)

    def in_hardware(name: str, datapath: Datapath, *, look_ahead: bool = looks_ahead) -> Architecture:
        """Architecture with what costs a program instructions: the calibrated range, limits of wear, and settling."""
        wear = () if spec.wear is None else spec.wear.codes(spec.output)
        # Constants that are loaded may make the filter slower, and the count is not among them.
        spare = 3 if hardware.reload else 1
        flagged = with_settling(datapath, spare * samples_to_settle(datapath))
        judged = replace(flagged, wear=wear)
        if front is None:
            return fitting(name, budget, replace(judged, calibrated=codes), board, look_ahead=look_ahead)
        return fitting(name, budget, front.before(judged, codes), board, ahead=ahead)

    budget = Budget(
        clock=hardware.clock,
        sample_rate=spec.sample_rate,
        channels=spec.channels,
        reload=hardware.reload,
        protect=hardware.protect,
        blocks=blocks_for(hardware.multipliers, board),
        decimate=1 if front is None else front.decimator.factor,
        samples_per_clock=hardware.samples_per_clock,
        hold=front is not None and spec.filter.hold,
        folds=hardware.multipliers != 0,
    )
    before = None if front is None else front.ahead(codes)
    ahead, budget, calibrates = _ahead(before, hardware.architecture, budget, board)

    def made_in(name: str) -> _Made:
        """Choose everything for an architecture."""
        with_look_ahead = partial(in_hardware, "parallel", look_ahead=True)
        if looks_ahead and ideal is not None:
            return _looking_ahead(plan_of, with_look_ahead, budget)
        quantized, reason = select(name)
        plain = quantized, reason, in_hardware(name, quantized.datapath)
        asked = hardware.pipeline != AUTO or wanted != AUTO or ideal is None or hardware.multipliers
        return plain if asked or name != "parallel" else _faster(plain, plan_of, with_look_ahead, budget)

    several = looks_ahead or hardware.samples_per_clock > 1
    names = ("parallel",) if several else candidates(hardware.architecture, budget.blocks, folds=budget.folds)
    (quantized, reason, architecture), refused = _first_that_keeps_up(names, made_in)
    asked_for = len(names) == 1 and hardware.architecture != AUTO
    why = reason_for(architecture, budget, asked=asked_for, board=board, refused=refused)
    return CoreDesign(
        spec=spec,
        core=kind,
        quantized=replace(quantized if front is None else front.counted(quantized), datapath=architecture.datapath),
        architecture=architecture,
        reasons={**decimates, "realization": reason, "architecture": why, **calibrates},
        fit=fitted,
        options={key: value for key, value in asked.items() if value is not None},
    )


_Made = tuple[Quantized, str, Architecture]
"""A proven design, the reason for its realization, and its architecture."""


def _check_realization(spec: Specification, wanted: str, widths_of: str | None, front: Front | None) -> None:
    """Check that no realization is asked for beside look-ahead, which has its own, or that no decimated filter has."""
    if front is not None and "lattice_wdf" in {wanted, widths_of}:
        raise SpecificationError(
            f"{spec.path}: the realization must be another one with filter.decimate = {front.decimator.factor}, not "
            "lattice_wdf: with its droop corrected, the filter is no sum of two allpass filters"
        )
    if spec.hardware.pipeline == "look-ahead" and (wanted != AUTO or widths_of is not None):
        raise SpecificationError(
            f'{spec.path}: the realization must be auto with hardware.pipeline = "look-ahead", not '
            f"{widths_of or wanted}"
        )


def _first_that_keeps_up(names: Sequence[str], made_in: Callable[[str], _Made]) -> tuple[_Made, str]:
    """Return the first design that keeps up, and why the one before did not, if there was one."""
    refused = ""
    for name in names[:-1]:
        try:
            return made_in(name), refused
        except ShortfallError as error:
            refused = str(error)
    return made_in(names[-1]), refused


def _faster(
    plain: _Made, plan_of: Callable[[str], Plan], in_hardware: Callable[[Datapath], Architecture], budget: Budget
) -> _Made:
    """Return a design with look-ahead, if a core must take a beat at each clock and its plain loops are too slow.

    Speeds are those of the estimate for an ECP5. The plain design stays if look-ahead cannot meet the specification, or
    is no faster.
    """
    single = budget.channels == 1 and not budget.reload and budget.protect == "none" and budget.decimate == 1
    reached = plain[2].clock_estimate
    if not single or budget.cycles > 1 or reached >= budget.clock:
        return plain
    try:
        quantized, reason, architecture = _looking_ahead(plan_of, in_hardware, budget, patient=False)
    except ShortfallError:
        return plain
    if architecture.clock_estimate <= reached:
        return plain
    return quantized, f"{reason}; plain loops reach {reached / 1e6:.0f} MHz", architecture


def _looking_ahead(
    plan_of: Callable[[str], Plan],
    in_hardware: Callable[[Datapath], Architecture],
    budget: Budget,
    *,
    patient: bool = True,
) -> _Made:
    """Choose how far recursions look ahead: as little as the clock allows, by the estimate for an ECP5.

    If not `patient`, responses so long that their design takes minutes are refused.

    Raises
    ------
    ShortfallError
        If no sections with look-ahead meet the specification.
    """
    best: _Made | None = None
    refused = ShortfallError("look-ahead must have more samples than a beat, and responses that are not too long")
    for samples, realization in LOOK_AHEAD.items():
        if samples <= budget.samples_per_clock:
            continue
        planned = plan_of(realization.name).under(FEW_ADDERS)
        if planned.is_long and not patient:
            continue
        try:
            quantized = prove(planned if planned.is_long else planned.trimmed())
        except ShortfallError as error:
            refused = error
            continue
        architecture = in_hardware(quantized.datapath)
        estimate = architecture.clock_estimate
        reached = estimate >= budget.clock
        reason = (
            f"{realization.name}: {'the shortest look-ahead that reaches' if reached else 'comes closest to'} a clock "
            f"of {float(budget.clock) / 1e6:,.6g} MHz on an ECP5, by an estimate of {estimate / 1e6:.0f} MHz"
        )
        if best is None or estimate > best[2].clock_estimate:
            best = quantized, reason, architecture
        if reached:
            break
    if best is None:
        raise refused
    return best


def _chosen_core(spec: Specification, core: str | None) -> str:
    if core is not None and core not in CORES:
        raise SpecificationError(f"the core must be one of {', '.join(CORES)}, not {core}{did_you_mean(core, CORES)}")
    if spec.calibration is None:
        if core not in {None, "filter"}:
            raise SpecificationError(
                f"{spec.path}: the core must be filter, not {core}: the specification has no [calibration]"
            )
        return "filter"
    return core or "instrument"


def front_in(spec: Specification, core: str, polynomial: Polynomial | None) -> tuple[Front | None, dict[str, str]]:
    """Return what stands before the filter of a core that decimates, and why; None and nothing if all samples go in.

    Raises
    ------
    ShortfallError
        If the factor that is asked for lets too much fold into the pass band, or takes too many bits.
    """
    if spec.filter.decimate is None or core == "calibration":
        return None, {}
    front, reason = front_of(
        spec.filter,
        spec.sample_rate,
        _inputs(spec, core),
        spec.output,
        spec.max_error,
        polynomial,
        f"{spec.name}_ahead",
    )
    return front, {"decimation": reason}


def _ahead(
    datapath: Datapath | None, wanted: str, budget: Budget, board: Board | None
) -> tuple[Architecture | None, Budget, dict[str, str]]:
    """Choose the architecture of the calibration before a decimator: that of the filter, or the smallest that keeps up.

    Return it, the budget that it leaves for the filter, and why.

    Raises
    ------
    ShortfallError
        If none keeps up with all samples.
    """
    if datapath is None:
        return None, budget, {}
    each = replace(budget, decimate=1, hold=False)
    names = candidates(wanted, budget.blocks, folds=budget.folds)
    refused = ""
    for name in names:
        try:
            made = fitting(name, each, datapath, board)
        except ShortfallError as error:
            refused = f"before the decimator, {error}"
        else:
            why = reason_for(made, each, asked=wanted != AUTO, board=board, refused=refused)
            left = replace(budget, blocks=_left(budget.blocks, made))
            return made, left, {"calibration before the decimator": why}
    raise ShortfallError(refused)


def _left(blocks: Blocks, ahead: Architecture) -> Blocks:
    """Return the multiplier blocks that what stands before the decimator leaves."""
    if blocks.available is None:
        return blocks
    return blocks._replace(available=max(0, blocks.available - ahead.multiplier_blocks))


def refuse_decimated_channels(design: CoreDesign, where: str) -> None:
    """Refuse a core that decimates several channels `where` only others can be.

    Raises
    ------
    SpecificationError
        If it does.
    """
    channels = design.spec.channels
    if design.datapath.decimator is not None and channels > 1:
        raise SpecificationError(
            f"{design.spec.path}: not yet available: channels must be 1 with filter.decimate {where}, not {channels}"
        )


def _known(wanted: str) -> str:
    if wanted not in {AUTO, *REALIZATIONS}:
        known = (AUTO, *REALIZATIONS)
        raise SpecificationError(
            f"the realization must be {', '.join(known)}, not {wanted}{did_you_mean(wanted, known)}"
        )
    return wanted


def _inputs(spec: Specification, core: str) -> tuple[Port, ...]:
    if core == "filter" and spec.calibration is not None:
        # A filter core takes the output of the calibration as its input, in the output's format.
        return (replace(spec.output, name=f"{spec.output.name}_in"),)
    return spec.inputs


def polynomial_of(spec: Specification) -> tuple[Polynomial, Fit | None]:
    """Return the calibration of a specification that has one, and the fit if it came from measurements.

    Raises
    ------
    SpecificationError
        If the measurements are unsuitable.
    """
    assert spec.calibration is not None
    if spec.calibration.data is not None:
        fitted = fit(read_measurements(spec.calibration.data))
        return fitted.polynomial, fitted
    assert spec.calibration.coefficients is not None
    return Polynomial(spec.calibration.coefficients), None


def calibrated_codes(inputs: Sequence[Port], fitted: Fit) -> tuple[tuple[int, int], ...]:
    """Lowest and highest code of each input that the measurements covered."""
    return tuple(port.enclosing(*ends) for port, ends in zip(inputs, fitted.covered, strict=True))


def filter_of(spec: Specification) -> Filter:
    """Design the filter of a specification.

    Raises
    ------
    SpecificationError
        If its edges and losses need an order that is too high.
    ShortfallError
        If a pole lies too close to the unit circle.
    """
    try:
        return design(spec.filter, spec.sample_rate)
    except SpecificationError as error:
        raise SpecificationError(f"{spec.path}: {error}") from None
