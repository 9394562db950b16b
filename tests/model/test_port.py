"""Ports: the format at a core's edge, its range, and the way between codes and physical values."""

import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sosmith.model.port import Port

VOLTAGE = Port.from_range("voltage", 16, Fraction(0), Fraction(10), unit="V")
AUDIO = Port.from_range("audio", 8, Fraction(-2), Fraction(2), signed=True)


def test_an_unsigned_port_divides_its_range() -> None:
    assert (VOLTAGE.lsb, VOLTAGE.zero) == (Fraction(10, 65536), 0)
    assert (VOLTAGE.lowest, VOLTAGE.highest, VOLTAGE.bytes) == (0, 65535, 2)
    assert VOLTAGE.decode(np.array([0, 1, 32768, 65535])).tolist() == [0.0, 10 / 65536, 5.0, 10 - 10 / 65536]


def test_a_signed_port_has_its_zero_at_code_zero() -> None:
    assert (AUDIO.lsb, AUDIO.zero) == (Fraction(1, 64), 0)
    assert (AUDIO.lowest, AUDIO.highest, AUDIO.bytes) == (-128, 127, 1)
    assert AUDIO.decode(np.array([-128, 0, 127])).tolist() == [-2.0, 0.0, 2 - 1 / 64]


def test_a_range_that_does_not_begin_at_zero() -> None:
    port = Port.from_range("temperature", 12, Fraction(-32), Fraction(96))
    assert (port.zero, port.lsb, port.bytes) == (-32, Fraction(1, 32), 2)
    assert port.decode(np.array([0, 1024])).tolist() == [-32.0, 0.0]


@pytest.mark.parametrize(("bits", "count"), [(2, 1), (8, 1), (9, 2), (16, 2), (17, 3), (32, 4)])
def test_whole_bytes_on_the_stream(bits: int, count: int) -> None:
    assert Port.from_range("x", bits, Fraction(0), Fraction(1)).bytes == count


def test_encoding_takes_the_nearest_code_and_halves_upwards() -> None:
    lsb = 1 / 64
    values = np.array([0.0, 0.49, 0.5, 0.51, 1.5, -0.49, -0.5, -0.51]) * lsb
    assert AUDIO.encode(values).tolist() == [0, 0, 1, 1, 2, 0, 0, -1]


def test_encoding_saturates() -> None:
    assert AUDIO.encode(np.array([-1e300, -2.0, -2.1, 1.99, 2.0, 1e300])).tolist() == [-128, -128, -128, 127, 127, 127]
    assert VOLTAGE.encode(np.array([-0.1, 10.0])).tolist() == [0, 65535]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_only_finite_values_are_encoded(value: float) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(f'values of voltage must be finite, not {value}')}$"):
        VOLTAGE.encode(np.array([1.0, value]))


@given(
    bits=st.integers(2, 32),
    signed=st.booleans(),
    high=st.fractions(min_value=Fraction(1, 1000), max_value=10**6, max_denominator=1000),
    share=st.floats(0, 1),
)
def test_codes_come_back(bits: int, signed: bool, high: Fraction, share: float) -> None:
    port = Port.from_range("x", bits, -high, high, signed=signed)
    some = port.lowest + round(share * (port.highest - port.lowest))
    codes = np.array([port.lowest, some, port.highest])
    assert port.encode(port.decode(codes)).tolist() == codes.tolist()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bits": 1}, "bits must be in 2..32, not 1"),
        ({"bits": 33}, "bits must be in 2..32, not 33"),
        ({"high": Fraction(0)}, "range must rise from low to high, not 0.0 to 0.0"),
        ({"low": Fraction(11)}, "range must rise from low to high, not 11.0 to 10.0"),
        ({"signed": True}, "range of a signed port must be symmetric, not 0.0 to 10.0"),
    ],
)
def test_impossible_ranges_are_refused(changes: dict[str, object], message: str) -> None:
    arguments: dict[str, object] = {"bits": 16, "low": Fraction(0), "high": Fraction(10)}
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        Port.from_range("voltage", **(arguments | changes))


def test_a_step_must_be_positive() -> None:
    with pytest.raises(ValueError, match=r"^lsb must be positive, not Fraction\(0, 1\)$"):
        Port(name="x", bits=8, signed=False, lsb=Fraction(0), zero=Fraction(0))


def test_codes_of_a_range_are_those_of_its_values() -> None:
    """One code further, no value of the range is nearest to it: it is outside, and told without delay."""
    port = Port(name="x", bits=8, signed=False, lsb=Fraction(1, 8), zero=Fraction(0))
    assert port.codes_between(0.3, 0.95) == (2, 8)  # 0.3 is 2.4 steps and 0.95 is 7.6
    assert port.codes_between(0.3125, 0.9374) == (3, 7)  # a half is rounded up
    assert port.codes_between(0.3, 0.3) == (2, 2)
    assert port.codes_between(-1.0, 1e6) == (0, 255)
    low, high = port.codes_between(0.3, 0.95)
    assert port.encode(np.array([0.3, 0.95])).tolist() == [low, high]
