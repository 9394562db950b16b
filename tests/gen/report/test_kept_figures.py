"""Figures of a report, between commands: those of the same run are drawn once, and any other run has its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from tests.gen.report.evidences import changed, evidence, facts

from sosmith.gen.report.behaviour import Behaviour, behaviour
from sosmith.gen.report.evidence import Alternative, Evidence
from sosmith.gen.report.figures import kept, painting
from sosmith.gen.report.figures.figure import Figure, Figures, Realized

CACHE_FOLDER = kept.cache_folder

RUN = evidence()

ERROR = Figure(title="Error", drawing="<svg/>", caption="«½\u00a0LSB»", legend=[("golden", "", "it")])
MADE = Figures({"error": ERROR, "step": None}, [Realized("section0", "<svg/>", ["v = x"], ["a1 = 3"])])


class Drawer:
    """Counts how often it draws."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self, shown: Evidence, measured: Behaviour, *, sound: bool) -> Figures:
        self.calls += 1
        return MADE

    def asked(self, shown: Evidence) -> Figures:
        return kept.figures_for(shown, behaviour(RUN), sound=False)


@pytest.fixture
def drawer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Drawer:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(kept, "cache_folder", CACHE_FOLDER)
    drawn = Drawer()
    monkeypatch.setattr(kept, "_drawn", drawn)
    return drawn


def test_the_same_run_is_drawn_once_however_fast_it_was(drawer: Drawer) -> None:
    assert [drawer.asked(RUN), drawer.asked(replace(RUN, wall_seconds=2.5, cycles_per_second=1.0))] == [MADE] * 2
    assert drawer.calls == 1


def one_sample_off() -> Evidence:
    hardware = RUN.run.hardware.copy()
    hardware[77] += 1 / 4096
    return changed(RUN, hardware=hardware)


@pytest.mark.parametrize(
    "other",
    [
        one_sample_off(),
        changed(RUN, golden=np.nextafter(RUN.run.golden, 0)),
        changed(RUN, unfiltered=RUN.run.golden),
        changed(RUN, differs=~RUN.run.differs),
        replace(RUN, facts=replace(RUN.facts, filter=facts(sample_rate=101.0))),
        replace(RUN, alternatives=(Alternative(name="df1", max_abs=0.4, rms=0.2),)),
    ],
    ids=["hardware", "golden", "unfiltered", "differs", "filter", "alternatives"],
)
def test_any_other_run_is_drawn_anew(other: Evidence, drawer: Drawer) -> None:
    for each in (RUN, other):
        drawer.asked(each)
    assert drawer.calls == 2


def test_other_sources_draw_anew(drawer: Drawer, monkeypatch: pytest.MonkeyPatch) -> None:
    drawer.asked(RUN)
    monkeypatch.setattr(kept, "digest_of_sources", lambda *_: "others")
    drawer.asked(RUN)
    assert drawer.calls == 2


def test_what_cannot_be_told_apart_is_drawn_each_time(drawer: Drawer, tmp_path: Path) -> None:
    loose: Any = (lambda: None,)
    for _ in range(2):
        assert drawer.asked(replace(RUN, recursions=loose)) == MADE
    assert drawer.calls == 2
    assert [*(tmp_path / "sosmith" / "figures").iterdir()] == []


def test_a_picture_does_not_follow_a_users_own_style() -> None:
    def drawn() -> str:
        return painting.draw("it", "It", 200, 100, lambda figure: figure.subplots().plot([1, 2]) and None)

    plain = drawn()
    style = {"lines.linewidth": 9.0, "axes.titlesize": 40, "xtick.direction": "in", "figure.facecolor": "red"}
    with mpl.rc_context(style):
        assert drawn() == plain
