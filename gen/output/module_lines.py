"""What modules of a core do that are no stages of its datapath: a few lines of comment for each.

::

    // multiply_accumulate: added = total + product, one instruction a clock, ..
    module name_multiply_accumulate(...)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sosmith.gen.architectures.shared_unit import SharedUnit
from sosmith.gen.core import CoreDesign
from sosmith.model.dataflow.program import Location

_SHELL = {
    "output_buffer": ("output_buffer: two results for a sink that waits; advance says that there is room.",),
    "input_buffer": ("input_buffer: two samples, which wait here for the last one of their channel.",),
    "guard": ("guard: scrubs memories while they are idle, and restarts the core after a fault.",),
    "reload_port": ("reload_port: the registers at s_axil_*, through which constants are loaded.",),
    "constant_banks": ("constant_banks: the constants that can be loaded, twice; a sample takes its bank along.",),
}


def module_lines(design: CoreDesign) -> Mapping[str, Sequence[str]]:
    """Return the lines for each module, by its name without those of the core and of what is behind a decimator."""
    unit = design.architecture
    return _SHELL | _unit_lines(unit, design) if isinstance(unit, SharedUnit) else _SHELL


def _unit_lines(unit: SharedUnit, design: CoreDesign) -> dict[str, Sequence[str]]:
    """Return the lines for the modules of a unit that runs a program."""
    program, serial, channels = unit.program, unit.bit_serial, design.spec.channels
    count, word, digit, total = (
        len(program.instructions),
        program.digit_bits + 1,
        program.digit_bits,
        program.accumulator_bits,
    )
    last = 3 if serial else 5
    each = f" for each of {channels} channels" if channels > 1 else ""
    return {
        "sequencer": (
            f"sequencer: clears the words after a reset, and counts through the {count} instructions for each sample.",
            "start: a sample is found; busy: it is in work; s_axis_tready: it has been read.",
        ),
        "program_memory": (
            f"program_memory: {count} instructions; instructionK is the one in pipeline stage K of {last}, if validK.",
            "Its fields: opcode [3:0]; address of the word read; target, that of the word written; above them",
            f"constant, {word} bits, two's complement. instructionK_is_NAME and the like: what the opcode asks for.",
        ),
        "word_memory": (
            f"word_memory: {program.words} words of {word} bits{each}.",
            f"A value lies in digits of {digit} bits, the lowest first, the last one with its sign, times 2**frac:",
            *(_place(location) for location in program.locations if location.is_state),
        ),
        "multiply_accumulate": (
            f"multiply_accumulate: added = total + product, {total} bits, for the instruction in stage {last}.",
            f"A product takes a clock for each bit of left, {word} of them at most: the multiples of shifted are added."
            if serial
            else f"product = data * factor, {word} by {word} bits, two clocks after the word was read.",
            f"total is then added; shifted by {digit} bits if the instruction carries, and 0 if it clears.",
        ),
        "result": (
            "result: given0, given1, .. are the digits of a result, the lowest first; m_axis_tdata is that within its",
            f"range, {design.datapath.output.bits} bits. It stays until accepted. rail, outside: flags of its sample.",
        ),
    }


def _place(location: Location) -> str:
    first, last = location.addresses[0], location.addresses[-1]
    whole = location.addresses == tuple(range(first, last + 1))
    words = ", ".join(map(str, location.addresses)) if not whole or first == last else f"{first} to {last}"
    return f"  {'word' if first == last else 'words'} {words}: {location.name}, frac {location.frac}"
