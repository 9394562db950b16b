"""A line through a socket."""

import select
import socket

from tests.host.lines import ScriptedLine


class SocketLine(ScriptedLine):
    """A line over a socket, to a board without a pseudo-terminal."""

    def __init__(self, end: socket.socket) -> None:
        super().__init__()
        self._socket = end

    def write(self, data: bytes) -> None:
        self._socket.sendall(data)

    def read(self, timeout: float) -> bytes:
        ready, _, _ = select.select([self._socket], [], [], max(timeout, 0))
        return self._socket.recv(1 << 16) if ready else b""

    def close(self) -> None:
        self._socket.close()
