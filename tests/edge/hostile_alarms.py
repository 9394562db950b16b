"""Alarms over a broker that is killed with -9 again and again: each comes, and copies have its number."""

from __future__ import annotations

import json
import os
import random
import signal
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sosmith.host.alarms import Alarm
from sosmith.host.mqtt import Broker, Publisher
from sosmith.host.readings import Readings
from tests.host.lines import device_of
from tests.interface.small import instrument_design

PATIENCE = 120.0
"""Seconds for what must come, on however busy a machine."""

CONNECT, PUBLISH, PINGREQ = 1, 3, 12


@dataclass(frozen=True)
class Published:
    """What came of it.

    Attributes
    ----------
    alarms, kills : int
        Alarms that were published, and kills of the broker.
    findings : tuple of str
        Alarms that were lost, or differ from their copy.
    """

    alarms: int
    kills: int
    findings: tuple[str, ...]


class KillableBroker:
    """A broker of MQTT 3.1.1 in a process of its own, which writes every alarm to a file before it acknowledges it."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._server.getsockname()[1]
        self._pid = 0

    def start(self) -> None:
        """Begin to answer."""
        self._pid = os.fork()
        if not self._pid:
            try:
                self._serve()
            finally:
                os._exit(1)

    def kill(self) -> None:
        """End it at whatever it does."""
        os.kill(self._pid, signal.SIGKILL)
        os.waitpid(self._pid, 0)

    def close(self) -> None:
        """Give the port back."""
        self._server.close()

    def _serve(self) -> None:
        while True:
            line, _ = self._server.accept()
            try:
                self._talk(line)
            except (OSError, EOFError):
                line.close()

    def _talk(self, line: socket.socket) -> None:
        while True:
            kind, body = _packet(line)
            if kind == CONNECT:
                line.sendall(b"\x20\x02\x00\x00")
            elif kind == PINGREQ:
                line.sendall(b"\xd0\x00")
            elif kind == PUBLISH:
                size = int.from_bytes(body[:2], "big")
                if body[2 : 2 + size].endswith(b"/alarm"):
                    with self._file.open("ab") as file:
                        file.write(body[4 + size :] + b"\n")
                line.sendall(b"\x40\x02" + body[2 + size : 4 + size])


def _packet(line: socket.socket) -> tuple[int, bytes]:
    """Receive a packet; return its type and what is behind its length."""
    kind, length, shift = _bytes(line, 1)[0] >> 4, 0, 0
    while True:
        byte = _bytes(line, 1)[0]
        length |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            return kind, _bytes(line, length)


def _bytes(line: socket.socket, count: int) -> bytes:
    made = b""
    while len(made) < count:
        part = line.recv(count - len(made))
        if not part:
            raise EOFError
        made += part
    return made


def published(folder: Path, count: int, rng: random.Random) -> Published:
    """Publish so many alarms while the broker is killed after some of them, before or after it could answer."""
    file, kills = folder / "alarms.txt", 0
    readings = Readings(device_of(instrument_design())._identity, None, "port")
    broker = KillableBroker(file)
    broker.start()
    try:
        with Publisher(Broker("127.0.0.1", broker.port, False, "T"), readings, 0.0, folder / "waiting") as publisher:
            publisher._client.reconnect_delay_set(0.01, 0.05)  # type: ignore[arg-type]
            for n in range(count):
                publisher.alarm(Alarm("fault", 0, n, 1.5, 1e9))
                if rng.random() < 0.1:
                    time.sleep(rng.choice((0.0, 0.001, 0.01)))
                    broker.kill()
                    kills += 1
                    publisher.update()
                    broker.start()
                    _until(publisher._client.is_connected, publisher.update)
            _until(lambda: publisher._outbox.waiting == 0, publisher.update)
    finally:
        broker.kill()
        broker.close()
    came = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    by_number: dict[int, list[object]] = {}
    for one in came:
        by_number.setdefault(one["number"], []).append(one)
    findings = [f"alarm {n} is lost" for n in range(1, count + 1) if n not in by_number]
    findings += [
        f"copies of alarm {n} differ" for n, all_of in by_number.items() if any(a != all_of[0] for a in all_of)
    ]
    findings += [f"alarm {n} was never published" for n in by_number if not 1 <= n <= count]
    return Published(count, kills, tuple(findings))


def _until(met: Callable[[], bool], turn: Callable[[], None]) -> None:
    end = time.monotonic() + PATIENCE
    while not met():
        turn()
        assert time.monotonic() < end, "what was published must be acknowledged once the broker is there"
        time.sleep(0.005)
