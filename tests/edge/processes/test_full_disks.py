"""Commands on full disks, a few in every run; `python -m benchmarks.edge --part disks` counts all."""

from __future__ import annotations

import errno
import os
import tempfile

import pytest

from sosmith import cli
from tests.edge.processes.full_disks import PLACES, WRITERS, drawn, missing, possible, tried

alone = pytest.mark.skipif(not possible(), reason="takes a file system of its own, which this machine does not allow")
FULL = os.strerror(errno.ENOSPC)


def test_every_path_that_a_command_writes_is_tried() -> None:
    assert missing() == []


@pytest.mark.slow
@alone
def test_a_full_disk_for_the_output_is_told() -> None:
    ended = tried(("init", "file"), "out", 4)
    assert (ended.status, ended.findings) == (3, ())
    assert ended.said == f"sosmith: error: out: the disk must take the output files, not: {FULL}\n"


def test_where_nobody_knows_which_disk_is_full_both_are_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_arguments: object, **_options: object) -> int:
        raise OSError(errno.ENOSPC, FULL)

    monkeypatch.setattr(tempfile, "tempdir", "/scratch")
    monkeypatch.setattr(cli.cli, "main", full)
    with pytest.raises(SystemExit) as end:
        cli.main()
    said = f"sosmith: error: the disks of the output and of /scratch must have room, not: {FULL}\n"
    assert (end.value.code, capsys.readouterr().err) == (3, said)


@alone
@pytest.mark.slow
def test_a_full_disk_for_temporary_files_is_told() -> None:
    ended = tried(("package", "-o"), "tmp", 4)
    assert (ended.status, ended.findings) == (3, ())
    assert ended.said.splitlines()[-1].startswith("sosmith: error: the disks of the output and of /")
    assert ended.said.endswith(f"/tmp must have room, not: {FULL}\n")


@alone
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(len(WRITERS)))
def test_every_command_on_a_full_disk(seed: int) -> None:
    writer, place, size = drawn(seed)
    assert place in PLACES
    assert tried(writer, place, size).findings == ()
