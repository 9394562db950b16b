# amaranth: UnusedElaboratable=no
"""The lock of the reload port: closed by a write of STATUS, opened by a reset, and by nothing else."""

from __future__ import annotations

import pytest
from tests.hdl.bus.axi_lite_bench import OKAY, SLVERR
from tests.hdl.bus.reload_benches import DEPTH, Bench, Scenario, benched, crc_of

from sosmith.hdl.reload import ReloadPort
from sosmith.model.reload.registers import CRC, DATA, LOCKING_STATUS, STATUS, VERSION, registers_of

LOCKED = LOCKING_STATUS.field("LOCKED")


async def locked(bench: Bench) -> int:
    word, response = await bench.bus.read(STATUS.address)
    assert response == OKAY
    return LOCKED.of(word)


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


@pytest.mark.parametrize("protected", [False, True])
@pytest.mark.parametrize(
    "scenario",
    [nothing_is_loaded_until_a_reset, a_load_is_ended_and_not_locked, a_write_with_too_few_bytes_does_not_lock],
)
def test_with_a_lock(scenario: Scenario, protected: bool) -> None:
    benched(scenario, lock=True, protected=protected)


def test_without_one() -> None:
    benched(without_a_lock_status_is_not_written)
    assert "locked" not in dict(ReloadPort(3).signature.members)


def test_only_a_core_with_a_lock_has_it_in_its_registers() -> None:
    plain, locking = (registers_of(protected=True, lock=lock) for lock in (False, True))
    assert [r.address for r in plain] == [r.address for r in locking]
    assert [r.name for r, other in zip(plain, locking, strict=True) if r != other] == ["STATUS"]
    assert locking[3].writes
    assert not plain[3].writes
