"""The document of the realizations' numerics: it is what the benchmark writes, refusals included."""

import subprocess
import sys
from pathlib import Path

import pytest
from benchmarks import numerics

from sosmith.gen.realizations.registry import REALIZATIONS, Realization
from sosmith.gen.specification.realizations import RealizationTerms
from sosmith.model.dataflow.structure import Stage
from sosmith.model.errors import ShortfallError


@pytest.mark.slow
def test_the_numerics_are_what_the_benchmark_writes() -> None:
    command = [sys.executable, "-m", "benchmarks.numerics", "--check"]
    result = subprocess.run(
        command, cwd=Path(numerics.__file__).parents[1], capture_output=True, text=True, check=False
    )
    assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.slow
def test_the_numerics_show_a_refusal_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> Stage:
        raise ShortfallError("it must fit, and does not")

    only = {"df1": Realization(terms=RealizationTerms("df1", ""), build=refuse)}
    monkeypatch.setitem(REALIZATIONS, "df1", only["df1"])
    monkeypatch.setattr(numerics, "SECTIONS", only)
    monkeypatch.setattr(numerics, "others", lambda _: [])
    *_, head, _, row = numerics.table("audio_lowpass").splitlines()
    advice = 'hardware.realization = "df1_ef2" meets the specification as it is'
    assert row.startswith("| df1 | refused: ")
    assert f"; {advice} |" in row
    assert row.count("|") == head.count("|")
    assert numerics.noise_curve("df1") == "refused: it must fit, and does not"
