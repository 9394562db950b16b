# amaranth: UnusedElaboratable=no
"""The reload port: what arrives whole and right becomes active between two samples, and nothing else ever does."""

import types
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from amaranth.hdl import ClockDomain, ClockSignal, Module
from amaranth.sim import Simulator
from tests.hdl.bus import reload_benches
from tests.hdl.bus.axi_lite_bench import OKAY, SLVERR
from tests.hdl.bus.reload_benches import DEPTH, Bench, Scenario, benched, crc_of
from tests.verify.parallel.cores import small_design
from tests.verify.small_specifications import PLAIN

from sosmith.hdl import reload
from sosmith.hdl.constant_banks import ConstantBanks
from sosmith.hdl.cores import parallel as core
from sosmith.hdl.reload import ReloadPort
from sosmith.model.dataflow.status import Flag
from sosmith.model.reload.registers import (
    ADDRESS_BITS,
    CRC,
    DATA,
    DESIGN,
    FAULTS,
    ID,
    LAYOUT,
    LOCKING_STATUS,
    MAGIC,
    REGISTERS,
    STATUS,
    VERSION,
    Outcome,
    registers_of,
)


async def a_good_load_becomes_active(bench: Bench) -> None:
    for _ in range(5):
        version, words = bench.pace.getrandbits(32), bench.words()
        assert set(await bench.load(version, words)) == {OKAY}
        await bench.bus.idle(2)
        assert bench.active == words
        assert await bench.version() == version
        assert await bench.bus.read(CRC.address) == (crc_of(version, words), OKAY)
        found = await bench.status()
        assert found == {"LOADING": 0, "PENDING": 0, "BANK": bench.swaps % 2, "OUTCOME": Outcome.ACCEPTED}
    assert bench.swaps == 5


async def a_wrong_crc_never_becomes_active(bench: Bench) -> None:
    words = bench.words()
    await bench.load(7, words)
    await bench.bus.idle(2)
    for flipped in (1, 2, 1 << 13, 1 << 31, 0xFFFFFFFF):
        wrong = bench.words()
        *others, last = await bench.load(8, wrong, crc=crc_of(8, wrong) ^ flipped)
        assert (set(others), last) == ({OKAY}, SLVERR)
        assert (await bench.status())["OUTCOME"] == Outcome.WRONG_CRC
    await bench.bus.idle(20)
    assert (bench.swaps, bench.active) == (1, words)
    assert await bench.version() == 7


async def a_load_broken_off_never_becomes_active(bench: Bench) -> None:
    write = bench.bus.write
    words, good = bench.words(), bench.words()
    await bench.load(7, words)
    await bench.bus.idle(2)

    async def then_refused(count: int, *access: int) -> None:
        """Begin a load of some words; break it off by a write that is refused; then nothing can save it."""
        assert await write(VERSION.address, 9) == OKAY
        for word in good[:count]:
            assert await write(DATA.address, word) == OKAY
        assert await write(*access) == SLVERR
        found = await bench.status()
        assert (found["LOADING"], found["OUTCOME"]) == (0, Outcome.BROKEN_OFF)
        assert await write(DATA.address, good[-1]) == SLVERR
        assert await write(CRC.address, crc_of(9, good)) == SLVERR

    await then_refused(DEPTH - 1, CRC.address, crc_of(9, good[:-1]))  # a word is missing
    await then_refused(DEPTH, DATA.address, 0)  # a word too many
    for address in (ID.address, LAYOUT.address, DESIGN.address, STATUS.address, 4 * len(REGISTERS)):
        await then_refused(DEPTH, address, 0)  # a write of what cannot be written
    for strobe in (0, 7, 14, 13):
        await then_refused(DEPTH, CRC.address, crc_of(9, good), strobe)
    await bench.bus.idle(20)
    assert (bench.swaps, bench.active) == (1, words)
    assert await bench.version() == 7


async def a_load_may_begin_anew(bench: Bench) -> None:
    assert await bench.bus.write(VERSION.address, 1) == OKAY
    assert await bench.bus.write(DATA.address, 5) == OKAY
    words = bench.words()
    assert set(await bench.load(2, words)) == {OKAY}
    await bench.bus.idle(2)
    assert bench.active == words


