"""Pages of ours among strangers: nobody is let in, nothing ends, and nothing grows, whatever is said to them."""

from __future__ import annotations

import logging
import os
import random
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.request import urlopen

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from sosmith.host.page import LivePage
from sosmith.host.readings import Readings
from sosmith.studio.server import Studio
from tests.edge.pages import hostile_browser as browser
from tests.host.lines import device_of
from tests.interface.small import instrument_design
from tests.studio.sessions import session_in

PATIENCE = 60.0
"""Seconds for an answer, on however busy a machine."""

LANES = 3
"""Threads of the studio that begin with the first job of their kind, and stay."""

GROWTH = 150.0
"""MB by which the process of a server may grow, all that it keeps for a while included."""


@dataclass(frozen=True)
class Heard:
    """What became of hostile messages to a page.

    Attributes
    ----------
    messages : int
        Their number.
    findings : tuple of str
        What must not be.
    """

    messages: int
    findings: tuple[str, ...]


@contextmanager
def page_of(name: str) -> Iterator[str]:
    """Serve the studio, or the page of a monitor; give its address."""
    if name == "studio":
        with tempfile.TemporaryDirectory() as folder, session_in(Path(folder)) as session, Studio(session) as studio:
            yield studio.address
    else:
        with LivePage(Readings(device_of(instrument_design())._identity, None, "port")) as page:
            yield page.address


def attacked(name: str, seed: int, count: int) -> Heard:
    """Say so many hostile things to a page, and see that it is as before."""
    rng, findings = random.Random(seed), list[str]()
    with watched(findings), page_of(name) as address:
        good(address)
        threads, before = threading.active_count(), memory()
        for n in range(count):
            try:
                findings += _one(name, address, rng)
            except Exception as error:
                findings.append(f"message {n} of seed {seed}: {type(error).__name__}: {error}")
        good(address)
        end = time.monotonic() + PATIENCE
        while threading.active_count() > threads + LANES and time.monotonic() < end:
            time.sleep(0.05)
        if threading.active_count() > threads + LANES:
            findings.append(f"{threading.active_count() - threads} threads are left")
        if memory() - before > GROWTH:
            findings.append(f"the memory must grow by at most {GROWTH:g} MB, not by {memory() - before:.0f} MB")
    return Heard(count, tuple(findings))


def _one(name: str, address: str, rng: random.Random) -> list[str]:
    """Say one thing; return what is wrong with the answer."""
    kind = rng.random()
    if kind < 0.5:
        return _request(address, rng)
    if kind < 0.65:
        return _frames(address, rng)
    with suppress(ConnectionClosed), connect(address.replace("http", "ws") + "live", max_size=None) as live:
        live.send(browser.message(rng))
        live.recv(PATIENCE)
    return []


def _request(address: str, rng: random.Random) -> list[str]:
    data = browser.requests(address, rng)
    answer = exchanged(address, data)
    status, token = answer[:12].removeprefix(b"HTTP/1.1 "), address.split("/")[3].encode()
    # A request for the right place and host that only the connection's end cuts off is none.
    if status in {b"200", b"101"} or (answer and not status[:1].isdigit()):
        return [f"{data[:300]!r} must be refused, not answered by {answer[:100]!r}"]
    return [f"{data[:300]!r} must not be told the secret"] if token in answer else []


def exchanged(address: str, data: bytes) -> bytes:
    """Send bytes and nothing more; return all that comes back."""
    port = int(address.split(":")[2].split("/", maxsplit=1)[0])
    answer = b""
    with suppress(ConnectionError), socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as line:
        with suppress(ConnectionError):
            line.sendall(data)
            line.shutdown(socket.SHUT_WR)
        while part := line.recv(65536):
            answer += part
    return answer


def _frames(address: str, rng: random.Random) -> list[str]:
    with suppress(ConnectionError), browser.opened(address) as live:
        live.sendall(browser.frames(rng))
        live.shutdown(socket.SHUT_WR)
        while live.recv(65536):
            pass
    return []


def good(address: str) -> None:
    """See that an honest browser has what it wants, once those before it are seen to have gone."""
    with urlopen(address, timeout=PATIENCE) as answer:
        assert answer.status == 200
    end = time.monotonic() + PATIENCE
    while True:
        try:
            with connect(address.replace("http", "ws") + "live") as live:
                assert live.recv(PATIENCE)
                return
        except ConnectionClosed:
            if time.monotonic() > end:
                raise
            time.sleep(0.1)


@contextmanager
def watched(findings: list[str]) -> Iterator[None]:
    """Note what is logged, and what processes write to stderr: neither must be."""

    class Noted(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            findings.append(record.getMessage())

    log, noted = logging.getLogger("sosmith.host.loopback"), Noted()
    log.addHandler(noted)
    with tempfile.TemporaryFile() as told:
        kept = os.dup(2)
        os.dup2(told.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            log.removeHandler(noted)
            told.seek(0)
            if said := told.read():
                findings.append(f"on stderr: {said[-500:].decode(errors='replace')}")


def memory() -> float:
    """Return the memory of this process in MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
