"""Direct form I sections: exact transfer functions, the effect of error feedback, refusals."""

import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy import signal
from tests.model.datapaths import butterworth, sections_of

from sosmith.model.dataflow.graph import Range
from sosmith.model.sections.direct_form import DirectForm1, Product, check_products

F7 = butterworth(7, 0.002588)


def test_integer_coefficients_make_the_transfer_function() -> None:
    for section, row in zip(sections_of(F7, bits=40), F7, strict=True):
        a1, a2 = section.denominator
        assert float(a1) == pytest.approx(row[4], abs=1e-11)
        assert float(a2) == pytest.approx(row[5], abs=1e-11)


@pytest.mark.parametrize("bits", [12, 17, 25])
def test_gain_at_zero_frequency_is_exactly_one(bits: int) -> None:
    for section in sections_of(F7, bits=bits):
        assert sum(section.numerator) == 1 + sum(section.denominator)


@pytest.mark.parametrize("feedback", [0, 1, 2])
def test_section_computes_its_difference_equation(feedback: int) -> None:
    """The graph against the recursion written out in rationals, with the quantizer's error fed back."""
    for section in sections_of(F7[1:], feedback=feedback, guard=3):
        b, (a1, a2), (k1, k2) = section.numerator, section.denominator, section.feedback
        rng = np.random.default_rng(7)
        x = rng.integers(-20000, 20000, 400).tolist()
        if section.x.frac:
            x = [code << section.x.frac for code in x]
        y = [code for (code,) in section.graph.run([[code] for code in x])]
        scale_x, scale_y = Fraction(1, 1 << section.x.frac), Fraction(1, 1 << section.y_frac)
        xs = [0, 0, *[code * scale_x for code in x]]
        ys, errors = [Fraction(0)] * 2, [Fraction(0)] * 2
        centre = scale_y / 2 * (1 + k1 + k2)
        for n in range(2, len(xs)):
            exact = b[0] * xs[n] + b[1] * xs[n - 1] + b[2] * xs[n - 2] - a1 * ys[-1] - a2 * ys[-2]
            v = exact - k1 * errors[-1] - k2 * errors[-2] + centre
            quantized = (v / scale_y).__floor__() * scale_y
            ys.append(quantized)
            errors.append(v - quantized)
        assert [code * scale_y for code in y] == ys[2:]


@pytest.mark.slow
def test_error_feedback_removes_the_dead_band() -> None:
    """THEORY section 6: a constant 1000 LSB disappears in a plain section, and comes through with feedback."""
    row = F7[1:2] if F7[0][5] == 0 else F7[:1]
    settled = {}
    for feedback in (0, 2):
        (section,) = sections_of(row, feedback=feedback, guard=0, bits=26)
        settled[feedback] = section.graph.run([[1000]] * 8000)[-1][0]
    assert settled[2] == 1000
    assert settled[0] < 600


@pytest.mark.slow
def test_rounding_error_is_bounded_by_the_shaped_peak_gain() -> None:
    """THEORY section 0: 4.1213 / 2 LSB with second-order feedback at the highest Q of F7."""
    row = signal.butter(7, 2 * 0.002588, output="sos")[-1:]
    (section,) = sections_of(row, feedback=2, guard=0, bits=40)
    rng = np.random.default_rng(3)
    x = rng.integers(-32768, 32768, 20000)
    y = np.array([code for (code,) in section.graph.run(x.reshape(-1, 1).tolist())])
    b = [float(v) for v in section.numerator]
    exact = signal.lfilter(b, [1.0, *map(float, section.denominator)], x.astype(float))
    assert 0.5 < np.abs(y - exact).max() <= 4.1214 / 2


@pytest.mark.parametrize(
    ("part", "taps", "stable"),
    [
        ((-1, 0), (-1, 0), True),
        ((-1, 0), (1, 0), False),
        ((1, 0), (1, 0), True),
        ((1, 0), (-1, 0), False),
        ((0, 1), (0, 1), True),
        ((0, 1), (1, 0), False),
        ((0, 1), (0, -1), False),
        ((-2, 1), (-2, 1), True),
        ((-2, 1), (-1, 1), False),
        ((2, 1), (2, 1), True),
        ((2, 1), (1, 1), False),
    ],
)
def test_stability_is_decided_to_the_last_bit(part: tuple[int, int], taps: tuple[int, int], stable: bool) -> None:
    """The integer part is on the edge of the triangle of stable (a1, a2); a product moves it by about 2**-400."""
    coarse = Product("A1", 3, 2, (1, 0, 0), (0, 0))
    for product in (Product("A2", 1, 400, (0, 0, 0), taps), Product("A2", 1, 397, (0, 0, 0), taps, 3)):
        if stable:
            check_products([coarse, product], part)
            continue
        with pytest.raises(ValueError, match=r"^poles must lie inside the unit circle, not at a1 = .*, a2 = .*$"):
            check_products([coarse, product], part)


def test_refusals() -> None:
    with pytest.raises(ValueError, match=r"^coefficient A1 must not be zero$"):
        Product("A1", 0, 4, (1, 0, 0), (0, 0))
    with pytest.raises(ValueError, match=r"^taps of A1 must not all be zero$"):
        Product("A1", 1, 4, (0, 0, 0), (0, 0))
    (section,) = sections_of(F7[-1:])
    unstable = Product("A1", -1, 4, (0, 0, 0), (-1, 1))
    with pytest.raises(ValueError, match=r"^poles must lie inside the unit circle, not at a1 = .*, a2 = .*$"):
        replace(section, products=(unstable, section.products[1]))
    with pytest.raises(ValueError, match=re.escape("products must not be empty")):
        DirectForm1(
            name="s",
            products=(),
            integer_part=(0, 0),
            feedback=(0, 0),
            x=Range(0, 0, 1),
            y_frac=0,
            v_range=(0, 1),
        )
