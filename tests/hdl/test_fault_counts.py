# amaranth: UnusedElaboratable=no
"""The register FAULTS of a protected core: it counts, stays at its highest value, and a write starts anew."""

from typing import Any

import pytest
from amaranth.hdl import Shape
from tests.formal.small import leaky
from tests.hdl.bus.axi_lite_bench import OKAY, SLVERR
from tests.hdl.bus.reload_benches import Bench, benched, crc_of

from sosmith.hdl.bus.axi_lite import SerialSlave
from sosmith.hdl.bus.serial_crc import SerialCrc
from sosmith.hdl.reload import ReloadPort
from sosmith.hdl.stages.interleaved import InterleavedStage
from sosmith.model.reload.registers import CRC, DATA, FAULTS, VERSION


async def counts(bench: Bench) -> tuple[int, int]:
    word, response = await bench.bus.read(FAULTS.address)
    assert response == OKAY
    return FAULTS.field("CORRECTED").of(word), FAULTS.field("UNCORRECTED").of(word)


async def found(bench: Bench, signal: Any, clocks: int) -> None:
    """Keep a finding up for some clocks."""
    bench.ctx.set(signal, 1)
    await bench.bus.idle(clocks)
    bench.ctx.set(signal, 0)


async def every_finding_counts(bench: Bench) -> None:
    assert await counts(bench) == (0, 0)
    await found(bench, bench.dut.corrected, 3)
    await found(bench, bench.dut.failed, 2)
    assert await counts(bench) == (3, 2)
    await found(bench, bench.dut.failed, 1)
    assert await counts(bench) == (3, 3)
    assert await bench.bus.write(FAULTS.address, 0xFFFFFFFF) == OKAY
    assert await counts(bench) == (0, 0)
    await found(bench, bench.dut.corrected, 1)
    assert await counts(bench) == (1, 0)
    await bench.reset()
    assert await counts(bench) == (0, 0)


async def a_write_acknowledges_for_one_clock(bench: Bench) -> None:
    """Find one at that very clock, too: it is not lost."""
    seen: list[bool] = []
    before = bench.bus.every_clock

    def watch() -> None:
        seen.append(bool(bench.ctx.get(bench.dut.acknowledge)))
        before()

    bench.bus.every_clock = watch
    bench.ctx.set(bench.dut.failed, 1)
    await bench.bus.write(FAULTS.address, 0)
    bench.ctx.set(bench.dut.failed, 0)
    assert sum(seen) == 1
    clocks = len(seen) - seen.index(True)
    assert await counts(bench) == (0, clocks)
    assert sum(seen) == 1


async def counts_stay_at_their_highest(bench: Bench) -> None:
    bench.ctx.set(bench.dut.corrected, 1)
    await bench.ctx.tick().repeat((1 << 16) + 5)
    bench.ctx.set(bench.dut.corrected, 0)
    assert await counts(bench) == ((1 << 16) - 1, 0)


async def a_load_goes_on_around_it(bench: Bench) -> None:
    words = bench.words()
    write = bench.bus.write
    responses = [await write(VERSION.address, 7), await write(DATA.address, words[0])]
    responses.append(await write(FAULTS.address, 0x12345678))
    responses += [await write(DATA.address, word) for word in words[1:]]
    responses.append(await write(CRC.address, crc_of(7, words)))
    assert set(responses) == {OKAY}
    await bench.bus.idle(2)
    assert bench.active == words


async def there_is_none(bench: Bench) -> None:
    assert (await bench.bus.read(FAULTS.address))[1] == SLVERR
    assert await bench.bus.write(FAULTS.address, 0) == SLVERR


def test_findings_are_counted() -> None:
    benched(every_finding_counts, protected=True)


def test_a_write_acknowledges() -> None:
    benched(a_write_acknowledges_for_one_clock, protected=True)


@pytest.mark.slow
def test_counts_do_not_wrap() -> None:
    benched(counts_stay_at_their_highest, protected=True)


def test_a_write_in_the_middle_of_a_load_does_not_disturb_it() -> None:
    benched(a_load_goes_on_around_it, protected=True)


def test_an_unprotected_core_has_no_such_register() -> None:
    benched(there_is_none)


def test_members_have_the_width_of_what_they_say() -> None:
    widths = {"write_address": 2, "write_data": 32, "o_index": 4, "o_word": 32, "o_count": 5}
    widths |= {"i0": 2, "o0": 3, "i_channel": 2, "o_channel": 2, "clear_channel": 2, "uses": 2}
    stage = InterleavedStage(leaky().stages[0], 3, protect="detect")
    for made in (ReloadPort(3, protected=True), SerialCrc(), SerialSlave(6), stage):
        for name, member in made.signature.members.items():
            if not name.startswith("s_axil_"):
                assert Shape.cast(member.shape).width == widths.get(name, 1), name
