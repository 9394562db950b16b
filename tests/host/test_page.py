"""The live view in a browser: who may see it, what it is sent, and that the page shows it and asks for nothing else."""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Iterator
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from tests.host.browser import BROWSER, Tab, browser
from tests.host.gauges import feed, gauge
from tests.host.lines import device_of
from tests.interface.small import filter_design
from tests.suite.extras import needs
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from sosmith.host.alarms import Alarm
from sosmith.host.page import LivePage, picture
from sosmith.host.page import page as html
from sosmith.host.readings import Readings


@pytest.fixture
def live() -> Iterator[tuple[Readings, LivePage]]:
    readings = gauge()
    with LivePage(readings) as page:
        yield readings, page


def test_what_the_page_is_sent() -> None:
    readings = gauge()
    assert picture(readings, "connected")["now"] == []
    feed(readings)
    readings.alarm(Alarm("wear_critical", 1, 200, 3.25, 1002.0))
    sent = picture(readings, "lost")
    assert {key: sent[key] for key in ("state", "samples", "seconds", "alarms")} == {
        "state": "lost",
        "samples": 1000,
        "seconds": 10.0,
        "alarms": 1,
    }
    assert sent["newest"] == [["wear_critical", 1, 2.0, 3.25]]
    (value, wear, rate, flags), second = sent["now"]
    assert (value, wear, rate) == pytest.approx((1.0999, 0.0999, 36.0))
    assert flags == []
    assert second[:2] == [2.0, 1.0]
    assert len(sent["times"]) == len(sent["values"][0]) == len(sent["rates"][0]) == len(sent["status"][0]) == 400
    assert (sent["times"][-1], sent["values"][0][-1]) == (9.99, 1.0999)
    assert sent["rates"][0][:40] == [None] * 40
    assert sent["rates"][0][40:] == pytest.approx([36.0] * 360)
    assert sum(sent["status"][1]) == 8


def test_it_stays_until_ctrl_c(live: tuple[Readings, LivePage]) -> None:
    readings, page = live
    feed(readings)

    def browse() -> None:
        with connect(page.address.replace("http", "ws") + "live") as reader:
            while json.loads(reader.recv())["state"] != "ended":
                pass
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)

    browser = threading.Thread(target=browse)
    browser.start()
    page.stay()
    browser.join()


def test_a_plain_filter_has_no_rate() -> None:
    about = device_of(filter_design())._identity
    assert 'value="1" data-what="rate"' not in html(Readings(about, None, "port"), "once")
    assert 'data-what="rate"' in html(gauge(), "once")


def test_only_who_knows_the_address_sees_anything(live: tuple[Readings, LivePage]) -> None:
    address = live[1].address
    root = address[: address.index("/", 8) + 1]
    assert root.startswith("http://127.0.0.1:")
    assert len(address) - len(root) > 30
    for path in ("", "live", "0" * 32 + "/", address[len(root) : -2] + "/"):
        with pytest.raises(HTTPError) as refused:
            urlopen(root + path)
        assert refused.value.code == 404
        refused.value.close()
    with pytest.raises(InvalidStatus):
        connect(root.replace("http", "ws") + "live")


def test_the_page_may_ask_for_nothing_but_its_websocket(live: tuple[Readings, LivePage]) -> None:
    with urlopen(live[1].address) as answer:
        headers, text = answer.headers, answer.read().decode()
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; ")
    assert "; script-src 'nonce-" in policy
    assert (headers["Referrer-Policy"], headers["Cache-Control"]) == ("no-referrer", "no-store")
    assert "http" not in text.replace("http://www.w3.org/2000/svg", "").replace('"https:"', "")


def test_each_reader_gets_pictures_until_the_end(live: tuple[Readings, LivePage]) -> None:
    readings, page = live
    with connect(page.address.replace("http", "ws") + "live") as first:
        assert json.loads(first.recv(60))["samples"] == 0
        feed(readings)
        with connect(page.address.replace("http", "ws") + "live") as second:
            assert json.loads(second.recv(60))["samples"] == 0
            page.close()
            for reader in (first, second):
                assert [json.loads(each)["samples"] for each in reader] == [1000]
                assert reader.close_code == 1000


