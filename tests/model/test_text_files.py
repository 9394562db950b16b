"""Writing files: what is there and is no file of its own stays what it is."""

from __future__ import annotations

import errno
import os
import re
import threading
from pathlib import Path

import pytest

from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.text_files import write_contents, write_files


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


def test_a_pipe_is_written_into(tmp_path: Path) -> None:
    pipe, read = tmp_path / "pipe", []
    os.mkfifo(pipe)
    # Where the pipe is replaced instead, nobody ever writes: the reader must not keep the tests from ending.
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()), daemon=True)
    reader.start()
    write_contents(tmp_path, {"pipe": b"through"})
    reader.join(timeout=60)
    assert pipe.is_fifo()
    assert read == [b"through"]


def test_the_null_device_stays_what_it_is(tmp_path: Path) -> None:
    (tmp_path / "null").symlink_to(os.devnull)
    write_contents(tmp_path, {"null": b"gone"})
    assert Path(os.devnull).is_char_device()
    assert (tmp_path / "null").is_symlink()


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


def test_a_device_that_is_full_is_the_fault_of_a_tool() -> None:
    message = "/dev: the disk must take the output files, not: No space left on device"
    with pytest.raises(ToolError, match=f"^{message}$"):
        write_contents(Path("/dev"), {"full": b"text"})
