"""The examples in the docstrings of the public interface, and the page made from them, run as they stand."""

import doctest
import importlib
from pathlib import Path

import pytest
from tests.gen.report.pictures import unpainted

PAGE = Path(__file__).parents[2] / "docs" / "python.md"
MODULES = ("calibration", "certificate", "comparison", "design", "exploration", "quantity", "report", "specification")


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.sweep(4)
@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings(name: str) -> None:
    module = importlib.import_module(f"sosmith.interface.{name}")
    result = doctest.testmod(module, optionflags=doctest.ELLIPSIS)
    assert result.failed == 0


@pytest.mark.slow
@unpainted
def test_the_page_runs_from_top_to_bottom() -> None:
    result = doctest.testfile(str(PAGE), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert result.attempted > 30
    assert result.failed == 0
