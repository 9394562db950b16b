"""What folds into the pass band, of decimator and filter together: no sine exceeds the claim, and one comes close."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
import pytest

import sosmith
from sosmith.gen.filter.decimation import Decimation, decimated
from sosmith.gen.filter.response import complex_response
from sosmith.gen.specification.specification import FilterSpec

SEEDS = range(20)


def drawn(seed: int) -> tuple[FilterSpec, Decimation]:
    """Draw a filter by order and cutoff, and a decimator before it; odd seeds have ripple in the pass band."""
    rng = random.Random(f"passband {seed}")
    factor = 1 << rng.randint(1, 5)
    rate, ratio = Fraction(1000), Fraction(rng.randint(20, 240), 1000)
    ripple = seed % 2 == 1
    spec = FilterSpec(
        family="chebyshev1" if ripple else rng.choice(["butterworth", "bessel"]),
        kind="lowpass",
        method="bilinear",
        order=rng.randint(1, 6),
        cutoff=(ratio * rate / factor,),
        passband_edge=None,
        stopband_edge=None,
        passband_loss=Fraction(rng.randint(1, 300), 100) if ripple else None,
        stopband_loss=None,
        sos=None,
    )
    decimation = Decimation(factor=factor, stages=rng.randint(1, 6), sample_rate=rate, edge=ratio * rate / factor)
    return spec, decimation


@pytest.mark.parametrize("seed", SEEDS)
def test_no_sine_exceeds_the_claim(seed: int) -> None:
    spec, decimation = drawn(seed)
    filter_ = decimated(spec, decimation)
    rate = float(decimation.rate)
    out = np.linspace(0, float(decimation.edge), 4001)[1:]
    own = np.abs(complex_response(filter_.sos, out, rate))
    for band, claim in enumerate(decimation.passing(filter_), start=1):
        below, above = (decimation.gain(band * rate + side * out) * own for side in (-1, 1))
        assert max(below.max(), above.max()) <= float(claim.gain) * (1 + 1e-9)
        assert below.max() >= float(claim.gain) * (1 - 2e-3)
        assert 0 <= claim.at * decimation.rate <= decimation.edge + decimation.rate / 2**16


def test_ripple_and_correction_count() -> None:
    """What the decimator lets through alone is less than what comes out."""
    larger = 0
    for seed in SEEDS:
        spec, decimation = drawn(seed)
        (whole,) = decimation.passing(decimated(spec, decimation), bands=1)
        larger += whole.gain > decimation.worst_aliasing
    assert 0 < larger < len(SEEDS)


@pytest.mark.slow
def test_a_sine_through_the_chain() -> None:
    specification = sosmith.Specification.load(
        {
            "name": "al",
            "sample_rate": 1000.0,
            "input": {"x": {"bits": 16, "range": [-1.0, 1.0], "signed": True}},
            "filter": {
                "family": "chebyshev1",
                "kind": "lowpass",
                "order": 3,
                "cutoff": 120.0,
                "passband_loss": 0.01,
                "decimate": 2,
            },
            "output": {"bits": 16, "range": [-2.0, 2.0], "signed": True, "max_error": 0.00036},
        }
    )
    design = sosmith.design(specification)
    claim = design.facts.decimation
    assert claim is not None
    assert claim.worst_aliasing <= 0.00036
    n = np.arange(4000)
    reached = 0.0
    for frequency in np.linspace(380.1, 500.0, 41):
        exact = design.run_exact(x=np.sin(2 * np.pi * frequency * n / 1000.0 + 0.3))[500:]
        reached = max(reached, float(abs(exact).max()))
    step = float(specification.checked.inputs[0].lsb)
    assert reached <= claim.worst_aliasing + 2 * step
    assert reached > claim.worst_aliasing / 2
