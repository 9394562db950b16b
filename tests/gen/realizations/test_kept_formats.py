"""Trimmed formats between commands: the same result without a search, and a search wherever anything is different."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from sosmith.gen.realizations import kept_formats
from sosmith.gen.realizations.kept_formats import Choice, kept_or_made
from sosmith.gen.realizations.section_format import SectionFormat

START = Choice(0, (SectionFormat(coefficients={"a1": (12345, 14), "a2": (-7, 3)}, fracs={"y": 12}),))
TRIMMED = Choice(1, (SectionFormat(coefficients={"a1": (773, 10), "a2": (-7, 3)}, fracs={"y": 5, "taps": 4}),))


CACHE_FOLDER = kept_formats.cache_folder


class Maker:
    """Counts how often it is asked."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self) -> Choice:
        self.calls += 1
        return TRIMMED


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Maker:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(kept_formats, "cache_folder", CACHE_FOLDER)
    return Maker()


def files(folder: Path) -> list[Path]:
    return sorted((folder / "sosmith" / "trimmed").iterdir())


def test_the_same_search_is_made_once(made: Maker, tmp_path: Path) -> None:
    assert [kept_or_made(START, ("df1", 0.5), made) for _ in range(3)] == [TRIMMED] * 3
    assert (made.calls, len(files(tmp_path))) == (1, 1)
    kept_or_made(START, ("df1", 0.25), made)
    kept_or_made(replace(START, input_stage=1), ("df1", 0.5), made)
    assert (made.calls, len(files(tmp_path))) == (3, 3)


def test_other_sources_make_another_search(made: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    kept_or_made(START, ("df1",), made)
    monkeypatch.setattr(kept_formats, "_sources", lambda: "others")
    kept_or_made(START, ("df1",), made)
    assert made.calls == 2


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("773", "773.5"),
        ("773", "true"),
        ('"a1"', '"b1"'),
        ('"y": 5, ', ""),
        ('"input_stage": 1', '"input_stage": -1'),
        ('"formats"', '"other"'),
        ("[{", "[[{"),
        ("{", ""),
    ],
)
def test_what_no_search_leaves_is_made_again(old: str, new: str, made: Maker, tmp_path: Path) -> None:
    kept_or_made(START, (), made)
    (place,) = files(tmp_path)
    text = place.read_text(encoding="utf-8")
    assert old in text
    place.write_text(text.replace(old, new), encoding="utf-8")
    assert kept_or_made(START, (), made) == TRIMMED
    assert made.calls == 2
    assert place.read_text(encoding="utf-8") == text


def test_without_a_folder_each_search_is_made(made: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert [kept_or_made(START, (), made) for _ in range(2)] == [TRIMMED] * 2
    assert made.calls == 2


def test_what_has_no_representation_of_its_own_is_not_kept(made: Maker, tmp_path: Path) -> None:
    kept_or_made(START, (object(),), made)
    assert not (tmp_path / "sosmith").exists()
    assert made.calls == 1


def test_the_older_half_goes(made: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_formats, "LIMIT", 6)
    for key in range(7):
        kept_or_made(START, (key,), made)
    assert len(files(tmp_path)) == 4
    kept_or_made(START, (6,), made)
    assert made.calls == 7
