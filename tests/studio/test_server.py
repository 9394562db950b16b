"""The server of the studio and its command: who is answered, and that all ends with it."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Event
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from tests.interface.small import FILTER
from tests.studio.lives import lives
from tests.studio.sessions import PATIENCE, file_in, proven, session_in, state, until
from websockets.exceptions import ConnectionClosedError, InvalidStatus
from websockets.sync.client import ClientConnection, connect

import sosmith
from sosmith.studio.server import Studio
from sosmith.studio.session import Session


@pytest.fixture(scope="module", name="studio")
def _studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Session, Studio]]:
    with session_in(tmp_path_factory.mktemp("studio")) as session, Studio(session) as studio:
        yield session, studio


def live(studio: Studio, **options: Any) -> ClientConnection:
    """Connect as a page does."""
    return connect(studio.address.replace("http", "ws") + "live", **options)


def refused(address: str, **headers: str) -> int:
    """Return the status with which a request is refused."""
    with pytest.raises(HTTPError) as found:
        urlopen(Request(address, headers=headers))
    found.value.close()
    return found.value.code


def test_only_who_knows_the_address_is_answered(studio: tuple[Session, Studio]) -> None:
    address = studio[1].address
    root = address[: address.index("/", 8) + 1]
    assert root.startswith("http://127.0.0.1:")
    assert len(address) - len(root) > 30
    for path in ("", "live", "report", "0" * 32 + "/", address[len(root) : -2] + "/", address[len(root) :] + "../"):
        assert refused(root + path) == 404
    with pytest.raises(InvalidStatus):
        connect(root.replace("http", "ws") + "live")


def test_no_other_site_is_answered(studio: tuple[Session, Studio]) -> None:
    address = studio[1].address
    port = address.split(":")[2].split("/")[0]
    assert refused(address, Host=f"evil.example:{port}") == 403
    assert refused(address, Origin="http://evil.example") == 403
    assert refused(address, Origin="null") == 403
    with pytest.raises(InvalidStatus, match="403"):
        live(studio[1], origin="http://evil.example")
    with live(studio[1], origin=f"http://127.0.0.1:{port}") as page:
        assert set(json.loads(page.recv(PATIENCE))) == {"you"}
    with urlopen(Request(address, headers={"Host": f"localhost:{port}"})) as answer:
        assert answer.status == 200


def test_it_listens_on_the_loopback_address_only(studio: tuple[Session, Studio]) -> None:
    port = int(studio[1].address.split(":")[2].split("/")[0])
    with pytest.raises(OSError, match=r"refused|unreachable"):
        socket.create_connection(("127.0.0.2", port), timeout=5)


def test_the_page_may_ask_for_nothing_but_its_websocket(studio: tuple[Session, Studio]) -> None:
    with urlopen(studio[1].address) as answer:
        headers, text = answer.headers, answer.read().decode()
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; ")
    assert re.search(r"script-src 'nonce-[\w-]{20,}'; connect-src 'self'$", policy)
    assert (headers["Referrer-Policy"], headers["Cache-Control"]) == ("no-referrer", "no-store")
    assert "http" not in text.replace("http://www.w3.org/2000/svg", "").replace('"https:"', "")


def test_there_is_nothing_to_send_but_messages(studio: tuple[Session, Studio]) -> None:
    port = int(studio[1].address.split(":")[2].split("/")[0])
    connection = http.client.HTTPConnection("127.0.0.1", port)
    connection.request("POST", studio[1].address[studio[1].address.index("/", 8) :], body="a" * 100)
    with pytest.raises(http.client.RemoteDisconnected):
        connection.getresponse()
    connection.close()


@pytest.mark.parametrize("text", ["{", "[]", '{"do": "exit"}', '{"do": "trace", "source": "/etc/passwd"}'])
def test_who_says_what_no_page_says_is_left(studio: tuple[Session, Studio], text: str) -> None:
    with live(studio[1]) as page:
        page.send(text)
        with pytest.raises(ConnectionClosedError):
            list(page)
        assert page.close_code == 1008


def test_every_page_is_told_of_a_change(studio: tuple[Session, Studio]) -> None:
    with live(studio[1]) as first, live(studio[1]) as second:
        ids = {json.loads(page.recv(PATIENCE))["you"] for page in (first, second)}
        assert len(ids) == 2
        first.send(json.dumps({"do": "change", "changes": {"filter.cutoff": 77.0}, "n": 1}))
        for page in (first, second):
            known: dict[str, Any] = {}
            while known.get("preview", {}).get("spec", {}).get("filter", {}).get("cutoff") != 77.0:
                known |= json.loads(page.recv(PATIENCE))
            assert known["preview"]["client"] in ids


def test_every_page_is_told_of_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with session_in(tmp_path) as session:
        wait = session.wait

        def late(seen: int, left: Event) -> tuple[int, dict[str, Any], bool]:
            """Wait as before, but tell of the end only when the server has begun to close, as on a busy machine."""
            version, news, ended = wait(seen, left)
            time.sleep(0.3 if ended else 0.0)
            return version, news, ended

        monkeypatch.setattr(session, "wait", late)
        studio = Studio(session)
        with live(studio) as first, live(studio) as second:
            for page in (first, second):
                assert set(json.loads(page.recv(PATIENCE))) == {"you"}
            studio.close()
            for page in (first, second):
                assert [json.loads(text) for text in page][-1].get("ended")


def test_a_port_that_is_taken_is_refused(studio: tuple[Session, Studio]) -> None:
    port = int(studio[1].address.split(":")[2].split("/")[0])
    with pytest.raises(sosmith.SpecificationError, match=rf"^--port must be free, not {port}: Address already in use$"):
        Studio(studio[0], port)


def command(*arguments: str) -> subprocess.Popen[str]:
    """Run the command, without a browser."""
    # A shell makes what it runs in the background ignore SIGINT, this test included.
    line = ["env", "--default-signal=INT", sys.executable, "-m", "sosmith.cli", "studio", *arguments, "--no-browser"]
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def children(pid: int) -> set[int]:
    """Ids of all processes that descend from one."""
    parents = {}
    for each in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(each.name)] = int((each / "stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, IndexError):
            continue  # it has ended meanwhile
    found: set[int] = set()
    while more := {each for each, parent in parents.items() if parent in {pid, *found}} - found:
        found |= more
    return found


@pytest.mark.parametrize(
    ("how", "status"),
    [
        (signal.SIGINT, 130),
        pytest.param(signal.SIGTERM, 143, marks=pytest.mark.slow),
        pytest.param(signal.SIGKILL, -9, marks=pytest.mark.slow),
    ],
)
def test_all_processes_end_with_the_command(tmp_path: Path, how: signal.Signals, status: int) -> None:
    slow = FILTER | {"filter": FILTER["filter"] | {"order": 9, "cutoff": 3.0}, "hardware": {}}
    with command(str(file_in(tmp_path, sosmith.Specification.load(slow).toml()))) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        address = process.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", address)
        with connect(address.replace("http", "ws") + "live") as page:
            known: dict[str, Any] = {}
            while known.get("proof", {}).get("step") in {None, "beginning"}:
                known |= json.loads(page.recv(PATIENCE))
            family = children(process.pid)
            assert len(family) >= 3  # the fork server, and a process each for preview and proof
            os.kill(process.pid, how)
            try:
                assert process.wait(PATIENCE) == status
            finally:
                process.kill()
        assert process.stderr.read().startswith(f"sosmith: the studio saves to {tmp_path}/plain.toml; Ctrl-C ends it\n")
    for _ in range(1200):
        if not any(map(lives, family)):
            break
        signal.sigtimedwait([], 0.05)
    assert [pid for pid in family if lives(pid)] == []


def test_a_specification_that_cannot_be_read_is_refused_at_once(tmp_path: Path) -> None:
    with command(str(tmp_path / "none.toml")) as process:
        output, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, output) == (2, "")
    told = "the specification must be a readable file, not: no such file or directory"
    assert errors == f"sosmith: error: {tmp_path}/none.toml: {told}\n"


@pytest.mark.slow
def test_a_cosimulation_ends_in_a_report_under_the_same_address(studio: tuple[Session, Studio]) -> None:
    session, server = studio
    proven(session)
    session.handle({"do": "trace", "source": "noise", "seconds": 0.5, "report": True}, "page")
    known = until(session, lambda known: known["report"]["state"] in {"done", "refused"})
    assert known["report"] | {"simulator": "verilator"} == {
        "state": "done",
        "old": False,
        "passed": True,
        "shortfalls": [],
        "samples": 500,
        "simulator": "verilator",
        "bit_exact": True,
    }
    with urlopen(server.address + "report") as answer:
        assert "script-src 'unsafe-inline'" in answer.headers["Content-Security-Policy"]
        assert "connect-src" not in answer.headers["Content-Security-Policy"]
        assert "<title>plain" in answer.read().decode()


@pytest.mark.slow
def test_a_stopped_cosimulation_leaves_no_simulator(studio: tuple[Session, Studio]) -> None:
    session, _ = studio
    proven(session)
    session.handle({"do": "change", "changes": {"filter.cutoff": 121.0}}, "page")
    session.handle({"do": "trace", "source": "noise", "seconds": 900.0, "report": True}, "page")
    until(session, lambda known: "of" in known["report"].get("step", "") and children_of(session))
    family = children_of(session)
    session.handle({"do": "stop"}, "page")
    assert state(session)["report"] == {"state": "none"}
    assert [pid for pid in family if lives(pid)] == []


def children_of(session: Session) -> set[int]:
    """Ids of the processes that a session's own have started."""
    return {child for pid in session.processes for child in children(pid)}
