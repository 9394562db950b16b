"""The notebooks of the gallery run from their first cell to their last; the site shows what comes of them."""

from __future__ import annotations

import importlib.util
import json
import re
from operator import attrgetter
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest
from tests.documents.shown import ROOT

import sosmith

NOTEBOOKS = sorted((ROOT / "docs" / "gallery").glob("*.ipynb"))
QUICK = ("board", "calibration")
"""Run within some seconds; the others are among the slow tests."""


def cells(path: Path) -> list[dict[str, Any]]:
    return [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, id=path.stem, marks=[] if path.stem in QUICK else [pytest.mark.slow]) for path in NOTEBOOKS],
)
def test_the_cells_of_a_notebook_run(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    mpl.use("agg")
    text = "\n\n".join("".join(cell["source"]) for cell in cells(path))
    assert "assert " in text, "a notebook shows that it is true"
    exec(compile(text, path.name, "exec"), {"__name__": "__main__"})


def test_notebooks_are_kept_without_outputs_and_are_in_the_site() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["audio", "board", "calibration", "exploration", "instrument"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for path in NOTEBOOKS for cell in cells(path))
    listed = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    assert all(f"gallery/{path.stem}.md" in listed for path in NOTEBOOKS)


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_becomes_a_page_with_its_outputs(path: Path) -> None:
    for package in ("nbclient", "ipykernel", "nbconvert"):
        pytest.importorskip(package, reason=f"{package} is missing: pip install 'sosmith[docs]'")
    spec = importlib.util.spec_from_file_location("gallery", ROOT / "docs" / "gallery.py")
    assert spec is not None
    assert spec.loader is not None
    gallery = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(gallery)
    text, pictures = gallery.page(gallery.executed(path), path.stem)
    assert "<table>" in text or "![" in text
    assert pictures
    assert all(f"({name})" in text or f"(./{name})" in text for name in pictures)
    assert f"({path.stem}.ipynb)" in text


def test_a_design_is_drawn_in_a_notebook() -> None:
    drawing = sosmith.design(
        sosmith.Specification.from_sos([[0.25, 0.5, 0.25, 1.0, -0.5, 0.25]], 1000, input_bits=8, realization="df1")
    ).plot()
    assert drawing._repr_svg_() == drawing.svg
    assert drawing.svg.startswith("<?xml")
    assert "Group delay" in drawing.svg
    assert repr(drawing) == "Drawing()"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_what_a_notebook_names_is_there(path: Path) -> None:
    text = "".join("".join(cell["source"]) for cell in cells(path))
    named = set(re.findall(r"\bsosmith((?:\.\w+)+)", text))
    assert named
    for name in named:
        attrgetter(name.removeprefix("."))(sosmith)
