"""Readings and alarms to an MQTT broker: a retained state, a last will, and alarms that wait while it is away."""

from __future__ import annotations

import io
import json
import math
import os
import re
import ssl
import stat
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from ipaddress import ip_address
from pathlib import Path
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit

from sosmith.host.alarms import Alarm
from sosmith.host.clock import utc_text
from sosmith.host.outbox import MOST, Outbox
from sosmith.host.readings import Readings
from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.foreign_files import opened

if TYPE_CHECKING:
    from paho.mqtt.client import Client

INTERVAL = 1.0
"""Seconds between two publications of a channel's reading, at least."""

PATIENCE = 10.0
"""Seconds to wait for the broker: for its answer at first, and for its acknowledgements at the end."""

KEEP_ALIVE = 15
"""Seconds after which a silent connection is tried; after half as many again, the broker publishes the last will."""

MAX_TOPIC = 1000
"""Most bytes of the beginning of all topics."""

Item = TypeVar("Item")

_PORTS = {"mqtt": 1883, "mqtts": 8883}
_QOS = 1  # at least once, acknowledged


@dataclass(frozen=True)
class Broker:
    """Where to publish, and as whom.

    Attributes
    ----------
    host : str
        Name or address.
    port : int
        TCP port.
    tls : bool
        Whether the connection is encrypted, and the broker's certificate checked.
    topic : str
        Beginning of all topics; empty for ``sosmith/<name of the core>``.
    user, password : str or None
        Credentials.
    authorities : Path or None
        File with the certificates to trust instead of the system's, in PEM.
    """

    host: str
    port: int
    tls: bool
    topic: str
    user: str | None = None
    password: str | None = field(default=None, repr=False)
    authorities: Path | None = None

    @classmethod
    def at(
        cls,
        url: str,
        *,
        credentials: Path | None = None,
        authorities: Path | None = None,
        plain_text: bool = False,
        environment: Mapping[str, str] = os.environ,
    ) -> Broker:
        """Return the broker at ``mqtt://HOST[:PORT][/TOPIC]``, or ``mqtts://`` for TLS.

        Parameters
        ----------
        url : str
            The address, without user and password.
        credentials : Path or None
            File with ``user:password`` that nobody else may read; None for the variables SOSMITH_MQTT_USER and
            SOSMITH_MQTT_PASSWORD.
        authorities : Path or None
            File with the certificates to trust instead of the system's.
        plain_text : bool
            Whether user and password may go over a line that is not encrypted; to this computer they may.
        environment : mapping
            Where the variables are.

        Raises
        ------
        SpecificationError
            If the address is none, or the credentials are open to others in their file or on the line.
        """
        try:
            parts = urlsplit(url)
            host, port = parts.hostname, parts.port
        except ValueError as error:
            raise SpecificationError(f"--mqtt must be mqtt://HOST[:PORT][/TOPIC], not {url}: {error}") from None
        if parts.username is not None or parts.password is not None:
            raise SpecificationError(
                "--mqtt must be without user and password, which others could see in the list of processes: "
                "--mqtt-credentials FILE, or SOSMITH_MQTT_USER and SOSMITH_MQTT_PASSWORD, take them"
            )
        topic = parts.path.strip("/")
        if parts.scheme not in _PORTS or not host or parts.query or re.search(r"[+#\0]|//", url.split("://", 1)[1]):
            raise SpecificationError(f"--mqtt must be mqtt://HOST[:PORT][/TOPIC] or mqtts://..., not {url}")
        user, password = environment.get("SOSMITH_MQTT_USER"), environment.get("SOSMITH_MQTT_PASSWORD")
        if credentials is not None:
            user, password = _credentials(credentials)
        tls = parts.scheme == "mqtts"
        if user is not None and not (tls or plain_text or _is_here(host)):
            raise SpecificationError(
                f"--mqtt must be mqtts://{host}... with user and password, not mqtt://, which sends them in plain "
                "text: --mqtt-plain-text allows it"
            )
        return cls(host, port or _PORTS[parts.scheme], tls, topic, user, password, authorities)

    def __str__(self) -> str:
        """Return what a message calls it."""
        return f"{self.host}:{self.port}"


def _is_here(host: str) -> bool:
    """Tell whether a host is this computer."""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


_LONGEST = 4096  # characters of a line with credentials


