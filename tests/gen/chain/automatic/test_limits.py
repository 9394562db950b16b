"""Limits of a whole chain, of stages that are given: every refusal word for word, and what is proven of the rest."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import pytest
from tests.gen.chain.automatic.asked import TREE, losses

import sosmith
from sosmith.model.errors import ShortfallError, SpecificationError

LIMITS = {"passband_edge": 100.0, "passband_loss": 1.0, "stopband_loss": 20.0, "stopband_edge": 2000.0}
GIVEN: dict[str, Any] = {
    "name": "rx",
    "sample_rate": 8000.0,
    "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    "stage": [
        {"name": "slow", "kind": "cic", "order": 2, "decimate": 2},
        {"name": "out", "kind": "fir", "taps": [0.25, 0.5, 0.25], "decimate": 2},
    ],
    "limits": LIMITS,
    "output": {"bits": 10, "range": [-1.0, 1.0], "signed": True},
}

Change = Callable[[dict[str, Any]], object]


def limit(**keys: Any) -> Change:
    return lambda tree: tree["limits"].update(keys)


def auto(**keys: Any) -> Change:
    def change(tree: dict[str, Any]) -> None:
        del tree["limits"]
        tree["stage"] = [TREE["stage"][0] | keys]

    return change


def without(key: str) -> Change:
    def change(tree: dict[str, Any]) -> None:
        auto()(tree)
        tree["stage"][0] = {name: value for name, value in tree["stage"][0].items() if name != key}

    return change


def several(tree: dict[str, Any]) -> None:
    del tree["limits"]
    tree["stage"] = [TREE["stage"][0], TREE["stage"][0] | {"name": "more", "decimate": 2}]


REFUSED: list[tuple[Change, str]] = [
    (
        limit(ripple=1.0),
        "limits.ripple must be one of the keys passband_edge, passband_loss, stopband_loss, stopband_edge, not an "
        "unknown one",
    ),
    (
        limit(passband_edge=1000.0),
        "limits.passband_edge must be above 0 and below half the output rate (1000 Hz), not 1000",
    ),
    (limit(passband_loss=0.0), "limits.passband_loss must be from 0.001 to 20 dB, not 0"),
    (limit(stopband_loss=181), "limits.stopband_loss must be from 1 to 180 dB, not 181"),
    (limit(stopband_loss="80"), "limits.stopband_loss must be a number, not '80': write 80, without quotes and unit"),
    (
        limit(stopband_edge=100.0),
        "limits.stopband_edge must be above passband_edge (100 Hz) and below half the sample_rate (4000 Hz), not 100",
    ),
    (lambda tree: tree["limits"].pop("passband_loss"), "limits.passband_loss must be a loss in dB, not missing"),
    (lambda tree: tree.update(limits=3), "limits must be a table, not 3"),
    (
        lambda tree: tree.update(stage=[{"name": "a", "kind": "fir", "taps": [1.0]}]),
        "not yet available: limits must be left out unless the stages decimate, and none of them interpolates, not "
        "given",
    ),
    (
        lambda tree: tree.update(stage=[*tree["stage"], {"name": "up", "kind": "cic", "order": 1, "interpolate": 2}]),
        "not yet available: limits must be left out unless the stages decimate, and none of them interpolates, not "
        "given",
    ),
    (
        lambda tree: tree.update(stage=[TREE["stage"][0]]),
        "limits must be left out beside a stage auto, which has its own, not given",
    ),
    (
        lambda tree: tree.update(stage=[TREE["stage"][0], *tree["stage"]]),
        "limits must be left out beside a stage auto, which has its own, not given",
    ),
    (
        several,
        "not yet available: stage[1].kind must be another kind beside a stage auto, of which there is one at most, not "
        "'auto'",
    ),
    (limit(first="no"), "limits.first must be the name of a stage: slow, out, not 'no'"),
    (limit(last=3), "limits.last must be the name of a stage: slow, out, not 3"),
    (limit(first="out", last="slow"), "limits.last must be the name of a stage from out on, not 'slow'"),
    (
        auto(decimate=134),
        "stage[0].decimate must be a product of factors up to 64, by which stages can decimate, not 134",
    ),
    (auto(decimate=4097), "stage[0].decimate must be a whole number from 2 to 4096, not 4097"),
    (without("decimate"), "stage[0].decimate must be a whole number from 2 to 4096, not missing"),
    (without("passband_edge"), "stage[0].passband_edge must be a frequency in Hz, not missing"),
    (
        auto(taps=[1.0]),
        "stage[0].taps must be one of the keys name, kind, decimate, passband_edge, passband_loss, stopband_loss, "
        "stopband_edge in a stage of the kind auto, not an unknown one",
    ),
    (
        auto(protect="none"),
        "stage[0].protect must be one of the keys name, kind, decimate, passband_edge, passband_loss, stopband_loss, "
        "stopband_edge in a stage of the kind auto, not an unknown one",
    ),
]


@pytest.mark.parametrize(("change", "sentence"), REFUSED)
def test_limits_that_cannot_be_are_refused(change: Change, sentence: str) -> None:
    tree = copy.deepcopy(GIVEN)
    change(tree)
    with pytest.raises(SpecificationError) as refused:
        sosmith.ChainSpecification.load(tree)
    assert str(refused.value) == f"specification: {sentence}"


def test_an_unknown_key_of_limits_is_refused_with_those_of_stages() -> None:
    tree = GIVEN | {"limits": LIMITS | {"from": "out"}}
    with pytest.raises(SpecificationError, match=r"^specification: limits\.from must be one of the keys passband_edge"):
        sosmith.ChainSpecification.load(tree)


def test_limits_of_some_stages_are_those_of_these_stages_alone() -> None:
    """A gain of 2 before them, and a pole behind them, change nothing of what is asked."""
    before, behind = (
        {"name": "twice", "kind": "gain", "factor": 2.0},
        {"name": "pole", "kind": "iir", "family": "butterworth", "order": 1, "cutoff": 50.0},
    )
    tree = GIVEN | {"stage": [before, *GIVEN["stage"], behind], "limits": LIMITS | {"first": "slow", "last": "out"}}
    tree["output"] = {"bits": 10, "range": [-4.0, 4.0], "signed": True}
    chain, alone = sosmith.design_chain(tree), sosmith.design_chain(GIVEN)
    assert chain.core.limited == alone.core.foldings[0]
    assert chain.passband == alone.passband
    assert [each.kept for each in chain.core.foldings] == [None]
    assert chain.core.spec.edge == 50
    tables = [table.title for table in chain.tables()]
    assert any(title.startswith("Pass band of slow to out, up to 100 Hz") for title in tables), tables


def test_a_chain_inside_its_limits_has_its_gains_proven() -> None:
    chain = sosmith.design_chain(GIVEN)
    ripple, alias, stopped = losses(chain, GIVEN | {"stage": [LIMITS | {"decimate": 4}]})
    (folding,) = chain.core.foldings
    assert folding.kept is not None
    assert folding.kept.stopped is not None
    assert folding.passing is not None
    most = float(folding.kept.most.gain)
    for peak, down in ((folding.kept.least, ripple), (folding.passing, alias), (folding.kept.stopped, stopped)):
        assert down is not None
        assert float(peak.gain) == pytest.approx(most * 10 ** (-down / 20), rel=2e-3)
    assert ripple <= 1.0
    assert chain.specification.checked.edge == 100


@pytest.mark.parametrize(
    ("change", "excess"),
    [
        (limit(passband_loss=0.01), "passband_loss: 0.0670 dB, not at most 0.01 dB"),
        (limit(stopband_loss=60), "stopband_loss: aliases into the pass band are 49.57 dB down, not 60 dB"),
        (limit(stopband_edge=1200.0), "stopband_loss: gains from stopband_edge on are 11.24 dB down, not 20 dB"),
    ],
)
def test_a_chain_outside_its_limits_is_refused_with_what_it_reaches(change: Change, excess: str) -> None:
    tree = copy.deepcopy(GIVEN)
    change(tree)
    with pytest.raises(ShortfallError) as refused:
        sosmith.design_chain(tree)
    assert str(refused.value).startswith("specification: the limits of the chain must be kept, and are not: ")
    assert excess in str(refused.value)


def test_a_gain_of_nothing_in_the_pass_band_is_refused() -> None:
    tree = copy.deepcopy(GIVEN)
    tree["stage"][1]["taps"] = [0.5, -0.9659258262890683, 0.5]
    tree["limits"] = {"passband_edge": 500.0, "passband_loss": 20.0, "stopband_loss": 1.0}
    with pytest.raises(ShortfallError, match=r"passband_loss: a gain of 0, not at most 20 dB"):
        sosmith.design_chain(tree)


def test_other_coefficients_of_a_stage_keep_to_the_limits_too() -> None:
    mixing = {"name": "mix", "kind": "fir", "taps": [0.3, 0.6, 0.3], "reload": True}
    tree = copy.deepcopy(GIVEN)
    tree["stage"] = [GIVEN["stage"][0], mixing, GIVEN["stage"][1]]
    tree["limits"] |= {"passband_loss": 0.15}
    tree["output"] |= {"range": [-2.0, 2.0], "max_error": 0.02}
    chain = sosmith.design_chain(tree)
    tree["stage"][1] = mixing | {"taps": [0.25, 0.625, 0.25]}
    assert chain.reload(tree, reset=True).stage == "mix"
    tree["stage"][1] = mixing | {"taps": [0.3, 0.1, 0.3]}
    with pytest.raises(ShortfallError) as refused:
        chain.reload(tree, reset=True)
    assert str(refused.value).endswith(
        "the limits of the chain must be kept with the set, and are not: passband_loss: 0.159 dB, not at most 0.15 dB: "
        "nothing is to be loaded"
    )
