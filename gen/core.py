"""From a specification to a core: chooses filter, calibration, realization and architecture, and fixes the formats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.blocks import blocks_for
from sosmith.gen.architectures.budget import Budget
from sosmith.gen.architectures.registry import candidates, fitting, reason_for
from sosmith.gen.architectures.search import AskedRealization, Response, Search
from sosmith.gen.filter.design import Filter, design
from sosmith.gen.fpga.boards import Board
from sosmith.gen.realizations.registry import REALIZATIONS, realizations_for
from sosmith.gen.specification.choices import AUTO, CORES, ERROR_FEEDBACK
from sosmith.gen.specification.combinations import asked_by
from sosmith.gen.specification.specification import Specification
from sosmith.gen.word_lengths.decimation.decimator import PreStage, pre_stage_of
from sosmith.gen.word_lengths.input_stage import needs_scaling
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.gen.word_lengths.selection import Progress
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.model.suggestion import did_you_mean

if TYPE_CHECKING:
    from sosmith.gen.calibration.fit import Fit


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
    kinds: Sequence[type[Architecture]] = (),
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
    kinds : sequence of type of Architecture
        Architectures to try in this order; those that the specification leaves open if empty. One with rings of samples
        is only for a core whose samples these can hold.

    Raises
    ------
    SpecificationError
        If the specification has no such core, or its measurements are unsuitable.
    ShortfallError
        If no formats meet the specification, or a ring that is asked for cannot hold the samples.
    """
    kind = chosen_core(spec, core)
    source = "in the specification" if realization is None else "on the command line"
    asked = AskedRealization(_known(realization or spec.hardware.realization), source, widths_of)
    response, decimates = response_of(spec, kind, progress)
    _check_realization(spec, asked, response)
    calibration, budget, calibrates = _calibration_hardware(spec, response, _budget(spec, response, board), board)
    search = Search(
        spec=spec,
        response=response,
        asked=asked,
        budget=budget,
        calibration=calibration,
        board=board,
        progress=progress,
    )
    wanted = spec.hardware.architecture
    rings = _fits_rings(spec, response, asked)
    if not kinds:
        kinds = candidates(wanted, budget.blocks, asked_by(spec), rings=rings, cycles=budget.cycles)
    elif not rings and any(each.is_filled for each in kinds):
        raise ShortfallError("a ring must keep the samples of an FIR filter as they come, and none that are scaled")
    (quantized, reason, architecture), refused = search.first_that_keeps_up(kinds)
    why = reason_for(architecture, budget, asked=wanted != AUTO, board=board, refused=refused)
    whole = quantized if response.pre_stage is None else response.pre_stage.counted(quantized)
    return CoreDesign(
        spec=spec,
        core=kind,
        quantized=replace(whole, datapath=architecture.datapath),
        architecture=architecture,
        reasons={**decimates, "realization": reason, "architecture": why, **calibrates},
        fit=response.fit,
        options=_given(core, realization, widths_of, board),
    )


def _given(core: str | None, realization: str | None, widths_of: str | None, board: Board | None) -> dict[str, str]:
    """Return the options that were given, by name."""
    names = {
        "core": core,
        "realization": realization,
        "widths_of": widths_of,
        "board": None if board is None else board.name,
    }
    return {key: name for key, name in names.items() if name is not None}


def response_of(
    spec: Specification, kind: str, progress: Progress = lambda step: None
) -> tuple[Response, dict[str, str]]:
    """Design what a core of this `kind` computes, and say why it decimates if it does.

    Raises
    ------
    SpecificationError
        If the measurements are unsuitable, or the filter needs an order that is too high.
    ShortfallError
        If the decimator lets too much fold into the pass band, or a pole lies too close to the unit circle.
    """
    polynomial, fitted = None, None
    if kind != "filter":
        progress("calibration")
        polynomial, fitted = polynomial_of(spec)
    progress("filter design")
    pre_stage, decimates = pre_stage_in(spec, kind, polynomial)
    inputs = inputs_of(spec, kind)
    if pre_stage is not None:
        ideal: Filter | None = pre_stage.filter
    else:
        ideal = None if kind == "calibration" else filter_of(spec)
    response = Response(
        inputs=inputs if pre_stage is None else (pre_stage.decimator.output,),
        codes=() if fitted is None else calibrated_codes(inputs, fitted),
        polynomial=polynomial,
        fit=fitted,
        pre_stage=pre_stage,
        ideal=ideal,
        factor=_own_factor(spec, kind),
    )
    return response, decimates


def _fits_rings(spec: Specification, response: Response, asked: AskedRealization) -> bool:
    """Say whether a core is an FIR filter of samples as they come, which a ring of memory can hold for one multiplier.

    A set of coefficients that is loaded at pins, or restarts the filter, goes to a program.
    """
    hardware = spec.hardware
    return (
        response.ideal is not None
        and response.ideal.is_fir
        and response.polynomial is None
        and not needs_scaling(response.inputs[0], spec.output)
        and not (hardware.reload and (spec.wear is not None or not hardware.reload_registers))
        and (asked.name == AUTO or REALIZATIONS[asked.name].keeps_samples)
    )


def _own_factor(spec: Specification, core: str) -> int:
    """Return by how much a filter decimates by itself: an FIR filter does, one with poles has a decimator before it."""
    return int(spec.filter.decimate or 1) if spec.filter.is_fir and core != "calibration" else 1