async def a_refused_read_breaks_nothing(bench: Bench) -> None:
    words = bench.words()
    assert await bench.bus.write(VERSION.address, 3) == OKAY
    for place, word in enumerate(words):
        assert await bench.bus.write(DATA.address, word) == OKAY
        assert await bench.bus.read(CRC.address) == (crc_of(3, words[: place + 1]), OKAY)
        assert (await bench.bus.read(DATA.address))[1] == SLVERR
        assert (await bench.bus.read(4 * len(REGISTERS)))[1] == SLVERR
        assert (await bench.status())["LOADING"]
    assert await bench.bus.write(CRC.address, crc_of(3, words)) == OKAY
    await bench.bus.idle(2)
    assert bench.active == words


async def the_lowest_address_bits_are_ignored(bench: Bench) -> None:
    write, read = bench.bus.write, bench.bus.read
    for low in range(4):
        version, words = 11 + low, bench.words()
        assert await write(VERSION.address + low, version) == OKAY
        for place, word in enumerate(words):
            assert await write(DATA.address + (low + place) % 4, word) == OKAY
        assert await write(CRC.address + low, crc_of(version, words)) == OKAY
        await bench.bus.idle(2)
        assert bench.active == words
        assert await read(VERSION.address + low) == (version, OKAY)
        assert await read(ID.address + low) == (MAGIC, OKAY)
        assert (await read(DATA.address + low))[1] == SLVERR
        assert (await read(4 * len(REGISTERS) + low))[1] == SLVERR
    for low in range(1, 4):  # the strobes of a manager that writes the bytes from there on
        assert await write(VERSION.address + low, 7, 15 << low & 15) == SLVERR
        assert not (await bench.status())["LOADING"]


async def a_pending_set_waits_for_a_gap_and_keeps_new_loads_away(bench: Bench) -> None:
    bench.gaps = 0.0
    words = bench.words()
    await bench.load(4, words)
    await bench.bus.idle(300)
    assert await bench.bus.write(VERSION.address, 5) == SLVERR
    assert await bench.bus.write(DATA.address, 5) == SLVERR
    found = await bench.status()
    assert (found["PENDING"], found["LOADING"], found["OUTCOME"]) == (1, 0, Outcome.ACCEPTED)
    assert await bench.version() == 0
    assert bench.swaps == 0
    bench.gaps = 1.0
    await bench.bus.idle(2)
    assert (bench.swaps, bench.active) == (1, words)
    assert await bench.version() == 4


async def no_load_begins_while_a_sample_uses_the_other_bank(bench: Bench) -> None:
    bench.ctx.set(bench.dut.shadow_free, 0)
    assert await bench.bus.write(VERSION.address, 5) == SLVERR
    assert await bench.bus.write(DATA.address, 5) == SLVERR
    assert not (await bench.status())["LOADING"]
    bench.ctx.set(bench.dut.shadow_free, 1)
    assert set(await bench.load(5, bench.words())) == {OKAY}


async def a_swap_does_not_show_half_way_through_a_read(bench: Bench) -> None:
    old, swap_at = 0, 0

    def every_clock() -> None:
        bench.gaps = float(bench.bus.clocks >= swap_at)
        bench.every_clock()

    bench.bus.every_clock = every_clock
    for delay in range(0, 45, 3):
        swap_at = 1 << 32
        new = ~old & 0xFFFFFFFF
        await bench.load(new, bench.words())
        swap_at = bench.bus.clocks + delay
        assert await bench.version() in {old, new}
        await bench.bus.idle(45)
        assert bench.swaps == delay // 3 + 1
        old = new


async def a_reset_ends_a_load_and_keeps_what_is_active(bench: Bench) -> None:
    words = bench.words()
    await bench.load(6, words)
    await bench.bus.idle(2)
    await bench.reset()
    assert await bench.bus.read(CRC.address) == (crc_of(6, words), OKAY)
    await bench.bus.write(VERSION.address, 7)
    await bench.reset()
    assert await bench.status() == {"LOADING": 0, "PENDING": 0, "BANK": 1, "OUTCOME": Outcome.NONE}
    assert await bench.bus.write(DATA.address, 7) == SLVERR
    bench.gaps = 0.0
    await bench.load(8, bench.words())
    await bench.reset()
    bench.gaps = 1.0
    await bench.bus.idle(20)
    assert (bench.swaps, bench.active) == (1, words)
    assert await bench.version() == 6
    bench.bus.set(arvalid=1)
    await bench.bus.idle(9)
    await bench.reset()  # in the middle of an access
    assert set(await bench.load(9, words)) == {OKAY}


