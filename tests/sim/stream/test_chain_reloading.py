"""A stage that interpolates is loaded at random moments: all results of a sample have the taps of one set."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.sim.stream.chain_reloading import run

import sosmith
from sosmith.gen.chain.joints.turns import TurnsUnit
from sosmith.hdl.shell.bank_pins import BankPins

TAPS = [0.2517, 0.5031, 0.9123, 0.7517, 0.2531]


def tree(taps: list[float], channels: int = 1, **stage: Any) -> dict[str, Any]:
    """Return a chain whose last stage is two cores of different pace, with three taps and with two."""
    fill = {"name": "fill", "kind": "fir", "interpolate": 2, "taps": taps, "reload": True}
    return {
        "name": "up",
        "sample_rate": 8000.0,
        "channels": channels,
        "input": {"x": {"bits": 10, "range": [-1.0, 1.0], "signed": True}},
        "stage": [{"name": "pre", "kind": "gain", "factor": 0.703, "architecture": "parallel"}, fill | stage],
        "output": {"bits": 12, "range": [-4.0, 4.0], "signed": True, "max_error": 0.01},
        "hardware": {"clock": 24.0e6},
    }


def designed(channels: int = 1, **stage: Any) -> tuple[sosmith.Chain, list[sosmith.ChainReload]]:
    chain = sosmith.design_chain(tree(TAPS, channels, **stage))
    others = [[round(tap * by, 4) for tap in TAPS] for by in (0.5, 0.75, 0.97)]
    return chain, [chain.reload(tree(taps, channels, **stage), version=k) for k, taps in enumerate(others)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stage", "channels", "count", "simulator"),
    [
        ({"architecture": "folded"}, 1, 8, "icarus"),
        ({"architecture": "parallel"}, 1, 15, "icarus"),
        ({"architecture": "serial"}, 3, 15, "icarus"),
        ({"architecture": "folded", "protect": "correct", "reload_lock": True}, 3, 15, "icarus"),
        ({"architecture": "folded"}, 1, 100, "verilator"),
        ({"architecture": "parallel", "protect": "detect"}, 3, 100, "verilator"),
    ],
)
def test_loads_at_any_moment(stage: dict[str, Any], channels: int, count: int, simulator: str, tmp_path: Path) -> None:
    given, wanted, outcome = run(tmp_path, *designed(channels, **stage), count, simulator)
    assert outcome["swaps"][-1] == len(outcome["accepted"])
    assert len(set(outcome["swaps"])) > count // 2  # most sets were used by a sample
    assert given == wanted


def _always(unit: TurnsUnit) -> Iterator[str]:
    del unit
    yield "assign between = 1'h1;"


@pytest.mark.slow
@pytest.mark.parametrize("part", ["between", "begun"])
def test_a_bank_that_changes_within_a_sample_is_noticed(
    part: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    join = BankPins.join
    if part == "between":
        monkeypatch.setattr(TurnsUnit, "_swap", _always)
    else:
        monkeypatch.setattr(BankPins, "join", lambda pins, m, core, begun: join(pins, m, core, begun & 0))
    given, wanted, _ = run(tmp_path, *designed(architecture="folded"), 40)
    assert given != wanted


def test_a_set_for_all_cores_is_one_load() -> None:
    """Its words are those of the cores, one after the other, and what is proven is that of the worst of them."""
    chain, (loaded, *_) = designed(architecture="folded")
    words = [core.architecture.bank_size[0] for core in chain.core.stages[1].cores]
    assert loaded.writes["name"] == "up_fill"
    assert loaded.writes["words"] == sum(words) == len(loaded.writes["writes"]) - 2
    assert loaded.writes["design"] not in [core.architecture.fingerprint for core in chain.core.stages[1].cores]
    swaps = loaded._swap.swaps
    bounds = [
        float(swap.new_set.quantized.bound * core.datapath.output.lsb)
        for swap, core in zip(swaps, chain.core.stages[1].cores, strict=True)
    ]
    assert loaded.writes["error_bound"] == max(bounds) > min(bounds)
    assert loaded.writes["zero_frequency_gain"] == pytest.approx(sum(TAPS) / 4, rel=1e-3)
    assert loaded.writes["chain"]["error_bound"] <= 0.01


def test_taps_that_do_not_fit_are_refused() -> None:
    chain = sosmith.design_chain(tree(TAPS))
    with pytest.raises(
        sosmith.ShortfallError, match=r"must have the coefficients b0, b1, not b0, b1, b2: what is loaded"
    ):
        chain.reload(tree([*TAPS, 0.25]))
    too_large = copy.deepcopy(TAPS)
    too_large[1] = 3.5
    with pytest.raises(sosmith.ShortfallError, match=r"the set must (fit|keep) "):
        chain.reload(tree(too_large))
