"""Loads over the link: what is active is read back, and a load that goes wrong is told and changes nothing."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from tests.host.lines import BadLine
from tests.host.reloadable import ReloadableCore
from tests.interface.small import FILTER

import sosmith
from sosmith.gen.core import CoreDesign
from sosmith.gen.output.identity import identity
from sosmith.gen.reload.register_writes import reload_json
from sosmith.gen.reload.reload import check_swap, own_set, set_for
from sosmith.host.board import Board
from sosmith.host.loading import Loaded
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.link.device import Device
from sosmith.model.reload.registers import CRC
from sosmith.sim.virtual_board.line_damage import LineDamage

SPEC = FILTER | {"hardware": {"realization": "df1_ef1", "architecture": "folded", "reload": True}}
OTHER = SPEC | {"filter": FILTER["filter"] | {"cutoff": 90.0}}


@cache
def swap() -> tuple[CoreDesign, Datapath, dict[str, Any]]:
    """Design a core and another set for it, proven."""
    made = sosmith.design(SPEC).core
    new = set_for(made, sosmith.design(OTHER).core.spec)
    proven = check_swap(made, own_set(made), new)
    return made, proven.new_set.quantized.datapath, reload_json(made, proven, 7)


def board(line_damage: LineDamage | None = None, design: int | None = None) -> tuple[Board, ReloadableCore]:
    made, other, proven = swap()
    fingerprint = proven["design"] if design is None else design
    core = ReloadableCore(made.datapath, fingerprint, proven["words"], {proven["writes"][-1][1]: other})
    device = Device(identity(made, "", baud=1_000_000, clock=12e6), core)
    return Board.on(BadLine(device, line_damage or (lambda data: data))), core


@pytest.mark.parametrize("seed", [None, 1, 2])
def test_a_set_becomes_active(seed: int | None) -> None:
    _, other, proven = swap()
    client, core = board(None if seed is None else LineDamage(200, seed))
    loaded = client.load(proven)
    assert loaded == Loaded(version=7, crc=proven["writes"][-1][1], design=proven["design"], words=proven["words"])
    codes = np.random.default_rng(1).integers(-512, 512, (300, 1))
    assert np.array_equal(client.run_codes(codes).codes, other.compute(codes))
    assert client.read_register(CRC.address) == loaded.crc
    assert core.read(CRC.address) == loaded.crc


def test_a_set_that_arrives_wrong_is_refused_and_the_former_one_stays() -> None:
    made, _, proven = swap()
    client, core = board()
    core.corrupt = 1
    with pytest.raises(sosmith.RefusedError, match=r"; the load ended as WRONG_CRC, and the former set is active$"):
        client.load(proven)
    codes = np.random.default_rng(1).integers(-512, 512, (300, 1))
    assert np.array_equal(client.run_codes(codes).codes, made.datapath.compute(codes))


def test_a_set_for_another_core_is_not_tried() -> None:
    _, _, proven = swap()
    client, core = board(design=1)
    expected = rf"^the board's register DESIGN must read {proven['design']:#x}, not 0x1$"
    with pytest.raises(sosmith.ShortfallError, match=expected):
        client.load(proven)
    assert core.read(CRC.address) == 0


def test_a_file_that_is_no_set(tmp_path) -> None:  # type: ignore[no-untyped-def]
    client, _ = board()
    (tmp_path / "set.json").write_text("[1]")
    expected = r"set.json: the set must be a file that `sosmith reload` has written, not another one$"
    with pytest.raises(sosmith.SpecificationError, match=expected):
        client.load(tmp_path / "set.json")
    with pytest.raises(sosmith.SpecificationError, match=r"none.json: the set must be a readable file, not: "):
        client.load(tmp_path / "none.json")


def test_a_locked_board_takes_no_set_until_a_reset() -> None:
    made, other, proven = swap()
    client, core = board()
    core.has_lock = True
    client.lock()
    with pytest.raises(
        sosmith.RefusedError, match=r"^the board must be reset before a set can be loaded, for it is locked$"
    ):
        client.load(proven)
    codes = np.random.default_rng(1).integers(-512, 512, (100, 1))
    assert np.array_equal(client.run_codes(codes).codes, made.datapath.compute(codes))
    core.reset()
    assert client.load(proven).version == 7
    core.reset()
    assert np.array_equal(client.run_codes(codes).codes, other.compute(codes))


def test_a_core_without_a_lock_refuses_it() -> None:
    client, core = board()
    with pytest.raises(sosmith.RefusedError):
        client.lock()
    assert not core.locked


def test_what_is_active_is_read_back(monkeypatch: pytest.MonkeyPatch) -> None:
    _, _, proven = swap()
    client, core = board()
    read = core.read
    monkeypatch.setattr(core, "read", lambda address: 5 if address == CRC.address else read(address))
    expected = rf"^the board's register CRC must read {proven['writes'][-1][1]:#x}, not 0x5$"
    with pytest.raises(sosmith.ShortfallError, match=expected):
        client.load(proven)
