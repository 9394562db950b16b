"""Many designs in every realization: never beyond the proven bound, and not far below it either.

Each design meets random full-scale samples, the sign-matched worst case of the whole filter and of every
quantizer's error path, and steps. `./run test --slow` runs all designs; the fast tests take every eighth. What no
lattice can be made of is refused in that realization; it gets further designs of its own.
"""

import re
from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest
from tests.gen.word_lengths.sweep_designs import REFUSED

from sosmith.gen.filter.design import decay_length, design, impulse_response
from sosmith.gen.realizations.registry import CASCADES, SECTIONS
from sosmith.gen.specification.specification import FilterSpec
from sosmith.gen.stimuli.error_paths import error_responses
from sosmith.gen.stimuli.worst_case_inputs import sign_matched
from sosmith.gen.word_lengths.quantize import quantize
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port
from sosmith.model.reference.golden import calibrated, filtered

RANDOM_SAMPLES = 1_000_000


class Design(NamedTuple):
    """One filter and its input and output width."""

    family: str
    kind: str
    order: int
    cutoff: tuple[float, ...]
    bits_in: int
    bits_out: int


def is_lattice(wanted: Design) -> bool:
    """Whether a filter is half the sum or difference of two allpass filters: known from the theory."""
    return wanted.order % 2 == 1 and wanted.family != "bessel"


DESIGNS = [
    Design("butterworth", "lowpass", 1, (0.001,), 8, 8),
    Design("butterworth", "lowpass", 2, (0.001,), 16, 16),
    Design("butterworth", "lowpass", 3, (0.0026,), 12, 16),
    Design("butterworth", "lowpass", 4, (0.0026,), 24, 24),
    Design("butterworth", "lowpass", 5, (1000 / 48000,), 16, 16),
    Design("butterworth", "lowpass", 6, (0.01,), 16, 12),
    Design("butterworth", "lowpass", 7, (0.002588,), 16, 16),
    Design("butterworth", "lowpass", 8, (0.05,), 16, 20),
    Design("butterworth", "lowpass", 9, (0.1,), 10, 14),
    Design("butterworth", "lowpass", 10, (0.2,), 16, 16),
    Design("butterworth", "lowpass", 10, (0.02,), 16, 16),
    Design("butterworth", "lowpass", 2, (0.45,), 16, 16),
    Design("butterworth", "lowpass", 5, (0.4,), 14, 10),
    Design("butterworth", "lowpass", 3, (0.25,), 18, 18),
    Design("butterworth", "highpass", 1, (0.001,), 16, 16),
    Design("butterworth", "highpass", 2, (0.005,), 16, 16),
    Design("butterworth", "highpass", 3, (0.02,), 12, 12),
    Design("butterworth", "highpass", 4, (0.1,), 16, 18),
    Design("butterworth", "highpass", 5, (0.25,), 8, 16),
    Design("butterworth", "highpass", 6, (0.4,), 16, 16),
    Design("butterworth", "bandpass", 1, (0.01, 0.02), 16, 16),
    Design("butterworth", "bandpass", 2, (0.05, 0.1), 16, 16),
    Design("butterworth", "bandpass", 3, (0.1, 0.3), 12, 16),
    Design("butterworth", "bandpass", 4, (0.2, 0.25), 16, 12),
    Design("butterworth", "bandstop", 2, (0.05, 0.1), 16, 16),
    Design("chebyshev1", "lowpass", 2, (0.005,), 16, 16),
    Design("chebyshev1", "lowpass", 3, (0.03,), 16, 24),
    Design("chebyshev1", "lowpass", 5, (0.1,), 12, 12),
    Design("chebyshev1", "lowpass", 6, (0.02,), 16, 16),
    Design("chebyshev1", "highpass", 4, (0.05,), 16, 16),
    Design("chebyshev1", "bandpass", 2, (0.1, 0.2), 16, 16),
    Design("chebyshev2", "lowpass", 4, (0.02,), 16, 16),
    Design("chebyshev2", "lowpass", 5, (0.2,), 14, 14),
    Design("chebyshev2", "highpass", 3, (0.1,), 16, 16),
    Design("elliptic", "lowpass", 3, (0.01,), 16, 16),
    Design("elliptic", "lowpass", 4, (0.05,), 16, 16),
    Design("elliptic", "lowpass", 6, (0.1,), 20, 20),
    Design("elliptic", "lowpass", 7, (0.02,), 16, 16),
    Design("elliptic", "highpass", 4, (0.3,), 16, 16),
    Design("elliptic", "bandpass", 2, (0.15, 0.2), 16, 16),
    Design("bessel", "lowpass", 4, (0.01,), 16, 16),
    Design("bessel", "lowpass", 3, (0.15,), 12, 12),
]

