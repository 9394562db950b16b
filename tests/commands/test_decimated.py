"""What the commands tell of a decimated instrument."""

import json
from pathlib import Path

import pytest
from tests.commands.invocation import Invocation
from tests.gen.word_lengths.decimated import INSTRUMENT, small

import sosmith


@pytest.fixture
def path(tmp_path: Path) -> str:
    target = tmp_path / "slight.toml"
    target.write_text(INSTRUMENT.format(extra=""), encoding="utf-8")
    return str(target)


@pytest.mark.slow
def test_the_design_tells_of_the_calibration(path: str) -> None:
    made = small()
    ahead, behind = made.architecture.calibration, made.architecture.program
    assert ahead is not None
    assert ahead.program is not None
    assert behind is not None
    clocks, result = ahead.cycles_per_sample, made.architecture.cycles_per_result
    table = Invocation("design", columns=200).good(path, "--details").stdout
    rows = {line.strip().split("   ")[0]: " ".join(line.split()) for line in table.splitlines() if line.strip()}
    assert rows["into the decimator"].endswith(" in 14 bits, within 1.62 µm; not limited")
    assert rows["calibration before the decimator"].endswith(
        f"folded: the smallest that keeps up; takes {clocks} of 120,000 clocks a sample"
    )
    assert rows["architecture"].endswith("folded folded")  # of the table beside the filter without a decimator
    assert f"takes {result} of 480,000 clocks for 4 samples" in table
    assert rows["clocks a sample"].startswith(f"clocks a sample {max(clocks, result / 4):g} ")
    words = ahead.program.words
    assert rows["memory, calibration"].endswith(f"{words} words of 16 bits a channel, 0 of them states")
    for program, where in ((ahead.program, " in the calibration"), (behind, "")):
        assert f"Schedule: {len(program.instructions)} instructions for each sample of each channel{where}\n" in table


@pytest.mark.slow
def test_the_same_for_programs(path: str) -> None:
    found = json.loads(Invocation("design").good(path, "--json").stdout)
    assert found["decimation"]["calibration"]["instructions"] > 10
    assert found["rate_costs"]["decimated"]["clocks_per_sample"] < found["rate_costs"]["direct"]["clocks_per_sample"]


@pytest.mark.slow
def test_factors_are_explored(path: str, tmp_path: Path) -> None:
    explored = Invocation("explore").good(path, "-p", "filter.decimate=2,4", "-o", str(tmp_path / "out"), "--json")
    found = json.loads(explored.stdout)
    assert [point["changes"]["filter.decimate"] for point in found["points"]] == [2, 4]
    assert all(point["passed"] for point in found["points"])
    most = [point["cost"]["instructions"] for point in found["points"]]
    ahead = small().architecture.calibration
    assert ahead is not None
    assert ahead.program is not None
    assert min(most) > len(ahead.program.instructions)


FAR_BELOW = """
name = "drift"
sample_rate = 1000000.0

[input.x]
bits = 8
range = [-1.0, 1.0]
signed = true

[filter]
family = "butterworth"
kind = "lowpass"
order = 1
cutoff = 0.5
decimate = 1024

[output]
bits = 8
range = [-1.0, 1.0]
signed = true
max_error = "faithful"

[hardware]
realization = "df1_ef2"
"""
"""A cutoff so low that no word lengths do without the decimator."""


@pytest.mark.slow
def test_a_filter_that_is_only_possible_behind_a_decimator(tmp_path: Path) -> None:
    path = tmp_path / "drift.toml"
    path.write_text(FAR_BELOW, encoding="utf-8")
    design = sosmith.design(path)
    (costs,) = (table for table in design.tables() if table.title == "The same filter without a decimator")
    assert costs.rows[-1] == ("without a decimator", "no word lengths meet the specification")
    assert [*design.as_dict()["rate_costs"]] == ["decimated"]
    path.write_text(FAR_BELOW.replace("decimate = 1024", ""), encoding="utf-8")
    refused = Invocation("design").run(str(path)).exception
    assert str(refused).endswith("no word length suffices for a filter closer to them without filter.decimate, not 0.5")
