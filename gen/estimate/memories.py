"""Quantities of memories, made as Yosys 0.70 makes them: of block RAM, of LUT4, or of flip-flops.

Yosys weighs these against each other by what its libraries of memories say that a cell costs, and takes the cheapest
(``passes/memory/memory_libmap.cc`` and ``techlibs/*/*rams*.txt`` of Yosys).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from sosmith.gen.estimate.quantities import LUT_INPUTS, Quantities
from sosmith.gen.fpga.boards import Device


class _BlockRam(NamedTuple):
    """A block RAM: bits, most bits of a word, and what it weighs."""

    bits: int
    widest: int
    cost: int


_BLOCK_RAMS = {"ice40": _BlockRam(4096, 16, 64), "ecp5": _BlockRam(18432, 36, 128), "gowin": _BlockRam(18432, 36, 128)}

_LUT_RAM_WORDS, _LUT_RAM_BITS = 16, 4
"""Words and bits of a memory made of four LUT4, which weigh 4."""

_LUT_RAM_STEPS = {"ecp5": 4, "gowin": 1}
"""Bits in whose multiples the width of such a memory is weighed, in the families that have it."""

_COST_OF_REGISTER = 2
"""What the register weighs that stands behind a memory without its own."""

_COST_OF_CHOICE = 0.5
"""What a choice between two bits weighs, and what finds one of the memories behind each other to be written."""

_ROM_BITS = 16
"""Bits of a memory that is never written that weigh as much as one flip-flop, which weighs 1."""


def block_rams(device: Device, depth: int, width: int) -> int:
    """Return the block RAMs of a memory made of them, each as wide as its number of words lets it be."""
    bits, widest, _ = _BLOCK_RAMS[device.family]
    wide = widest
    while depth * wide > bits and wide > 1:
        wide //= 2
    return -(-width // wide) * -(-depth // (bits // widest * (widest // wide)))


def of_memory(device: Device, depth: int, width: int, *, block: bool = False) -> Quantities:
    """Count a memory that is written; `block` says that it is asked to be block RAM."""
    made: Quantities = Counter({"memory_bits": depth * width})
    blocks = block_rams(device, depth, width)
    deep = -(-depth // _LUT_RAM_WORDS)
    has_lut_ram = device.family in _LUT_RAM_STEPS
    others = depth * width if not has_lut_ram else min(depth * width, _lut_ram_cost(device, deep, width))
    if block or _block_cost(device, blocks) < others:
        return made + Counter({"rams": blocks, "ram_width": width})
    if others == depth * width:
        return made + Counter({"muxed": width * (depth - 1), "registers": (depth + 1) * width})
    cells = deep * -(-width // _LUT_RAM_BITS)
    made += Counter({"lut_ram": _LUT_RAM_BITS * cells, "registers": width})
    return made + Counter({"lut_ram_chosen": (deep - 1) * width, "lut_ram_written": deep * (deep > 1)})


def _block_cost(device: Device, blocks: int) -> int:
    return _BLOCK_RAMS[device.family].cost * blocks + _COST_OF_REGISTER * (device.family in _LUT_RAM_STEPS)


def _lut_ram_cost(device: Device, deep: int, width: int) -> float:
    step = _LUT_RAM_STEPS[device.family]
    chosen = (deep - 1) * width + deep * (deep > 1)
    return deep * -(-width // step) * step + _COST_OF_CHOICE * chosen + _COST_OF_REGISTER


def of_rom(device: Device, words: Sequence[int], width: int, *, block: bool = False) -> Quantities:
    """Count a memory that is never written: of block RAM or of LUT4; `block` says that it is asked to be block RAM."""
    made: Quantities = Counter({"memory_bits": len(words) * width})
    blocks = block_rams(device, len(words), width)
    if block or _block_cost(device, blocks) < len(words) * width / _ROM_BITS:
        return made + Counter({"rams": blocks})
    return made + _rom(words, width) + Counter({"registers": width})


def _rom(words: Sequence[int], bits: int) -> Quantities:
    """Count the LUT4 of such a memory, and the choices between them.

    There is one for each different column of 16 words that is not constant. Columns of twice as many words are chosen
    from two that differ, and so on.
    """
    size, columns = 1 << LUT_INPUTS, [tuple(word >> bit & 1 for word in words) for bit in range(bits)]
    made: Quantities = Counter({"rom": len(_parts(columns, size))})
    while size < len(words):
        size *= 2
        made["rom_chosen"] += sum(len(part) > size // 2 and _differ(part, size // 2) for part in _parts(columns, size))
    return made


def _parts(columns: Sequence[tuple[int, ...]], size: int) -> set[tuple[int, ...]]:
    """Return the different parts of so many words that columns have, without those that are constant."""
    parts = (column[start : start + size] for column in columns for start in range(0, len(column), size))
    return {part for part in parts if 0 < sum(part) < len(part)}


def _differ(part: tuple[int, ...], half: int) -> bool:
    """Say whether the halves of a part differ where both have words."""
    return any(first != second for first, second in zip(part, part[half:], strict=False))
