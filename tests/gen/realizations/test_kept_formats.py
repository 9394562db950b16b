"""What a search came to, between commands: the same result without a search, and a search wherever anything differs."""

from __future__ import annotations

from itertools import count
from pathlib import Path

import pytest

from sosmith.gen.realizations import kept_files, kept_formats
from sosmith.gen.realizations.kept_formats import Choice, choice_of_tree, kept_or_made, tree_of_choice
from sosmith.gen.realizations.section_format import SectionFormat

TRIMMED = Choice(1, (SectionFormat(coefficients={"a1": (773, 10), "a2": (-7, 3)}, fracs={"y": 5, "taps": 4}),))

CACHE_FOLDER = kept_formats.cache_folder


class Maker:
    """Counts how often it is asked."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self) -> Choice:
        self.calls += 1
        return TRIMMED

    def asked(self, *key: object) -> Choice:
        return kept_or_made(key, self, tree_of_choice, choice_of_tree)


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Maker:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(kept_formats, "cache_folder", CACHE_FOLDER)
    monkeypatch.setattr(kept_files, "_written", count())
    return Maker()


def files(folder: Path) -> list[Path]:
    return sorted((folder / "sosmith" / "trimmed").iterdir())


def test_the_same_search_is_made_once(made: Maker, tmp_path: Path) -> None:
    assert [made.asked("df1", 0.5) for _ in range(3)] == [TRIMMED] * 3
    assert (made.calls, len(files(tmp_path))) == (1, 1)
    made.asked("df1", 0.25)
    made.asked("df2t", 0.5)
    assert (made.calls, len(files(tmp_path))) == (3, 3)


@pytest.mark.parametrize("nothing", [None, 0.0, float("inf"), [2, 0, 1]])
def test_what_is_nothing_is_kept_too(nothing: object, made: Maker) -> None:
    calls = count(1)

    def search() -> object:
        assert next(calls) == 1
        return nothing

    assert [kept_or_made(("order",), search, lambda it: it, lambda it: it) for _ in range(2)] == [nothing] * 2


def test_what_fails_is_not_kept(made: Maker, tmp_path: Path) -> None:
    def fail() -> float:
        raise ValueError("no")

    for _ in range(2):
        with pytest.raises(ValueError, match=r"^no$"):
            kept_or_made(("size",), fail, float, float)
    assert files(tmp_path) == []


def test_other_sources_make_another_search(made: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    made.asked("df1")
    monkeypatch.setattr(kept_formats, "_sources", lambda: "others")
    made.asked("df1")
    assert made.calls == 2


def test_every_source_that_decides_is_looked_at() -> None:
    room = Path(kept_formats.__file__).resolve().parents[2]
    assert all(any((room / part).glob("*.py")) for part in kept_formats._SOURCES)
    assert len(kept_formats._sources()) == 64


@pytest.mark.parametrize(("old", "new"), [("773", "774"), ("[{", "[[{"), ("{", ""), ("\n", ""), ("\n", "\n\n")])
def test_what_is_not_as_it_was_written_is_made_again(old: str, new: str, made: Maker, tmp_path: Path) -> None:
    made.asked()
    (place,) = files(tmp_path)
    text = place.read_text(encoding="utf-8")
    assert old in text
    place.write_text(text.replace(old, new), encoding="utf-8")
    assert made.asked() == TRIMMED
    assert made.calls == 2
    assert place.read_text(encoding="utf-8") == text


def test_without_a_folder_each_search_is_made(made: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert [made.asked() for _ in range(2)] == [TRIMMED] * 2
    assert made.calls == 2


def test_what_has_no_representation_of_its_own_is_not_kept(made: Maker, tmp_path: Path) -> None:
    made.asked(object())
    assert not (tmp_path / "sosmith").exists()
    assert made.calls == 1


def test_the_older_half_goes(made: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_formats, "LIMIT", 6)
    monkeypatch.setattr(kept_files, "_LOOKS", 3)  # at the first file, the fourth, the seventh
    for key in range(8):
        made.asked(key)
    assert len(files(tmp_path)) == 5
    made.asked(7)
    assert made.calls == 8
