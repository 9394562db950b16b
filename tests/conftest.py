"""What holds for every test: which cases run always, how signals are taken, and what is no garbage."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers

from tests.suite.sweeps import covering

settings.register_profile("sosmith", derandomize=True, deadline=None)  # the same cases every time, however slow
settings.load_profile("sosmith")
# Hypothesis also draws numbers that stand in our modules: reading all of them takes longer than most folders of tests,
# and which they are depends on what was imported before.
vars(providers)["_get_local_constants"] = lambda: providers._local_constants

pytest_plugins = ["pytester", "tests.suite.kept_designs", "tests.suite.native_yosys", "tests.suite.parts"]


@pytest.hookimpl(tryfirst=True)  # before `-m` takes its choice
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the cases of a sweep that do not run always as slow; let tests marked so come first."""
    items.sort(key=lambda item: item.get_closest_marker("first") is None)
    sweeps: dict[str, list[pytest.Function]] = {}
    for item in items:
        if isinstance(item, pytest.Function) and item.get_closest_marker("sweep") and hasattr(item, "callspec"):
            sweeps.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for cases in sweeps.values():
        mark = cases[0].get_closest_marker("sweep")
        assert mark is not None
        # Those that are slow for another reason cover nothing for the fast part.
        fast = [case for case in cases if not case.get_closest_marker("slow")]
        kept = covering([case.callspec.indices for case in fast], *mark.args)
        for number, case in enumerate(fast):
            if number not in kept:
                case.add_marker(pytest.mark.slow)


def pytest_collection() -> None:
    """Collect no garbage while some ten thousand tests are made."""
    gc.disable()


def pytest_collection_finish() -> None:
    """Keep the collector of garbage from looking at all tests again and again: they are not let go before the end."""
    gc.freeze()
    gc.set_threshold(20_000)
    gc.enable()


def _unmoved(number: int, frame: object) -> None:
    """Take a signal as if it were ignored; but unlike one that is, programs started from here do not inherit that."""


IGNORED = signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
"""Whether hang-ups are ignored by who started the tests, as under nohup."""

SIGNALS = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
    signal.SIGHUP: _unmoved if IGNORED else signal.SIG_DFL,
}
"""How each test finds the signals, and every process that it starts, whoever ignores some: nohup, a script's job."""


@pytest.fixture(autouse=True)
def _signals() -> Iterator[None]:
    """Put the signals right before a test, and what commands in this process make of them afterwards."""
    for number, handler in SIGNALS.items():
        signal.signal(number, handler)
    yield
    for number, handler in SIGNALS.items():
        signal.signal(number, handler)


SEARCHING = ("word_lengths", "realizations", "proof", "test_core.py")
"""Below ``tests/gen``: tests that change what the search for formats does, or that are about it."""


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of this run alone, one for all of its processes."""
    own = tmp_path_factory.getbasetemp()
    return own.parent if "PYTEST_XDIST_WORKER" in os.environ else own


@pytest.fixture(scope="session")
def _formats(run_folder: Path) -> Path:
    """Return a folder for the formats that the search comes to."""
    folder = run_folder / "formats"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture
def searches_anew(request: pytest.FixtureRequest) -> bool:
    """Whether a test is about the search itself; one elsewhere that changes the search has it as a parameter, True."""
    within = request.path.relative_to(request.config.rootpath).parts[1:3]
    return len(within) == 2 and within[0] == "gen" and within[1] in SEARCHING


@pytest.fixture(autouse=True)
def _formats_are_kept(searches_anew: bool, monkeypatch: pytest.MonkeyPatch, _formats: Path) -> None:
    """Search for the formats of a design once a run, as a user's commands do, but anew where the search is tested."""
    kept = sys.modules.get("sosmith.gen.realizations.kept_formats")
    if kept is not None:
        monkeypatch.setattr(kept, "cache_folder", lambda: None if searches_anew else _formats)


@pytest.fixture(autouse=True)
def _bitstreams_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make each bitstream: tests put other programs in place of those that do."""
    kept = sys.modules.get("sosmith.gen.fpga.kept_bitstreams")
    if kept is not None:
        monkeypatch.setattr(kept, "cache_folder", lambda: None)


@pytest.fixture(autouse=True)
def _figures_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw the figures of each report: a test may look at them, or change what draws them."""
    kept = sys.modules.get("sosmith.gen.report.figures.kept")
    if kept is not None:
        monkeypatch.setattr(kept, "cache_folder", lambda: None)
