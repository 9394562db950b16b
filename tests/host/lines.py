"""Lines without a port: to a model of a board that can be damaged or unplugged, and to scripted bytes."""

from __future__ import annotations

from collections.abc import Callable

from tests.interface.small import filter_design

import sosmith
from sosmith.host.model_line import ModelLine, model_of
from sosmith.model.errors import LinkLostError
from sosmith.model.link.device import Device


def device_of(design: sosmith.Design, window: int = 4) -> Device:
    """Return the model of a board with a design."""
    return model_of(design.core, window=window)


def plain_device() -> Device:
    """Return the model of a board with a small filter."""
    return device_of(filter_design())


class BadLine(ModelLine):
    """A line to a model that is damaged in both directions, and can be unplugged."""

    def __init__(self, device: Device, damage: Callable[[bytes], bytes] = lambda data: data) -> None:
        super().__init__(device)
        self.device, self.damage, self.unplugged, self.closed = device, damage, False, False

    def write(self, data: bytes) -> None:
        """Send bytes to the model."""
        self._check()
        super().write(self.damage(data))

    def read(self, timeout: float) -> bytes:
        """Return what the model has sent."""
        self._check()
        return self.damage(super().read(timeout))

    def close(self) -> None:
        """Remember that it was closed."""
        self.closed = True

    def _check(self) -> None:
        if self.unplugged:
            raise LinkLostError("the line must stay connected, not: unplugged")


class ScriptedLine:
    """A line that answers every reading with the next bytes of a script, then with nothing."""

    def __init__(self, *script: bytes) -> None:
        self.script, self.closed = list(script), False

    def write(self, data: bytes) -> None:
        """Ignore what is sent."""

    def read(self, timeout: float) -> bytes:
        """Return the next bytes."""
        return self.script.pop(0) if self.script else b""

    def close(self) -> None:
        """Remember that it was closed."""
        self.closed = True
