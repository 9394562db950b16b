"""The server of the studio: the page and its websocket, for whoever knows the address, on this machine only."""

from __future__ import annotations

import json
import secrets
import threading
import time
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING, Any

from sosmith import ChainSpecification, Specification, __version__
from sosmith.host.loopback import REPORT_POLICY, Loopback, page_policy, take_messages
from sosmith.model.templates import render
from sosmith.studio.session import MAX_FILE, Session

if TYPE_CHECKING:
    from websockets.sync.server import ServerConnection

FAREWELL = 2.0
"""Seconds that pages have at most, all together, to hear that it is the end."""


def _choices() -> dict[str, Any]:
    """Return the names among which the form chooses, and what a stage of each kind knows."""
    kinds = ChainSpecification.kinds()
    return {
        **Specification.choices(),
        "stage.kind": tuple(kinds),
        "kinds": kinds,
        "families": {kind: ChainSpecification.families(kind) for kind in kinds},
    }


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
        self._session = session
        nonce = secrets.token_urlsafe(16)
        html = render(
            ("sosmith.studio.page", "sosmith.gen.report"),
            "studio.html.jinja",
            nonce=nonce,
            name=session.file.name,
            version=__version__,
            choices=_choices(),
        )
        pages = {"": lambda: (html, page_policy(nonce)), "report": self._report}
        self._server = Loopback(pages, self._serve, port, max_message=4 * MAX_FILE)
        self.address = self._server.address
        self._tellers: set[threading.Thread] = set()

    def close(self) -> None:
        """End the session and the server."""
        self._session.close()
        # Pages are told that it is the end, which they cannot be once the server has closed their connections. A page
        # that does not listen is not waited for.
        end = time.monotonic() + FAREWELL
        for teller in self._tellers.copy():
            teller.join(max(0.0, end - time.monotonic()))
        self._server.close()

    def __enter__(self) -> Studio:
        """Return the studio."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End."""
        self.close()

    def _report(self) -> tuple[str, str] | None:
        """Return the report and its content policy, if there is one."""
        with suppress(OSError):
            return self._session.report.read_text(encoding="utf-8"), REPORT_POLICY
        return None

    def _serve(self, connection: ServerConnection) -> None:
        """Do what a page says, and tell it what is new."""
        from websockets.exceptions import ConnectionClosed

        client, left = secrets.token_hex(8), threading.Event()
        with suppress(ConnectionClosed):
            connection.send(json.dumps({"you": client}))
            teller = threading.Thread(target=self._tell, args=(connection, left), daemon=True)
            teller.start()
            self._tellers.add(teller)
            take_messages(connection, lambda message: self._session.handle(message, client))
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
