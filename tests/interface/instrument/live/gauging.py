"""The model of a board with converters, before whose sensor targets are put."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

import sosmith
from sosmith.gen.output.verilog import core_verilog
from sosmith.host.model_line import model_of
from sosmith.model.link.device import Device
from sosmith.model.link.frames import Message
from sosmith.model.link.identity import CONVERTER_FLAGS, Identity
from sosmith.model.link.packing import bytes_of
from sosmith.model.link.protocol import MAX_BODY, Status, Type

GAUGE: dict[str, Any] = {
    "name": "targets",
    "sample_rate": 1000,
    "input": {"voltage": {"bits": 16, "range": [0.0, 10.0]}, "temperature": {"bits": 12, "range": [0.0, 128.0]}},
    "calibration": {"coefficients": [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]},
    "filter": {"family": "butterworth", "kind": "lowpass", "order": 1, "cutoff": 20.0},
    "output": {"bits": 16, "range": [0.0, 16.0], "unit": "mm", "max_error": 0.0005},
    "hardware": {"realization": "df1_ef1", "architecture": "parallel"},
}
"""An instrument that follows a target in some hundredths of a second."""

RETAINED = 255
"""Results that the board keeps."""


_TEXTS: dict[int, tuple[sosmith.Design, str]] = {}


def _text_of(design: sosmith.Design) -> str:
    """Return the SystemVerilog of a design, which is written once."""
    if id(design) not in _TEXTS:
        _TEXTS[id(design)] = design, core_verilog(design.core)
    return _TEXTS[id(design)][1]


class Time:
    """Time that passes only while somebody sleeps."""

    def __init__(self) -> None:
        self.now = 0.0

    def time(self) -> float:
        """Return the time in s."""
        return self.now

    def monotonic(self) -> float:
        """Return the time in s."""
        return self.now

    def sleep(self, seconds: float, /) -> None:
        """Let it pass."""
        self.now += seconds


class GaugingDevice(Device):
    """A board whose converters give what a function of time says.

    Parameters
    ----------
    design : Design
        Its core.
    now : callable
        Returns the time in s.
    voltages : callable
        Returns the voltages of all channels in V at a time.
    core : Core or None
        Another core in its place, such as one with registers.
    """

    def __init__(
        self,
        design: sosmith.Design,
        now: Callable[[], float],
        voltages: Callable[[float], Any],
        core: Any = None,
        **changes: Any,
    ) -> None:
        fed = model_of(design.core, _text_of(design))
        about = fed._identity.model_dump()
        about |= {"source": "converter", "flags": about["flags"] | CONVERTER_FLAGS, **changes}
        super().__init__(Identity.model_validate(about), core or fed._core)
        self._now, self._voltages = now, voltages
        self._kept, self._measured = deque[tuple[int, bytes]](maxlen=RETAINED), 0
        self.temperature = 21.0
        self.raised = 0

    def _carried_out(self, request: Message) -> tuple[bytes, Status]:
        if request.type not in {Type.POLL, Type.CONVERTERS}:
            return super()._carried_out(request)
        about = self._identity
        if request.type == Type.CONVERTERS:
            return bytes(about.channels * len(about.inputs)), Status.OK
        due = int(self._now() * about.sample_rate)
        if due > self._measured:
            self._measure(np.arange(self._measured, due) / about.sample_rate)
        body = bytes([self._kept[0][0]]) if self._kept else b"\0"
        while self._kept and len(body) + about.result_bytes < MAX_BODY:
            body += self._kept.popleft()[1]
        return body, Status.OK

    def _measure(self, times: npt.NDArray[np.float64]) -> None:
        about = self._identity
        n, width = len(times), about.channels
        voltages = np.array([np.broadcast_to(self._voltages(time), (width,)) for time in times.tolist()])
        read = [voltages, np.full((n, width), self.temperature)][: len(about.inputs)]
        columns = [port.encode(each.ravel()) for port, each in zip(about.input_ports, read, strict=True)]
        results = self._core.feed(0, bytes_of(np.stack(columns, axis=1), [port.bytes for port in about.input_ports]))
        size = about.result_bytes
        for k in range(n * width):
            one = results[k * size : (k + 1) * size]
            self._kept.append((k % width, one[:-1] + bytes([one[-1] | self.raised])))
        self._measured += n
