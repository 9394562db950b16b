"""New coefficients for existing hardware: designed in its formats, proven again, and refused if they do not fit.

Ranges and bound of a set are proven for a core that runs with it from reset. A swap, however, starts from states of
another set, so it is proven too: that nothing wraps from the first sample on, for all inputs before and after, and
after how many samples the bound holds again (`sosmith.gen.reload.transient`). A core that judges wear restarts with
the new set instead, so that the proof of the set by itself is all that it takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from sosmith.gen.architectures.budget import Budget
from sosmith.gen.architectures.fingerprint import structure
from sosmith.gen.architectures.shared_unit import SharedUnit
from sosmith.gen.core import CoreDesign, calibrated_codes, filter_of, polynomial_of
from sosmith.gen.filter.decimation import decimated
from sosmith.gen.filter.design import Filter
from sosmith.gen.quantity import quantity
from sosmith.gen.reload.first_samples import check_samples, first_samples, held_codes
from sosmith.gen.reload.other_constants import with_constants
from sosmith.gen.reload.transient import transient
from sosmith.gen.specification.specification import Specification
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.gen.word_lengths.settling import samples_to_settle
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding.fold import program
from sosmith.model.dataflow.graph import Node, Op
from sosmith.model.dataflow.program import Program
from sosmith.model.dataflow.structure import Stage
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.reload.constants import constants, packed, values_of, with_ranges, with_room
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.output import OutputStage
from sosmith.model.sections.start import StartStage

ADVICE = (
    "go there in smaller steps, each after the one before has faded, or stop the samples and reset the core before "
    "the first one with the new set"
)
"""Remedy if a swap is refused."""

ROOM = (
    "hardware for the curves of other days must be designed with room for them, as `calibrate export --room` writes it"
)
"""Remedy if a coefficient of a calibration is too wide."""


@dataclass(frozen=True, kw_only=True)
class OtherSet:
    """New constants for existing hardware.

    Attributes
    ----------
    quantized : Quantized
        The design with these constants, its bound proven.
    program : Program or None
        Program with these constants, with as many instructions as before; None in the parallel architecture.
    """

    quantized: Quantized
    program: Program | None


@dataclass(frozen=True, kw_only=True)
class Swap:
    """A swap from one set to another in which nothing can wrap.

    Attributes
    ----------
    new_set : OtherSet
        The new set. Its program, if any, allows for all values that the swap can cause.
    samples : int
        Length of the transient: from then on the error is at most the set's bound plus
        `sosmith.gen.proof.fading.RESIDUE` output LSB, and another swap may follow. 0 if the core restarts.
    use : Fraction
        Largest share of its hardware range that any state may use, at most 1.
    """

    new_set: OtherSet
    samples: int
    use: Fraction


def own_set(hardware: CoreDesign) -> OtherSet:
    """Return the set that a core was generated with, in the formats that all sets share.

    Raises
    ------
    ShortfallError
        If these formats cannot represent its constants exactly.
    """
    quantized = with_constants(hardware.quantized, None, None, room=room_of(hardware))
    if _values(quantized.datapath) != _values(hardware.datapath):
        raise ShortfallError(
            f"the realization must keep its coefficients to be loaded anew, and {quantized.realization} does not"
        )
    return OtherSet(quantized=quantized, program=hardware.architecture.program)


def _check_settling(hardware: CoreDesign, other: Quantized) -> None:
    """Check that the hardware counts far enough for a set, if it flags samples until the filter has settled."""
    counted = hardware.quantized.settling
    decimator = other.datapath.decimator
    remembered = 0 if decimator is None else decimator.remembered
    samples = samples_to_settle(other.datapath) + remembered if counted else 0
    if samples > counted:
        raise ShortfallError(
            f"the set must settle within {counted:,} samples, to which the hardware counts, not {samples:,}"
        )


def _values(datapath: Datapath) -> list[Fraction]:
    """Values of all constants, in the order of the nodes."""
    return [
        node.parameter * Fraction(2) ** -(node.parameter_frac if node.op is Op.SCALE else node.frac)
        for stage in datapath.stages
        for node in stage.graph.nodes
        if node.op in {Op.SCALE, Op.CONSTANT}
    ]


def set_for(hardware: CoreDesign, wanted: Specification) -> OtherSet:
    """Make the set for another specification: its filter, its calibration, its `max_error`.

    Raises
    ------
    SpecificationError
        If it differs in something that cannot be loaded, or the hardware is not reloadable.
    ShortfallError
        As `other_set`.
    """
    spec = hardware.spec
    if not spec.hardware.reload:
        raise SpecificationError(f"{spec.path}: hardware.reload must be true for a set to be loaded, not false")
    for name, have, other in (
        ("sample_rate", spec.sample_rate, wanted.sample_rate),
        ("inputs", spec.inputs, wanted.inputs),
        ("output", spec.output, wanted.output),
        ("wear", spec.wear, wanted.wear),
    ):
        if have != other:
            raise SpecificationError(f"{wanted.path}: {name} must be as in {spec.path} for a set to be loaded there")
    if (spec.calibration is None) != (wanted.calibration is None):
        presence = "no" if spec.calibration is None else "a"
        raise SpecificationError(f"{wanted.path}: there must be {presence} [calibration], as in {spec.path}")
    quantized = hardware.quantized
    ideal, polynomial, covered = None, None, None
    if quantized.filter is not None and wanted.filter != spec.filter:
        ideal = _filter_of(hardware, wanted)
    if quantized.calibration is not None and wanted.calibration != spec.calibration:
        raise SpecificationError(
            f"{wanted.path}: calibration must be as in {spec.path} for a set to be loaded there, as it stands before "
            "the decimator"
        )
    if quantized.polynomial is not None and wanted.calibration != spec.calibration:
        polynomial, fitted = polynomial_of(wanted)
        inputs = hardware.datapath.inputs
        ends = tuple((port.lowest, port.highest) for port in inputs)
        covered = ends if fitted is None else calibrated_codes(inputs, fitted)
    return other_set(hardware, ideal=ideal, polynomial=polynomial, calibrated=covered, max_error=wanted.max_error)


def _filter_of(hardware: CoreDesign, wanted: Specification) -> Filter:
    """Design the filter of a specification, of the hardware with a decimator the one behind that.

    Raises
    ------
    SpecificationError
        If it decimates by another factor.
    ShortfallError
        If too much folds into its pass band.
    """
    quantized, decimator, spec = hardware.quantized, hardware.datapath.decimator, wanted.filter
    factor, own = hardware.datapath.samples_per_result, hardware.spec.filter
    if (spec.decimate or 1) not in {own.decimate, factor} or spec.hold != own.hold:
        raise SpecificationError(
            f"{wanted.path}: filter.decimate and filter.hold must be as in {hardware.spec.path} for a set to be loaded "
            f"there, {factor} and {str(own.hold).lower()}"
        )
    if decimator is None or quantized.decimation is None or spec.cutoff is None:
        return filter_of(wanted)
    decimation = replace(quantized.decimation, edge=spec.cutoff[0])
    ideal = decimated(spec, decimation)
    low, high = hardware.datapath.decimated_range
    amplitude = decimator.input.lsb * (high - low) / 2
    gain = max(decimation.worst_aliasing, decimation.passing(ideal, bands=1)[0].gain)
    if gain * amplitude > wanted.max_error:
        folds, allowed = (quantity(float(x), wanted.output.unit) for x in (gain * amplitude, wanted.max_error))
        raise ShortfallError(
            f"the decimator must keep a full-scale sine that folds into the pass band within {allowed}, not {folds}: "
            "lower the cutoff or raise output.max_error"
        )
    return ideal


def other_set(
    hardware: CoreDesign,
    *,
    ideal: Filter | None = None,
    polynomial: Polynomial | None = None,
    calibrated: tuple[tuple[int, int], ...] | None = None,
    max_error: Fraction | None = None,
) -> OtherSet:
    """Make constants of another filter or polynomial for an existing core, and prove their error.

    The formats of all signals are the hardware's. In a program, coefficients may have more fraction bits than those
    they replace: as few as the allowed error requires.

    Parameters
    ----------
    hardware : CoreDesign
        Design of the core.
    ideal, polynomial
        As for `sosmith.gen.reload.other_constants.with_constants`.
    calibrated : tuple of (int, int) or None
        Lowest and highest code of each input that the calibration covers; None for the core's own. The parallel
        architecture keeps checking its own range, so the new range must contain it.
    max_error : Fraction or None
        Error allowed, in the output's unit; None for the core's own limit.

    Raises
    ------
    ShortfallError
        If the constants have another structure, do not fit the hardware, or exceed the bound. Such constants must not
        be loaded.
    """
    allowed = hardware.spec.max_error if max_error is None else max_error
    room = room_of(hardware)
    refusal: ShortfallError | None = None
    for finer in range((0 if ideal is None else room) + 1):
        try:
            quantized = with_constants(hardware.quantized, ideal, polynomial, finer=finer, room=room)
            _check_settling(hardware, quantized)
            _check_bound(quantized, allowed)
            if calibrated is not None:
                _check_calibrated(hardware, calibrated)
                quantized = replace(quantized, datapath=replace(quantized.datapath, calibrated=calibrated))
            made = OtherSet(quantized=quantized, program=_fitted(hardware, quantized.datapath, "set"))
            hardware.architecture.bank(quantized.datapath, made.program)  # which says what does not fit there
            return made
        except ShortfallError as error:
            refusal = refusal or error  # the first refusal is for the hardware's own formats
    assert refusal is not None
    raise refusal


def room_of(hardware: CoreDesign) -> int:
    """Count the fraction bits that coefficients may have beyond the hardware's, with unchanged state formats.

    A program aligns the least significant bit of a state with a digit boundary, so states often have more fraction bits
    than in the datapath. It is 0 in the parallel architecture, where every bit has its own wire.
    """
    unit_program = hardware.architecture.program
    if unit_program is None or not hardware.quantized.sections:
        return 0
    fracs = {location.name: location.frac for location in unit_program.locations if location.is_state}
    lifted = with_constants(hardware.quantized, None, None, room=1)
    return min(
        (
            fracs[f"{old.name}.{old.graph.nodes[i].name}"] - old.graph.nodes[i].frac
            for old, new in zip(hardware.quantized.sections, lifted.sections, strict=True)
            for i in old.graph.delays
            if new.graph.nodes[i].frac != old.graph.nodes[i].frac
        ),
        default=0,
    )


def check_swap(hardware: CoreDesign, active: OtherSet | None, other: OtherSet) -> Swap:
    """Prove that nothing wraps when `other` takes over from `active`, between any two samples, for all inputs in range.

    Parameters
    ----------
    hardware : CoreDesign
        Design of the core.
    active : OtherSet or None
        Set in use: since reset, or since a swap whose transient has ended. None if the core is reset between the
        swap and the next sample: then only the set itself is proven, as it is if the core restarts by itself.
    other : OtherSet
        The new set.

    Raises
    ------
    ShortfallError
        If a signal could exceed its range in the hardware.
    """
    if active is None or hardware.architecture.restarts or not other.quantized.sections:
        return Swap(new_set=other, samples=0, use=_use(hardware, other.quantized.datapath, other.program))
    old, new = active.quantized, other.quantized
    first_range = first_samples(hardware.quantized) if new.steady else None
    if first_range is not None:
        check_samples(old, first_range)
        check_samples(new, first_range)
    transition = transient(old, new, first_range)
    first = len(new.datapath.stages) - 1 - len(transition.ranges)
    ranges: list[dict[str, tuple[int, int]]] = [{} for _ in new.datapath.stages]
    ranges[first : first + len(transition.ranges)] = transition.ranges
    if first_range is not None:
        ranges[first - 1] = held_codes(new, first_range)
    try:
        during = with_ranges(new.datapath, ranges)
        new_program = _fitted(hardware, during, "swap")
    except ValueError as error:
        raise ShortfallError(f"the swap must fit the hardware: {error}; {ADVICE}") from None
    except ShortfallError as error:
        raise ShortfallError(f"{error}; {ADVICE}") from None
    return Swap(
        new_set=replace(other, program=new_program), samples=transition.samples, use=_use(hardware, during, new_program)
    )


def _use(hardware: CoreDesign, during: Datapath, new_program: Program | None) -> Fraction:
    """Largest share of its hardware range that a state of the filter may use, among those that are not just inputs."""
    shares = []
    locations = {} if new_program is None else {location.name: location for location in new_program.locations}
    own = hardware.datapath
    for before, stage, roomy in zip(own.stages, during.stages, with_room(own).stages, strict=True):
        if isinstance(before, StartStage | OutputStage):
            continue  # a first sample may have any value, and a counter keeps to its own
        for index in stage.graph.delays:
            node = stage.graph.nodes[index]
            if stage.graph.nodes[node.operands[0]].op in {Op.INPUT, Op.FRACTION, Op.DELAY}:
                continue
            (low, high), shift = _word(roomy.graph.nodes[index]), 0
            if new_program is not None:
                location = locations[f"{stage.name}.{node.name}"]
                high = (1 << new_program.digit_bits * location.digits) - 1
                low, shift = -high - 1, location.frac - node.frac
            shares += [Fraction(node.low << shift, low or -1), Fraction(node.high << shift, high)]
    return max(shares, default=Fraction(0))


def _check_bound(quantized: Quantized, allowed: Fraction) -> None:
    output = quantized.datapath.output
    bound = quantized.bound * output.lsb
    if bound > allowed:
        raise ShortfallError(
            f"the set must keep its error within {quantity(float(allowed), output.unit)}, and is proven to "
            f"{quantity(float(bound), output.unit)} only: nothing is to be loaded"
        )


def _check_calibrated(hardware: CoreDesign, calibrated: tuple[tuple[int, int], ...]) -> None:
    if hardware.architecture.program is not None:
        return
    own = hardware.datapath.calibrated
    if any(low > own_low or own_high > high for (low, high), (own_low, own_high) in zip(calibrated, own, strict=True)):
        raise ShortfallError(
            f"the measurements must cover all codes that the hardware's did, {_ends(own)}, not {_ends(calibrated)}: "
            "the parallel architecture goes on to flag samples by those"
        )


def _ends(ranges: tuple[tuple[int, int], ...]) -> str:
    return " and ".join(f"{low}..{high}" for low, high in ranges)


def _fitted(hardware: CoreDesign, datapath: Datapath, what: str) -> Program | None:
    """Check that the hardware can run `datapath`; return its program, if there is one. `what` names it in messages."""
    architecture, spec = hardware.architecture, hardware.spec
    are_limited = [_is_limited(each) for each in (hardware.datapath, datapath)]
    if are_limited[1] and not are_limited[0]:
        raise ShortfallError(f"the {what} must keep the output within its range, as the hardware does not limit it")
    if not isinstance(architecture, SharedUnit):
        _check_parallel(hardware.datapath, datapath, what)
        return None
    before = architecture.program
    try:
        new_program = program(datapath.behind_decimator, before.digit_bits, like=before).padded(
            len(before.instructions)
        )
    except ValueError as error:  # FoldingError is one
        raise ShortfallError(f"the {what} must fit the hardware: {error}") from None
    budget = Budget(
        clock=spec.hardware.clock,
        sample_rate=spec.sample_rate,
        channels=architecture.channels,
        decimate=datapath.samples_per_result,
    )
    needed = architecture.clocks_of(new_program)
    if needed > budget.cycles:
        raise ShortfallError(f"the {what} must take at most {budget.cycles:,} clocks a sample, not {needed:,}")
    return new_program


def _is_limited(datapath: Datapath) -> bool:
    graph = datapath.stages[-1].graph
    return graph.nodes[graph.outputs[0]].op is Op.CLAMP


def _check_parallel(hardware: Datapath, other: Datapath, what: str) -> None:
    """Check that `other` is `hardware` with other constants, and that the constants and all ranges fit.

    Raises
    ------
    ShortfallError
        If not; names the first mismatch.
    """
    loadable = constants(hardware)
    polynomials = [each for each in loadable if isinstance(hardware.stages[each.stage], HornerStep)]
    for old, new in zip(with_room(hardware).stages, other.stages, strict=True):
        if [*map(structure, _compared(old, new))] != [*map(structure, new.graph.nodes)]:
            raise ShortfallError(f"the {what} must fit the hardware: {old.name} must have the same operations")
    for some, remedy in ((polynomials, f"; {ROOM}"), (loadable, "")):
        try:
            packed(values_of(other, some), some)
        except ValueError as error:
            raise ShortfallError(f"the {what} must fit the hardware: {error}{remedy}") from None
    for old, new in zip(with_room(hardware).stages, other.stages, strict=True):
        for room, node in zip(_compared(old, new), new.graph.nodes, strict=True):
            low, high = _word(room)
            if not low <= node.low <= node.high <= high:
                raise ShortfallError(
                    f"the {what} must fit the hardware: {old.name}.{node.name or node.op.value} must stay in "
                    f"{low}..{high}, not {node.low}..{node.high}"
                )


def _compared(hardware: Stage, other: Stage) -> Sequence[Node]:
    """Return the hardware's nodes, without a limit at the end that a set whose output stays in range does without."""
    nodes = hardware.graph.nodes
    spare = nodes[-1].op is Op.CLAMP and other.graph.nodes[-1].op is not Op.CLAMP
    return nodes[:-1] if spare else nodes


def _word(node: Node) -> tuple[int, int]:
    """Smallest and largest code that the hardware's signal for a node can hold."""
    span = 1 << node.width
    return (-span // 2, span // 2 - 1) if node.signed else (0, span - 1)
