"""Bad specifications, each refused in one sentence: file, key, what would be right, what was found."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.gen.specification.bad_specifications import (
    BAD,
    BASE,
    with_fault,
)

from sosmith.gen.specification.specification import load
from sosmith.model.errors import SpecificationError


@pytest.mark.parametrize(("old", "new", "sentence"), [pytest.param(*case, id=subject) for subject, *case in BAD])
def test_a_bad_specification_is_refused_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, sentence: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("spec.toml").write_text(with_fault(old, new), encoding="utf-8")
    with pytest.raises(SpecificationError, match=f"^{re.escape(f'spec.toml: {sentence}')}$"):
        load(Path("spec.toml"))


def test_the_specification_that_the_bad_ones_are_made_from_is_good(tmp_path: Path) -> None:
    (tmp_path / "spec.toml").write_text(BASE, encoding="utf-8")
    assert load(tmp_path / "spec.toml").name == "demo"


def test_a_byte_that_is_no_utf8_is_refused_with_its_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("spec.toml").write_bytes(b'name = "demo"\nunit = "\xb5m"\n')
    with pytest.raises(SpecificationError, match=r"^spec\.toml: line 2 must be UTF-8 text, not the byte 0xb5$"):
        load(Path("spec.toml"))


def test_a_missing_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sentence = "none.toml: the specification must be a readable file, not: no such file or directory"
    with pytest.raises(SpecificationError, match=f"^{re.escape(sentence)}$"):
        load(Path("none.toml"))


def test_a_folder_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("folder.toml").mkdir()
    sentence = "folder.toml: the specification must be a readable file, not: is a directory"
    with pytest.raises(SpecificationError, match=f"^{re.escape(sentence)}$"):
        load(Path("folder.toml"))


def test_an_impossible_path_is_refused() -> None:
    sentence = r"'a\x00b' must be the path of a file, not an impossible one"
    with pytest.raises(SpecificationError, match=f"^{re.escape(sentence)}$"):
        load(Path("a\0b"))


def test_rules_about_several_keys_are_told_all_at_once(tmp_path: Path) -> None:
    """One finding of each subject."""
    (tmp_path / "spec.toml").write_text(
        'name = "many"\nsample_rate = 1000.0\ninput.x = { bits = 8, range = [-1.0, 2.0], signed = true }\n'
        'filter = { family = "butterworth", kind = "lowpass", order = 2, cutoff = 600.0, decimate = 2 }\n'
        "output = { bits = 8, range = [-1.0, 1.0], signed = true, max_error = 0.001 }\n"
        "hardware = { clock = 10.0, reload = true, samples_per_clock = 2 }\n"
    )
    with pytest.raises(SpecificationError) as refused:
        load(tmp_path / "spec.toml")
    first, *others = str(refused.value).splitlines()
    keys = [line.removeprefix(f"{tmp_path / 'spec.toml'}: ").split(maxsplit=1)[0] for line in (first, *others)]
    assert keys == ["input.x.range", "filter.cutoff", "output.max_error", "hardware.clock", "not"]
    assert others[-1].startswith("  not yet available: hardware.reload must be false with hardware.samples_per_clock")
