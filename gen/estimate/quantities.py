"""Quantities of hardware that an estimate is made from, such as bits of sums and of choices, known before synthesis.

Each is counted in LUT4 where one LUT4 does the work of a bit, so that the factors of a fit are about 1.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from sosmith.gen.fpga.boards import Device
from sosmith.gen.word_lengths.cost import Multiplication
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.port import Port

Quantities = Counter[str]
"""Amount of each quantity by its name."""

_LUT_INPUTS = 4

_BLOCK_BITS = {"ice40": 4096, "ecp5": 18432, "gowin": 18432}
"""Bits of a block RAM."""

_BLOCK_WIDTH = {"ice40": 16, "ecp5": 36, "gowin": 36}
"""Most bits of one of its words."""

_BLOCK_COST = {"ice40": 64, "ecp5": 128, "gowin": 128}
"""What Yosys 0.70 weighs a block RAM with against other ways to make a memory; ``cost`` in its library of memories."""

_LUT_RAM_FAMILIES = {"ecp5", "gowin"}
"""Those with memories of 16 words and 4 bits made of four LUT4, which weigh 4; a flip-flop weighs 1."""

_LUT_RAM_WORDS, _LUT_RAM_BITS = 16, 4

_COLUMN = 3
"""Check bits that most data bits belong to, where a wrong bit can be corrected."""

_COST_OF_CHOICE = 2 / 3
"""What a choice between two bits weighs: four bits take two LUT4."""

_ROM_BITS = 16
"""Bits of a memory that is never written that weigh as much as one flip-flop."""

FAMILIES = tuple(_BLOCK_BITS)
"""Families of FPGAs that there are quantities for."""


def tree(inputs: int) -> int:
    """Return the LUT4 that join so many signals into one: each takes four and leaves one."""
    return -(-max(0, inputs - 1) // (_LUT_INPUTS - 1))


def block_rams(device: Device, depth: int, width: int) -> int:
    """Return the block RAMs of a memory made of them, each as wide as its number of words lets it be."""
    bits, widest = _BLOCK_BITS[device.family], _BLOCK_WIDTH[device.family]
    wide = widest
    while depth * wide > bits and wide > 1:
        wide //= 2
    return -(-width // wide) * -(-depth // (bits // widest * (widest // wide)))


def of_memory(device: Device, depth: int, width: int, *, block: bool = False) -> Quantities:
    """Count a memory that is written, made as synthesis does: of block RAM, of LUT4, or of flip-flops.

    `block` says that it is asked to be block RAM.
    """
    made: Quantities = Counter({"memory_bits": depth * width})
    blocks = block_rams(device, depth, width)
    deep = -(-depth // _LUT_RAM_WORDS)
    small = deep * -(-width // _LUT_RAM_BITS) * _LUT_RAM_BITS
    has_small = device.family in _LUT_RAM_FAMILIES
    small_cost = small + (deep - 1) * width * _COST_OF_CHOICE if has_small else depth * width
    if block or _BLOCK_COST[device.family] * blocks < small_cost:
        return made + Counter({"rams": blocks, "ram_width": width})
    if has_small:
        return made + Counter({"lut_ram": small + (deep - 1) * width, "registers": width})
    return made + Counter({"muxed": width * (depth - 1), "registers": (depth + 1) * width})


def of_rom(device: Device, words: Sequence[int], width: int) -> Quantities:
    """Count a memory that is never written: of block RAM or of LUT4."""
    made: Quantities = Counter({"memory_bits": len(words) * width})
    blocks = block_rams(device, len(words), width)
    if _BLOCK_COST[device.family] * blocks < len(words) * width / _ROM_BITS:
        return made + Counter({"rams": blocks})
    return made + Counter({"rom": _rom(words, width), "registers": width})


def _rom(words: Sequence[int], bits: int) -> int:
    """Return the LUT4 of such a memory: one for each different column of 16 words that is not constant."""
    size = 1 << _LUT_INPUTS
    found: set[tuple[int, ...]] = set()
    for start in range(0, len(words), size):
        block = words[start : start + size]
        for bit in range(bits):
            column = tuple(word >> bit & 1 for word in block)
            if 0 < sum(column) < len(column):
                found.add((*column, *[2] * (size - len(column))))
    return len(found)


def check_bits(bits: int, protect: str) -> int:
    """Return the check bits of a word: parity, or enough for a column of each bit with an odd number of ones."""
    if protect == "none":
        return 0
    checks = 3 if protect == "correct" else 1
    while protect == "correct" and 2 ** (checks - 1) - checks < bits:
        checks += 1
    return checks


def of_check_bits(bits: int, protect: str, *, written: bool = True) -> Quantities:
    """Count what makes check bits where a word is written, compares them where it is read, and corrects a bit."""
    checks = check_bits(bits, protect)
    if not checks:
        return Counter()
    joined = bits if checks == 1 else _COLUMN * bits // checks
    made: Quantities = Counter({"parities": checks * ((1 + written) * tree(joined) + 1)})
    return made + Counter({"corrected": bits * (1 + tree(checks)) if checks > 1 else 0})


def parity(code: int) -> int:
    """Return the parity of a word."""
    return code.bit_count() % 2


def of_inputs(ports: Sequence[Port], calibrated: Sequence[tuple[int, int]]) -> Quantities:
    """Count what finds codes at the ends of their ranges, and outside a calibration where its range is known."""
    made: Quantities = Counter()
    for port in ports:
        made["logic"] += 2 * tree(port.bits)
    for port, (low, high) in zip(ports, calibrated, strict=False):
        made["compared"] += port.bits * ((low > port.lowest) + (high < port.highest))
    return made


def of_output_buffer(bits: int) -> Quantities:
    """Count the buffer of two words beside a pipeline."""
    return Counter({"chosen": bits, "registers": 2 * bits + 2})


def flags_of(datapath: Datapath) -> int:
    """Return the number of flags of a result: two of inputs, one of its limits, those of wear, one while it settles."""
    return 3 + 2 * bool(datapath.wear) + datapath.settles


def soft_product(product: Multiplication, rows: int) -> int:
    """Return the LUT4 of a product without multiplier blocks: rows are added up three by three, the last two by carry.

    `rows` is the number of shifted copies of the data, or of the factor if that is wider. With a sign each of them is
    extended to the whole product, half of the other operand on average.
    """
    narrow, wide = sorted((product.data.bits, product.factor.bits))
    if rows < narrow:  # a constant with zeros
        narrow, wide = product.factor.bits, product.data.bits
    signed = product.data.signed or product.factor.signed
    return (2 * (rows - 2) + 1) * (wide + (narrow // 2 if signed else 1)) if rows > 1 else 0
