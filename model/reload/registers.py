"""The registers of a reloadable core, described once for hardware, host, C header and documents.

The address of a register is four times its index in `REGISTERS`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

MAGIC = int.from_bytes(b"SOSM", "little")
"""Value of ``ID``: the letters SOSM, the first one in the lowest byte."""

INTERFACE = 1
"""Version of this register map, in ``LAYOUT``."""

BITS = 32
"""Width of a register, and of the data bus to it."""

MAX_WORDS = (1 << 16) - 1
"""Most words of a bank: what the field of ``LAYOUT`` holds."""


class Outcome(IntEnum):
    """How the last load ended."""

    NONE = 0  # no load has ended since reset
    ACCEPTED = 1  # its CRC was right; active once no swap is pending
    WRONG_CRC = 2  # the CRC of the words is not the one that was written
    BROKEN_OFF = 3  # a write was refused before the load was complete


@dataclass(frozen=True)
class Field:
    """A field of a register: its lowest bit, its width, its meaning, and the names of its values, if they have any."""

    name: str
    low: int
    bits: int
    text: str
    values: type[IntEnum] | None = None

    @property
    def mask(self) -> int:
        """Mask of the field's bits in the register."""
        return ((1 << self.bits) - 1) << self.low

    def of(self, word: int) -> int:
        """Return the field of a register's value `word`."""
        return (word & self.mask) >> self.low


@dataclass(frozen=True)
class Register:
    """A register: whether it can be read and written, what that does, and its fields; without any, it is one number."""

    name: str
    reads: bool
    writes: bool
    text: str
    fields: tuple[Field, ...] = ()

    def __post_init__(self) -> None:
        end = 0
        for field in self.fields:
            if not end <= field.low < field.low + field.bits <= 32:
                raise ValueError(f"field {field.name} of {self.name} must lie in bits {end} to 31, in ascending order")
            end = field.low + field.bits

    def field(self, name: str) -> Field:
        """Return the field `name`."""
        return next(field for field in self.fields if field.name == name)

    @property
    def index(self) -> int:
        """Index in `PROTECTED_REGISTERS`."""
        return [register.name for register in PROTECTED_REGISTERS].index(self.name)

    @property
    def address(self) -> int:
        """Address in bytes."""
        return 4 * self.index


ID = Register("ID", True, False, 'Always 0x4D534F53, in memory the letters "SOSM".')
LAYOUT = Register(
    "LAYOUT",
    True,
    False,
    "How to talk to this core.",
    (
        Field("INTERFACE", 0, 16, "Version of this register map."),
        Field("WORDS", 16, 16, "Words of a bank: a load takes exactly so many."),
    ),
)
DESIGN = Register(
    "DESIGN",
    True,
    False,
    "Fingerprint of the core's structure and formats: a set made for another fingerprint does not fit.",
)
STATUS = Register(
    "STATUS",
    True,
    False,
    "What is going on.",
    (
        Field("LOADING", 0, 1, "A load has begun and is not complete."),
        Field("PENDING", 1, 1, "A load was accepted and becomes active at the next gap between samples."),
        Field("BANK", 2, 1, "Bank that is active."),
        Field("OUTCOME", 4, 2, "How the last load ended.", Outcome),
    ),
)
VERSION = Register(
    "VERSION",
    True,
    True,
    "Reads the version of the active set, 0 before the first one. A write begins a load: it gives the new set's "
    "version, any number of the host's choice, and makes it the first word of the CRC. Refused while a swap is pending "
    "or a sample still uses the other bank.",
)
DATA = Register(
    "DATA",
    False,
    True,
    "A write gives the next word of the bank. Refused outside a load and beyond the bank's end.",
)
CRC = Register(
    "CRC",
    True,
    True,
    "Reads the CRC-32 (IEEE 802.3, as zlib.crc32) of the version and the words so far, each as four bytes, the lowest "
    "first. A write tells what it should be, and ends the load: if it is right, the set becomes active between two "
    "samples, else the write is refused. Refused too while words are missing.",
)
FAULTS = Register(
    "FAULTS",
    True,
    True,
    "Counts the wrong bits that were found, in protected cores; each count stays at its highest value. A write of any "
    "word sets both to 0 and ends the flag `fault`.",
    (
        Field("CORRECTED", 0, 16, "Findings that were corrected; a bit in use counts each time until it is rewritten."),
        Field("UNCORRECTED", 16, 16, "Findings that could not be corrected; each one ends in a restart."),
    ),
)
REGISTERS = (ID, LAYOUT, DESIGN, STATUS, VERSION, DATA, CRC)
"""The registers of every reloadable core, by ascending address."""

PROTECTED_REGISTERS = (*REGISTERS, FAULTS)
"""Those of a protected one."""

LOCKING_STATUS = replace(
    STATUS,
    writes=True,
    text="What is going on. In a core with a lock a write of any word closes it: no set can be loaded until a reset. "
    "Refused during a load and while a swap is pending.",
    fields=(
        *STATUS.fields[:3],
        Field("LOCKED", 3, 1, "No set can be loaded until a reset; 0 without a lock."),
        *STATUS.fields[3:],
    ),
)
"""``STATUS`` of a core with a lock."""


def registers_of(*, protected: bool, lock: bool = False) -> tuple[Register, ...]:
    """Return the registers of a core, by ascending address.

    Parameters
    ----------
    protected : bool
        Whether it counts faults.
    lock : bool
        Whether it can be locked.
    """
    registers = PROTECTED_REGISTERS if protected else REGISTERS
    return tuple(LOCKING_STATUS if lock and register is STATUS else register for register in registers)


BANK_INPUTS = ("reload_write", "reload_address", "reload_data", "reload_bank", "reload_acknowledge")
"""Inputs of a core whose registers are elsewhere; the last one only if it counts faults."""

ADDRESS_BITS = (4 * len(PROTECTED_REGISTERS) - 1).bit_length()
"""Number of address lines of the slave."""
