"""The page of the studio in a real browser: handles, keys, fields, text, and that it asks for nothing else."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.host.browser import BROWSER, Tab, browser
from tests.house import ROOT
from tests.interface.small import INSTRUMENT
from tests.studio.pages import PROVEN, mouse, text_of, typed
from tests.studio.sessions import TEXT, session_in, state, until
from tests.suite.extras import needs

from sosmith import Specification
from sosmith.studio.server import Studio
from sosmith.studio.session import Session

pytestmark = pytest.mark.skipif(BROWSER is None, reason="there is no Chromium on this machine")


@pytest.fixture(scope="module", name="tab")
def _tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with browser(tmp_path_factory.mktemp("profile")) as tab:
        yield tab


@pytest.fixture(scope="module", name="studio")
def _studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Session, Studio]]:
    with session_in(tmp_path_factory.mktemp("studio")) as session, Studio(session) as studio:
        yield session, studio


@pytest.fixture(name="page")
def _page(tab: Tab, studio: tuple[Session, Studio]) -> Iterator[Session]:
    """Open the page on the specification as it was at first; nothing may be said, and nothing else asked for."""
    session, server = studio
    session.handle({"do": "text", "text": TEXT}, "test")
    tab.asked.clear()
    tab.said.clear()
    tab.window(1200, 900)
    tab.open(server.address)
    tab.until(f"document.readyState === 'complete' && document.getElementById('state') && {PROVEN}")
    yield session
    assert tab.said == []
    assert tab.asked == [server.address, server.address.replace("http", "ws") + "live"]


def spot(tab: Tab, handle: str) -> tuple[float, float]:
    """Where a handle is in the window."""
    tab.value("document.getElementById('gain').scrollIntoView({block: 'center'})")
    box: dict[str, float] = tab.value(
        f"(({{x, y, width, height}}) => ({{x: x + width / 2, y: y + height / 2}}))"
        f"(document.querySelector('#handle-{handle} .knob').getBoundingClientRect())"
    )
    return box["x"], box["y"]


def asked(session: Session, key: str) -> Any:
    """Return what the specification asks for."""
    return state(session)["preview"]["spec"]["filter"][key]


def test_zeros_outside_of_the_unit_circle_are_shown(tab: Tab, page: Session) -> None:
    """Some at 1.41 are drawn; those at 4.1 are told."""
    shown = "[...document.querySelectorAll('#plane .zero')].every(zero => { const [, , width, height] = "
    shown += "zero.closest('svg').getAttribute('viewBox').split(' ').map(Number), x = Number(zero.getAttribute('cx')), "
    shown += "y = Number(zero.getAttribute('cy')); return x > 0 && x < width && y > 0 && y < height; })"
    head, _, rest = TEXT.partition("[filter]")
    _, _, tail = rest.partition("\n[")
    for taps, all_shown, told in (
        ("0.3, 0.0, -0.75, 0.0, 0.3", True, ""),
        ("0.1, 0.0, 1.7, 0.0, 0.1", False, "2 zeros farther out"),
    ):
        page.handle({"do": "text", "text": f"{head}[filter]\ntaps = [{taps}]\n\n[{tail}"}, "test")
        tab.until("document.getElementById('describe').textContent.startsWith('FIR of 5 taps')")
        tab.until(f"document.getElementById('poles').textContent === '{told}'")
        assert tab.value(shown) == all_shown


def test_it_shows_the_design(tab: Tab, page: Session) -> None:
    proof = state(page)["design"]
    assert text_of(tab, "#describe") == "Butterworth lowpass, order 2, 100 Hz at 1000 Hz"
    assert text_of(tab, "#detail").endswith(" allowed. df1_ef1, parallel.")
    assert tab.value("document.querySelectorAll('#gain path.line').length") == 2
    assert tab.value("document.querySelectorAll('#plane .pole').length") == 2
    assert tab.value("document.querySelectorAll('#plane .zero').length") == 2
    assert text_of(tab, "#stepfacts").startswith("overshoot 4.")
    assert tab.value("document.querySelector('#budget tbody').rows.length") == 4  # without the start
    assert text_of(tab, "#budget tbody tr:last-child").split()[0] == "sum"
    assert tab.value("document.getElementById('toml').value") == TEXT
    assert "start" not in TEXT
    assert tab.value("document.querySelector('[data-key=\"hardware.start\"]').value") == "steady"
    assert tab.value("[...document.getElementById('source').options].map((each) => each.value)") == list(
        proof["scenarios"]
    )


def test_the_cutoff_is_dragged(tab: Tab, page: Session) -> None:
    x, y = spot(tab, "cutoff0")
    mouse(tab, "mousePressed", x, y)
    for k in range(1, 11):
        mouse(tab, "mouseMoved", x - 8 * k, y)
    until(page, lambda known: known["preview"]["spec"]["filter"]["cutoff"] < 70)
    tab.until("document.getElementById('state').textContent === 'Changing'")
    mouse(tab, "mouseReleased", x - 80, y)
    tab.until(PROVEN)
    cutoff = asked(page, "cutoff")
    assert 20 < cutoff < 70
    assert tab.value("document.querySelector('[data-key=\"filter.cutoff\"]').value") == f"{cutoff:g}"
    assert f"cutoff = {cutoff}  # of the sensor" in tab.value("document.getElementById('toml').value")
    assert spot(tab, "cutoff0")[0] != x


def test_a_handle_is_moved_by_keys(tab: Tab, page: Session) -> None:
    tab.value("document.getElementById('handle-cutoff0').focus()")
    tab.key("ArrowRight")
    until(page, lambda known: known["preview"]["spec"]["filter"]["cutoff"] == 101.0)
    tab.key("ArrowRight")
    until(page, lambda known: known["preview"]["spec"]["filter"]["cutoff"] == 102.01)
    tab.key("PageDown")
    until(page, lambda known: known["preview"]["spec"]["filter"]["cutoff"] < 93)
    tab.until(PROVEN)
    assert tab.value("document.activeElement.id") == "handle-cutoff0"  # what has the focus keeps it
    assert tab.value("document.activeElement.getAttribute('role')") == "slider"
    assert tab.value("document.activeElement.getAttribute('aria-valuetext')") == f"{asked(page, 'cutoff'):.5g} Hz"


def test_the_mask_is_dragged_and_moved_by_keys(tab: Tab, page: Session) -> None:
    tab.value("document.querySelector('input[value=mask]').click()")
    tab.until("document.getElementById('handle-stopband_edge0') !== null && " + PROVEN)
    assert (asked(page, "passband_edge"), asked(page, "stopband_edge"), asked(page, "stopband_loss")) == (100, 200, 40)
    assert tab.value("document.querySelectorAll('#gain .mask').length") == 2
    x, y = spot(tab, "stopband_edge0")
    mouse(tab, "mousePressed", x, y)
    for k in range(1, 6):
        mouse(tab, "mouseMoved", x + 3 * k, y + 10 * k)
    mouse(tab, "mouseReleased", x + 15, y + 50)
    until(page, lambda known: known["preview"]["spec"]["filter"]["stopband_loss"] > 45)
    tab.until(PROVEN)
    assert 201 < asked(page, "stopband_edge") < 300
    tab.value("document.getElementById('handle-passband_edge0').focus()")
    tab.key("ArrowUp")
    until(page, lambda known: known["preview"]["spec"]["filter"]["passband_loss"] == 0.95)
    tab.value("document.querySelector('input[value=order]').click()")
    tab.until("document.getElementById('handle-cutoff0') !== null && " + PROVEN)
    assert asked(page, "order") == state(page)["preview"]["stages"][0]["filter"]["order"]


def test_numbers_are_typed_and_a_wrong_one_is_told(tab: Tab, page: Session) -> None:
    typed(tab, '[data-key="filter.cutoff"]', "140")
    until(page, lambda known: known["preview"]["spec"]["filter"]["cutoff"] == 140)
    typed(tab, '[data-key="filter.cutoff"]', "140x")
    tab.until("document.querySelector('[data-key=\"filter.cutoff\"]').getAttribute('aria-invalid') === 'true'")
    typed(tab, '[data-key="filter.cutoff"]', "600")
    tab.until("document.getElementById('state').textContent === 'Not a filter yet'")
    assert text_of(tab, "#detail").endswith(
        "filter.cutoff must be above 0 and below half the sample_rate (500 Hz), not 600"
    )
    assert tab.value("document.querySelector('[data-key=\"filter.cutoff\"]').value") == "600"
    typed(tab, '[data-key="filter.cutoff"]', "60")
    tab.until(PROVEN)
    assert asked(page, "cutoff") == 60


@pytest.mark.parametrize(("wrong", "told"), [("40", "Not a filter yet"), ("2k", "")])
def test_the_number_before_a_wrong_one_is_taken_as_soon_as_it_is_entered(
    tab: Tab, page: Session, wrong: str, told: str
) -> None:
    field = "document.querySelector('[data-key=\"filter.order\"]')"
    typed(tab, '[data-key="filter.order"]', wrong)
    if told:
        tab.until(f"document.getElementById('state').textContent === {told!r}")
    else:
        tab.until(f"{field}.getAttribute('aria-invalid') === 'true'")
    typed(tab, '[data-key="filter.order"]', "2")
    tab.value(f"{field}.dispatchEvent(new Event('change', {{ bubbles: true }}))")
    tab.until(f"{PROVEN} && !{field}.hasAttribute('aria-invalid')")
    assert asked(page, "order") == 2


def test_a_family_and_a_kind_are_chosen(tab: Tab, page: Session) -> None:
    for key, name in (("family", "elliptic"), ("kind", "bandpass")):
        tab.value(
            f"(() => {{ const field = document.querySelector('[data-key=\"filter.{key}\"]'); field.value = '{name}'; "
            "field.dispatchEvent(new Event('change', { bubbles: true })); })()"
        )
        until(page, lambda known, key=key, name=name: known["preview"]["spec"]["filter"][key] == name)
    tab.until(PROVEN)
    assert tab.value("document.querySelectorAll('.handle').length") == 2
    shown = "[...document.querySelectorAll('#controls label')].filter((each) => each.checkVisibility()).length"
    assert tab.value(shown) == 3 + 2 + 1 + 2 + 2 + 4 + 4  # choices, forms, order, edges, losses, signal, hardware


def test_the_text_is_typed_and_saved(tab: Tab, page: Session) -> None:
    tab.value("(() => { const box = document.getElementById('toml'); box.focus(); box.select(); })()")
    tab.call("Input.insertText", text=TEXT.replace("cutoff = 100.0", "cutoff = 33.0"))
    until(page, lambda known: known["preview"]["spec"]["filter"]["cutoff"] == 33)
    tab.until("document.querySelector('[data-key=\"filter.cutoff\"]').value === '33'")
    assert text_of(tab, "#saved") == "· not saved"
    tab.value("document.getElementById('write').click()")
    tab.until("document.getElementById('saving').textContent === 'Saved.'")
    assert tab.value("document.getElementById('write').disabled") is True
    assert (page.file).read_text() == TEXT.replace("cutoff = 100.0", "cutoff = 33.0")
    page.file.write_text("# changed\n")
    tab.value("(() => { const box = document.getElementById('toml'); box.focus(); box.select(); })()")
    tab.call("Input.insertText", text=TEXT)
    tab.until("document.getElementById('write').disabled === false")
    tab.value("document.getElementById('write').click()")
    tab.until("document.getElementById('write').textContent === 'Overwrite plain.toml'")
    assert text_of(tab, "#saving") == "plain.toml has changed on the disk since it was read. Overwrite it?"
    tab.value("document.getElementById('write').click()")
    tab.until("document.getElementById('saving').textContent === 'Saved.'")
    assert page.file.read_text() == TEXT


def test_realizations_and_a_trace_are_shown(tab: Tab, page: Session) -> None:
    tab.value("document.getElementById('compare').click()")
    done = "document.getElementById('comparing').textContent === ''"
    tab.until(f"{done} && document.querySelectorAll('#realizations tbody tr').length > 7")
    assert tab.value("document.querySelector('#realizations tr.taken').cells[0].innerText") == "df1_ef1, taken"
    tab.value("document.getElementById('compare').click()")
    tab.until("document.getElementById('realizations').hidden")
    tab.value(
        "document.getElementById('source').value = 'noise'; document.querySelector('#run button[value=trace]').click()"
    )
    tab.until("document.getElementById('tracefigure').hidden === false")
    assert text_of(tab, "#tracetitle") == "Output on noise"
    assert "bit for bit what the hardware computes: largest error" in text_of(tab, "#tracefacts")
    assert tab.value("document.querySelectorAll('#traceerror path.line').length") == 2
    assert not tab.value("document.getElementById('channels').checkVisibility()")


def test_a_channel_of_a_trace_is_chosen(tab: Tab, page: Session) -> None:
    page.handle({"do": "change", "changes": {"channels": 2, "hardware.architecture": "folded"}}, "test")
    tab.until(f"document.getElementById('toml').value.includes('channels = 2') && {PROVEN}")
    tab.value(
        "document.getElementById('source').value = 'noise'; document.querySelector('#run button[value=trace]').click()"
    )
    tab.until("document.getElementById('channels').checkVisibility()")
    assert text_of(tab, "#tracetitle") == "Output on noise, channel 0"
    first = tab.value("document.querySelector('#traceerror path.line').getAttribute('d')")
    tab.value("const s = document.getElementById('channel'); s.value = '1'; s.dispatchEvent(new Event('change'))")
    assert text_of(tab, "#tracetitle") == "Output on noise, channel 1"
    assert tab.value("document.querySelector('#traceerror path.line').getAttribute('d')") != first
    assert "samples on each of 2 channels" in text_of(tab, "#tracefacts")


def dropped(tab: Tab, text: str) -> None:
    """Drop a file with this text, as a file manager does."""
    tab.value(
        f"{{const carried = new DataTransfer(); carried.items.add(new File([{json.dumps(text)}], 'measured.csv'));"
        "for (const kind of ['dragover', 'drop']) document.getElementById('drop').dispatchEvent("
        "new DragEvent(kind, {dataTransfer: carried, bubbles: true, cancelable: true}))}"
    )


def test_measurements_are_dropped(tab: Tab, page: Session) -> None:
    page.handle({"do": "text", "text": Specification.load(INSTRUMENT).toml()}, "test")
    dropped(tab, "a,b\n")
    tab.until("document.getElementById('fitted').className === 'problem'")
    assert "clearance_mm" in text_of(tab, "#fitted")
    dropped(tab, (ROOT / "examples/measurements/march.csv").read_text(encoding="utf-8"))
    tab.until("document.getElementById('fitted').innerText.includes(' measurements, orders ')")
    assert tab.value("document.getElementById('fitted').className") == ""
    assert not tab.value("document.getElementById('drop').classList.contains('over')")
    tab.until("document.getElementById('toml').value.includes('coefficients = [[')")


@pytest.mark.parametrize(("width", "dark"), [(390, False), (390, True), (1200, False), (1200, True)])
def test_it_fits_every_window(tab: Tab, page: Session, width: int, dark: bool) -> None:
    tab.window(width, 900, dark=dark)
    tab.until(f"document.querySelector('#gain svg').getBoundingClientRect().width <= {width}")
    assert tab.value("document.documentElement.scrollWidth <= innerWidth")
    assert (tab.value("getComputedStyle(document.body).backgroundColor") == "rgb(20, 22, 26)") == dark
    plot, controls = (f"document.querySelector('{each}').getBoundingClientRect()" for each in (".plots", "#controls"))
    tables = "[...document.querySelectorAll('.scroll')].filter((each) => each.scrollWidth > each.clientWidth + 1)"
    assert width < 900 or tab.value(f"{tables}.length") == 0  # on a phone they are scrolled
    under = tab.value(f"{controls}.top > {plot}.bottom")
    assert under == (width < 900)  # what one looks at comes first on a phone


@needs("axe_core_python")
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, True)])
def test_everybody_can_use_it(tab: Tab, page: Session, width: int, dark: bool) -> None:
    tab.window(width, 900, dark=dark)
    assert tab.faults() == []


def test_it_is_printed_without_its_controls(tab: Tab, page: Session, tmp_path: Path) -> None:
    tab.call("Emulation.setEmulatedMedia", media="print")
    places = "#controls, .tools, .drop, .save, .hint"
    hidden = f"[...document.querySelectorAll('{places}')].filter((each) => each.checkVisibility())"
    assert tab.value(f"{hidden}.length") == 0
    assert tab.value("document.querySelector('#gain svg').checkVisibility()")
    printed = tab.call("Page.printToPDF", printBackground=True)
    (tmp_path / "studio.pdf").write_bytes(base64.b64decode(printed["data"]))
    assert (tmp_path / "studio.pdf").read_bytes().startswith(b"%PDF-")
    tab.call("Emulation.setEmulatedMedia", media="")


@pytest.mark.slow
def test_the_end_is_told(tab: Tab, tmp_path: Path) -> None:
    with session_in(tmp_path) as session, Studio(session) as studio:
        tab.open(studio.address)
        tab.until(f"document.getElementById('state') && {PROVEN}")
    tab.until("document.getElementById('state').textContent === 'The studio has ended'")
    tab.open("about:blank")
