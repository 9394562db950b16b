"""The model of a board with converters: it measures by itself, as time passes, and keeps its latest results."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace

from tests.host.lines import device_of
from tests.interface.small import filter_design, instrument_design

from sosmith.model.link.device import Device
from sosmith.model.link.frames import Message
from sosmith.model.link.identity import Identity
from sosmith.model.link.protocol import MAX_BODY, Status, Type

RETAINED = 255
"""Results that it keeps."""


class MeasuringDevice(Device):
    """A board whose results are their own sample numbers, modulo 256.

    Parameters
    ----------
    now : callable
        Returns the time in s; sample n is measured n + 1 sample periods after 0.
    identity : Identity
        What it says that it is.
    """

    def __init__(self, now: Callable[[], float], identity: Identity) -> None:
        fed = device_of(instrument_design() if identity.name == "gauge" else filter_design())
        super().__init__(identity, fed._core)
        self._now = now
        self._measured, self._kept = 0, deque[tuple[int, int]](maxlen=RETAINED)
        self.status = 0

    def _carried_out(self, request: Message) -> tuple[bytes, Status]:
        about = self._identity
        if request.type == Type.SAMPLES:
            return b"", Status.UNKNOWN
        if request.type == Type.POLL_PACKED and about.packing is not None:
            body, status = self._carried_out(replace(request, type=Type.POLL))
            return body[:1] + about.packing.packed(body[1:]), status
        if request.type == Type.CONVERTERS:
            return bytes(about.channels * len(about.inputs)), Status.OK
        if request.type != Type.POLL:
            return super()._carried_out(request)
        due = int(self._now() * about.sample_rate) * about.channels
        for n in range(max(self._measured, due - RETAINED), due):
            self._kept.append((n % about.channels, n // about.channels))
        self._measured = max(due, self._measured)
        if not self._kept:
            return b"\0", Status.OK
        body = bytes([self._kept[0][0]])
        while self._kept and len(body) + about.result_bytes < MAX_BODY:
            _, number = self._kept.popleft()
            body += (number % 256).to_bytes(about.output_port.bytes, "little") + bytes([self.status])
        return body, Status.OK


def measuring_identity(channels: int = 1, sample_rate: float = 100.0) -> Identity:
    """Return the identity of a board with converters."""
    changes = {"source": "converter", "channels": channels, "sample_rate": sample_rate}
    made = device_of(filter_design())._identity
    return Identity.model_validate(made.model_dump() | changes)
