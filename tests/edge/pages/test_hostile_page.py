"""Pages of ours among strangers, a part in every run; `python -m benchmarks.edge` says ten thousand things to each."""

from __future__ import annotations

import socket
from contextlib import ExitStack
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from sosmith.host import loopback
from sosmith.host.loopback import MAX_CONNECTIONS, MAX_SOCKETS, POLICY_VIOLATION
from tests.edge.pages.hostile_page import attacked, exchanged, good, page_of


@pytest.mark.parametrize("name", ["monitor", "studio"])
def test_hostile_messages(name: str) -> None:
    assert attacked(name, 1, 40).findings == ()


def test_a_page_is_read_and_nothing_else() -> None:
    with page_of("monitor") as address:
        for method in ("HEAD", "POST", "OPTIONS"):
            with pytest.raises(HTTPError, match="405") as refused:
                urlopen(Request(address, method=method))
            refused.value.close()


def test_requests_that_never_end_leave_room_and_are_only_so_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slow connections are open side by side; beyond the limit, one more is closed at once, not served by a thread."""
    monkeypatch.setattr(loopback, "OPEN_TIMEOUT", 600.0)
    with page_of("monitor") as address, ExitStack() as slow:
        place = ("127.0.0.1", int(address.split(":")[2].split("/", maxsplit=1)[0]))
        lines = []
        for n in range(2 * MAX_CONNECTIONS):
            lines.append(slow.enter_context(socket.create_connection(place, timeout=30)))
            lines[-1].sendall(b"GET / HTTP/1.1\r\nHost: ")
            if n == MAX_CONNECTIONS // 2:
                assert urlopen(address).status == 200
        answers = []
        for line in lines[-10:]:
            try:
                answers.append(line.recv(100))
            except ConnectionError:
                answers.append(b"")
        assert answers == [b""] * 10
        for line in lines:
            line.close()
        assert exchanged(address, b"GET / HTTP/1.0\r\n\r\n")[:12] in {b"HTTP/1.1 403", b""}


def test_a_page_that_is_opened_again_and_again() -> None:
    """Without new pictures, as when the trace has ended: pages that have gone do not count."""
    with page_of("monitor") as address:
        for _ in range(2 * MAX_SOCKETS):
            good(address)


def test_a_page_that_says_something_to_the_monitor_is_closed() -> None:
    with page_of("monitor") as address, connect(address.replace("http", "ws") + "live") as page:
        page.recv(60)
        page.send("{}")
        with pytest.raises(ConnectionClosed):
            page.recv(60)
        assert page.close_code == POLICY_VIOLATION
