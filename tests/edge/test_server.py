"""Both pages: strangers, other sites and bad messages are answered at one place, and none of them is heard."""

from __future__ import annotations

import json
import os
import random
import re
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from sosmith.host.loopback import MAX_SOCKETS, POLICY_VIOLATION, Loopback, take_messages
from sosmith.host.page import LivePage
from sosmith.host.readings import Readings
from sosmith.studio.server import Studio
from tests.host.lines import device_of
from tests.interface.small import instrument_design
from tests.studio.sessions import session_in, until


@pytest.fixture(scope="module", name="studio")
def _studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with session_in(tmp_path_factory.mktemp("studio")) as session, Studio(session) as studio:
        yield studio.address


@pytest.fixture(name="address", params=["studio", "monitor"])
def _address(request: pytest.FixtureRequest, studio: str) -> Iterator[str]:
    if request.param == "studio":
        yield studio
        return
    with LivePage(Readings(device_of(instrument_design())._identity, None, "port")) as page:
        yield page.address


def status(address: str, **headers: str) -> int:
    try:
        with urlopen(Request(address, headers=headers)) as answer:
            return int(answer.status)
    except HTTPError as error:
        error.close()
        return error.code


def test_no_other_host_or_site_is_answered(address: str) -> None:
    port = address.split(":")[2].split("/", maxsplit=1)[0]
    live = address.replace("http", "ws") + "live"
    assert status(address) == status(address, Host=f"localhost:{port}", Origin=f"http://localhost:{port}") == 200
    for host in (f"evil.example:{port}", "127.0.0.1", "localhost:1", "", f"127.0.0.1.evil.example:{port}"):
        assert status(address, Host=host) in {400, 403}
    for origin in ("http://evil.example", "null", f"https://127.0.0.1:{port}", f"http://127.0.0.1:{port}.evil.example"):
        assert status(address, Origin=origin) == 403
        with pytest.raises(InvalidStatus, match="403"):
            connect(live, origin=origin)  # type: ignore[arg-type]


def test_a_page_may_ask_for_its_websocket_only(address: str) -> None:
    with urlopen(address) as answer:
        policy = answer.headers["Content-Security-Policy"]
    assert re.fullmatch(r"default-src 'none'; .*script-src 'nonce-[\w-]{20,}'; connect-src 'self'", policy)


def test_there_are_only_so_many_websockets(address: str) -> None:
    live = address.replace("http", "ws") + "live"
    with ExitStack() as pages:
        for _ in range(MAX_SOCKETS):
            pages.enter_context(connect(live)).recv(20)  # it is served now
        with connect(live) as one_more:
            with pytest.raises(ConnectionClosed):
                one_more.recv(20)
            assert one_more.close_code == POLICY_VIOLATION


BAD = [
    b"\xff\x00",
    "[" * 100_000,
    '{"do": []}',
    '{"do": {}}',
    '{"do": "change", "n": 1e999}',
    '{"do": "change", "changes": {"a": [[]]}, "n": {}}',
    '{"do": "text", "text": 1}',
    '{"do": "trace", "source": ["a"]}',
    '{"do": "trace", "source": "x", "csv": "\\ud800"}',
    '{"do": "trace", "source": "x", "csv": 5}',
    '{"do": "calibration", "csv": "\\udfff"}',
    "9" * 5000,
    '{"do": "text", "text": "\\ud800"}',
    '{"do": "change", "changes": {"name": "\\ud800"}}',
]


@pytest.mark.parametrize("message", BAD, ids=range(len(BAD)))
def test_what_no_page_says_ends_its_connection_without_a_traceback(
    studio: str, message: str | bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    with connect(studio.replace("http", "ws") + "live", max_size=None) as page:
        page.send(message)
        with pytest.raises(ConnectionClosed):
            list(page)
        assert page.close_code == POLICY_VIOLATION
    assert capfd.readouterr().err == ""


def test_random_messages(studio: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    chance = random.Random(1)
    values = [None, True, -1, 1e308, "", "\udc00", [], {}, {"a": {}}, "x" * 70_000]
    for _ in range(60):
        made = {key: chance.choice(values) for key in ("n", "changes", "text", "source", "seconds", "csv", "on")}
        made["do"] = chance.choice([*values[:9], "change", "trace", "calibration", "realizations", "text"])
        with connect(studio.replace("http", "ws") + "live", max_size=None) as page:
            page.send(json.dumps(made))
    assert status(studio) == 200
    assert "Traceback" not in capfd.readouterr().err


class _Broken:
    """A session or a reading with a fault of its own."""

    def __getattr__(self, name: str) -> object:
        raise KeyError(f"a\n\x1b[2J{name}")


def told(caplog: pytest.LogCaptureFixture) -> str:
    """Return the only sentence that was logged, without the number of a line."""
    (sentence,) = caplog.messages
    return re.sub(r"line \d+", "line N", sentence)


def test_a_fault_of_our_own_in_a_page_is_told(caplog: pytest.LogCaptureFixture) -> None:
    broken = _Broken()
    pages = {"": lambda: broken.page, "other": lambda: ("<p>", "default-src 'none'")}
    server = Loopback(pages, lambda connection: None)  # type: ignore[arg-type]
    try:
        assert (status(server.address), status(server.address + "other")) == (500, 200)
    finally:
        server.close()
    assert told(caplog) == (
        "the page itself must be answered, not end in a fault of this program, KeyError: 'a\\\\n\\\\x1b[2Jpage' "
        "in test_server.py, line N: please report it"
    )


def test_a_fault_of_our_own_in_a_message_is_told(caplog: pytest.LogCaptureFixture) -> None:
    def take(message: object) -> None:
        json.loads("{")  # a ValueError, as those of bad messages

    server = Loopback({}, lambda connection: take_messages(connection, take))
    try:
        with connect(server.address.replace("http", "ws") + "live") as page:
            page.send("{}")
            with pytest.raises(ConnectionClosed):
                page.recv(20)
            assert page.close_code == 1011
    finally:
        server.close()
    assert told(caplog) == (
        "a message of a page must be answered, not end in a fault of this program, JSONDecodeError: Expecting property "
        "name enclosed in double quotes: line N column 2 (char 1) in decoder.py, line N: please report it"
    )


def test_a_dropped_file_that_the_disk_does_not_take_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with session_in(tmp_path) as session:
        monkeypatch.setattr(Path, "write_bytes", lambda *_: os.open(tmp_path / "none" / "none", os.O_RDONLY))
        for message, topic in (({"do": "calibration"}, "calibration"), ({"do": "trace", "source": "x"}, "trace")):
            session.handle(message | {"csv": "a"}, "page")
            known = until(session, lambda known, topic=topic: known[topic]["state"] == "refused")  # type: ignore[misc]
            assert "must be a folder that can be written, not: No such file or directory" in known[topic]["error"]
