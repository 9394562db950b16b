"""Has Yosys read a core's SystemVerilog, and compares what it sees with what the verifier reads."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from sosmith.gen.fpga.yosys import run_yosys, yosys_version
from sosmith.model.errors import ToolError
from sosmith.verify.graph import RejectedError
from sosmith.verify.reader.outside import SCRIPT
from sosmith.verify.reader.second_reader import Readings, compare_readings
from sosmith.verify.reader.source import read_source
from sosmith.verify.verdict.limits import limited

SECOND_READERS = ("yosys",)
_USE = "the second reader"


def read_again(text: str, top: str, seconds: float) -> Readings:
    """Compare the reading of a core's SystemVerilog with that of Yosys.

    Parameters
    ----------
    text : str
        What `verify` has accepted.
    top : str
        Name of its top module.
    seconds : float
        Time that the comparison may take, in s; 0 for any.

    Raises
    ------
    ShortfallError
        If Yosys sees anything else, or does not take the text.
    ToolError
        If Yosys is missing.
    """
    yosys_version(_USE)
    with limited(seconds):
        modules = read_source(text, top).modules
        with TemporaryDirectory() as folder:
            (Path(folder) / "core.sv").write_text(text, encoding="ascii")
            try:
                run_yosys(SCRIPT.format(top=top), Path(folder), _USE)
            except ToolError as error:
                raise RejectedError(
                    f"the second reader must take the SystemVerilog of {top}, and does not: {error}"
                ) from None
            netlist = (Path(folder) / "core.json").read_text(encoding="utf-8")
        return compare_readings(modules, netlist)