LATTICES = [
    Design("butterworth", "lowpass", 1, (0.45,), 16, 16),
    Design("butterworth", "lowpass", 3, (0.001,), 16, 16),
    Design("butterworth", "lowpass", 3, (0.45,), 12, 12),
    Design("butterworth", "lowpass", 7, (0.05,), 16, 24),
    Design("butterworth", "lowpass", 9, (0.02,), 16, 16),
    Design("butterworth", "lowpass", 9, (0.3,), 24, 20),
    Design("butterworth", "highpass", 7, (0.05,), 12, 14),
    Design("butterworth", "highpass", 9, (0.4,), 16, 16),
    Design("butterworth", "bandpass", 1, (0.2, 0.21), 20, 20),
    Design("butterworth", "bandpass", 3, (0.02, 0.04), 16, 16),
    Design("butterworth", "bandpass", 5, (0.1, 0.15), 12, 12),
    Design("butterworth", "bandstop", 1, (0.01, 0.011), 16, 16),
    Design("butterworth", "bandstop", 3, (0.05, 0.3), 14, 16),
    Design("chebyshev1", "lowpass", 1, (0.01,), 10, 10),
    Design("chebyshev1", "lowpass", 3, (0.002,), 16, 16),
    Design("chebyshev1", "lowpass", 9, (0.2,), 16, 16),
    Design("chebyshev1", "highpass", 5, (0.01,), 16, 16),
    Design("chebyshev1", "bandpass", 3, (0.2, 0.3), 8, 12),
    Design("chebyshev2", "lowpass", 3, (0.45,), 16, 16),
    Design("chebyshev2", "lowpass", 7, (0.05,), 18, 18),
    Design("chebyshev2", "highpass", 5, (0.3,), 24, 24),
    Design("chebyshev2", "bandpass", 3, (0.05, 0.1), 16, 14),
    Design("elliptic", "lowpass", 5, (0.1,), 8, 8),
    Design("elliptic", "lowpass", 9, (0.25,), 16, 16),
    Design("elliptic", "highpass", 3, (0.001,), 14, 14),
    Design("elliptic", "highpass", 7, (0.2,), 16, 12),
    Design("elliptic", "bandpass", 3, (0.15, 0.2), 16, 16),
]
"""Designs for the realization that takes only some of the others."""

ALL = [
    pytest.param(
        (number, realization), id=f"{number}-{realization}", marks=[] if number % 8 == 4 else [pytest.mark.slow]
    )
    for number in range(len(DESIGNS))
    for realization in SECTIONS
    if realization in CASCADES or is_lattice(DESIGNS[number])
] + [
    pytest.param(
        (number, "lattice_wdf"), id=f"{number}-lattice_wdf", marks=[] if number % 8 == 4 else [pytest.mark.slow]
    )
    for number in range(len(DESIGNS), len(DESIGNS) + len(LATTICES))
]


