"""The live view in a browser: a page of its own on the loopback address, which a websocket keeps up to date."""

from __future__ import annotations

import json
import math
import secrets
import threading
import time
from contextlib import suppress
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sosmith.host.loopback import POLICY_VIOLATION, Loopback, page_policy
from sosmith.host.readings import Readings
from sosmith.model.templates import render

if TYPE_CHECKING:
    from websockets.sync.server import ServerConnection

INTERVAL = 0.25
"""Seconds between two pictures that the page is sent, at least."""

LOOK = 0.1
"""Seconds after which it is looked whether a page is still there, where there are no new pictures."""

FAREWELL = 2.0
"""Seconds that readers have to take the last picture."""

POINTS = 400
"""Most points of a curve that the page is sent: about as many as it has room for."""


class LivePage:
    """A server for the page, for whoever knows its address.

    Only this machine reaches it, and the address has a random part, without which it answers nothing. The page asks for
    nothing but the websocket it came with. A reader that is slow misses pictures; it never holds up the monitor.

    Parameters
    ----------
    readings : Readings
        What is shown; read by `update` and `close` only, in the thread that calls them.

    Attributes
    ----------
    address : str
        What to open in a browser.
    """

    def __init__(self, readings: Readings) -> None:
        self._readings = readings
        nonce = secrets.token_urlsafe(16)
        html = page(readings, nonce)
        self._changed = threading.Condition()
        self._picture, self._number, self._ended, self._readers = "", 0, False, 0
        self._due = -math.inf
        self._show("connected")
        self._server = Loopback({"": lambda: (html, page_policy(nonce))}, self._serve)
        self.address = self._server.address

    def update(self) -> None:
        """Send the readings to all who look, but not too often."""
        if time.monotonic() >= self._due or self._readings.state != self._state:
            self._show(self._readings.state)

    def stay(self) -> None:
        """Show the last readings as those of a trace that has ended, until Ctrl-C."""
        try:
            self._show("ended")
            threading.Event().wait()
        except KeyboardInterrupt:
            pass

    def close(self) -> None:
        """Send the last readings, and end; a second call does nothing."""
        if self._ended:
            return
        self._ended = True
        self._show("ended")
        with self._changed:
            self._changed.wait_for(lambda: self._readers == 0, FAREWELL)
        self._server.close()

    def __enter__(self) -> LivePage:
        """Return the page."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End."""
        self.close()

    def _show(self, state: str) -> None:
        self._due, self._state = time.monotonic() + INTERVAL, state
        text = json.dumps(picture(self._readings, state), allow_nan=False, separators=(",", ":"))
        with self._changed:
            self._picture, self._number = text, self._number + 1
            self._changed.notify_all()

    def _is_after(self, seen: int) -> bool:
        return self._number != seen

    def _serve(self, connection: ServerConnection) -> None:
        """Send each new picture, or the newest one if several were made meanwhile, until the page is gone."""
        from websockets.exceptions import ConnectionClosed

        seen, ended = 0, False
        with self._changed:
            self._readers += 1
        try:
            while not ended:
                with self._changed:
                    fresh = self._changed.wait_for(partial(self._is_after, seen), LOOK)
                    seen, shown, ended = self._number, self._picture, self._ended
                if fresh:
                    connection.send(shown)
                with suppress(TimeoutError):  # it raises ConnectionClosed if the page is gone
                    connection.recv(timeout=0)
                    connection.close(POLICY_VIOLATION)  # this page says nothing
            connection.close()
        except ConnectionClosed:
            pass
        finally:
            with self._changed:
                self._readers -= 1
                self._changed.notify_all()


def page(readings: Readings, nonce: str) -> str:
    """Return the page as HTML; `nonce` marks its script as ours."""
    about = readings.identity
    output = about.output_port
    facts = {
        "name": about.name,
        "quantity": output.name,
        "unit": output.unit,
        "digits": min(max(math.ceil(-math.log10(output.lsb)), 0), 6),
        "flags": about.flags,
        "initial": readings.initial,
        "limits": readings.limits,
        "rated": readings.rated,
    }
    return render(
        ("sosmith.host", "sosmith.gen.report"),
        "live.html.jinja",
        about=about,
        port=readings.port,
        facts=facts,
        nonce=nonce,
        quantities=[
            output.name,
            *(["wear"] if readings.initial is not None else []),
            *(["rate"] if readings.rated else []),
        ],
        rated=readings.rated,
    )


def picture(readings: Readings, state: str) -> dict[str, Any]:
    """Return what the page shows at this moment, as a tree for JSON.

    Parameters
    ----------
    readings : Readings
        The readings.
    state : str
        ``connected``, ``lost`` or ``ended``.
    """
    about = readings.identity
    curves = [history.thinned(POINTS) for history in readings.histories]
    seconds = curves[0][0] / about.result_rate
    return {
        "state": state,
        "samples": readings.samples,
        "seconds": readings.seconds,
        "alarms": readings.alarms,
        "now": [[one.value, one.wear, one.per_hour, list(one.flags)] for one in readings.now],
        "times": seconds.tolist(),
        "values": [values.tolist() for _, values, _ in curves],
        "rates": [_rates(seconds, values) for _, values, _ in curves],
        "status": [status.tolist() for _, _, status in curves],
        "newest": [
            [alarm.flag, alarm.channel, alarm.sample / about.result_rate, alarm.value]
            for alarm in reversed(readings.newest_alarms)
        ],
    }


def _rates(seconds: npt.NDArray[np.float64], values: npt.NDArray[np.float64]) -> list[float | None]:
    """Change per hour over the last tenth of the points before each one; None where there are not that many."""
    span = max(len(values) // 10, 1)
    changes: npt.NDArray[np.float64] = (values[span:] - values[:-span]) / (seconds[span:] - seconds[:-span]) * 3600
    return [*[None] * min(span, len(values)), *changes.tolist()]
