"""The recipes: what their pages show is the specification, what the command prints, and what it draws.

Run as a script, it renews their pages and pictures; arguments name some of them.
"""

import contextlib
import re
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile
from tests.documents.shown import ROOT, carry_out, furnish, with_output

import sosmith

RECIPES = ROOT / "docs" / "recipes"
PAGES = sorted(page.stem for page in RECIPES.glob("*.md") if page.stem != "README")
QUICK = ("linearizer", "notch")
"""Designed within a few seconds; the others are among the slow tests."""

_SPECIFICATION = re.compile(r"(?<=```toml\n).*?(?=```)", re.DOTALL)


def drawn(name: str) -> Path:
    return ROOT / "docs" / "images" / "recipes" / f"{name}.svg"


def specification(name: str) -> str:
    return (ROOT / "examples" / "recipes" / f"{name}.toml").read_text(encoding="utf-8")


def page(name: str) -> str:
    return (RECIPES / f"{name}.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in QUICK else [pytest.mark.slow]) for n in PAGES])
def test_a_recipe_prints_and_draws_what_its_page_shows(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(furnish(tmp_path))
    carry_out(page(name), tmp_path)
    assert page(name) == with_output(page(name), tmp_path)
    assert (tmp_path / f"{name}.svg").read_bytes() == drawn(name).read_bytes()
    if name == "telephone":
        made = sosmith.design("telephone.toml")
        rate, heard = wavfile.read("heard.wav")
        assert (rate, heard.dtype) == (48000, np.int16)
        assert np.array_equal(heard, made.run_codes(x=made.trace("noise.wav").coded[0].codes[:, 0]))


@pytest.mark.parametrize("name", PAGES)
def test_the_specification_shown_is_that_of_the_example(name: str) -> None:
    assert _SPECIFICATION.findall(page(name)) == [specification(name)]
    assert f"images/recipes/{name}.svg" in page(name)


def test_the_sound_of_the_recipe_is_that_of_the_hardware(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The lines themselves are among the slow tests; here the integer model plays, and shorter."""
    monkeypatch.chdir(tmp_path)
    Path("telephone.toml").write_text(specification("telephone"), encoding="utf-8")
    made = sosmith.design("telephone.toml", realization="df1")
    made.trace("pink_noise", seconds=0.2).write("noise.wav")
    noise = made.trace("noise.wav")
    heard = made.run(**noise.inputs)
    spectrum = np.abs(np.fft.rfft(heard)) / np.abs(np.fft.rfft(noise.inputs["x"]))
    frequency = np.fft.rfftfreq(len(heard), 1 / 48000)
    assert np.median(spectrum[(frequency > 500) & (frequency < 2000)]) == pytest.approx(1, abs=0.05)
    assert np.median(spectrum[frequency > 15000]) < 0.02


def test_each_recipe_is_listed() -> None:
    listed = re.findall(r"\]\((\w+)\.md\)", (RECIPES / "README.md").read_text(encoding="utf-8"))
    assert sorted(listed) == PAGES


if __name__ == "__main__":
    for name in sys.argv[1:] or PAGES:
        with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch):
            text = _SPECIFICATION.sub(lambda _, name=name: specification(name), page(name))
            carry_out(text, furnish(Path(scratch)))
            (RECIPES / f"{name}.md").write_text(with_output(text, Path(scratch)), encoding="utf-8")
            drawn(name).parent.mkdir(parents=True, exist_ok=True)
            drawn(name).write_bytes((Path(scratch) / f"{name}.svg").read_bytes())
