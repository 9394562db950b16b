"""A server on the loopback address for pages of ours: who is answered, with what headers, and what is taken."""

from __future__ import annotations

import json
import logging
import os
import secrets
import threading
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sosmith.model.errors import SpecificationError

if TYPE_CHECKING:
    from websockets.http11 import Request, Response
    from websockets.sync.server import ServerConnection

MAX_SOCKETS = 32
"""Most websockets at once; a page has one."""

MAX_CONNECTIONS = 128
"""Most connections at once, whatever they ask for: with more, files of the monitor could not be opened any more."""

OPEN_TIMEOUT = 5.0
"""Seconds within which a request must be complete."""

MAX_MESSAGE = 1 << 10
"""Longest message in bytes from a page that has nothing to say."""

POLICY_VIOLATION = 1008
"""Code with which a websocket is closed that says what no page of ours says."""

_NOT_HERE = "There is nothing here.\n"

_NOTHING = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; "
)
REPORT_POLICY = _NOTHING + "script-src 'unsafe-inline'"
"""Content policy of a report, which asks for nothing."""


_FAULT = 1011
"""Code with which a websocket is closed that a fault of our own has ended."""

_log = logging.getLogger(__name__)


class MessageError(Exception):
    """A page has said what no page of ours says."""


def page_policy(nonce: str) -> str:
    """Return the content policy of a page whose script is marked by `nonce`, and asks for its websocket only."""
    return _NOTHING + f"script-src 'nonce-{nonce}'; connect-src 'self'"


class Loopback:
    """Serves pages and one kind of websocket to whoever knows the address, on this machine only.

    A request is answered if it is for this host by an address of the loopback, from no other site, and has the random
    part of the address in its path.

    Parameters
    ----------
    pages : mapping of str to callable
        Each gives HTML and its content policy, or None if there is nothing yet; by the path after the random part.
    talk : callable
        Serves one websocket, at the path ``live``; called in a thread of its own.
        A fault of ours in either is logged by a sentence, and answered by the status 500, or by closing with 1011.
    port : int
        TCP port; 0 for a free one.
    max_message : int
        Longest message in bytes that a page may send.

    Attributes
    ----------
    address : str
        What to open in a browser.

    Raises
    ------
    SpecificationError
        If the port is taken.
    """

    def __init__(
        self,
        pages: Mapping[str, Callable[[], tuple[str, str] | None]],
        talk: Callable[[ServerConnection], None],
        port: int = 0,
        max_message: int = MAX_MESSAGE,
    ) -> None:
        from websockets.sync.server import ServerConnection, serve

        check_free = self._check_free

        class Limited(ServerConnection):
            def __init__(self, *given: Any, **options: Any) -> None:
                check_free()
                super().__init__(*given, **options)

        self._pages, self._talk = pages, talk
        self._lock, self._threads = threading.Lock(), set[threading.Thread]()
        self._token = secrets.token_urlsafe(24)
        self._free = threading.BoundedSemaphore(MAX_SOCKETS)
        # What a browser or a stranger does to a connection is of no interest to who reads the terminal.
        silent = logging.Logger("sosmith.host.loopback", logging.CRITICAL + 1)
        try:
            self._server = serve(
                self._serve,
                "127.0.0.1",
                port,
                process_request=self._answer,
                max_size=max_message,
                open_timeout=OPEN_TIMEOUT,
                close_timeout=1,
                create_connection=Limited,
                server_header=None,
                logger=silent,
            )
        except OSError as error:
            raise SpecificationError(f"--port must be free, not {port}: {os.strerror(error.errno or 0)}") from None
        taken = self._server.socket.getsockname()[1]
        self._hosts = {f"127.0.0.1:{taken}", f"localhost:{taken}"}
        self.address = f"http://127.0.0.1:{taken}/{self._token}/"
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End all connections, and the server."""
        self._server.shutdown()
        self._thread.join()

    def _check_free(self) -> None:
        """Refuse one connection too many, which closes it; called in the thread of each."""
        with self._lock:
            self._threads = {thread for thread in self._threads if thread.is_alive()} | {threading.current_thread()}
            if len(self._threads) > MAX_CONNECTIONS:
                raise ConnectionRefusedError

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for a page; let one for the websocket pass."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            # a name that another machine has made to point here
            return connection.respond(403, "The host must be 127.0.0.1 or localhost, with the port of this page.\n")
        if any(origin.removeprefix("http://") not in self._hosts for origin in origins):
            return connection.respond(403, "The origin must be this page.\n")
        if getattr(request, "method", "GET") != "GET":  # older versions of websockets know no other
            return connection.respond(405, "The method must be GET.\n")
        place = request.path.encode()
        if secrets.compare_digest(place, f"/{self._token}/live".encode()):
            return None
        for name, render in self._pages.items():
            if secrets.compare_digest(place, f"/{self._token}/{name}".encode()):
                return self._page(connection, name, render)
        return connection.respond(404, _NOT_HERE)

    def _page(self, connection: ServerConnection, name: str, render: Callable[[], tuple[str, str] | None]) -> Response:
        try:
            page = render()
        except Exception as error:
            _tell_fault(f"the page {name or 'itself'}", error)
            return connection.respond(500, "A fault of this program, not of the request: its terminal tells more.\n")
        return connection.respond(404, _NOT_HERE) if page is None else _page(connection, *page)

    def _serve(self, connection: ServerConnection) -> None:
        if not self._free.acquire(blocking=False):
            connection.close(POLICY_VIOLATION, "too many pages")
            return
        try:
            self._talk(connection)
        except Exception as error:
            _tell_fault("a message of a page", error)
            connection.close(_FAULT)
        finally:
            self._free.release()


def take_messages(connection: ServerConnection, take: Callable[[Any], None]) -> None:
    """Hand each message of a page to `take`, until it leaves or says what it never says: that ends the connection.

    Parameters
    ----------
    connection : ServerConnection
        The websocket.
    take : callable
        Takes a tree of JSON; raises `MessageError` for one that no page of ours sends. What else it raises is a fault
        of its own, and is passed on.
    """
    from websockets.exceptions import ConnectionClosed

    with suppress(ConnectionClosed):
        for text in connection:
            try:
                take(_tree(text))
            except MessageError:
                connection.close(POLICY_VIOLATION)


def _tree(text: str | bytes) -> Any:
    """Read JSON."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):  # bytes that are no text and numbers of too many digits included
        raise MessageError from None


def _tell_fault(what: str, error: Exception) -> None:
    """Log a fault of our own, and where it is, in one sentence."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    _log.error(
        "%s must be answered, not end in a fault of this program, %s in %s, line %s: please report it",
        what,
        ascii(f"{type(error).__name__}: {error}")[1:-1],
        Path(place.filename).name,
        place.lineno,
    )


def _page(connection: ServerConnection, html: str, policy: str) -> Response:
    response = connection.respond(200, html)
    del response.headers["Content-Type"]
    response.headers["Content-Type"] = "text/html; charset=utf-8"
    response.headers["Content-Security-Policy"] = policy
    response.headers["Referrer-Policy"] = "no-referrer"
    response.headers["X-Content-Type-Options"] = "nosniff"
    response.headers["Cache-Control"] = "no-store"
    return response
