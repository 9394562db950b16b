"""The page of an exploration in a real browser: a point leads to its design, and it asks for nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.host.browser import BROWSER, Tab, browser
from tests.suite.extras import needs

from sosmith.sim.exploration.page import exploration_page
from sosmith.sim.exploration.run import Outcome

pytestmark = pytest.mark.skipif(BROWSER is None, reason="there is no Chromium on this machine")

REALIZATIONS = ("df1", "df1_ef1", "df2t", "delta", "state_space", "lattice_wdf")
ERRORS = (0.00025, 0.0005, 0.001, 0.002)


def design(n: int, realization: str, allowed: float) -> dict[str, Any]:
    """Return the result of one design: the more accurate, the dearer."""
    return {
        "key": f"{n:064x}",
        "changes": {"hardware.realization": realization, "output.max_error": allowed},
        "refused": None,
        "passed": n % 5 != 4,
        "shortfalls": [],
        "realization": realization,
        "architecture": "parallel",
        "error": {"bound": allowed * (0.9 + 0.01 * n), "max_abs": allowed / 2, "rms": allowed / 5, "unit": "mm"},
        "sqnr_db": 90.0,
        "stopband_attenuation_db": 60.0,
        "cycles_per_sample": 1,
        "latency_cycles": 20,
        "cost": {"value": 1000.0 + 37 * n + 0.5 / allowed, "unit": "LUT4, a block as 864", "source": "estimate"},
        "reference_sha256": "1" * 64,
        "trace_sha256": "2" * 64,
        "datapath_sha256": "3" * 64,
    }


@pytest.fixture(scope="module", name="page")
def _page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    sweep = [(realization, allowed) for realization in REALIZATIONS for allowed in ERRORS]
    points = [design(n, realization, allowed) for n, (realization, allowed) in enumerate(sweep)]
    points[0] |= {"report": "designs/0/report.html", "report_passed": True}
    points[7] = {"key": "7" * 64, "changes": points[7]["changes"], "refused": "No words of 18 bits keep this error."}
    outcome = Outcome(
        name="flange_wear",
        parameters={"hardware.realization": list(REALIZATIONS), "output.max_error": list(ERRORS)},
        search=None,
        samples=20_000,
        trace="song.wav",
        board=None,
        points=tuple(points),
        tasks=(),
    )
    path = tmp_path_factory.mktemp("exploration") / "exploration.html"
    path.write_text(exploration_page(outcome), encoding="utf-8")
    return path


@pytest.fixture(scope="module", name="tab")
def _tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with browser(tmp_path_factory.mktemp("profile")) as tab:
        yield tab


@pytest.mark.parametrize(("width", "dark"), [(390, False), (1200, False), (1200, True)])
def test_it_fits_and_says_nothing(tab: Tab, page: Path, width: int, dark: bool) -> None:
    tab.show(page, width, dark=dark)
    shown = "[...document.querySelectorAll('figure svg')].filter((each) => each.checkVisibility()).length"
    assert tab.value(shown) == 1
    assert (tab.value("getComputedStyle(document.body).backgroundColor") == "rgb(20, 22, 26)") == dark
    assert tab.is_quiet(page)


@needs("axe_core_python")
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, True)])
def test_everybody_can_read_it(tab: Tab, page: Path, width: int, dark: bool) -> None:
    tab.show(page, width, dark=dark)
    assert tab.faults() == []


def test_a_point_leads_to_its_design(tab: Tab, page: Path) -> None:
    tab.show(page, 1200)
    links = "document.querySelectorAll('.wide svg a')"
    assert tab.value(f"{links}.length") == len(REALIZATIONS) * len(ERRORS) - 1
    for n in (0, 10):
        target = str(tab.value(f"{links}[{n}].getAttribute('href')"))
        tab.value(f"{links}[{n}].scrollIntoView({{block: 'center'}})")
        box = f"{links}[{n}].getBoundingClientRect()"
        x, y = (tab.value(f"{box}.{start} + {box}.{size} / 2") for start, size in (("x", "width"), ("y", "height")))
        for kind in ("mousePressed", "mouseReleased"):
            tab.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
        tab.until(f"location.hash === '{target}'")
        place = f"document.querySelector('{target}').getBoundingClientRect()"
        tab.until(f"{place}.top >= 0 && {place}.bottom <= innerHeight")
    assert tab.said == []


def test_a_design_leads_to_its_report(tab: Tab, page: Path) -> None:
    tab.show(page, 1200)
    reports = tab.value("[...document.querySelectorAll('a.badge')].map((each) => each.getAttribute('href'))")
    assert set(reports) == {"designs/0/report.html"}


@pytest.mark.slow
def test_on_paper_nothing_is_folded_up(tab: Tab, page: Path) -> None:
    tab.show(page, 1200)
    tab.call("Emulation.setEmulatedMedia", media="print")
    assert tab.value("document.querySelector('details td').checkVisibility()")
    tab.call("Emulation.setEmulatedMedia", media="")
