"""Writing files: what is there and is no file of its own stays what it is."""

from __future__ import annotations

import errno
import fcntl
import os
import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.text_files import write_contents, write_file, write_files


def test_files_are_replaced_and_nothing_else_is_left(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("old")
    assert write_files(tmp_path, {"a": "new", "b": "too"}) == [tmp_path / "a", tmp_path / "b"]
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "new", "b": "too"}


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real/a")
    for text in ("first", "second"):
        write_files(tmp_path, {"link": text})
        assert (tmp_path / "link").is_symlink()
        assert (tmp_path / "real" / "a").read_text() == text


@pytest.mark.parametrize("kind", ["a folder", "a pipe", "a socket", "a device"])
@pytest.mark.parametrize("linked", [False, True])
def test_what_is_no_file_is_refused_and_stays_what_it_is(tmp_path: Path, kind: str, linked: bool) -> None:
    with made(tmp_path / "it", kind) as place:
        path = tmp_path / "link" if linked else place
        if linked:
            path.symlink_to(place)
        before = place.lstat()
        message = f"{path}: the output file must be a file, not {kind}"
        with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
            write_contents(path.parent, {"first": b"text", path.name: b"text"})
        assert (place.lstat().st_ino, place.lstat().st_mode) == (before.st_ino, before.st_mode)
        assert not (path.parent / "first").exists()


@contextmanager
def made(path: Path, kind: str) -> Iterator[Path]:
    """Make something that is no file, at `path` or, for a device, where one is."""
    if kind == "a folder":
        path.mkdir()
    elif kind == "a pipe":
        os.mkfifo(path)
    elif kind == "a socket":
        with socket.socket(socket.AF_UNIX) as bound:
            bound.bind(str(path))
            yield path
        return
    yield Path("/dev/full") if kind == "a device" else path


def test_one_file_by_its_path(tmp_path: Path) -> None:
    assert write_file(tmp_path / "new" / "a", "text") == tmp_path / "new" / "a"
    assert write_file(tmp_path / "new" / "a", b"other").read_bytes() == b"other"


def test_a_folder_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    message = f"{tmp_path / 'b'}: the output file must be a file, not a folder"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        write_files(tmp_path, {"a": "text", "b": "text"})
    assert not (tmp_path / "a").exists()


def test_a_full_disk_leaves_no_folder_and_is_the_fault_of_a_tool(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_path: Path, _data: bytes) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    folder = tmp_path / "new" / "too"
    message = f"{folder}: the disk must take the output files, not: No space left on device"
    with pytest.raises(ToolError, match=f"^{re.escape(message)}$"):
        write_files(folder, {"a": "text"})
    assert list(tmp_path.iterdir()) == []


def test_what_a_kill_has_left_goes_with_the_next_writing(tmp_path: Path) -> None:
    """A scratch folder stays while somebody holds it, and as long as somebody may be about to."""
    old, held, new, other = (tmp_path / name for name in (".sosmith-a", ".sosmith-b", ".sosmith-c", ".sosmith"))
    elsewhere = tmp_path / "elsewhere"
    for place in (old, held, new, other, elsewhere):
        place.mkdir()
        (place / "part").write_text("a")
    for place in (old, held, other):
        os.utime(place, (0, 0))
    link = tmp_path / ".sosmith-d"
    link.symlink_to(elsewhere)
    number = os.open(held, os.O_RDONLY)
    fcntl.flock(number, fcntl.LOCK_SH)
    write_files(tmp_path, {"file": "text"})
    os.close(number)
    assert {path.name for path in tmp_path.iterdir()} == {
        held.name,
        new.name,
        other.name,
        link.name,
        "elsewhere",
        "file",
    }
    assert (elsewhere / "part").read_text() == "a"
    write_files(tmp_path, {"file": "text"})
    assert not held.exists()


def test_a_scratch_folder_is_held(tmp_path: Path) -> None:
    def pieces() -> Iterator[str]:
        (place,) = tmp_path.glob(".sosmith-*")
        os.utime(place, (0, 0))
        write_files(tmp_path, {"other": "text"})
        yield "whole"

    write_contents(tmp_path, {"file": pieces()})
    assert (tmp_path / "file").read_text() == "whole"
