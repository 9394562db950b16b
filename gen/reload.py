"""Other coefficients for hardware that exists: made in its formats, proven anew, and refused where they do not fit.

Ranges and bound are proven for a core that runs from reset with one set. What a swap hands on is a state that
another filter made: until it has died away, neither is proven, and at the rails values do leave the ranges.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.architecture import Budget, structure
from sosmith.gen.core import CoreDesign
from sosmith.gen.design import Filter
from sosmith.gen.quantity import quantity
from sosmith.gen.quantize import Quantized, with_constants
from sosmith.hdl import folded
from sosmith.model.constants import constants, packed, values_of, with_room
from sosmith.model.datapath import Datapath
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.program import Program, program


@dataclass(frozen=True, kw_only=True)
class OtherSet:
    """Constants for hardware that exists.

    Attributes
    ----------
    quantized : Quantized
        The design with them, its bound proven.
    program : Program or None
        What the hardware's unit runs with them, in as many instructions as before; None in the parallel architecture.
    """

    quantized: Quantized
    program: Program | None


def other_set(
    hardware: CoreDesign,
    *,
    ideal: Filter | None = None,
    polynomial: Polynomial | None = None,
    max_error: Fraction | None = None,
) -> OtherSet:
    """Make constants of another filter or polynomial for a core that exists, and prove their error.

    The formats of all signals are the hardware's. Where a program is loaded, coefficients may have more fraction bits
    than those that they replace: as few as the error allowed needs.

    Parameters
    ----------
    hardware : CoreDesign
        What the core was made from.
    ideal, polynomial
        As for `sosmith.gen.quantize.with_constants`.
    max_error : Fraction or None
        Error allowed, in the output's unit; None for what the core was made for.

    Raises
    ------
    ShortfallError
        If the constants have another structure, do not fit the hardware, or break the bound. Nothing of the kind
        must be loaded.
    """
    allowed = hardware.spec.max_error if max_error is None else max_error
    room = room_of(hardware)
    refusal: ShortfallError | None = None
    for finer in range((0 if ideal is None else room) + 1):
        try:
            quantized = with_constants(hardware.quantized, ideal, polynomial, finer=finer, room=room)
            _check_bound(quantized, allowed)
            return OtherSet(quantized=quantized, program=_fitted(hardware, quantized))
        except ShortfallError as error:
            refusal = refusal or error  # the first one is about the hardware's own formats
    assert refusal is not None
    raise refusal


def room_of(hardware: CoreDesign) -> int:
    """Fraction bits that coefficients may have more than the hardware's, with all states where they are.

    A program keeps a state with as many fraction bits as bring its cut between two digits, often more than the
    datapath has. None in the parallel architecture, where every bit has its own wire.
    """
    made = hardware.architecture.program
    if made is None or not hardware.quantized.sections:
        return 0
    places = {place.name: place.frac for place in made.places if place.is_state}
    lifted = with_constants(hardware.quantized, None, None, room=1)
    return min(
        (
            places[f"{old.name}.{old.graph.nodes[i].name}"] - old.graph.nodes[i].frac
            for old, new in zip(hardware.quantized.sections, lifted.sections, strict=True)
            for i in old.graph.delays
            if new.graph.nodes[i].frac != old.graph.nodes[i].frac
        ),
        default=0,
    )


def parallel_bank(hardware: CoreDesign, made: OtherSet) -> list[int]:
    """Words of a bank of the parallel architecture."""
    loadable = constants(hardware.datapath)
    return packed(values_of(made.quantized.datapath, loadable), loadable)


def _check_bound(quantized: Quantized, allowed: Fraction) -> None:
    output = quantized.datapath.output
    bound = quantized.bound * output.lsb
    if bound > allowed:
        raise ShortfallError(
            f"the set must keep its error within {quantity(float(allowed), output.unit)}, and is proven to "
            f"{quantity(float(bound), output.unit)} only: nothing is to be loaded"
        )


def _fitted(hardware: CoreDesign, quantized: Quantized) -> Program | None:
    """Check that the hardware can run it; return its program, if there is one."""
    before = hardware.architecture.program
    if before is None:
        _check_parallel(hardware.datapath, quantized.datapath)
        return None
    try:
        made = program(quantized.datapath, before.digit_bits, like=before).padded(len(before.instructions))
    except ValueError as error:  # FoldingError is one
        raise ShortfallError(f"the set must fit the hardware: {error}") from None
    spec, architecture = hardware.spec, hardware.architecture
    budget = Budget(clock=spec.hardware.clock, sample_rate=spec.sample_rate, channels=architecture.channels)
    needed = folded.latency_cycles(made, serial=architecture.name == "serial") + 1
    if needed > budget.cycles:
        raise ShortfallError(f"the set must take at most {budget.cycles:,} clocks a sample, not {needed:,}")
    return made


def _check_parallel(hardware: Datapath, other: Datapath) -> None:
    """Check that `other` is `hardware` with other constants, and that these and all ranges fit.

    Raises
    ------
    ShortfallError
        If not; tells the first thing that does not fit.
    """
    loadable = constants(hardware)
    for old, new in zip(with_room(hardware).stages, other.stages, strict=True):
        if [*map(structure, old.graph.nodes)] != [*map(structure, new.graph.nodes)]:
            raise ShortfallError(f"the set must fit the hardware: {old.name} must have the same operations")
    try:
        packed(values_of(other, loadable), loadable)
    except ValueError as error:
        raise ShortfallError(f"the set must fit the hardware: {error}") from None
    for old, new in zip(with_room(hardware).stages, other.stages, strict=True):
        for room, node in zip(old.graph.nodes, new.graph.nodes, strict=True):
            if not room.low <= node.low <= node.high <= room.high:
                raise ShortfallError(
                    f"the set must fit the hardware: {old.name}.{node.name or node.op.value} must stay in "
                    f"{room.low}..{room.high}, not {node.low}..{node.high}"
                )
