"""Clocks and words of the folded and serial architectures."""

from __future__ import annotations

from sosmith.model.dataflow.program import Opcode, Program

FOLDED_DEPTH, SERIAL_DEPTH = 5, 3
"""Pipeline stages from the program memory to the accumulator; one more where two products are added up before it."""

_SLICES = {256: 16, 512: 8, 1024: 4, 2048: 2}
"""Width of an iCE40's block RAM, by its number of words."""


def pipeline_depth(program: Program, *, serial: bool) -> int:
    """Pipeline stages from the program memory to the accumulator."""
    return SERIAL_DEPTH if serial else FOLDED_DEPTH + program.products - 1


def latency_cycles(program: Program, *, serial: bool, protect: str = "none") -> int:
    """Clocks from the edge that finds a sample to the edge that can hand its result on; in serial, an upper bound."""
    late = protect != "none"  # the first instruction is then read once there is a sample, since scrubbing uses the port
    clocks = program.serial_cycles if serial else len(program.instructions)
    return late + clocks + pipeline_depth(program, serial=serial)


def taken_cycles(program: Program, *, serial: bool, protect: str = "none") -> int:
    """Clocks from the edge that finds a sample to the edge that accepts it; in serial, an upper bound.

    With protection it is accepted when its result is there, otherwise once the program has read it.
    """
    if protect != "none":
        return latency_cycles(program, serial=serial, protect=protect)
    takes = [number for number, instruction in enumerate(program.instructions) if instruction.opcode is Opcode.TAKE]
    if not serial:
        return takes[-1] + pipeline_depth(program, serial=serial) - 1
    return sum(map(program.serial_cycles_of, program.instructions[: takes[-1] + 1])) + SERIAL_DEPTH - 1


def overlaps(program: Program, *, serial: bool, channels: int = 1, reload: bool = False, protect: str = "none") -> bool:
    """Whether a sample is begun while the last instructions of the one before are still in the pipeline.

    A folded core with one channel does so, if it has neither reload nor protection, unless its program is so short that
    the sample would still be on offer at its end, or the result before would come after the wait for it to leave.
    """
    plain = not serial and channels == 1 and not reload and protect == "none"
    takes = [number for number, instruction in enumerate(program.instructions) if instruction.opcode is Opcode.TAKE]
    is_long = min(program.result_start, len(program.instructions) - takes[-1]) >= pipeline_depth(program, serial=serial)
    return plain and is_long


def cycles_per_sample(
    program: Program, *, serial: bool, channels: int = 1, reload: bool = False, protect: str = "none"
) -> int:
    """Clocks between samples at the highest rate; in serial, an upper bound."""
    if overlaps(program, serial=serial, channels=channels, reload=reload, protect=protect):
        return len(program.instructions)
    idle = protect != "none"  # at least one clock, for scrubbing
    return latency_cycles(program, serial=serial, protect=protect) + idle


def reset_cycles(program: Program, channels: int) -> int:
    """Clocks after a reset in which the memory is cleared."""
    return memory_depth(program, channels) + 1


def memory_depth(program: Program, channels: int) -> int:
    """Return the number of words of the memory; the upper bits of an address are the channel."""
    return program.words * channels


def word_slices(depth: int, width: int) -> list[tuple[int, int]]:
    """Return the lowest bit of each slice of the memory, and the bit behind its highest.

    A slice is as wide as a block RAM of `depth` words. Block RAMs side by side need no logic; behind each other they
    would.

    Examples
    --------
    >>> word_slices(256, 18), word_slices(512, 18)
    ([(0, 16), (16, 18)], [(0, 8), (8, 16), (16, 18)])
    """
    wide = next((bits for most, bits in _SLICES.items() if depth <= most), _SLICES[max(_SLICES)])
    return [(low, min(low + wide, width)) for low in range(0, width, wide)]