SCENARIOS: tuple[Scenario, ...] = (
    a_good_load_becomes_active,
    a_wrong_crc_never_becomes_active,
    a_load_broken_off_never_becomes_active,
    a_load_may_begin_anew,
    a_refused_read_breaks_nothing,
    the_lowest_address_bits_are_ignored,
    a_pending_set_waits_for_a_gap_and_keeps_new_loads_away,
    no_load_begins_while_a_sample_uses_the_other_bank,
    a_swap_does_not_show_half_way_through_a_read,
    a_reset_ends_a_load_and_keeps_what_is_active,
)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.__name__)
def test_the_port(scenario: Scenario) -> None:
    assert len(REGISTERS) < 1 << (ADDRESS_BITS - 2)  # there is an address behind the last register
    benched(scenario)


MUTANTS: dict[str, tuple[Scenario, str, str, str]] = {
    "another polynomial": (a_good_load_becomes_active, "bus/serial_crc", "0xEDB88320", "0xEDB88321"),
    "a CRC goes on from the load before": (
        a_good_load_becomes_active,
        "bus/serial_crc",
        "with m.If(self.i_clear)",
        "with m.If(0)",
    ),
    "any CRC is right": (a_wrong_crc_never_becomes_active, "reload", "right.eq(0)", "right.eq(1)"),
    "only the last bit of the CRC counts": (
        a_wrong_crc_never_becomes_active,
        "reload",
        "with m.If(slave.o_start):",
        "with m.If(slave.o_shift):",
    ),
    "words may be missing": (
        a_load_broken_off_never_becomes_active,
        "reload",
        "_is_at(slave, CRC) & loading & complete",
        "_is_at(slave, CRC) & loading",
    ),
    "words may be too many": (
        a_load_broken_off_never_becomes_active,
        "reload",
        "_is_at(slave, DATA) & loading & ~complete",
        "_is_at(slave, DATA) & loading",
    ),
    "a refused write is forgiven": (
        a_load_broken_off_never_becomes_active,
        "reload",
        "[loading.eq(0), outcome.eq(Outcome.BR",
        "[outcome.eq(Outcome.BR",
    ),
    "a swap without leave": (
        a_pending_set_waits_for_a_gap_and_keeps_new_loads_away,
        "reload",
        "self.pending & self.may_swap",
        "self.pending",
    ),
    "a load begins with a swap pending": (
        a_pending_set_waits_for_a_gap_and_keeps_new_loads_away,
        "reload",
        "VERSION) & ~self.pending &",
        "VERSION) &",
    ),
    "a load begins in a bank in use": (
        no_load_begins_while_a_sample_uses_the_other_bank,
        "reload",
        "& self.shadow_free)",
        ")",
    ),
    "a new version goes to the active set": (
        a_good_load_becomes_active,
        "reload",
        "slave.o_index ^ ~bank",
        "slave.o_index ^ bank",
    ),
    "a version is read across a swap": (
        a_swap_does_not_show_half_way_through_a_read,
        "reload",
        "VERSION) & seen_bank",
        "VERSION) & bank",
    ),
    "a load does not begin at the first word": (
        a_load_may_begin_anew,
        "reload",
        "[loading.eq(1), taken.eq(0)]",
        "loading.eq(1)",
    ),
    "a reset changes the bank": (
        a_reset_ends_a_load_and_keeps_what_is_active,
        "reload",
        "bank = Signal(reset_less=True)",
        "bank = Signal()",
    ),
    "single bytes are written": (
        a_load_broken_off_never_becomes_active,
        "bus/axi_lite",
        "partial.eq(~self.s_axil_wstrb.all())",
        "partial.eq(0)",
    ),
    "an unaligned write is refused": (
        the_lowest_address_bits_are_ignored,
        "bus/axi_lite",
        "partial.eq(~self.s_axil_wstrb.all())",
        "partial.eq(~self.s_axil_wstrb.all() | self.s_axil_awaddr[:2].any())",
    ),
    "an unaligned part of a word is written": (
        the_lowest_address_bits_are_ignored,
        "bus/axi_lite",
        "partial.eq(~self.s_axil_wstrb.all())",
        "partial.eq(~self.s_axil_wstrb.all() & ~self.s_axil_awaddr[:2].any())",
    ),
    "an unaligned read is of another word": (
        the_lowest_address_bits_are_ignored,
        "bus/axi_lite",
        "index.eq(self.s_axil_araddr[2:])",
        "index.eq(self.s_axil_araddr[2:] + self.s_axil_araddr[:2].any())",
    ),
    "an answer does not wait": (
        a_refused_read_breaks_nothing,
        "bus/axi_lite",
        "self.s_axil_bready, self.s_axil_rready",
        "self.s_axil_bready, 1",
    ),
    "ready follows valid": (
        a_good_load_becomes_active,
        "bus/axi_lite",
        "arready.eq(idle & ~writes)",
        "arready.eq(self.s_axil_arvalid & idle & ~writes)",
    ),
    "refusals are not told": (a_refused_read_breaks_nothing, "bus/axi_lite", "failed.eq(refused)", "failed.eq(0)"),
}
"""For each the scenario that must notice it, the module, and what is replaced by what."""

