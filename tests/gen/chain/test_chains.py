"""Random chains: no error exceeds the bound, no port between stages limits anything, and no sine exceeds what folds."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.chain.chains import KINDS, draw, exact, flags, response, steps_of, stimulus

import sosmith

SEEDS = range(24)
FEW = (1, 5)
SAMPLES = 900
CASES = [pytest.param(seed, marks=[] if seed in FEW else pytest.mark.slow) for seed in SEEDS]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("seed", CASES)
def test_a_chain_keeps_to_what_it_claims(seed: int, tmp_path: Path) -> None:
    chain = sosmith.design_chain(draw(seed))
    base, bound = chain.core.spec.base, chain.core.bound
    assert bound <= base.max_error

    codes = stimulus(chain, SAMPLES, seed)
    results = chain.run_codes(x=codes).reshape(-1, base.channels)
    assert len(results) == -(-SAMPLES // chain.factor)
    (port,), output = base.inputs, base.output
    low, high = (output.zero + output.lsb * code for code in (output.lowest, output.highest))
    worst, within = Fraction(0), 0
    for k in range(base.channels):
        values = [port.zero + port.lsb * int(code) for code in codes[:, k]]
        for code, value in zip(results[:, k].tolist(), exact(chain, values), strict=True):
            worst = max(worst, abs(output.zero + output.lsb * code - min(max(value, low), high)))
            within += low < value < high
    assert worst <= bound
    assert worst > bound / 4 or within < 20

    _, status = chain.core.compute_with_status(codes[:, :, None])
    for k in range(base.channels):
        assert np.array_equal(status[:, k] & 1, flags(chain, codes[:, k]))
        settling = np.flatnonzero(status[:, k] & 32)
        assert np.array_equal(settling, np.arange(min(chain.core.settling, len(status))))
    assert (chain.core.settling > 0) == (base.hardware.start == "zero")

    between: np.ndarray = codes[:, :, None]
    for stage in chain.core.stages[:-1]:
        between = stage.design.datapath.compute(between)[:, :, None]
        assert stage.output.lowest < between.min()
        assert between.max() < stage.output.highest

    check_sines(chain)
    chain.generate(tmp_path)
    (tmp_path / "chain.toml").write_text(chain.specification.toml(), encoding="utf-8")
    proof = sosmith.ChainCertificate.load(tmp_path / f"{chain.name}.certificate.json").verify(
        spec=tmp_path / "chain.toml", files=tmp_path
    )
    states = {name: part.state.value for name, part in proof.scope.items()}
    assert {states[name] for name in ("chain", "stages", "top", "arithmetic", "filter", "c_model")} == {"proven"}
    table = draw(seed)
    guarded = any("protect" in stage or "reload" in stage for stage in table["stage"])
    assert not proof.missing or guarded or any("decimated" in kind for kind in kinds_of(table))
    assert proof.bound == pytest.approx(chain.bound, rel=1e-9)


def check_sines(chain: sosmith.Chain) -> None:
    """Search for a sine that comes out at another frequency with more than is claimed."""
    factor = chain.factor
    assert set(chain.folding) <= {"anywhere", "passband"}
    assert ("anywhere" in chain.folding) == (factor > 1)
    if factor == 1:
        return
    frequencies = np.linspace(0.5 / factor, 0.5, 6001)
    gains = gains_at(chain, frequencies)
    claimed, at = chain.folding["anywhere"]
    assert gains.max() <= claimed * (1 + 1e-9)
    assert gains_at(chain, np.array([at / 64000]))[0] == pytest.approx(claimed, rel=2e-3)
    if "passband" in chain.folding:
        (folding,) = chain.core.foldings
        edge = float(folding.edge or 0)
        distance = np.abs(frequencies * factor - np.round(frequencies * factor)) / factor
        passing = gains[(distance <= edge) & (np.round(frequencies * factor) >= 1)]
        assert passing.max() <= chain.folding["passband"][0] * (1 + 1e-9)


def gains_at(chain: sosmith.Chain, frequencies: np.ndarray) -> np.ndarray:
    gains, step = np.ones(frequencies.shape), 1
    for sections, factor in steps_of(chain):
        z = np.exp(-2j * np.pi * frequencies * step)
        for b, a in sections:
            over, under = (sum(float(c) * z**k for k, c in enumerate(taps)) for taps in (b, a))
            gains = gains * np.abs(over / under)
        step *= factor
    return gains


@pytest.mark.slow
def test_gains_to_the_end_are_those_of_responses() -> None:
    """A gain that is claimed is the sum of the magnitudes of what an impulse behind the stage makes at the end."""
    chain = sosmith.design_chain(draw(5))
    whole = np.abs(response(chain)).sum()
    ends = [abs(port.lsb * code) for port in chain.core.spec.base.inputs for code in (port.lowest, port.highest)]
    largest = float(max(ends))
    assert float(chain.core.stages[-1].reach) == pytest.approx(whole * largest, rel=1e-6)
    assert chain.gains[chain.core.stages[-1].spec.name] == 1


def kinds_of(table: dict[str, Any]) -> set[str]:
    """Return the kinds of a chain's stages; one with poles behind a decimator, not proven as a whole, apart."""
    return {
        f"decimated {stage['kind']}" if "decimate" in stage and stage["kind"] == "iir" else stage["kind"]
        for stage in table["stage"]
    }


def test_the_draws_are_of_all_kinds() -> None:
    tables = [draw(seed) for seed in SEEDS]
    assert {kind for table in tables for kind in kinds_of(table)} == set(KINDS)
    assert {len(table["stage"]) for table in tables} == {2, 3, 4}
    assert {table["channels"] for table in tables} == {1, 3}
    assert {table["hardware"].get("start", "steady") for table in tables} == {"steady", "zero"}
    assert {stage.get("protect", "none") for table in tables for stage in table["stage"]} == {
        "none",
        "detect",
        "correct",
    }
    assert {stage.get("reload", False) for table in tables for stage in table["stage"]} == {False, True}
