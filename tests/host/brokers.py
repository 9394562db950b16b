"""A real MQTT broker for the tests, mosquitto on the loopback address, and a subscriber whose session outlives it."""

from __future__ import annotations

import getpass
import os
import shutil
import socket
import subprocess
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.suite.extras import needed

mqtt = needed("paho.mqtt.client")

MOSQUITTO = shutil.which("mosquitto", path=f"{os.environ.get('PATH', '')}:/usr/sbin:/usr/local/sbin")
PATIENCE = 60.0
"""Seconds to wait for what must come."""


class Mosquitto:
    """A broker that keeps its sessions and messages in a folder when it is stopped.

    Parameters
    ----------
    folder : Path
        Where it keeps them.
    *lines : str
        Lines of the configuration, such as those for TLS.
    """

    def __init__(self, folder: Path, *lines: str) -> None:
        with socket.socket() as found:
            found.bind(("127.0.0.1", 0))
            self.port: int = found.getsockname()[1]
        kept = ["persistence true", f"persistence_location {folder}/", f"user {getpass.getuser()}"]
        listening = [f"listener {self.port} 127.0.0.1", *(lines or ["allow_anonymous true"])]
        (folder / "mosquitto.conf").write_text("\n".join([*kept, *listening]) + "\n")
        self._command = [str(MOSQUITTO), "-c", str(folder / "mosquitto.conf")]
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it, and wait until it listens."""
        self._process = subprocess.Popen(self._command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        end = time.monotonic() + PATIENCE
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port)).close()
                return
            except OSError:
                assert self._process.poll() is None, "mosquitto must start"
                assert time.monotonic() < end, "mosquitto must listen"
                time.sleep(0.01)

    def stop(self) -> None:
        """Stop it; what it holds is written."""
        assert self._process is not None
        self._process.terminate()
        self._process.wait(PATIENCE)


@contextmanager
def running(folder: Path, *lines: str) -> Iterator[Mosquitto]:
    """Run a broker while the context lasts."""
    broker = Mosquitto(folder, *lines)
    broker.start()
    try:
        yield broker
    finally:
        broker.stop()


class Subscriber:
    """Collects what is published under a topic, in a session that the broker keeps.

    Attributes
    ----------
    messages : list of tuple
        Topic, text and whether it was retained.
    """

    def __init__(self, port: int, topic: str) -> None:
        self.messages: list[tuple[str, str, bool]] = []
        self._subscribed = False
        self._client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, uuid.uuid4().hex, clean_session=False)
        self._client.reconnect_delay_set(1, 1)
        self._client.on_connect = lambda client, *_: client.subscribe(topic, 1)
        self._client.on_subscribe = self._on_subscribe
        self._client.on_message = self._on_message
        self._client.connect("127.0.0.1", port)
        self._client.loop_start()
        self.until(lambda: self._subscribed)

    def texts(self, topic: str) -> list[str]:
        """Return what came under a topic."""
        return [text for where, text, _ in self.messages if where == topic]

    def until(self, met: Any) -> None:
        """Wait until a condition is met."""
        end = time.monotonic() + PATIENCE
        while not met():
            assert time.monotonic() < end, f"the messages must come, not just {self.messages}"
            time.sleep(0.01)

    def __enter__(self) -> Subscriber:
        """Return the subscriber."""
        return self

    def __exit__(self, *error: object) -> None:
        """Leave the broker."""
        self._client.disconnect()
        self._client.loop_stop()

    def _on_subscribe(self, *_: Any) -> None:
        self._subscribed = True

    def _on_message(self, client: Any, data: Any, message: Any) -> None:
        self.messages.append((message.topic, message.payload.decode(), message.retain))
