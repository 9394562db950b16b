"""A core behind a decimator whose results are held, at the end of a port: a result for each sample, none too late."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from tests.commands.invocation import Invocation
from tests.gen.output.packages.made import design_of
from tests.host.ports import plugged

import sosmith
from sosmith.gen.output.generate import generated
from sosmith.host.board import Board
from sosmith.host.model_line import ModelLine, model_of
from sosmith.host.port_run import run_on
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.arrays import Codes
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.traces.trace_file import write_traces
from sosmith.sim.cosimulate import CosimulationResult, first_copies
from sosmith.sim.simulation import simulate

STREAM, MONITOR = Invocation("stream"), Invocation("monitor")
FACTOR = 4


def held(codes: Codes) -> tuple[Codes, Codes]:
    """Return code and status of the result that belongs to each sample."""
    datapath = design_of("held").core.datapath
    results, status = datapath.compute(codes), datapath.compute_status(codes)
    return np.repeat(results, FACTOR)[: len(codes)], np.repeat(status, FACTOR)[: len(codes)]


def samples(count: int) -> Codes:
    return np.random.default_rng(2).integers(-512, 512, (count, 1))


@pytest.mark.parametrize("steps", [(1,) * 11, (3, 1, 200, 5, 4), (250,)])
def test_each_sample_has_its_result_however_few_are_sent_at_a_time(steps: tuple[int, ...]) -> None:
    codes = samples(sum(steps))
    parts = np.split(codes, np.cumsum(steps)[:-1])
    with design_of("held").board() as board:
        found = [board.run_codes(part) for part in parts]
    expected, status = held(codes)
    assert np.concatenate([results.codes for results in found]).tolist() == expected.tolist()
    assert np.concatenate([results.status for results in found]).tolist() == status.tolist()


def test_a_session_begins_with_a_first_sample() -> None:
    """Copies that were not fetched in the session before are gone."""
    device = model_of(design_of("held").core)
    codes = samples(10)
    for count in (10, 9):
        with Board.on(ModelLine(device)) as board:
            assert board.run_codes(codes[:count]).codes.tolist() == held(codes[:count])[0].tolist()


@pytest.mark.slow
def test_the_accuracy_suite_takes_each_result_once(tmp_path: Path) -> None:
    made = design_of("held")
    traces = traces_for(made.core, "sweep", seed=1, seconds=0.202)
    device = model_of(made.core, generated(made.core)["held.sv"])
    with Board.on(ModelLine(device)) as board:
        run = partial(run_on, board)
        evidence = simulate(made.core, traces, tmp_path, hardware=run, vectors=tmp_path / "some.hex")
    assert (evidence.run.mismatches, evidence.run.samples, evidence.simulator) == (0, 51, "board")
    lines = (tmp_path / "some_responses.hex").read_text(encoding="utf-8").split()
    assert [int(line.split("_")[1], 16) for line in lines] == (held(traces[0].codes)[0] % 65536).tolist()


def test_a_copy_that_differs_is_seen() -> None:
    def run(codes: list[int], status: list[int]) -> CosimulationResult:
        return CosimulationResult(
            codes=np.array(codes)[:, np.newaxis, np.newaxis],
            status=np.array(status, np.uint8)[:, np.newaxis],
            cycles=1,
            wall_seconds=1.0,
            cycles_per_second=1.0,
            simulator="board",
            tools={},
        )

    assert first_copies(run([5, 5, 5, 6, 6], [0] * 5), 3).codes[:, 0, 0].tolist() == [5, 6]
    for codes, status in (([5, 5, 5, 6, 7], [0] * 5), ([5, 5, 5, 6, 6], [0, 0, 0, 1, 0])):
        with pytest.raises(ShortfallError, match=r"^result 1 must come out 3 times, and changes meanwhile$"):
            first_copies(run(codes, status), 3)


def test_commands_have_a_row_for_each_sample(tmp_path: Path) -> None:
    made = design_of("held")
    (trace,) = traces_for(made.core, "noise", seed=1, seconds=0.03)
    write_traces(tmp_path / "noise.csv", [trace])
    with plugged(model_of(made.core)) as port:
        _, *lines = STREAM.good(port, str(tmp_path / "noise.csv")).stdout.splitlines()
        out = tmp_path / "live.csv"
        MONITOR.good(port, "--trace", str(tmp_path / "noise.csv"), "--speed", "0", "-o", str(out))
    expected, _ = held(trace.codes)
    assert [int(line.split(",")[2]) for line in lines] == expected.tolist()
    assert [float(line.split(",")[0]) for line in lines] == trace.time.tolist()
    rows = out.read_text(encoding="utf-8").splitlines()
    place = rows[0].split(",").index("y_code")
    assert [int(row.split(",")[place]) for row in rows[1:]] == expected.tolist()


THREE = design_of("held").specification.as_dict() | {"channels": 3, "hardware": {"clock": 12e6}}
FILTERS = {
    "cic": {key: value for key, value in THREE["filter"].items() if key != "hold"},
    "fir": {"taps": [0.25, 0.5, 0.25], "decimate": FACTOR},
}


@pytest.mark.parametrize("name", FILTERS)
def test_each_sample_of_several_channels_has_the_result_of_its_own(name: str) -> None:
    made = sosmith.design(THREE | {"filter": FILTERS[name]})
    codes = np.random.default_rng(3).integers(-512, 512, (50, 3, 1))
    results, status = made.core.datapath.compute_with_status(codes)
    last = np.arange(len(codes)) // FACTOR
    with made.board() as board:
        found = [board.run_codes(part) for part in np.split(codes, [1, 3, 30])]
    assert np.array_equal(np.concatenate([each.codes for each in found]), results[last])
    assert np.array_equal(np.concatenate([each.status for each in found]), status[last])


def test_a_board_with_several_channels_repeats_results_itself() -> None:
    with pytest.raises(SpecificationError) as refused:
        sosmith.design(THREE).board()
    assert str(refused.value) == (
        "specification: filter.hold must be false with filter.decimate = 4 and several channels on a board, which "
        "keeps the last result of each, not true"
    )


@pytest.mark.slow
def test_the_suite_takes_each_result_of_several_channels_once(tmp_path: Path) -> None:
    made = sosmith.design(THREE | {"filter": FILTERS["cic"]})
    traces = traces_for(made.core, "sweep", seed=1, seconds=0.202)
    device = model_of(made.core, generated(made.core)["held.sv"])
    with Board.on(ModelLine(device)) as board:
        evidence = simulate(made.core, traces, tmp_path, hardware=partial(run_on, board))
    assert (evidence.run.mismatches, evidence.run.samples, evidence.simulator) == (0, 3 * 51, "board")