USED_BY = {"bus/serial_crc": (reload, "SerialCrc"), "bus/axi_lite": (reload, "SerialSlave")}
"""Where the components of a module are looked up; the port itself here."""


@pytest.mark.sweep(4)
@pytest.mark.parametrize("mutant", MUTANTS.values(), ids=list(MUTANTS))
def test_a_broken_port_is_noticed(mutant: tuple[Scenario, str, str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    scenario, name, old, new = mutant
    path = Path(reload.__file__).parent / f"{name}.py"
    source = path.read_text(encoding="utf-8")
    assert source.count(old) == 1
    broken = types.ModuleType(f"sosmith.hdl.{name}")
    exec(compile(source.replace(old, new), path, "exec"), vars(broken))
    user, component = USED_BY.get(name, (reload_benches, "ReloadPort"))
    monkeypatch.setattr(user, component, getattr(broken, component))

    with pytest.raises(AssertionError):
        benched(scenario)


def test_constants_tell_what_the_core_is() -> None:
    async def scenario(bench: Bench) -> None:
        read = bench.bus.read
        assert await read(ID.address) == (MAGIC, OKAY)
        word, _ = await read(LAYOUT.address)
        assert [field.of(word) for field in LAYOUT.fields] == [1, DEPTH]
        assert await read(DESIGN.address) == (0x89ABCDEF, OKAY)
        assert await bench.version() == 0
        assert set((await bench.status()).values()) == {0}

    benched(scenario, design=0x89ABCDEF)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_loads_of_all_kinds_at_any_pace(seed: int) -> None:
    async def scenario(bench: Bench) -> None:
        pace, version = bench.pace, 0
        active: list[int | None] = [None] * 3
        for _ in range(15):
            bench.gaps = pace.choice((1.0, 0.1, 0.01))
            words, new, crc = bench.words(pace.choice((2, 3, 3, 3, 3, 4))), pace.getrandbits(32), None
            if pace.random() < 0.3:
                crc = crc_of(new, words) ^ 1 << pace.randrange(32)
            responses = await bench.load(new, words, crc=crc)
            while (await bench.status())["PENDING"]:
                pass
            good = crc is None and len(words) == 3
            assert (responses[-1] == OKAY) == good
            if good:
                active, version = [word & 0x1FFFF for word in words], new
            assert bench.active == active
            assert await bench.version() == version

    benched(scenario, bits=17, seed=seed)


@pytest.mark.parametrize("depth", [1, 2, 4, 7])
def test_every_word_of_a_bank_is_reached(depth: int) -> None:
    async def scenario(bench: Bench) -> None:
        words = bench.words()
        assert set(await bench.load(1, words)) == {OKAY}
        await bench.bus.idle(2)
        assert bench.active == words

    benched(scenario, depth)


def test_latency_is_as_stated() -> None:
    async def scenario(bench: Bench) -> None:
        bus = bench.bus
        found: dict[str, set[int]] = {"read": set(), "write": set(), "refused": set()}

        async def timed(kind: str, asks: tuple[str, ...], answer: str, address: int) -> None:
            bus.set(**{f"{channel}valid": 1 for channel in asks}, awaddr=address, araddr=address, wstrb=15)
            start = bus.clocks
            while not bus.get(f"{answer}valid"):
                taken = [channel for channel in asks if bus.get(f"{channel}valid") and bus.get(f"{channel}ready")]
                await bus.clock()
                bus.set(**{f"{channel}valid": 0 for channel in taken})
            found[kind].add(bus.clocks - start)
            bus.set(**{f"{answer}ready": 1})
            await bus.clock()
            bus.set(**{f"{answer}ready": 0})

        for wait in (1, 2, 1, 1, 2, 2, 1):
            await bus.idle(wait)
            await timed("read", ("ar",), "r", ID.address)
            await bus.idle(wait // 2)
            await timed("write", ("aw", "w"), "b", VERSION.address)
            await bus.idle(wait)
            await timed("refused", ("aw", "w"), "b", ID.address)
            await bus.idle(wait // 2)
            await timed("refused", ("ar",), "r", DATA.address)
        assert found == {"read": {35, 36}, "write": {36, 37}, "refused": {2, 3, 4}}

    benched(scenario)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"depth": 0}, r"^depth must be 1 to 65535, not 0$"),
        ({"depth": 65536}, r"^depth must be 1 to 65535, not 65536$"),
        ({"depth": 1, "bits": 33}, r"^bits must be 1 to 32, not 33$"),
        ({"depth": 1, "bits": 0}, r"^bits must be 1 to 32, not 0$"),
    ],
)
def test_impossible_sizes_are_refused(options: dict[str, int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ReloadPort(**options)


def simulated(dut: Any, testbench: Any) -> None:
    """Run a core, out of reset and with a sink that is ready, in the clock domain `bench`."""
    m = Module()
    m.domains.bench = ClockDomain()
    m.submodules.core = dut
    m.d.comb += [dut.aclk.eq(ClockSignal("bench")), dut.aresetn.eq(1), dut.m_axis_tready.eq(1)]
    simulator = Simulator(m)
    simulator.add_clock(1e-6, domain="bench")
    simulator.add_testbench(testbench)
    simulator.run()


@pytest.mark.parametrize("wrong", [1, 2])
def test_a_core_loads_the_idle_bank_and_flags_what_the_wrong_one_gives(
    wrong: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bit 0 stands for the bank in use at first, bit 1 for the other."""

    class Banks(ConstantBanks):
        """Banks with wrong bits."""

        def elaborate(self, platform: object) -> Module:
            """Build them."""
            m = super().elaborate(platform)
            m.d.comb += self.wrong.eq(wrong)
            return m

    monkeypatch.setattr(core, "ConstantBanks", Banks)
    dut: Any = core.Core(replace(small_design(PLAIN, "df1_ef1").datapath, wear=((10, 20),)), 1, 1, protect="detect")

    async def testbench(ctx: Any) -> None:
        for name, value in {"awaddr": VERSION.address, "awvalid": 1, "wvalid": 1, "wstrb": 15}.items():
            ctx.set(getattr(dut, f"s_axil_{name}"), value)
        (response,) = await ctx.tick("bench").sample(dut.s_axil_bresp).until(dut.s_axil_bvalid)
        assert response == OKAY
        ctx.set(dut.s_axis_tvalid, 1)
        (status,) = await ctx.tick("bench").sample(dut.m_axis_tuser).until(dut.m_axis_tvalid)
        assert status >> Flag.FAULT == (wrong == 1)
        for name, value in {"awvalid": 0, "bready": 1, "araddr": FAULTS.address, "arvalid": 1}.items():
            ctx.set(getattr(dut, f"s_axil_{name}"), value)
        (faults,) = await ctx.tick("bench").sample(dut.s_axil_rdata).until(dut.s_axil_rvalid)
        assert FAULTS.field("CORRECTED").of(faults) == 0
        assert (FAULTS.field("UNCORRECTED").of(faults) > 0) == (wrong == 1)

    simulated(dut, testbench)


def test_a_core_whose_samples_take_any_constants_swaps_at_once() -> None:
    """It has nothing to wait for: what was loaded is active when the load has been answered."""
    dut: Any = core.Core(small_design(PLAIN, "df1_ef1").datapath, 1, 1)

    async def write(ctx: Any, address: int, word: int) -> int:
        for name, value in {"awaddr": address, "wdata": word, "awvalid": 1, "wvalid": 1, "wstrb": 15}.items():
            ctx.set(getattr(dut, f"s_axil_{name}"), value)
        (response,) = await ctx.tick("bench").sample(dut.s_axil_bresp).until(dut.s_axil_bvalid)
        for name, value in {"awvalid": 0, "wvalid": 0, "bready": 1}.items():
            ctx.set(getattr(dut, f"s_axil_{name}"), value)
        await ctx.tick("bench")
        ctx.set(dut.s_axil_bready, 0)
        return int(response)

    async def testbench(ctx: Any) -> None:
        for register, word in ((VERSION, 7), (DATA, 0), (DATA, 0), (CRC, crc_of(7, [0, 0]))):
            assert await write(ctx, register.address, word) == OKAY
        for name, value in {"araddr": VERSION.address, "arvalid": 1}.items():
            ctx.set(getattr(dut, f"s_axil_{name}"), value)
        (version,) = await ctx.tick("bench").sample(dut.s_axil_rdata).until(dut.s_axil_rvalid)
        assert version == 7

    simulated(dut, testbench)


# The lock.


async def locked(bench: Bench) -> int:
    word, response = await bench.bus.read(STATUS.address)
    assert response == OKAY
    return LOCKING_STATUS.field("LOCKED").of(word)


async def nothing_is_loaded_until_a_reset(bench: Bench) -> None:
    words = bench.words()
    assert set(await bench.load(7, words)) == {OKAY}
    await bench.bus.idle(2)
    assert await locked(bench) == 0
    assert await bench.bus.write(STATUS.address, 0) == OKAY  # whatever the word
    for _ in range(3):
        assert set(await bench.load(8, bench.words())) == {SLVERR}
        assert await bench.bus.write(STATUS.address, 0xFFFFFFFF) == OKAY  # it stays
    await bench.bus.idle(20)
    assert (await locked(bench), bench.swaps, bench.active) == (1, 1, words)
    assert await bench.version() == 7
    await bench.reset()
    assert await locked(bench) == 0
    others = bench.words()
    assert set(await bench.load(9, others)) == {OKAY}
    await bench.bus.idle(2)
    assert (bench.active, await bench.version()) == (others, 9)


async def a_load_is_ended_and_not_locked(bench: Bench) -> None:
    assert await bench.bus.write(VERSION.address, 3) == OKAY
    assert await bench.bus.write(DATA.address, 5) == OKAY
    assert await bench.bus.write(STATUS.address, 1) == SLVERR
    assert await locked(bench) == 0
    words = bench.words()
    assert await bench.bus.write(CRC.address, crc_of(3, [5] * DEPTH)) == SLVERR
    assert set(await bench.load(4, words)) == {OKAY}
    await bench.bus.idle(2)
    assert bench.active == words


async def a_write_with_too_few_bytes_does_not_lock(bench: Bench) -> None:
    assert await bench.bus.write(STATUS.address, 1, 7) == SLVERR
    assert await locked(bench) == 0


async def without_a_lock_status_is_not_written(bench: Bench) -> None:
    assert await bench.bus.write(STATUS.address, 1) == SLVERR
    assert await locked(bench) == 0
    assert set(await bench.load(4, bench.words())) == {OKAY}


@pytest.mark.sweep(2)
@pytest.mark.parametrize("protected", [False, True])
@pytest.mark.parametrize(
    "scenario",
    [nothing_is_loaded_until_a_reset, a_load_is_ended_and_not_locked, a_write_with_too_few_bytes_does_not_lock],
)
def test_with_a_lock(scenario: Scenario, protected: bool) -> None:
    benched(scenario, lock=True, protected=protected)


def test_without_a_lock() -> None:
    benched(without_a_lock_status_is_not_written)
    assert "locked" not in dict(ReloadPort(3).signature.members)


def test_only_a_core_with_a_lock_has_it_in_its_registers() -> None:
    plain, locking = (registers_of(protected=True, lock=lock) for lock in (False, True))
    assert [r.address for r in plain] == [r.address for r in locking]
    assert [r.name for r, other in zip(plain, locking, strict=True) if r != other] == ["STATUS"]
    assert locking[3].writes
    assert not plain[3].writes
