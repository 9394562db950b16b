"""Roundoff noise of the realizations against closed forms, exactly and measured.

The formulas are those of 1/A, (1 - w)/A and (1 - w)**2/A in THEORY sections 3.1 to 3.5, for a second-order
low-pass section of unity gain: w = 1/z, u = tan(pi fc / fs), a0 = 1 + u/Q + u**2. The error of a quantizer has
the variance 1/12 of the square of its step (rounding), or is shaped so that only its variance counts (floor).
"""

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
import pytest
from scipy import signal
from tests.gen.proven_stages import Ranges, proven_cascade, run

from sosmith.gen.filter.design import decay_length
from sosmith.gen.proof.linear_model import LinearModel, Source, linear_model
from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.model.dataflow.graph import Range
from sosmith.model.dataflow.structure import Stage
from sosmith.model.port import Port
from sosmith.model.sections.transposed_form import TransposedForm

Q = 2.24698  # the highest of a 7th-order Butterworth filter
CUTOFFS = (0.0015, 0.004, 0.01, 0.025, 0.05)
BITS = 30  # significant bits of a coefficient: what is left moves the poles by nothing that these tests can see
INPUT = Port.from_range("x", 27, -(1 << 26), 1 << 26, signed=True)
"""Wide, so that even b0 times its step is far above a step of y, and the quantization errors are white."""

SAMPLES = 1 << 22


def row_of(cutoff: float) -> tuple[float, ...]:
    u = math.tan(math.pi * cutoff)
    a0 = 1 + u / Q + u * u
    return u * u / a0, 2 * u * u / a0, u * u / a0, 1.0, 2 * (u * u - 1) / a0, (1 - u / Q + u * u) / a0


def plain(u: float, a0: float) -> float:
    """Power of the impulse response of 1/A: 30 dB per decade."""
    return Q * a0**2 * (1 + u * u) / (16 * u**3)


def once(u: float, a0: float) -> float:
    """Power of the impulse response of (1 - w)/A: 10 dB per decade."""
    return Q * a0**2 / (4 * u)


def twice(u: float, a0: float) -> float:
    """Power of the impulse response of (1 - w)**2/A: none."""
    return a0 * (1 + u * Q)


CLOSED_FORMS: dict[str, dict[str, Callable[[float, float], float]]] = {
    "df1": {"v": plain},
    "df1_ef1": {"v": once},
    "df1_ef2": {"v": twice},
    "df2t": {"v": plain, "t1": plain, "t2": plain},
    "delta": {"v": twice, "t1": once, "t2": plain},
    "delta, fine states": {"v": twice},
}
"""By realization and quantizer; for t2 of delta still without Delta squared."""

FINE = 24  # fraction bits that leave no noise of their own

CASES = [(realization, cutoff) for realization in CLOSED_FORMS for cutoff in CUTOFFS]


def closed_form(stage: Stage, realization: str, quantizer: str, cutoff: float) -> float:
    u = math.tan(math.pi * cutoff)
    gain = CLOSED_FORMS[realization][quantizer](u, 1 + u / Q + u * u)
    if isinstance(stage, TransposedForm) and quantizer == "t2":
        return float(gain * 4.0**stage.delta_exponent)
    return gain


@lru_cache(maxsize=32)
def section(case: str, cutoff: float) -> Stage:
    """Make the section with every quantizer at whole LSBs, or only that of y, and its ranges proven."""
    realization, _, fine = case.partition(", ")
    fracs = {"v": 0} | dict.fromkeys(("t1", "t2"), FINE if fine else 0)

    def build(x: Range, ranges: Ranges) -> Stage:
        form = SectionFormat(x=x, coefficient_bits=BITS, fracs=fracs, ranges=ranges)
        return REALIZATIONS[realization].build(row_of(cutoff), form, "section")

    (stage,) = proven_cascade([build], INPUT)
    return stage


@lru_cache(maxsize=1)
def noise() -> np.ndarray:
    return np.random.default_rng(11).integers(INPUT.lowest, INPUT.highest + 1, SAMPLES)


def quantizers(model: LinearModel) -> list[Source]:
    return [source for source in model.sources if source.name not in {"input", "constant"}]


def power(model: LinearModel, source: Source, node: int) -> float:
    """Sum of the squares of the impulse response from a source to a node."""
    a = [float(value) for value in model.denominator]
    impulse = np.zeros(decay_length(np.array([[1.0, 0.0, 0.0, *a]])))
    impulse[0] = 1
    return float(np.sum(signal.lfilter([float(value) for value in source.numerators[node]], a, impulse) ** 2))


@pytest.mark.parametrize(("realization", "cutoff"), CASES)
def test_exact_noise_gains_are_the_closed_forms(realization: str, cutoff: float) -> None:
    stage = section(realization, cutoff)
    model = linear_model(stage.graph)
    found = {s.name: power(model, s, model.output) for s in quantizers(model) if s.name in CLOSED_FORMS[realization]}
    expected = {name: closed_form(stage, realization, name, cutoff) for name in CLOSED_FORMS[realization]}
    assert found == pytest.approx(expected, rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("realization", "cutoff"), CASES)
def test_measured_noise_is_that_of_the_closed_forms(realization: str, cutoff: float) -> None:
    """Mean square of the integer model minus the same transfer function in double precision, within 0.2 dB."""
    stage = section(realization, cutoff)
    model = linear_model(stage.graph)
    transfer = [[float(value) for value in values] for values in (model.transfer, model.denominator)]
    error = run([stage], INPUT, noise()) - signal.lfilter(*transfer, noise().astype(float))
    settled = error[int(20 / cutoff) :]
    expected = sum(closed_form(stage, realization, name, cutoff) for name in CLOSED_FORMS[realization]) / 12
    assert abs(10 * math.log10(np.mean(settled**2) / expected)) < 0.2


@pytest.mark.parametrize(
    ("realization", "slope"), [("df1", -30), ("df1_ef1", -10), ("df1_ef2", 0), ("df2t", -30), ("delta", -10)]
)
def test_slope_over_the_cutoff(realization: str, slope: int) -> None:
    """Decibels per decade of the cutoff, over three octaves, in which Delta falls to an eighth."""
    levels = []
    for cutoff in (0.001, 0.008):
        model = linear_model(section(realization, cutoff).graph)
        levels.append(10 * math.log10(sum(power(model, source, model.output) for source in quantizers(model))))
    assert (levels[1] - levels[0]) / math.log10(8) == pytest.approx(slope, abs=0.5)


def test_scaled_delta_form_comes_near_the_minimum_of_all_structures() -> None:
    """THEORY 3.4: the states' noise, scaled by their power for white input, is 2.7838 in section 0 of F7.

    The minimum over all structures is Q**2/2 + 1/8 = 2.6495; the limit of the delta form is Q**2/2 + 1/4.
    """
    cutoff = math.atan(0.00813) / math.pi
    model = linear_model(section("delta", cutoff).graph)
    by_name = {section("delta", cutoff).graph.nodes[index].name: index for index in model.bounds}
    states = [source for source in quantizers(model) if source.name != "v"]
    total = sum(power(model, model.sources[0], by_name[s.name]) * power(model, s, model.output) for s in states)
    assert total == pytest.approx(2.7838, abs=5e-5)
    assert Q**2 / 2 + 1 / 8 < Q**2 / 2 + 1 / 4 < total < 1.01 * (Q**2 / 2 + 1 / 4)