def _budget(spec: Specification, response: Response, board: Board | None) -> Budget:
    """Return the time and the multiplier blocks that there are for a core."""
    hardware, pre_stage = spec.hardware, response.pre_stage
    return Budget(
        clock=hardware.clock,
        sample_rate=spec.sample_rate,
        channels=spec.channels,
        reload=hardware.reload,
        protect=hardware.protect,
        blocks=blocks_for(hardware.multipliers, board),
        decimate=response.factor if pre_stage is None else pre_stage.decimator.factor,
        samples_per_clock=hardware.samples_per_clock,
        hold=spec.filter.hold and (pre_stage is not None or response.factor > 1),
        reload_lock=hardware.reload_lock,
        reload_registers=hardware.reload_registers,
    )


def _check_realization(spec: Specification, asked: AskedRealization, response: Response) -> None:
    """Check that the realization that is asked for goes together with the rest.

    Raises
    ------
    SpecificationError
        If it is not for such a filter, has none behind a decimator, stands beside look-ahead, which has its own, or has
        no other one's word lengths.
    """
    named = [name for name in (asked.name, asked.widths_of) if name in REALIZATIONS]
    fir = response.ideal is not None and response.ideal.is_fir
    for name in named if response.ideal is not None else ():
        if name not in (suited := realizations_for(fir=fir)):
            form = "an FIR filter" if fir else "second-order sections"
            raise SpecificationError(
                f"{spec.path}: the realization must be {AUTO}, {', '.join(suited)} for {form}, not {name}"
            )
    factor = 1 if response.pre_stage is None else response.pre_stage.decimator.factor
    for name in named:
        if factor > 1 and (reason := REALIZATIONS[name].not_decimated):
            raise SpecificationError(
                f"{spec.path}: the realization must be another one with filter.decimate = {factor}, not {name}: "
                f"{reason}"
            )
    if spec.hardware.pipeline == "look-ahead" and named:
        raise SpecificationError(
            f'{spec.path}: the realization must be auto with hardware.pipeline = "look-ahead", not {named[-1]}'
        )
    if response.ideal is not None and asked.widths_of is not None and asked.name not in ERROR_FEEDBACK:
        raise SpecificationError(
            f"the realization at the widths of {asked.widths_of} must be {', '.join(ERROR_FEEDBACK)}, not {asked.name}"
        )


def chosen_core(spec: Specification, core: str | None) -> str:
    """Return the kind of core, one of `CORES`: the one that is asked for, or everything in the specification.

    Raises
    ------
    SpecificationError
        If the specification has no such core.
    """
    if core is not None and core not in CORES:
        raise SpecificationError(f"the core must be one of {', '.join(CORES)}, not {core}{did_you_mean(core, CORES)}")
    if spec.calibration is None:
        if core not in {None, "filter"}:
            raise SpecificationError(
                f"{spec.path}: the core must be filter, not {core}: the specification has no [calibration]"
            )
        return "filter"
    return core or "instrument"


def pre_stage_in(
    spec: Specification, core: str, polynomial: Polynomial | None
) -> tuple[PreStage | None, dict[str, str]]:
    """Return what stands before the filter of a core that decimates, and why; None and nothing if all samples go in.

    Raises
    ------
    ShortfallError
        If the factor that is asked for lets too much fold into the pass band, or takes too many bits.
    """
    if spec.filter.decimate is None or core == "calibration" or spec.filter.is_fir:
        return None, {}
    pre_stage, reason = pre_stage_of(
        spec.filter,
        spec.sample_rate,
        inputs_of(spec, core),
        spec.output,
        spec.max_error,
        polynomial,
        f"{spec.name}_ahead",
        steady=spec.hardware.start == "steady",
    )
    return pre_stage, {"decimation": reason}


def _calibration_hardware(
    spec: Specification, response: Response, budget: Budget, board: Board | None
) -> tuple[Architecture | None, Budget, dict[str, str]]:
    """Choose the architecture of the calibration before a decimator: that of the filter, or the smallest that keeps up.

    Return it, the budget that it leaves for the filter, and why.

    Raises
    ------
    ShortfallError
        If none keeps up with all samples.
    """
    datapath = None if response.pre_stage is None else response.pre_stage.calibration_datapath(response.codes)
    if datapath is None:
        return None, budget, {}
    wanted = spec.hardware.architecture
    each = replace(budget, decimate=1, hold=False, blocks=budget.blocks.keeping_one(), reload=False, reload_lock=False)
    refused = ""
    for kind in candidates(wanted, budget.blocks, asked_by(spec)):
        try:
            architecture = fitting(kind, each, datapath, board)
        except ShortfallError as error:
            refused = f"before the decimator, {error}"
        else:
            why = reason_for(architecture, each, asked=wanted != AUTO, board=board, refused=refused)
            left = replace(budget, blocks=budget.blocks.without(architecture.multiplier_blocks))
            return architecture, left, {"calibration before the decimator": why}
    raise ShortfallError(refused)


def _known(wanted: str) -> str:
    if wanted not in {AUTO, *REALIZATIONS}:
        known = (AUTO, *REALIZATIONS)
        raise SpecificationError(
            f"the realization must be {', '.join(known)}, not {wanted}{did_you_mean(wanted, known)}"
        )
    return wanted


def inputs_of(spec: Specification, core: str) -> tuple[Port, ...]:
    """Return the inputs of a kind of core."""
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
        # Most calibrations are given: only measurements load what reads and fits them.
        from sosmith.gen.calibration.fit import fit, read_measurements  # noqa: PLC0415

        fitted = fit(read_measurements(spec.calibration.data))
        return fitted.polynomial, fitted
    assert spec.calibration.coefficients is not None
    return Polynomial(spec.calibration.coefficients), None


def calibrated_codes(inputs: Sequence[Port], fitted: Fit) -> tuple[tuple[int, int], ...]:
    """Lowest and highest code that a measured value of each input has: any other is of a value outside."""
    return tuple(port.codes_between(*ends) for port, ends in zip(inputs, fitted.covered, strict=True))


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