def _credentials(path: Path) -> tuple[str, str]:
    """Read ``user:password`` from a file that is its owner's alone."""
    try:
        with io.TextIOWrapper(opened(path), encoding="utf-8") as file:
            about = os.fstat(file.fileno())
            if stat.S_IMODE(about.st_mode) & 0o077:
                raise SpecificationError(
                    f"{path}: the credentials must be readable by their owner only (chmod 600), "
                    f"not have mode {stat.S_IMODE(about.st_mode):o}"
                )
            user, colon, password = file.readline(_LONGEST).rstrip("\r\n").partition(":")
    except (OSError, UnicodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "no UTF-8"
        raise SpecificationError(f"{path}: the credentials must be a text that can be read, not: {reason}") from None
    if not (user and colon):
        raise SpecificationError(f"{path}: the credentials must be a line user:password, not something else")
    return user, password


class Publisher:
    """Publishes under the topic T, everything with QoS 1.

    - ``T/status``, retained: ``connected`` or ``lost``, as the board is; ``ended``; ``offline``, the last will, when
      this program is gone or does not answer.
    - ``T/channel/K``, retained: the newest reading of channel K as JSON, once a second, while there is a connection.
    - ``T/alarm``: each alarm as JSON. Alarms wait for the broker's acknowledgement, through any number of connections;
      the same one may come twice, with the same ``number``. As many as `sosmith.host.outbox.MOST` wait; those that come
      then are left out, and missing among the numbers.

    Parameters
    ----------
    broker : Broker
        The broker.
    readings : Readings
        What is published; read in the thread that calls `update` and `close`.
    start : float
        When this run began, in seconds since 1970: alarms of different runs have the same numbers.
    keep : Path or None
        File that keeps alarms over restarts until they are acknowledged; None for memory.

    Raises
    ------
    SpecificationError
        If the topic has a sign that topics must not have, or the file cannot be used.
    ToolError
        If paho-mqtt is missing, or the broker does not accept the connection within 10 s; later it is waited for.
    """

    def __init__(self, broker: Broker, readings: Readings, start: float, keep: Path | None = None) -> None:
        self._broker, self._readings, self._start, self._keep = broker, readings, start, keep
        self._topic = _topic(broker.topic or f"sosmith/{readings.identity.name}")
        self._number, self._due, self._state, self._left_out = 0, -math.inf, "", 0
        # What the client's thread tells the one of the monitor.
        self._acknowledged: SimpleQueue[int] = SimpleQueue()
        self._news: SimpleQueue[str] = SimpleQueue()
        self._answered, self._again, self._refusal = threading.Event(), threading.Event(), ""
        self._outbox = Outbox(keep)
        try:
            self._client = self._connected()
        except BaseException:
            self._outbox.close()
            raise
        self.update()

    def update(self) -> None:
        """Publish what is new: a change of the state at once, readings once a second; take what is acknowledged."""
        readings = self._readings
        if readings.state != self._state or self._again.is_set():
            self._again.clear()  # after an absence, the last will stands there
            self._state = readings.state
            self._outbox.show(f"{self._topic}/status", self._state)
        if time.monotonic() >= self._due and self._client.is_connected():
            self._due = time.monotonic() + INTERVAL
            for one in readings.now:
                content = {
                    "time": utc_text(readings.utc, "milliseconds"),
                    "sample": readings.samples - 1,
                    "quantity": readings.identity.output_port.name,
                    "unit": readings.identity.output_port.unit,
                    "value": one.value,
                    "wear": one.wear,
                    "per_hour": one.per_hour,
                    "flags": one.flags,
                }
                self._outbox.show(f"{self._topic}/channel/{one.channel}", _json(content))
        self._exchange()

    def alarm(self, alarm: Alarm) -> None:
        """Publish an alarm, now or when the broker is back."""
        self._number += 1
        content = {
            "number": self._number,
            "since": utc_text(self._start, "milliseconds"),
            "time": utc_text(alarm.utc, "milliseconds"),
            "sample": alarm.sample,
            "channel": alarm.channel,
            "flag": alarm.flag,
            "value": alarm.value,
            "unit": self._readings.identity.output_port.unit,
        }
        self._outbox.put(f"{self._topic}/alarm", _json(content))
        if self._outbox.left_out and not self._left_out:
            self._news.put(f"{MOST} alarms wait for the broker at {self._broker}; further ones are left out")
        self._left_out = self._outbox.left_out
        self._exchange()

    def news(self) -> list[str]:
        """Return what has happened to the connection since the last call, a sentence each."""
        return _drained(self._news)

    def close(self) -> None:
        """Publish the last readings and the end, and leave when all of it is acknowledged.

        Raises
        ------
        ToolError
            If alarms are not acknowledged within 10 s, or were left out.
        """
        self._due = -math.inf
        self.update()
        self._outbox.show(f"{self._topic}/status", "ended")
        end = time.monotonic() + PATIENCE
        while True:
            self._exchange()
            if self._outbox.empty or time.monotonic() > end:
                break
            time.sleep(0.01)
        self._client.disconnect()
        self._client.loop_stop()
        self._outbox.close()
        if left := self._outbox.waiting + self._left_out:
            kept = "" if self._keep is None else f"; {self._outbox.waiting} wait in {self._keep} for the next start"
            raise ToolError(f"the broker at {self._broker} must acknowledge every alarm, not leave out {left}{kept}")

    def _exchange(self) -> None:
        """Take what is acknowledged, and give the client what it may have now."""
        for number in _drained(self._acknowledged):
            self._outbox.acknowledged(number)
        if self._client.is_connected():
            self._outbox.hand_over(self._hand)

    def _hand(self, topic: str, text: str, retain: bool) -> int:
        return self._client.publish(topic, text, _QOS, retain=retain).mid

    def __enter__(self) -> Publisher:
        """Return the publisher."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Publish the end, and leave."""
        self.close()

    def _connected(self) -> Client:
        """Return a client that is connected, and connects again whenever it has to."""
        mqtt = paho()
        client: Client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, reconnect_on_failure=True)
        client.reconnect_delay_set(1, 30)
        client.will_set(f"{self._topic}/status", "offline", _QOS, retain=True)
        if self._broker.user is not None:
            client.username_pw_set(self._broker.user, self._broker.password)
        client.on_connect, client.on_disconnect = self._on_connect, self._on_disconnect
        client.on_publish = lambda client, data, number, reason, properties: self._acknowledged.put(number)
        try:
            if self._broker.tls:
                client.tls_set(None if self._broker.authorities is None else str(self._broker.authorities))
            client.connect(self._broker.host, self._broker.port, KEEP_ALIVE)
        except (OSError, ssl.SSLError) as error:
            reason = getattr(error, "verify_message", None) or error.strerror or str(error)
            raise ToolError(f"the broker at {self._broker} must be there, not: {reason}") from None
        client.loop_start()
        if not self._answered.wait(PATIENCE) or self._refusal:
            client.disconnect()
            client.loop_stop()
            reason = self._refusal or f"silent for {PATIENCE:g} s"
            raise ToolError(f"the broker at {self._broker} must accept the connection, not: {reason}")
        return client

    def _on_connect(self, client: Client, data: Any, flags: Any, reason: Any, properties: Any) -> None:
        """Take the answer of the broker; called in the client's thread, at every connection."""
        again = self._answered.is_set()
        if reason.is_failure:
            self._refusal = str(reason)
            if again:
                self._news.put(f"the broker at {self._broker} refuses: {reason}; trying again")
        elif again:
            self._again.set()
            self._news.put(f"the broker at {self._broker} is connected again")
        self._answered.set()

    def _on_disconnect(self, client: Client, data: Any, flags: Any, reason: Any, properties: Any) -> None:
        if reason.is_failure and self._answered.is_set():
            self._news.put(f"the broker at {self._broker} is gone; waiting for it")


def _topic(text: str) -> str:
    """Check the beginning of all topics."""
    if not text.isprintable() or set("#+") & set(text) or len(text.encode()) > MAX_TOPIC:
        raise SpecificationError(
            f"the topic must be printable, of {MAX_TOPIC} bytes at most, and without # and +, "
            f"not {ascii(text[:MAX_TOPIC])[1:-1]}"
        )
    return text


def _json(content: dict[str, Any]) -> str:
    return json.dumps(content, ensure_ascii=False, allow_nan=False)


def _drained(queue: SimpleQueue[Item]) -> list[Item]:
    """Take everything out of a queue that another thread fills."""
    taken = []
    while True:
        try:
            taken.append(queue.get_nowait())
        except Empty:
            return taken


def paho() -> Any:
    """Return the module of the MQTT client.

    Raises
    ------
    ToolError
        If it is missing.
    """
    try:
        from paho.mqtt import client
    except ImportError:
        raise ToolError("paho-mqtt must be installed for MQTT: pip install 'sosmith[mqtt]'") from None
    return client
