"""A board in Verilator, with its serial line in Python's hands: bytes in, bytes out."""

import struct
import subprocess
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from sosmith.sim.simulators import find_simulator
from sosmith.sim.verilated_model import Builder

_MAIN = Path(__file__).with_name("line_main.cpp")
_MOST = 50_000_000  # clocks


class Reply(NamedTuple):
    """What a board sends: the bytes, the clocks from the first start bit to the last stop bit, and all clocks."""

    data: bytes
    sending: int
    clocks: int


def built(verilog: str, top: str, folder: Path) -> Path:
    """Compile a board's top for `Line`."""
    tool = find_simulator("verilator", folder / "bin")
    (folder / "top.sv").write_text(verilog, encoding="utf-8")
    # Registers and memories without an initial value start at random.
    builder = Builder(tool.version, tool.environment, folder)
    builder.build_program(folder / "top.sv", top, _MAIN, _MAIN, folder / "line")
    return folder / "line"


class Line:
    """The line of a board, at `clocks_per_bit`; the board runs while it is called."""

    def __init__(self, program: Path, clocks_per_bit: float) -> None:
        self._process = subprocess.Popen(
            [program, str(clocks_per_bit)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.communicate()
        assert kind is not None or self._process.returncode == 0

    def call(self, data: bytes, silence: int, *, breaks: bool = False) -> Reply:
        """Send bytes without a gap, with `breaks` hold the line low for two more; wait for `silence` clocks."""
        send, receive = self._process.stdin, self._process.stdout
        assert send is not None
        assert receive is not None
        send.write(struct.pack("<4I", len(data), silence, _MOST, breaks) + data)
        sending, clocks, count = struct.unpack("<3I", _all(receive.read, 12))
        return Reply(_all(receive.read, count), sending, clocks)


def _all(read, count: int) -> bytes:  # type: ignore[no-untyped-def]
    data = b""
    while len(data) < count:
        more = read(count - len(data))
        assert more, "the board must send bytes with right stop bits"
        data += more
    return data
