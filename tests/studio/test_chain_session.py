"""Sessions on chains: what is told of a chain is what the interface computes, and errors stand at their stage."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.chain.chains import PLAIN
from tests.studio.sessions import proven, session_in, state, until

import sosmith
from sosmith.studio.document import errors_by_stage
from sosmith.studio.history import STEPS, History
from sosmith.studio.session import Session

TEXT = sosmith.ChainSpecification.load(PLAIN).toml()
BETWEEN = [
    {"name": "up", "kind": "fir", "taps": [0.5, 1.0, 0.5], "interpolate": 2},
    {"name": "out", "kind": "fir", "passband_edge": 2e3, "stopband_edge": 6e3, "passband_loss": 1, "stopband_loss": 30}
    | {"interpolate": 2},
]


@pytest.fixture(scope="module", name="session")
def _session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    with session_in(tmp_path_factory.mktemp("studio"), TEXT) as session:
        yield session


def say(session: Session, **message: Any) -> dict[str, Any]:
    """Say what a page says; return what the session then knows of the text."""
    session.handle(message, "page")
    known: dict[str, Any] = state(session)["document"]
    return known


def test_a_chain_is_shown_and_proven(session: Session) -> None:
    say(session, do="text", text=TEXT)
    known, chain = proven(session), sosmith.design_chain(PLAIN)
    shown, whole = known["design"], known["preview"]["chain"]
    assert known["document"]["stages"] == [[8000, 4000], [4000, 4000], [4000, 2000]]
    assert (shown["bound"], shown["latency"]) == (float(chain.bound), chain.latency_cycles)
    assert dict(shown["budget"]) == {name: float(value) for name, value in chain.budget.items()}
    assert sum(each["share"] for each in shown["stages"]) == pytest.approx(shown["bound"])
    assert shown["cost"]["luts"] == sum(core.estimates[0].luts for core in chain.stages)
    assert [each["cost"]["luts"] for each in shown["stages"]] == [core.estimates[0].luts for core in chain.stages]
    gain = 20 * np.log10(np.maximum(abs(chain.frequency_response(whole["f"])), 1e-12))
    product, heard = np.sum([whole["stages"][name] for name in chain.gains], axis=0), gain > -100  # not in a notch
    assert np.array(whole["db"])[heard] == pytest.approx(gain[heard], abs=1e-3)
    assert np.array(whole["db"])[heard] == pytest.approx(product[heard], abs=1e-3)
    assert [list(each) for each in shown["chain"]["limits"]] == [list(each) for each in chain.bands]
    (limit,) = (db for _, _, db, _ in shown["chain"]["limits"])
    assert max(whole["aliases"]["folds"]) <= limit + 1e-6
    assert [table["title"] for table in shown["tables"]] == [table.title for table in chain.tables()]


def test_what_folds_to_a_frequency_is_the_largest_that_does() -> None:
    falling = {"name": "low", "kind": "fir", "taps": [0.5, 0.5], "decimate": 3}
    rising = {"name": "high", "kind": "fir", "taps": [0.5, -0.5], "decimate": 3}
    again = {"name": "again", "kind": "gain", "factor": 0.5}
    for stages, images in (
        ([falling], [1750.0, 2250.0]),
        ([rising], [1750.0, 2250.0]),
        ([falling, {**rising, "decimate": 2}, again], [750.0, 1250.0, 1750.0, 2250.0, 2750.0]),
    ):
        ideal = sosmith.ChainSpecification.load({**PLAIN, "sample_rate": 6000, "stage": stages}).filter
        found = ideal.aliases(5 if len(images) == 2 else 3)
        assert found is not None
        f, stays, folds = found
        assert f[1] == 250.0
        assert stays[1] == pytest.approx(abs(ideal.frequency_response(250.0)))
        assert folds[1] == pytest.approx(max(abs(ideal.frequency_response(images))))


def test_the_integers_of_results_in_turn_are_those_of_the_filter(session: Session) -> None:
    """By taps, which are used as they are, and by edges, which are times the factor."""
    tree = {**PLAIN, "stage": BETWEEN, "output": {"bits": 8, "range": [-2.0, 2.0], "signed": True}}
    say(session, do="text", text=sosmith.ChainSpecification.load(tree).toml())
    known = proven(session)
    for asked, made in zip(known["preview"]["stages"], known["design"]["stages"], strict=True):
        at = [k for k, db in enumerate(asked["response"]["db"]) if db > -20]
        assert [made["f"][k] for k in at] == [asked["response"]["f"][k] for k in at]
        assert [made["db"][k] for k in at] == pytest.approx([asked["response"]["db"][k] for k in at], abs=0.05)
        assert len(made["sections"]) == 2
    say(session, do="trace", source="noise", seconds=0.05)
    found = until(session, lambda known: known["trace"]["state"] == "done")["trace"]
    assert found["samples"] == 4 * 400
    assert found["max_error"] <= found["bound"]
    assert found["channels"][0]["truth"] is None
    assert found["t"] == sorted(found["t"])


def test_realizations_of_a_stage_are_compared(session: Session) -> None:
    say(session, do="text", text=TEXT)
    proven(session)
    say(session, do="realizations", on=True, stage=2)
    rows = until(session, lambda known: known["realizations"]["state"] == "done")["realizations"]["rows"]
    made = {row["realization"]: row.get("bound") for row in rows}
    stage = {**PLAIN["stage"][2], "realization": "fir_direct"}
    assert made["fir_direct"] == float(sosmith.design_chain({**PLAIN, "stage": [*PLAIN["stage"][:2], stage]}).bound)
    say(session, do="realizations", on=False)


def test_an_error_stands_at_its_stage(session: Session) -> None:
    say(session, do="text", text=TEXT.replace("order = 2", "order = 13"))
    known = until(session, lambda known: known["proof"]["state"] == "refused")
    assert known["proof"]["wrong"] == ["order must be a whole number from 1 to 12, not 13", "", ""]
    assert known["document"]["keys"]["stage"][0]["order"] == 13
    for error, wrong in (
        ("x.toml: stage[1].taps must be a\n  stage[0].order must be b", ["order must be b", "taps must be a"]),
        ("x.toml: stage b_p1: filter.kind must be c", ["", "band must be c"]),
        ("stage a: filter's edges and losses must be met", ["edges and losses must be met", ""]),
        ("x.toml: stage[7].name must be d", ["", ""]),
        ("x.toml: output must be e", ["", ""]),
    ):
        assert errors_by_stage(error, ["a", "b"]) == wrong


def test_every_change_is_undone_but_what_is_dragged_is_one(session: Session) -> None:
    before = say(session, do="text", text=TEXT)
    for value in (3, 4, 5):
        say(session, do="change", changes={"stage.0.order": value}, moving=True)
    dragged = say(session, do="change", changes={"stage.0.order": 6})
    assert dragged["undo"] == before["undo"] + 1
    moved = say(session, do="stages", what="move", at=0, to=2)
    assert [stage["name"] for stage in moved["keys"]["stage"]] == ["double", "out", "slow"]
    assert say(session, do="undo")["text"] == dragged["text"]
    assert say(session, do="undo")["text"] == TEXT
    assert say(session, do="redo")["text"] == dragged["text"]
    added = say(session, do="stages", what="add", kind="gain", at=0)
    assert (added["redo"], added["undo"]) == (0, dragged["undo"] + 1)
    known = say(session, do="text", text="name = ")
    assert (known["readable"], known["keys"]) == (False, added["keys"])
    assert say(session, do="stages", what="remove", at=0)["text"] == "name = "
    assert say(session, do="undo")["text"] == added["text"]
    history = History("0")
    for k in range(1, STEPS + 9):
        history.take(str(k), moving=False)
    assert history.steps == (STEPS, 0)
    assert [history.undone() for _ in range(STEPS + 1)][-2:] == ["8", None]


@pytest.mark.parametrize(
    "text", ["", "stage = 1", "stage = [1, {}]", "[[stage]]\n" * 3, "sample_rate = 'x'\n[[stage]]"]
)
def test_no_text_ends_the_session(session: Session, text: str) -> None:
    known = say(session, do="text", text=text)
    for what in ("move", "remove", "add", "split", "chosen"):
        known = say(session, do="stages", what=what, kind="cic", at=1, to=0)
    assert known["text"]
    until(session, lambda known: known["proof"]["state"] == "refused")


def test_chosen_stages_are_written_into_the_text(tmp_path: Path) -> None:
    limits = {"passband_edge": 300.0, "passband_loss": 0.5, "stopband_loss": 40.0}
    auto = {"name": "down", "kind": "auto", "decimate": 2, **limits}
    with session_in(tmp_path, sosmith.ChainSpecification.load({**PLAIN, "stage": [auto]}).toml()) as session:
        known = proven(session)
        assert (known["preview"]["stages"], known["preview"]["chain"]) == ([None], None)
        assert known["design"]["tables"][0]["title"].startswith("rx: structures")
        bound = known["design"]["bound"]
        written = say(session, do="stages", what="chosen")["keys"]
        assert (written["limits"], written["stage"]) == (limits, known["design"]["chosen"]["stage"])
        assert proven(session)["design"]["bound"] == bound