def test_what_the_board_says_is_text_and_no_markup() -> None:
    nasty = "</script><img src=x onerror=alert(1)>"
    text = html(gauge(name=nasty, sosmith=nasty, output=("y", 12, False, 0.0, 1.0, nasty)), "nonce")
    assert "<img" not in text
    assert text.count("</script>") == 2


@pytest.mark.sweep(1)
@pytest.mark.skipif(BROWSER is None, reason="there is no Chromium on this machine")
@needs("axe_core_python")
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, True)])
def test_everybody_can_read_it(live: tuple[Readings, LivePage], tmp_path: Path, width: int, dark: bool) -> None:
    readings, page = live
    with browser(tmp_path) as tab:
        tab.window(width, 900, dark=dark)
        tab.open(page.address)
        tab.until("document.getElementById('state')?.textContent === 'No alarm, connected'")
        feed(readings)
        readings.alarm(Alarm("wear_critical", 1, 200, 3.25, 1002.0))
        page.update()
        tab.until("document.querySelectorAll('#alarms tbody tr').length === 1")
        assert tab.faults() == []


def _limits(tab: Tab) -> list[str]:
    names: list[str] = tab.value("[...document.querySelectorAll('#plot .limit-name')].map((text) => text.textContent)")
    assert tab.value("document.querySelectorAll('#plot line.limit').length") == sum(name[0].isalpha() for name in names)
    return names


@pytest.mark.skipif(BROWSER is None, reason="there is no Chromium on this machine")
def test_the_page_in_a_browser(live: tuple[Readings, LivePage], tmp_path: Path) -> None:
    readings, page = live
    with browser(tmp_path) as tab:
        tab.window(1200, 900)
        tab.open(page.address)
        tab.until("document.getElementById('state')?.textContent === 'No alarm, connected'")
        feed(readings)
        readings.alarm(Alarm("wear_critical", 1, 200, 3.25, 1002.0))
        readings.state = "lost"
        page.update()
        tab.until("document.getElementById('state').textContent === '1 alarm, board lost, waiting for it'")
        rows = tab.value("[...document.querySelectorAll('#channels tbody tr')].map((row) => row.innerText.trim())")
        assert [row.split() for row in rows] == [
            ["0", "1.100", "0.100", "+36.000", "–"],
            ["1", "2.000", "1.000", "0.000", "–"],
        ]
        assert tab.value("document.querySelector('#alarms tbody').innerText").split() == [
            *("0:00:02.00", "1", "3.250"),
            *("wear", "critical"),
        ]
        assert tab.value("document.querySelectorAll('#plot path.line').length") == 2
        assert tab.value("document.querySelectorAll('#plot .raised').length") == 1
        # Warnings at 1.5 and criticals at 3 mm; the curves reach from 1 to 2.
        assert _limits(tab) == ["critical 3 mm", "warning 1.5 mm"]
        tab.value("document.querySelector('#channels input').click()")
        assert tab.value("document.querySelectorAll('#plot path.line').length") == 1
        # The second channel's limits, as the first one is hidden; it stays at 2 mm, from where neither is near.
        assert _limits(tab) == ["\u2191 critical 3 mm", "\u2193 warning 1.5 mm"]
        tab.value("document.querySelector('input[data-what=wear]').click(); document.getElementById('plot').focus()")
        tab.key("End")
        assert tab.value("document.getElementById('cursor').textContent") == "At 0:00:09.99, wear in mm: 1: 1.000"
        for width in (375, 1200):
            tab.window(width, 800)
            assert tab.value("document.documentElement.scrollWidth - innerWidth") <= 0
        tab.value("document.querySelector('#channels input').focus()")
        page.close()
        tab.until("document.getElementById('state').textContent === '1 alarm, the monitor has ended'")
        assert tab.value("document.activeElement.type") == "checkbox"  # what has the focus keeps it
        assert tab.said == []
        assert tab.asked == [page.address, page.address.replace("http", "ws") + "live"]