def quantized_design(number: int, realization: str) -> Quantized:
    wanted = [*DESIGNS, *LATTICES][number]
    ideal = design(
        FilterSpec(
            family=wanted.family,
            kind=wanted.kind,
            method="bilinear",
            order=wanted.order,
            cutoff=tuple(Fraction(f) for f in wanted.cutoff),
            passband_edge=None,
            stopband_edge=None,
            passband_loss=Fraction(1, 2),
            stopband_loss=Fraction(50),
            sos=None,
        ),
        1.0,
    )
    output = Port.from_range("y", wanted.bits_out, Fraction(-1), Fraction(1), signed=True)
    return quantize(
        name="sweep",
        inputs=(Port.from_range("x", wanted.bits_in, Fraction(-1), Fraction(1), signed=True),),
        output=output,
        max_error=output.lsb,
        ideal=ideal,
        polynomial=None,
        realization=realization,
    )


@pytest.fixture(scope="module")
def numbered(request: pytest.FixtureRequest) -> tuple[int, Quantized]:
    """Make a design of the sweep and give its number; its tests follow each other, so that none is made twice."""
    number, realization = request.param
    return number, quantized_design(number, realization)


def stimuli(quantized: Quantized, seed: int) -> Iterator[np.ndarray]:
    (port,) = quantized.datapath.inputs
    rng = np.random.default_rng(seed)
    yield rng.integers(port.lowest, port.highest + 1, RANDOM_SAMPLES)
    for response in (impulse_response(quantized.quantized_sos), *error_responses(quantized)):
        yield np.where(sign_matched(response), port.highest, port.lowest)
    settle = decay_length(quantized.quantized_sos)
    heights = [1, port.highest // 3, port.highest, port.lowest, 5, 0]
    yield np.repeat(heights, min(settle, 200_000))


@pytest.mark.slow
@pytest.mark.parametrize("numbered", ALL, indirect=True)
def test_no_input_exceeds_the_certificate(numbered: tuple[int, Quantized]) -> None:
    number, quantized = numbered
    datapath = quantized.datapath
    lsb = float(datapath.output.lsb)
    assert quantized.bound * datapath.output.lsb <= datapath.output.lsb
    worst = 0.0
    for codes in stimuli(quantized, number):
        column = codes.reshape(-1, 1)
        assert quantized.filter is not None
        golden = filtered(calibrated(column, datapath.inputs, None), quantized.filter.sos, datapath.output)
        error = np.abs(datapath.output.decode(datapath.compute(column)) - golden).max() / lsb
        assert error <= float(quantized.bound) + 1e-6
        worst = max(worst, float(error))
    assert worst >= 0.4 * float(quantized.bound)


@pytest.mark.parametrize("number", [k for k, wanted in enumerate(DESIGNS) if not is_lattice(wanted)])
def test_what_is_no_lattice_is_refused(number: int) -> None:
    with pytest.raises(ShortfallError, match=f"^{re.escape(REFUSED)}$"):
        quantized_design(number, "lattice_wdf")


def test_there_are_enough_lattices() -> None:
    assert sum(map(is_lattice, [*DESIGNS, *LATTICES])) >= 40


@pytest.mark.sweep(2)
@pytest.mark.parametrize("numbered", ALL, indirect=True)
def test_no_value_leaves_its_proven_range(numbered: tuple[int, Quantized]) -> None:
    """The exact interpreter checks every node on the worst case of the whole filter, its end and then noise."""
    number, quantized = numbered
    (port,) = quantized.datapath.inputs
    response = impulse_response(quantized.quantized_sos)
    strongest = int(np.searchsorted(np.cumsum(np.abs(response)), 0.999 * np.abs(response).sum()))
    pattern = sign_matched(response[: min(strongest + 1, 12_000)])
    codes = np.where(pattern[: len(pattern) // 2], port.highest, port.lowest)
    noise = np.random.default_rng(number).integers(port.lowest, port.highest + 1, 1000)
    column = np.concatenate([codes, noise]).reshape(-1, 1)
    assert quantized.datapath.compute_exact(column) == quantized.datapath.compute(column).tolist()
