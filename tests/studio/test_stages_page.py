"""The list of stages on the page, in a real browser: dragged, added, edited, removed, and each of it undone."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.gen.chain.chains import PLAIN
from tests.host.browser import BROWSER, Tab, browser
from tests.interface.small import FILTER
from tests.studio.pages import ANSWERED, PROVEN, mouse, text_of, typed
from tests.studio.sessions import session_in, state
from tests.suite.extras import needs

import sosmith
from sosmith.studio.server import Studio
from sosmith.studio.session import Session

pytestmark = pytest.mark.skipif(BROWSER is None, reason="there is no Chromium on this machine")

TEXT = "# as asked\n" + sosmith.ChainSpecification.load(PLAIN).toml()


@pytest.fixture(scope="module", name="tab")
def _tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with browser(tmp_path_factory.mktemp("profile")) as tab:
        yield tab


@pytest.fixture(scope="module", name="studio")
def _studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Session, Studio]]:
    with session_in(tmp_path_factory.mktemp("studio"), TEXT) as session, Studio(session) as studio:
        yield session, studio


@pytest.fixture(name="page")
def _page(tab: Tab, studio: tuple[Session, Studio]) -> Iterator[Session]:
    """Open the page on the chain as it was at first; nothing may be said."""
    session, server = studio
    session.handle({"do": "text", "text": TEXT}, "test")
    tab.said.clear()
    tab.window(1200, 900)
    tab.open(server.address)
    tab.until(f"document.readyState === 'complete' && document.getElementById('state') && {PROVEN}")
    yield session
    assert tab.said == []


def stages(tab: Tab) -> list[str]:
    """Return the names of the stages, as soon as all is answered that the page has asked for."""
    tab.until(ANSWERED)
    return str(
        tab.value("[...document.querySelectorAll('#stages strong')].map((one) => one.textContent).join()")
    ).split(",")


def click(tab: Tab, place: str) -> None:
    """Click on an element."""
    tab.value(f"document.querySelector({place!r}).click()")


def chosen(tab: Tab, key: str, name: str) -> None:
    """Choose a name in a field of the form."""
    tab.value(
        f"(() => {{ const field = document.querySelector('[data-key=\"{key}\"]'); field.value = '{name}'; "
        "field.dispatchEvent(new Event('change', { bubbles: true })); })()"
    )


def grip(tab: Tab, k: int) -> tuple[float, float, float]:
    """Return where the handle of a stage is in the window, and how far it is to that of the next one."""
    tab.value("document.getElementById('stages').scrollIntoView({block: 'center'})")
    found: list[float] = tab.value(
        "[...document.querySelectorAll('.grip')].map((one) => one.getBoundingClientRect())"
        ".flatMap(({x, y, width, height}) => [x + width / 2, y + height / 2])"
    )
    return found[2 * k], found[2 * k + 1], found[3] - found[1]


def test_it_shows_the_chain_and_the_chosen_stage(tab: Tab, page: Session) -> None:
    design = sosmith.design_chain(PLAIN)
    assert stages(tab) == ["slow", "double", "out"]
    rates = "[...document.querySelectorAll('.rate')].map((one) => one.textContent)"
    assert tab.value(rates) == ["8 kHz → 4 kHz", "4 kHz → 4 kHz", "4 kHz → 2 kHz"]
    costs = [f"{design.cores[name][0].estimates[0].luts:,} LUT4" for name in design.gains]
    assert [one in text_of(tab, f"#stages li:nth-child({k + 1})") for k, one in enumerate(costs)] == [True] * 3
    parts = tab.value("[...document.querySelectorAll('#budget tbody th')].map((one) => one.textContent)")
    assert parts == ["slow", "double", "out", "sum"]
    assert tab.value("document.querySelectorAll('#chaingain .other').length") == 2
    assert tab.value("document.querySelectorAll('#chaingain .ideal').length") == 1  # the chosen stage
    assert tab.value("document.querySelectorAll('#chaingain .band').length") == 1
    assert tab.value("document.querySelectorAll('#chaingain .limit').length") == 1
    assert text_of(tab, "#chainfacts") == "aliases at most −10.4 dB: proven"
    assert tab.value("document.querySelectorAll('#aliases path.line').length") == 2
    assert text_of(tab, "#gaintitle") == "Gain of stage slow"
    titles = tab.value("[...document.querySelectorAll('#tables caption')].map((one) => one.textContent)")
    assert titles == [table.title for table in design.tables()]
    click(tab, "#stages li:nth-child(3) .pick")
    assert text_of(tab, "#gaintitle") == "Gain of stage out"
    assert tab.value("document.querySelector('[data-key=\"stage.taps\"]').value") == "0.25, 0.5, 0.25"
    assert tab.value("document.querySelectorAll('#gain path.line').length") == 2  # ideal, and with integers
    assert text_of(tab, "#ofstage") == ", stage out"


def test_a_stage_is_dragged_with_the_mouse_and_all_is_undone(tab: Tab, page: Session) -> None:
    x, y, far = grip(tab, 0)
    mouse(tab, "mousePressed", x, y)
    for k in range(1, 5):
        mouse(tab, "mouseMoved", x, y + k * far / 3)
    assert tab.value("document.querySelector('.held strong').textContent") == "slow"
    assert state(page)["document"]["text"] == TEXT  # nothing is changed before it is let go
    mouse(tab, "mouseReleased", x, y + 4 * far / 3)
    assert stages(tab) == ["double", "slow", "out"]
    assert text_of(tab, ".chosen strong") == "slow"  # it stays chosen
    assert [
        stage["name"]
        for stage in sosmith.ChainSpecification.from_toml(tab.value("document.getElementById('toml').value")).as_dict()[
            "stage"
        ]
    ] == ["double", "slow", "out"]
    tab.until(PROVEN)
    mouse(tab, "mousePressed", x, y)
    mouse(tab, "mouseMoved", x, y + 2 * far)
    tab.key("Escape")
    mouse(tab, "mouseReleased", x, y + 2 * far)
    assert stages(tab) == ["double", "slow", "out"]
    tab.call("Input.dispatchKeyEvent", type="keyDown", key="z", code="KeyZ", modifiers=2)
    assert stages(tab) == ["slow", "double", "out"]
    assert state(page)["document"]["text"] == TEXT
    click(tab, "#redo")
    assert stages(tab) == ["double", "slow", "out"]


def test_a_stage_is_dragged_with_a_finger_and_moved_by_keys(tab: Tab, page: Session) -> None:
    tab.window(390, 900)
    tab.call("Emulation.setTouchEmulationEnabled", enabled=True)
    x, y, far = grip(tab, 2)
    tab.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
    for k in range(1, 5):
        tab.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=[{"x": x, "y": y - k * far / 2}])
    tab.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    tab.call("Emulation.setTouchEmulationEnabled", enabled=False)
    assert stages(tab) == ["out", "slow", "double"]
    tab.value("document.querySelector('#stages li:first-child .pick').focus()")
    for name, order in (
        ("ArrowDown", ["slow", "out", "double"]),
        ("ArrowDown", ["slow", "double", "out"]),
        ("ArrowUp", ["slow", "out", "double"]),
    ):
        tab.call("Input.dispatchKeyEvent", type="keyDown", key=name, code=name, modifiers=1)
        assert stages(tab) == order
        assert tab.value("document.activeElement.querySelector('strong').textContent") == "out"  # it keeps the focus
    assert text_of(tab, "#stagessaid") == "out is stage 2 of 3."
    click(tab, "#stages li:nth-child(2) .earlier")
    assert stages(tab) == ["out", "slow", "double"]


def test_a_stage_is_added_edited_and_removed(tab: Tab, page: Session) -> None:
    tab.value("document.getElementById('newkind').value = 'fir'")
    click(tab, "#addstage")
    assert stages(tab) == ["slow", "fir", "double", "out"]
    assert text_of(tab, "#gaintitle") == "Gain of stage fir"
    typed(tab, '[data-key="filter.passband_edge"]', "5000")
    wrong = "document.querySelector('#stages li:nth-child(2) .problem').textContent"
    tab.until(f"{wrong} !== ''")
    assert tab.value(wrong) == "passband_edge must be above 0 and below half the sample_rate (2000 Hz), not 5000"
    tab.until("document.getElementById('state').textContent === 'Not a chain yet'")
    typed(tab, '[data-key="filter.passband_edge"]', "600")
    tab.until(f"{wrong} === '' && document.getElementById('handle-passband_edge0') !== null")
    tab.value("document.getElementById('handle-passband_edge0').focus()")
    tab.key("ArrowRight")
    tab.until("document.querySelector('[data-key=\"filter.passband_edge\"]').value === '606'")
    chosen(tab, "stage.kind", "cic")
    assert stages(tab) == ["slow", "fir", "double", "out"]
    shown = "[...document.querySelectorAll('#stageset [data-key]')].filter((one) => one.checkVisibility())"
    fields = tab.value(f"{shown}.map((one) => one.dataset.key.split('.')[1]).join()")
    assert fields == "name,kind,decimate,interpolate,order,realization,architecture"
    typed(tab, '[data-key="stage.name"]', "half")
    tab.until("document.querySelector('#stages li:nth-child(2) strong').textContent === 'half'")
    assert text_of(tab, "#stagelegend") == "Stage half"
    for _ in range(4):
        click(tab, "#stages .remove")
        tab.until(ANSWERED)
    tab.until("document.getElementById('detail').textContent === 'There must be a stage: add one to the list.'")
    assert text_of(tab, "#nostages") == "There is no stage yet: add one."
    steps = state(page)["document"]["undo"]
    for _ in range(steps - 1):
        click(tab, "#undo")
    tab.until(ANSWERED)
    assert state(page)["document"]["redo"] == steps - 1


def test_what_is_typed_for_a_stage_is_not_sent_for_the_next_one(tab: Tab, page: Session) -> None:
    click(tab, "#stages li:nth-child(2) .pick")
    typed(tab, '[data-key="stage.name"]', "later")
    page.handle({"do": "stages", "what": "remove", "at": 1}, "another page")
    tab.until("document.querySelectorAll('#stages li').length === 2")
    tab.value("document.activeElement.blur()")
    assert tab.value("sent") == 0
    assert stages(tab) == ["slow", "out"]


def test_what_is_no_list_of_stages_is_shown_as_such(tab: Tab, page: Session) -> None:
    for text in ("stage = 1", "stage = [[1], {}]", "[stage]\nx = 1", "[filter]\n[stage]", "name="):
        page.handle({"do": "text", "text": text}, "another page")
        tab.until(f"known.document.text === {text!r} && known.preview.error !== null")
        assert text_of(tab, "#state").startswith("Not a ")
        for button in (".pick", "#addstage", "#undo"):
            tab.value(f"document.querySelector('{button}')?.click()")
        tab.until(ANSWERED)


def test_a_single_core_becomes_a_chain(tab: Tab, page: Session) -> None:
    single = sosmith.Specification.load(FILTER).toml()
    page.handle({"do": "text", "text": single}, "test")
    tab.until("document.getElementById('toml').value.includes('[filter]')")
    assert not tab.value("document.getElementById('stagelist').checkVisibility()")
    assert not tab.value("document.getElementById('chain').checkVisibility()")
    click(tab, "#split")
    assert stages(tab) == ["filter"]
    tab.until(PROVEN)
    assert tab.value("document.querySelectorAll('#gain .handle').length") == 1
    click(tab, "#undo")
    tab.until(f"({ANSWERED}) && document.getElementById('stagelist').hidden")
    assert state(page)["document"]["text"] == single


@needs("axe_core_python")
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, True)])
def test_everybody_can_use_it(tab: Tab, page: Session, width: int, dark: bool) -> None:
    tab.window(width, 900, dark=dark)
    assert tab.faults() == []
    assert tab.value("document.documentElement.scrollWidth <= innerWidth")
