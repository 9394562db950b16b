"""The server of the studio: the page and its websocket, for whoever knows the address, on this machine only."""

from __future__ import annotations

import json
import logging
import os
import secrets
import threading
import time
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING

from sosmith import Specification, SpecificationError, __version__
from sosmith.model.templates import render
from sosmith.studio.session import MAX_FILE, MessageError, Session

if TYPE_CHECKING:
    from websockets.http11 import Request, Response
    from websockets.sync.server import ServerConnection

POLICY_VIOLATION = 1008
"""Code with which a websocket is closed that says what no page of ours says."""

FAREWELL = 2.0
"""Seconds that pages have at most, all together, to hear that it is the end."""


class Studio:
    """Serves a session.

    Parameters
    ----------
    session : Session
        What is being designed.
    port : int
        TCP port; 0 for a free one.

    Attributes
    ----------
    address : str
        What to open in a browser.

    Raises
    ------
    SpecificationError
        If the port is taken.
    """

    def __init__(self, session: Session, port: int = 0) -> None:
        from websockets.sync.server import serve

        self._session = session
        self._token, nonce = secrets.token_urlsafe(24), secrets.token_urlsafe(16)
        self._html = render(
            ("sosmith.studio", "sosmith.gen.report"),
            "studio.html.jinja",
            nonce=nonce,
            name=session.file.name,
            version=__version__,
            choices=Specification.choices(),
        )
        only = (
            "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; "
            "frame-ancestors 'none'; "
        )
        self._policy = only + f"script-src 'nonce-{nonce}'; connect-src 'self'"
        self._report_policy = only + "script-src 'unsafe-inline'"
        # What a browser or a stranger does to a connection is of no interest to who reads the terminal.
        silent = logging.Logger("sosmith.studio", logging.CRITICAL + 1)
        try:
            self._server = serve(
                self._serve,
                "127.0.0.1",
                port,
                process_request=self._answer,
                max_size=4 * MAX_FILE,
                close_timeout=1,
                server_header=None,
                logger=silent,
            )
        except OSError as error:
            raise SpecificationError(f"--port must be free, not {port}: {os.strerror(error.errno or 0)}") from None
        taken = self._server.socket.getsockname()[1]
        self._hosts = {f"127.0.0.1:{taken}", f"localhost:{taken}"}
        self.address = f"http://127.0.0.1:{taken}/{self._token}/"
        self._tellers: set[threading.Thread] = set()
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the session and the server."""
        self._session.close()
        # Pages are told that it is the end, which they cannot be once the server has closed their connections. A page
        # that does not listen is not waited for.
        end = time.monotonic() + FAREWELL
        for teller in self._tellers.copy():
            teller.join(max(0.0, end - time.monotonic()))
        self._server.shutdown()
        self._thread.join()

    def __enter__(self) -> Studio:
        """Return the studio."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End."""
        self.close()

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for the page or the report; let one for the websocket pass."""
        if request.headers.get("Host") not in self._hosts:
            # a name that another machine has made to point here
            return connection.respond(403, "The host must be 127.0.0.1 or localhost, with the port of the studio.\n")
        origin = request.headers.get("Origin")
        if origin is not None and origin.removeprefix("http://") not in self._hosts:
            return connection.respond(403, "The origin must be the studio's own page.\n")
        place = request.path.encode()

        def asked(name: str) -> bool:
            return secrets.compare_digest(place, f"/{self._token}/{name}".encode())

        if asked("live"):
            return None
        if asked(""):
            return self._page(connection, self._html, self._policy)
        if asked("report"):
            with suppress(OSError):
                return self._page(connection, self._session.report.read_text(encoding="utf-8"), self._report_policy)
        return connection.respond(404, "There is nothing here.\n")

    def _page(self, connection: ServerConnection, html: str, policy: str) -> Response:
        response = connection.respond(200, html)
        del response.headers["Content-Type"]
        response.headers["Content-Type"] = "text/html; charset=utf-8"
        response.headers["Content-Security-Policy"] = policy
        response.headers["Referrer-Policy"] = "no-referrer"
        response.headers["X-Content-Type-Options"] = "nosniff"
        response.headers["Cache-Control"] = "no-store"
        return response

    def _serve(self, connection: ServerConnection) -> None:
        """Do what a page says, and tell it what is new."""
        from websockets.exceptions import ConnectionClosed

        client, left = secrets.token_hex(8), threading.Event()
        with suppress(ConnectionClosed):
            connection.send(json.dumps({"you": client}))
            teller = threading.Thread(target=self._tell, args=(connection, left), daemon=True)
            teller.start()
            self._tellers.add(teller)
            for text in connection:
                try:
                    self._session.handle(json.loads(text), client)
                except (MessageError, ValueError):
                    connection.close(POLICY_VIOLATION)
        left.set()
        self._session.nudge()

    def _tell(self, connection: ServerConnection, left: threading.Event) -> None:
        """Send what is new, until the session or the connection ends."""
        from websockets.exceptions import ConnectionClosed

        seen, ended = 0, False
        with suppress(ConnectionClosed):
            while not ended:
                seen, news, ended = self._session.wait(seen, left)
                connection.send(
                    json.dumps(news | ({"ended": True} if ended else {}), allow_nan=False, separators=(",", ":"))
                )
            connection.close()
        self._tellers.discard(threading.current_thread())
