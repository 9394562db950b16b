"""Targets read live: the voltage behind a board's results, by the calibration that is really active in it."""

import copy
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.host.reloadable import ReloadableCore
from tests.interface.instrument.live.gauging import GAUGE, GaugingDevice, Time

import sosmith
from sosmith.host.board import Board
from sosmith.host.model_line import ModelLine
from sosmith.interface.instrument.live.targets import LiveTargets
from sosmith.model.errors import ShortfallError, SpecificationError

OTHER = [[1.25, -0.0034], [0.35, 0.0006], [0.0591]]


def spec(**changes: Any) -> dict[str, Any]:
    return copy.deepcopy(GAUGE) | changes


@cache
def reloadable() -> sosmith.Design:
    return sosmith.design(spec(hardware=GAUGE["hardware"] | {"reload": True}))


def board_of(design: sosmith.Design, clock: Time, voltages: Any, core: Any = None, **changes: Any) -> Board:
    return Board.on(ModelLine(GaugingDevice(design, clock.monotonic, voltages, core, **changes)))


@pytest.mark.slow
@pytest.mark.parametrize("gain", [1.0, 0.9])
def test_the_voltage_before_the_sensor_is_read(gain: float, tmp_path: Path) -> None:
    """A filter whose gain at zero frequency is not 1 is undone as well."""
    section = [0.1 * gain, 0.0, 0.0, 1.0, -0.9, 0.0]
    design = sosmith.design(spec(filter={"sos": [section]}))
    design.generate(tmp_path)
    clock, rng = Time(), np.random.default_rng(1)
    board = board_of(design, clock, lambda t: (2.0 if t < 3 else 6.0) + rng.normal(0, 0.005))
    with LiveTargets(board, files=tmp_path, clock=clock) as targets:
        first = targets.read(2.0, 21.0, seconds=1.0)
        clock.now = 5.0
        second = targets.read(5.5, 21.0, seconds=1.0)
    for found, voltage in ((first, 2.0), (second, 6.0)):
        assert found.count == 1000
        assert abs(found.voltage - voltage) < 4 * found.uncertainty
        assert 0.00005 < found.uncertainty < 0.0006
        assert 0.0005 < found.scatter < 0.005
        assert found.row(0.03) == (found.clearance, found.voltage, 21.0, 0.03, found.uncertainty, 0.0)


def test_a_wrong_temperature_gives_the_result_again(tmp_path: Path) -> None:
    design, clock = sosmith.design(spec()), Time()
    design.generate(tmp_path)
    with LiveTargets(board_of(design, clock, lambda t: 5.0), files=tmp_path, clock=clock) as targets:
        found = targets.read(4.4, 31.0, seconds=0.2)
    assert design.core.quantized.polynomial is not None
    assert found.voltage != pytest.approx(5.0, abs=0.001)
    assert float(design.core.quantized.polynomial(found.voltage, 31.0)) == pytest.approx(found.result, abs=1e-9)


def test_results_in_volts_need_no_files() -> None:
    plain = {key: value for key, value in spec().items() if key != "calibration"}
    plain["input"] = {"voltage": plain["input"]["voltage"]}
    plain["output"] = {"bits": 16, "range": [0.0, 10.0], "unit": "V", "max_error": 0.01}
    clock = Time()
    with LiveTargets(board_of(sosmith.design(plain), clock, lambda t: 3.25), clock=clock) as targets:
        found = targets.read(2.0, 21.0, seconds=0.2)
    assert found.voltage == pytest.approx(3.25, abs=0.001)


@pytest.mark.slow
def test_the_set_that_was_loaded_counts(tmp_path: Path) -> None:
    design = reloadable()
    design.generate(tmp_path)
    other = sosmith.Specification.load(
        spec(hardware=GAUGE["hardware"] | {"reload": True}) | {"calibration": {"coefficients": OTHER}}
    )
    proven = design.reload(other, version=3)
    written = tmp_path / "other.reload.json"
    written.write_text(json.dumps(proven.writes))
    assert proven.writes["calibration"] == [["5/4", "-17/5000"], ["7/20", "3/5000"], ["591/10000"]]
    crc = proven.writes["writes"][-1][1]
    loaded = proven._swap.new_set.quantized.datapath
    core = ReloadableCore(design.core.datapath, proven.writes["design"], proven.writes["words"], {crc: loaded})
    clock = Time()

    def read(active: Path | None) -> float:
        board = board_of(design, clock, lambda t: 6.0, core)
        with LiveTargets(board, files=tmp_path, active=active, clock=clock) as targets:
            return targets.read(5.5, 21.0, seconds=0.2).voltage

    assert read(None) == pytest.approx(6.0, abs=0.001)
    message = "^the board's last load must have ended as ACCEPTED, not as NONE: load the set$"
    with pytest.raises(ShortfallError, match=message):
        read(written)
    board_of(design, clock, lambda t: 6.0, core).load(proven.writes)
    assert read(written) == pytest.approx(6.0, abs=0.001)
    with pytest.raises(ShortfallError, match=r"^the set that is active on the board, version 3, must be named$"):
        read(None)
    written.write_text(json.dumps(proven.writes | {"version": 4}))
    with pytest.raises(ShortfallError, match=r"^the board's register VERSION must read 0x4, not 0x3$"):
        read(written)
    changed = [*proven.writes["writes"][:-1], [proven.writes["writes"][-1][0], crc ^ 1]]
    written.write_text(json.dumps(proven.writes | {"writes": changed}))
    with pytest.raises(ShortfallError, match=r"^the board's register CRC must read 0x[0-9a-f]+, not 0x[0-9a-f]+$"):
        read(written)
    written.write_text(json.dumps({key: value for key, value in proven.writes.items() if key != "calibration"}))
    message = "^the set must say its calibration, as `sosmith reload` writes it, not only words$"
    with pytest.raises(SpecificationError, match=message):
        read(written)


@pytest.mark.slow
def test_what_cannot_be_read_is_refused_and_the_port_given_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    design, clock = sosmith.design(spec(channels=2)), Time()
    message = r"^the channel must be given, 0 to 1: the board has several$"
    with pytest.raises(SpecificationError, match=message):
        LiveTargets(board_of(design, clock, lambda t: 5.0), clock=clock)
    message = r"^the files of the board's core, targets, must be in build/targets, or named by --files$"
    with pytest.raises(SpecificationError, match=message):
        LiveTargets(board_of(design, clock, lambda t: 5.0), channel=1, clock=clock)
    sosmith.design(spec()).generate(tmp_path)
    with pytest.raises(
        ShortfallError, match=r"^the board's design must be [0-9a-f]{12}, not [0-9a-f]{12}; its core is t"
    ):
        LiveTargets(board_of(design, clock, lambda t: 5.0), files=tmp_path, channel=1, clock=clock)
    one = sosmith.design(spec(output=GAUGE["output"] | {"unit": "um"}))
    with pytest.raises(SpecificationError, match=r"^the board must give mm or V, not um$"):
        LiveTargets(board_of(one, clock, lambda t: 5.0), files=tmp_path, clock=clock)
