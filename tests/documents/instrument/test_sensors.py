"""The document of the sensors, and that the bench files hold the errors which follow from the paper's figures."""

import subprocess
import sys
from pathlib import Path

import pytest
from benchmarks import sensors

from sosmith.instrument.scenarios.file import load_scenario

ROOT = Path(sensors.__file__).parents[1]


@pytest.mark.slow
def test_the_document_is_what_the_benchmark_writes() -> None:
    command = [sys.executable, "-m", "benchmarks.sensors", "--check"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")


def test_the_tables_of_errors_and_of_keys_are_up_to_date() -> None:
    text = (ROOT / sensors.DOCUMENT).read_text(encoding="utf-8")
    assert sensors.readings_table() in text
    assert sensors.key_table() in text


@pytest.mark.parametrize(("name", "errors"), [(name, errors) for name, _, errors in sensors.bench_files()])
def test_bench_files_hold_the_derived_errors(name: str, errors: dict[str, float]) -> None:
    document = load_scenario(sensors.SCENARIOS / f"{name}.toml").document
    assert document.calibration is not None
    inductive = document.sensors.inductive
    assert inductive.noise == pytest.approx(errors["noise"], abs=0.0005)
    assert inductive.systematic_error.rms == pytest.approx(errors["systematic"], abs=0.0006)
    assert document.calibration.scatter == pytest.approx(errors["scatter"], abs=0.0006)


def test_the_papers_tables_are_as_printed() -> None:
    # What the paper prints as means: 96.1826 % of table 1, 3.46646 % of table 2.
    assert 100 - 10 * sum(sensors.TABLE_1) == pytest.approx(96.1826, abs=5e-5)
    assert 100 * sum(sensors.TABLE_2) / 18 == pytest.approx(3.46646, abs=1e-4)
    # The filter made every one of the ten errors smaller.
    assert all(after < before for before, after in zip(sensors.TABLE_1, sensors.TABLE_4, strict=True))
