"""A line to the model of a board in the same process, for trying out and for tests without hardware."""

from __future__ import annotations

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.identity import identity
from sosmith.model.link.device import Device
from sosmith.model.link.integer_core import HeldCore, IntegerCore


class ModelLine:
    """A line to a model of a board, which answers at once: where no byte waits, none will come.

    Parameters
    ----------
    device : Device
        The model.
    """

    def __init__(self, device: Device) -> None:
        self._device, self._waiting = device, bytearray()

    def write(self, data: bytes) -> None:
        """Send bytes to the model."""
        self._waiting += self._device.feed(data)

    def read(self, timeout: float) -> bytes:
        """Return what the model has sent; waits for nothing."""
        data = bytes(self._waiting)
        self._waiting.clear()
        return data

    def close(self) -> None:
        """Forget what has not been read."""
        self._waiting.clear()


def model_of(design: CoreDesign, verilog: str = "", *, window: int = 4, baud: int = 1_000_000) -> Device:
    """Return the model of a board with a core, whose SystemVerilog is `verilog`."""
    own_identity = identity(design, verilog, baud=baud, clock=float(design.spec.hardware.clock))
    decimates = design.datapath.samples_per_result > 1
    core = (HeldCore if decimates else IntegerCore)(design.datapath, design.spec.channels)
    return Device(own_identity, core, window=window)
