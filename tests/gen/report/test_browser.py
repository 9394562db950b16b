"""Pages in a real browser: they fit the window, say nothing on the console, ask for nothing, and can be worked with."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.gen.report.behaviours import told
from tests.gen.report.evidences import LSB, evidence, page_of
from tests.gen.report.reports import WORSE, report
from tests.host.browser import BROWSER, Tab, browser
from tests.suite.extras import needs

from sosmith.gen.report.comparison.baseline import judge
from sosmith.gen.report.comparison.page import comparison_page

pytestmark = pytest.mark.skipif(BROWSER is None, reason="there is no Chromium on this machine")

SAMPLES = 40_000
WORST = 23_456
"""Sample with the largest error, of the 40,000 of a run."""


@pytest.fixture(scope="module", name="tab")
def _tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with browser(tmp_path_factory.mktemp("profile")) as tab:
        yield tab


@pytest.fixture(scope="module", name="comparison")
def _comparison(tmp_path_factory: pytest.TempPathFactory) -> Path:
    reports = [report(), report(**WORSE, name="another_design_with_a_long_name")]
    path = tmp_path_factory.mktemp("comparison") / "comparison.html"
    path.write_text(comparison_page(reports, judge(reports[0], reports[1:])), encoding="utf-8")
    return path


@pytest.fixture(scope="module", name="accuracy")
def _accuracy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the page of a long run with noise everywhere."""
    generator = np.random.default_rng(3)
    time = np.arange(SAMPLES) / 100
    truth = 3 + 0.01 * time
    golden = truth + 0.1 * generator.standard_normal(SAMPLES)
    hardware = np.round(golden / LSB) * LSB
    hardware[WORST] = np.round(golden[WORST] / LSB + 0.5) * LSB + LSB
    run = evidence(
        time=time,
        truth=truth,
        reading=time > 10,
        golden=golden,
        hardware=hardware,
        unfiltered=golden + generator.standard_normal(SAMPLES),
        error_bound=0.0006,
        max_error=0.0007,
        provenance=told(),
        files={f"wear.{suffix}": "5" * 64 for suffix in ("sv", "il", "json", "certificate.json", "c", "h")},
    )
    path = tmp_path_factory.mktemp("accuracy") / "report.html"
    path.write_text(page_of(run), encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize(("width", "dark"), [(390, False), (1200, False), (1200, True)])
def test_comparison(tab: Tab, comparison: Path, width: int, dark: bool) -> None:
    tab.show(comparison, width, dark=dark)
    assert tab.value("document.querySelectorAll('svg').length") == 9
    assert tab.is_quiet(comparison)


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("width", "dark"), [(390, False), (1200, False), (1200, True)])
def test_report(tab: Tab, accuracy: Path, width: int, dark: bool) -> None:
    tab.show(accuracy, width, dark=dark)
    tab.until("document.querySelector('.readout').textContent !== ''")
    assert tab.value("getComputedStyle(document.querySelector('.still')).display") == "none"
    paper = tab.value("getComputedStyle(document.body).backgroundColor")
    assert (paper == "rgb(20, 22, 26)") == dark
    assert tab.is_quiet(accuracy)


@needs("axe_core_python")
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, True)])
def test_everybody_can_read_them(tab: Tab, accuracy: Path, comparison: Path, width: int, dark: bool) -> None:
    for page in (accuracy, comparison):
        tab.show(page, width, dark=dark)
        assert tab.faults() == []


def readout(tab: Tab) -> str:
    """Return what the viewer says of the sample at its crosshair."""
    return str(tab.value("document.querySelector('.readout').textContent"))


def click(tab: Tab, name: str) -> None:
    """Click a button of the viewer."""
    tab.value(f"document.querySelector('#viewer button[value={name}]').click()")


def drawn(tab: Tab) -> str:
    """Return what is on the canvas."""
    return str(tab.value("document.querySelector('canvas').toDataURL()"))


def test_samples_are_read_out_and_zoomed(tab: Tab, accuracy: Path) -> None:
    tab.show(accuracy, 1200)
    tab.until("document.querySelector('.readout').textContent !== ''")
    first = readout(tab)
    assert first.startswith("time 234.560 s · sample 23,456 · code 22,025 · 5.377 mm · error 400.6 nm = 1.64 LSB")
    assert first.endswith("minus true value 31.6 µm")
    near = drawn(tab)
    tab.value("document.querySelector('canvas').focus()")
    tab.key("ArrowRight")
    assert readout(tab) != first
    click(tab, "all")
    far = drawn(tab)
    assert far != near
    tab.key("Home")
    assert (readout(tab), drawn(tab)) == (first, near)
    # with the mouse: over the middle of the whole run, then over a quarter of it
    click(tab, "all")
    tab.value("document.querySelector('canvas').scrollIntoView()")
    left, top, width = (
        tab.value(f"document.querySelector('canvas').getBoundingClientRect().{side}") for side in ("x", "y", "width")
    )
    move(tab, "mousePressed", left + width / 2, top + 50)
    middle = int(readout(tab).partition("sample ")[2].partition(" ")[0].replace(",", ""))
    assert abs(middle - SAMPLES / 2) < SAMPLES / 20
    move(tab, "mouseMoved", left + 3 * width / 4, top + 50)
    move(tab, "mouseReleased", left + 3 * width / 4, top + 50)
    assert drawn(tab) not in (near, far)
    assert tab.is_quiet(accuracy)


def move(tab: Tab, kind: str, x: float, y: float) -> None:
    """Move the mouse, or its button."""
    tab.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)


@pytest.mark.slow
def test_on_paper_everything_is_unfolded_and_the_viewer_is_a_picture(tab: Tab, accuracy: Path) -> None:
    """With the script and without it."""
    for scripted in (True, False):
        tab.call("Emulation.setScriptExecutionDisabled", value=not scripted)
        tab.show(accuracy, 1200)
        tab.call("Emulation.setEmulatedMedia", media="print")
        folded = "[...document.querySelectorAll('details table')].every((each) => each.checkVisibility())"
        assert tab.value("document.querySelectorAll('details:not([open])').length") > 0
        assert tab.value(folded)
        assert tab.value("getComputedStyle(document.querySelector('.viewer')).display") == "none"
        assert tab.value("document.querySelector('.still svg').checkVisibility()")
        tab.call("Emulation.setEmulatedMedia", media="")
    assert tab.value("getComputedStyle(document.querySelector('.viewer')).display") == "none"
    assert tab.value("document.querySelector('.still svg').checkVisibility()")
    tab.call("Emulation.setScriptExecutionDisabled", value=False)
