"""The line to a board: bytes in both directions over a serial port, with typed errors."""

from __future__ import annotations

import errno
import os
import select
import termios
from typing import Protocol

import serial

from sosmith.model.errors import LinkLostError, ToolError

_ROOM = 1 << 16
"""Most bytes that one read takes."""

_PLAIN = {errno.ENOTTY: "no serial port", errno.EWOULDBLOCK: "in use by another program"}
"""What some errors of the system mean for a port."""


class Line(Protocol):
    """Bytes to and from a board."""

    def write(self, data: bytes) -> None:
        """Send all of `data`."""
        ...

    def read(self, timeout: float) -> bytes:
        """Return what has arrived; wait up to `timeout` seconds for it, and return nothing if nothing came."""
        ...

    def close(self) -> None:
        """Give the line back."""
        ...


class SerialLine:
    """A serial port, for this process alone.

    Parameters
    ----------
    port : str
        Its name, such as ``/dev/ttyUSB1``, or the path that a virtual board prints.
    baud : int
        Bits per second.

    Raises
    ------
    ToolError
        If there is no such port, it may not be used, or another program uses it.
    """

    def __init__(self, port: str, baud: int) -> None:
        try:
            self._serial = serial.Serial(port, baud, timeout=0, write_timeout=10.0, exclusive=True)
            self._serial.reset_input_buffer()
        except (serial.SerialException, OSError, ValueError, termios.error) as error:  # the last one: gone meanwhile
            raise ToolError(f"{port} must be a serial port that is free, not: {_reason(error)}") from None
        self._port = port

    def write(self, data: bytes) -> None:
        """Send all of `data`; raises LinkLostError if the port is gone or takes nothing."""
        try:
            self._serial.write(data)
        except (serial.SerialException, OSError) as error:
            raise self._lost(error) from None

    def read(self, timeout: float) -> bytes:
        """Return what arrives within `timeout` seconds, as soon as there is something; LinkLostError as `write`."""
        try:
            ready, _, _ = select.select([self._serial.fileno()], [], [], max(timeout, 0))
            data: bytes = self._serial.read(_ROOM) if ready else b""
        except (serial.SerialException, OSError, TypeError) as error:  # TypeError: closed meanwhile
            raise self._lost(error) from None
        return data

    def close(self) -> None:
        """Close the port."""
        self._serial.close()

    def _lost(self, error: Exception) -> LinkLostError:
        return LinkLostError(f"{self._port} must stay connected, not: {_reason(error)}")


def _reason(error: Exception) -> str:
    """Return what the system says, without what pyserial puts around it."""
    number = error.errno if isinstance(error, OSError) else None
    for each in (error, error.__context__):
        if isinstance(each, termios.error):
            number = each.args[0]
    if number is None:
        return str(error)
    return _PLAIN.get(number) or os.strerror(number)
