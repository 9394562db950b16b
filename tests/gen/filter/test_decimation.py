"""How far to decimate: droop corrected, aliasing bounded, delay known, and the choice of "auto"."""

import math
import re
from fractions import Fraction

import numpy as np
import pytest
from tests.gen.filter.decimations import RATE, decimation, lowpass

from sosmith.gen.filter.decimation import (
    Decimation,
    choose,
    decimated,
    decimated_step,
    group_delay,
    stages_for,
)
from sosmith.gen.filter.design import design, impulse_response
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port

EXACT = Fraction(1, 32000)  # a quarter of a micrometre of 8 mm


def response_at(made: Decimation, frequency: np.ndarray) -> np.ndarray:
    """Return the gain of the decimator as the sum over its impulse response."""
    port = Port(name="x", bits=8, signed=True, lsb=Fraction(1), zero=Fraction(0))
    cic = Decimator(input=port, factor=made.factor, stages=made.stages, dropped=0)
    taps = np.array(cic.impulse_response, dtype=np.float64) / made.factor**made.stages
    turns = np.exp(-2j * np.pi / float(made.sample_rate) * np.outer(frequency, np.arange(len(taps))))
    return turns @ taps


@pytest.mark.parametrize(("factor", "stages"), [(2, 1), (2, 4), (8, 3), (16, 4), (64, 5)])
def test_a_step_goes_through_as_in_integers(factor: int, stages: int) -> None:
    port = Port(name="x", bits=8, signed=True, lsb=Fraction(1), zero=Fraction(0))
    cic = Decimator(input=port, factor=factor, stages=stages, dropped=0)
    step = decimated_step(factor, stages)
    codes = np.repeat([0, 1], [factor, len(step) * factor])
    assert (step * factor**stages).tolist() == cic.exact(codes)[1:].tolist()
    assert step[-1] == 1 > step[-2]


@pytest.mark.parametrize(("factor", "stages"), [(2, 1), (8, 3), (16, 4), (64, 8)])
def test_the_correction_is_the_multiple_next_to_the_best(factor: int, stages: int) -> None:
    best = (math.sqrt(1 + stages * (1 - factor**-2) / 3) - 1) / 2
    assert decimation(factor, stages).correction == Fraction(round(best * 1024), 1024)


@pytest.mark.parametrize("order", [1, 2, 5, 6])
def test_the_correction_flattens_the_pass_band(order: int) -> None:
    """Whether there is a section of first order, which takes the zero, or none."""
    spec, found = lowpass(order), decimation()
    direct, plain = design(spec, RATE), design(spec, found.rate)
    corrected = found.corrected(plain)
    assert len(corrected.rows) == len(plain.rows) + (order % 2 == 0)
    assert found.deviation(corrected, direct) < 0.015
    assert found.deviation(plain, direct) > 0.09
    # Rows and exact sections are the same filter.
    exact = math.prod((sum(b) / sum(a) for b, a in corrected.exact), start=Fraction(1))
    assert corrected.dc_gain == pytest.approx(float(exact), abs=1e-12)
    assert corrected.describe.endswith(" Hz at 6.25 Hz, decimated by 16")


@pytest.mark.parametrize(("factor", "stages", "edge"), [(2, 1, "9"), (4, 3, "2.5"), (16, 4, "0.2587802")])
def test_aliasing_is_bounded_and_reached(factor: int, stages: int, edge: str) -> None:
    made = decimation(factor, stages, edge)
    assert len(made.aliasing) == factor // 2
    for band, bound in enumerate(made.aliasing, start=1):
        centre = band * float(made.rate)
        within = np.linspace(centre - float(made.edge), centre + float(made.edge), 801)
        gains = abs(response_at(made, within[within <= float(RATE) / 2]))
        assert gains.max() <= float(bound) * (1 + 1e-9) + 1e-15
        assert gains.max() == pytest.approx(float(bound), rel=1e-9, abs=1e-15)
    assert made.worst_aliasing == max(made.aliasing)


def test_response_and_delay() -> None:
    made = decimation()
    frequency = np.array([0.0, 0.1, 3.0, 6.25, 40.0])
    assert np.allclose(made.response(frequency), response_at(made, frequency), rtol=0, atol=1e-12)
    assert np.allclose(made.gain(frequency), abs(response_at(made, frequency)), rtol=0, atol=1e-12)
    filter_ = made.corrected(design(lowpass(), made.rate))
    response = impulse_response(filter_.sos)
    centre = (response * np.arange(len(response))).sum() / response.sum()
    assert float(group_delay(filter_.exact)) == pytest.approx(centre, rel=1e-9)
    assert float(made.delay(filter_)) == pytest.approx(centre / 6.25 + 4 * 15 / 2 / 100, rel=1e-9)


def test_the_locomotive() -> None:
    found, reason = choose(lowpass(), RATE, EXACT, 16)
    assert found is not None
    assert (found.factor, found.stages) == (16, 4)
    filter_, direct = decimated(lowpass(), found), design(lowpass(), RATE)
    assert found.delay(filter_) <= Fraction(11, 10) * group_delay(direct.exact) / RATE
    fewer = decimation(16, 3)
    assert fewer.worst_aliasing > EXACT >= found.worst_aliasing
    farther = stages_for(32, lowpass(), RATE, EXACT)
    assert farther is not None
    assert farther.delay(decimated(lowpass(), farther)) > Fraction(11, 10) * group_delay(direct.exact) / RATE
    assert reason == (
        "by 16: the largest power of two with a delay at most 10 % longer and a gain within 0.1 dB; 4 stages keep what "
        "folds into the pass band below -109.1 dB"
    )


def test_where_nothing_is_gained() -> None:
    found, reason = choose(lowpass(2, "20"), RATE, EXACT, 16)
    assert found is None
    assert reason == "none: no power of two has a delay at most 10 % longer and a gain within 0.1 dB"


def test_a_factor_that_is_asked_for() -> None:
    found, reason = choose(lowpass(decimate=4), RATE, EXACT, 16)
    assert found is not None
    assert (found.factor, found.stages) == (4, 3)
    assert reason.startswith("by 4: asked for in the specification; 3 stages keep")
    sentence = (
        "filter.decimate must be so small that a full-scale sine which folds into the pass band is at most "
        "output.max_error with 12 stages of at most 63 bits, not 64"
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(sentence)}$"):
        choose(lowpass(decimate=64), RATE, Fraction(1, 10**9), 16)
