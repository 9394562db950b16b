"""Explorations as a whole: figures, files, the same result from any number of processes and after interruptions."""

from __future__ import annotations

import csv
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.interface.small import FILTER
from tests.suite.extras import needed

import sosmith
from sosmith import SpecificationError, ToolError
from sosmith.gen.word_lengths.cost import LUTS_OF_A_BLOCK
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.sim.exploration import processes
from sosmith.sim.exploration.evaluation import evaluate

SWEEP: dict[str, list[Any]] = {
    "hardware.realization": ["df1", "df1_ef1"],
    "output.max_error": [0.0011, 0.004],
    "output.bits": [9, 10],
}
"""Eight combinations; 9 bits have an LSB of 0.0039, so two of them cannot keep within 0.0011."""

FILES = ("exploration.json", "exploration.html", "points.csv")


def explored(folder: Path, **changes: Any) -> sosmith.Exploration:
    return sosmith.explore(FILTER, folder=folder, **({"parameters": SWEEP, "samples": 300, "jobs": 1} | changes))


@pytest.fixture(scope="module", name="found")
def exploration(tmp_path_factory: pytest.TempPathFactory) -> sosmith.Exploration:
    return explored(tmp_path_factory.mktemp("explored"))


def contents(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in FILES}


@pytest.mark.slow
def test_figures_are_those_of_the_design(found: sosmith.Exploration) -> None:
    point = found.points[3]
    assert point["changes"] == {"hardware.realization": "df1", "output.max_error": 0.004, "output.bits": 10}
    tables = {key: dict(value) if isinstance(value, dict) else value for key, value in FILTER.items()}
    tables["output"]["max_error"] = 0.004
    design = sosmith.design(tables, realization="df1")
    (trace,) = traces_for(design.core, "passband_sweep", seed=1, seconds=0.3)
    error = design.run_codes(x=trace.codes[:, 0]) * 2 / 1024 - design.run_exact(x=trace.values()[:, 0])
    assert len(error) == 300
    assert point["error"]["max_abs"] == pytest.approx(np.abs(error).max(), rel=1e-12)
    assert point["error"]["bound"] == design.bound
    estimate = design.estimates[0]
    assert (point["cost"]["device"], point["cost"]["luts"]) == (estimate.device, estimate.luts)
    assert point["cost"]["multiplier_blocks"] == estimate.multiplier_blocks
    assert point["cost"]["value"] == estimate.luts + LUTS_OF_A_BLOCK * estimate.multiplier_blocks
    assert (point["cycles_per_sample"], point["architecture"], point["passed"]) == (1, "parallel", True)


@pytest.mark.slow
def test_refused_combinations_say_why(found: sosmith.Exploration) -> None:
    refused = [point for point in found.points if point["refused"] is not None]
    assert len(refused) == 2
    assert all("max_error" in point["refused"] for point in refused)
    assert all(point["changes"]["output.bits"] == 9 for point in refused)


def test_the_front_is_of_points_that_nobody_beats(found: sosmith.Exploration) -> None:
    designs = [point for point in found.points if point["refused"] is None]
    for one in found.front:
        assert not any(
            other["error"]["bound"] < one["error"]["bound"] and other["cost"]["value"] <= one["cost"]["value"]
            for other in designs
        )
    best = min(point["error"]["bound"] for point in designs)
    assert best in [point["error"]["bound"] for point in found.front]


