"""The C driver compiles without a warning, and loads sets into a model of the registers."""

import ctypes
import random
import subprocess
import zlib
from dataclasses import dataclass, field

import pytest
from tests.gen.output.packages.made import design_of, package_of, unpacked

from sosmith.gen.output.core_facts import ReloadFacts
from sosmith.model.reload.registers import (
    CRC,
    DATA,
    DESIGN,
    FAULTS,
    ID,
    INTERFACE,
    LAYOUT,
    MAGIC,
    STATUS,
    VERSION,
    Outcome,
)

READ = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_uint32, ctypes.POINTER(ctypes.c_uint32))
WRITE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32)
GOOD, REFUSED, OTHER_CORE, WRONG_CRC, BROKEN_OFF, WRONG_COUNT, STILL_PENDING = range(7)


class Bus(ctypes.Structure):
    _fields_ = (("read", READ), ("write", WRITE), ("context", ctypes.c_void_p))


@dataclass
class Core:
    """The registers as docs/registers.md describes them; a swap stays pending for some reads of ``STATUS``."""

    facts: ReloadFacts
    pending: int = 0
    corrupts: bool = False
    breaks_off_after: int | None = None
    version: int = 0
    bank: list[int] = field(default_factory=list)
    loading: list[int] | None = None
    outcome: Outcome = Outcome.NONE
    faults: int = 3 << 16 | 5

    def read(self, _context: object, address: int, word: "ctypes._Pointer[ctypes.c_uint32]") -> int:
        layout = INTERFACE | self.facts.words << LAYOUT.field("WORDS").low
        values = {ID: MAGIC, LAYOUT: layout, DESIGN: self.facts.design, VERSION: self.version, FAULTS: self.faults}
        if address == STATUS.address:
            word[0] = self.outcome << STATUS.field("OUTCOME").low | bool(self.pending) << STATUS.field("PENDING").low
            self.pending = max(self.pending - 1, 0)
            return 0
        found = [value for register, value in values.items() if register.address == address]
        word[0] = found[0] if found else 0
        return 0 if found else 2

    def write(self, _context: object, address: int, word: int) -> int:
        if address == VERSION.address:
            self.loading = [word]
        elif address == DATA.address and self.loading is not None and len(self.loading) <= self.facts.words:
            if self.breaks_off_after == len(self.loading):
                self.loading, self.outcome = None, Outcome.BROKEN_OFF
                return 2
            self.loading.append(word ^ (self.corrupts and len(self.loading) == 7))
        elif address == CRC.address and self.loading is not None and len(self.loading) == self.facts.words + 1:
            taken, self.loading = self.loading, None
            if word != zlib.crc32(b"".join(each.to_bytes(4, "little") for each in taken)):
                self.outcome = Outcome.WRONG_CRC
                return 2
            self.outcome, self.version, self.bank = Outcome.ACCEPTED, taken[0], taken[1:]
        elif address == FAULTS.address:
            self.faults = 0
        else:
            return 2
        return 0


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = unpacked("tunable", tmp_path_factory.mktemp("driver")) / "driver"
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-I../core", "-shared", "-fPIC"]
    subprocess.run([*command, "tunable_driver.c", "-o", "driver.so"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "driver.so"))


def core(**state: object) -> Core:
    facts = design_of("tunable").facts.reload
    assert facts is not None
    return Core(facts, **state)  # type: ignore[arg-type]


def load(library: ctypes.CDLL, core: Core, words: list[int], patience: int = 10) -> int:
    bus = Bus(READ(core.read), WRITE(core.write), None)
    array = (ctypes.c_uint32 * len(words))(*words)
    return int(
        library.tunable_load(
            ctypes.byref(bus), ctypes.c_uint32(0xCAFE0001), array, ctypes.c_size_t(len(words)), ctypes.c_ulong(patience)
        )
    )


def some_words() -> list[int]:
    rng = random.Random(1)
    return [rng.getrandbits(32) for _ in range(core().facts.words)]


@pytest.mark.slow
def test_a_set_is_loaded(library: ctypes.CDLL) -> None:
    made, words = core(pending=4), some_words()
    assert load(library, made, words) == GOOD
    assert (made.version, made.bank, made.pending) == (0xCAFE0001, words, 0)
    bus, version = Bus(READ(made.read), WRITE(made.write), None), ctypes.c_uint32()
    assert library.tunable_version(ctypes.byref(bus), ctypes.byref(version)) == GOOD
    assert version.value == 0xCAFE0001


@pytest.mark.parametrize(
    ("state", "outcome"),
    [
        ({"corrupts": True}, WRONG_CRC),
        ({"breaks_off_after": 3}, REFUSED),
        ({"pending": 100}, STILL_PENDING),
    ],
)
def test_what_goes_wrong_is_told(state: dict[str, object], outcome: int, library: ctypes.CDLL) -> None:
    assert load(library, core(**state), some_words()) == outcome


def test_a_set_of_another_size_is_not_sent(library: ctypes.CDLL) -> None:
    made = core()
    assert load(library, made, some_words()[1:]) == WRONG_COUNT
    assert made.loading is None


def test_another_core_is_recognized(library: ctypes.CDLL) -> None:
    own = core()
    for made, expected in ((own, GOOD), (Core(ReloadFacts(**vars(own.facts) | {"design": 1})), OTHER_CORE)):
        bus = Bus(READ(made.read), WRITE(made.write), None)
        assert library.tunable_check(ctypes.byref(bus)) == expected


def test_faults_are_counted_and_cleared(library: ctypes.CDLL) -> None:
    made = core()
    bus = Bus(READ(made.read), WRITE(made.write), None)
    counts = ctypes.c_uint32(), ctypes.c_uint32()
    for expected in ((5, 3), (0, 0)):
        assert library.tunable_faults(ctypes.byref(bus), *map(ctypes.byref, counts)) == GOOD
        assert tuple(count.value for count in counts) == expected
        assert library.tunable_clear_faults(ctypes.byref(bus)) == GOOD


def test_registers_in_memory_are_reached(library: ctypes.CDLL) -> None:
    memory = (ctypes.c_uint32 * 8)()
    facts = core().facts
    layout = INTERFACE | facts.words << LAYOUT.field("WORDS").low
    for register, value in ((ID, MAGIC), (LAYOUT, layout), (DESIGN, facts.design)):
        memory[register.address // 4] = value
    library.tunable_at.restype = Bus
    bus = library.tunable_at(memory)
    assert library.tunable_check(ctypes.byref(bus)) == GOOD
    memory[FAULTS.address // 4] = 1
    assert library.tunable_clear_faults(ctypes.byref(bus)) == GOOD
    assert memory[FAULTS.address // 4] == 0


def test_a_core_without_registers_has_no_driver() -> None:
    assert not [path for path in package_of("plain") if path.startswith("driver/")]