def test_files(found: sosmith.Exploration) -> None:
    tree = json.loads((found.folder / "exploration.json").read_text(encoding="utf-8"))
    assert tree == found.as_dict()
    assert tree["front"] == found.front
    with (found.folder / "points.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 8
    assert sum(row["on_front"] == "True" for row in rows) == len(found.front)
    assert [row["error.bound"] for row in rows if row["refused"] == ""] == [
        str(point["error"]["bound"]) for point in found.points if point["refused"] is None
    ]


def test_points_as_parquet(found: sosmith.Exploration, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parquet = needed("pyarrow.parquet")
    rows = parquet.read_table(found.to_parquet(tmp_path / "points.parquet")).to_pylist()
    assert [row["error.bound"] for row in rows] == [point.get("error", {}).get("bound") for point in found.points]
    assert sum(row["on_front"] for row in rows) == len(found.front)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ToolError) as refusal:
        found.to_parquet(tmp_path / "other.parquet")
    assert str(refusal.value) == "pyarrow must be installed for Parquet: pip install 'sosmith[parquet]'"


def test_page_leads_from_a_point_to_its_design(found: sosmith.Exploration) -> None:
    page = (found.folder / "exploration.html").read_text(encoding="utf-8")
    links = set(re.findall(r'href="#(design-\d+)"', page))
    assert links == set(re.findall(r'id="(design-\d+)"', page))
    assert len(links) == 6
    assert not re.search(r"https?:|url\((?!#)|@import|<script", page.replace("http://www.w3.org/1999/xlink", ""))
    assert "2 combinations have none." in page


def test_a_second_run_evaluates_nothing(found: sosmith.Exploration, monkeypatch: pytest.MonkeyPatch) -> None:
    def never(task: Any) -> Any:
        raise AssertionError(task)

    before = contents(found.folder)
    monkeypatch.setattr(processes, "evaluate", never)
    assert explored(found.folder) == found
    assert contents(found.folder) == before


def test_a_run_that_failed_goes_on(found: sosmith.Exploration, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was done is kept; nothing is evaluated twice, and the files are the same."""
    evaluated: list[str] = []

    def fails_at_the_fourth(task: Any) -> Any:
        if len(evaluated) == 3:
            raise ToolError("the compiler must work, not fail")
        evaluated.append(task.key)
        return evaluate(task)

    with monkeypatch.context() as patched:
        patched.setattr(processes, "evaluate", fails_at_the_fourth)
        with pytest.raises(ToolError, match="the compiler must work"):
            explored(tmp_path)
    assert len((tmp_path / "points.jsonl").read_text(encoding="utf-8").splitlines()) == 3
    explored(tmp_path)
    keys = [json.loads(line)["key"] for line in (tmp_path / "points.jsonl").read_text(encoding="utf-8").splitlines()]
    assert len(set(keys)) == len(keys) == 8
    assert contents(tmp_path) == contents(found.folder)


@pytest.mark.slow
def test_a_design_that_another_sweep_has_made_is_shown_with_the_changes_of_this_one(tmp_path: Path) -> None:
    made = [
        explored(tmp_path, parameters={key: [value]}, samples=100).points
        for key, value in (("hardware.architecture", "parallel"), ("hardware.realization", "df1_ef1"))
    ]
    assert made[0][0]["key"] == made[1][0]["key"]
    assert [point["changes"] for (point,) in made] == [
        {"hardware.architecture": "parallel"},
        {"hardware.realization": "df1_ef1"},
    ]


@pytest.mark.slow
def test_an_address_that_is_none_leaves_no_client_behind(tmp_path: Path) -> None:
    needed("distributed")
    before = set(threading.enumerate())
    with pytest.raises(ToolError, match=r"^a Dask scheduler must answer at nowhere, not: missing port number in "):
        explored(tmp_path, jobs=None, scheduler="nowhere")
    assert set(threading.enumerate()) == before


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"samples": 0}, "samples must be at least 1, not 0"),
        ({"jobs": 0}, "jobs must be at least 1, not 0"),
        ({"parameters": {"output.bits": [9, 10, 9]}}, "output.bits must have each of its values once, not 9 twice"),
        (
            {"parameters": {"output.max_error": [float("nan")]}},
            "output.max_error must have finite numbers, texts, true, false, or lists of these as its values, not nan",
        ),
        (
            {"parameters": {"name": [date(2024, 1, 2)]}},
            "name must have finite numbers, texts, true, false, or lists of these as its values, not 2024-01-02",
        ),
        ({"scheduler": "tcp://x"}, "jobs must come without a scheduler, whose workers do the designs, not with one"),
    ],
)
def test_options_that_do_not_fit(options: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(SpecificationError, match=f"^{message}$"):
        explored(tmp_path, **options)


@pytest.mark.slow
def test_a_sound_is_the_trace_of_all_designs(tmp_path: Path) -> None:
    spec, sweep = sosmith.Specification.load(FILTER), {"hardware.realization": ["df1"]}
    sosmith.design(spec, realization="df1").trace("noise", seconds=0.1).write(tmp_path / "noise.wav")
    made = [
        sosmith.explore(spec, sweep, folder=tmp_path / "explored", samples=100, trace=trace, jobs=1).points[0]
        for trace in (tmp_path / "noise.wav", "noise", None)
    ]
    assert len({point["key"] for point in made}) == 3
    page = (tmp_path / "explored" / "exploration.html").read_text(encoding="utf-8")
    assert "100 samples each, bit-true" in page
    assert made[0]["trace_sha256"] == made[1]["trace_sha256"] != made[2]["trace_sha256"]


@pytest.mark.slow
def test_too_few_samples_for_every_design_are_told_before_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "evaluate", lambda task: pytest.fail("a design must not be made"))
    spec = sosmith.Specification.example()
    bits = {"output.bits": [16]}
    slow = bits | {"filter.cutoff": [0.02, 0.01], "hardware.realization": ["df1", "delta"]}
    message = "samples must be at least 43,043 for the filter to settle, and 86,085 for the slowest of these, not 200"
    with pytest.raises(SpecificationError, match=f"^{message}$"):
        sosmith.explore(spec, slow, folder=tmp_path / "grid", samples=200)
    assert not (tmp_path / "grid").exists()
    with pytest.raises(SpecificationError, match=r"^samples must be at least 86,085 for the filter to settle, not 1$"):
        sosmith.explore(spec, slow | {"filter.cutoff": [0.01]}, search=1, folder=tmp_path / "search", samples=1)
    with pytest.raises(pytest.fail.Exception):  # some filters settle
        sosmith.explore(spec, bits | {"filter.cutoff": [0.01, 1.0]}, folder=tmp_path / "some", samples=2000, jobs=1)


def test_a_scheduler_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    message = r"the package distributed is needed for --scheduler, and was not found: pip install 'sosmith\[cluster\]'"
    with pytest.raises(ToolError, match=f"^{message}$"):
        explored(tmp_path, jobs=None, scheduler="tcp://127.0.0.1:1")


# processes


@contextmanager
def started(*command: str, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a process in a group of its own, of which nothing outlives the context."""
    running = subprocess.Popen(
        [sys.executable, *command],
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    try:
        yield running
    finally:
        with suppress(ProcessLookupError):
            os.killpg(running.pid, signal.SIGKILL)
        running.communicate()


def hangs_at_the_second(task: Any) -> Any:
    """Stand for an evaluation: leaves a temporary folder, and never ends if the task is true."""
    made = {"folder": tempfile.mkdtemp()}
    if task:
        time.sleep(600)
    return made


@pytest.mark.slow
def test_what_processes_leave_that_are_ended_is_deleted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "evaluate", hangs_at_the_second)
    batches: Any = [[False, True]]
    results = processes.in_processes(batches, 2)
    folder = Path(next(results)["folder"])
    assert folder.is_dir()
    results.close()
    assert not folder.exists()


def command_line(folder: Path, *more: str) -> list[str]:
    (folder / "spec.toml").write_text(sosmith.Specification.load(FILTER).toml(), encoding="utf-8")
    values = [f"-p{key}={','.join(map(str, values))}" for key, values in SWEEP.items()]
    return ["-m", "sosmith.cli", "explore", "spec.toml", *values, "--samples", "300", "-o", "out", *more]


def lines(folder: Path) -> int:
    path = folder / "out" / "points.jsonl"
    return path.read_bytes().count(b"\n") if path.exists() else 0


def wait_for_lines(folder: Path, running: subprocess.Popen[str], count: int) -> None:
    end = time.monotonic() + 1200
    while lines(folder) < count and running.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_interrupted_by_a_signal_it_goes_on(found: sosmith.Exploration, number: signal.Signals, tmp_path: Path) -> None:
    """Two processes; whatever ends the run, no process is left and the next one ends with the same files."""
    with started(*command_line(tmp_path, "--jobs", "2"), folder=tmp_path) as running:
        wait_for_lines(tmp_path, running, 1)
        os.kill(running.pid, number)
        said, _ = running.communicate(timeout=1200)  # ends when the last process has closed its stdout
        assert running.returncode == (130 if number == signal.SIGINT else -number), said
        assert number != signal.SIGINT or "the same command goes on from there" in said
    assert 1 <= lines(tmp_path) < 8
    with started(*command_line(tmp_path, "--jobs", "2"), folder=tmp_path) as running:
        said, _ = running.communicate(timeout=1200)
        assert running.returncode == 0, said
    assert lines(tmp_path) == 8
    assert contents(tmp_path / "out") == contents(found.folder)


@pytest.mark.slow
def test_a_cluster_of_which_a_worker_is_killed(found: sosmith.Exploration, tmp_path: Path) -> None:
    """A real scheduler with two worker processes, one killed in the middle: nothing lost, nothing twice."""
    with ExitStack() as stack:
        contact = tmp_path / "scheduler.json"
        options = ["--scheduler-file", str(contact)]
        scheduler = ["-m", "distributed.cli.dask_scheduler", *options, "--host", "127.0.0.1", "--port", "0"]
        stack.enter_context(started(*scheduler, "--no-dashboard", folder=tmp_path))
        worker = ["-m", "distributed.cli.dask_worker", *options, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
        workers = [stack.enter_context(started(*worker, folder=tmp_path)) for _ in range(2)]
        end = time.monotonic() + 300
        while not contact.exists():
            assert time.monotonic() < end
            time.sleep(0.05)
        address = json.loads(contact.read_text(encoding="utf-8"))["address"]
        running = stack.enter_context(started(*command_line(tmp_path, "--scheduler", address), folder=tmp_path))
        wait_for_lines(tmp_path, running, 2)
        os.killpg(workers[0].pid, signal.SIGKILL)
        said, _ = running.communicate(timeout=1200)
        assert running.returncode == 0, said
    assert lines(tmp_path) == 8
    assert contents(tmp_path / "out") == contents(found.folder)
