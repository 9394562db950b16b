"""The converter: ideal codes, each of its errors, clipping, and its faults."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from sosmith.instrument.sensors.digitizer import CodeFault, Digitizer, with_faults
from sosmith.model.arithmetic.random_streams import streams
from sosmith.model.arrays import Codes
from sosmith.model.port import Port

VOLTAGE = Port.from_range("voltage", 16, Fraction(0), Fraction(10), unit="V")
SIGNED = Port.from_range("emf", 8, Fraction(-1), Fraction(1), signed=True, unit="mV")


@pytest.mark.parametrize("port", [VOLTAGE, SIGNED], ids=["unsigned", "signed"])
def test_without_errors_it_is_the_ports_own_format(port: Port) -> None:
    values = np.random.default_rng(1).uniform(-2, 12, 10_000)
    np.testing.assert_array_equal(Digitizer().codes(port, values), port.encode(values))


def test_offset_gain_and_nonlinearity() -> None:
    ideal = np.arange(VOLTAGE.highest + 1)
    values = VOLTAGE.decode(ideal)
    np.testing.assert_array_equal(Digitizer(offset=3.0).codes(VOLTAGE, values)[:-3], ideal[:-3] + 3)
    lost = Digitizer(gain_error=-0.001).codes(VOLTAGE, values)
    np.testing.assert_allclose(lost, ideal * 0.999, atol=0.5)
    bent = Digitizer(inl=20.0).codes(VOLTAGE, values) - ideal
    assert (bent.max(), bent.min()) == (20, -20)
    assert bent[[0, len(bent) // 2, -1]].tolist() == [0, 0, 0]
    assert np.abs(np.diff(bent)).max() <= 1


def test_clipping() -> None:
    assert Digitizer().codes(VOLTAGE, np.array([-1.0, 0.0, 10.0, 99.0])).tolist() == [0, 0, 65535, 65535]
    assert Digitizer(offset=-5.0).codes(SIGNED, np.array([-1.0, 1.0])).tolist() == [-128, 123]
    assert Digitizer(inl=1e3).codes(SIGNED, np.array([-5.0, 5.0])).tolist() == [-128, 127]


def test_only_finite_values() -> None:
    with pytest.raises(ValueError, match=r"^values of voltage must be finite, not np.float64\(inf\)$"):
        Digitizer().codes(VOLTAGE, np.array([1.0, np.inf]))


def faulted(*faults: CodeFault, port: Port = VOLTAGE) -> Codes:
    return with_faults(np.arange(100, 110), port, faults, streams(1))


def test_a_stuck_code_is_the_last_one_before_or_a_given_one() -> None:
    assert faulted(CodeFault(start=3, stop=6)).tolist() == [100, 101, 102, 102, 102, 102, 106, 107, 108, 109]
    assert faulted(CodeFault(start=0, stop=2)).tolist()[:3] == [0, 0, 102]
    assert faulted(CodeFault(start=8, stop=99, code=7)).tolist()[7:] == [107, 7, 7]
    assert faulted(CodeFault(start=8, stop=99, code=1 << 20)).tolist()[-1] == 65535
    both = faulted(CodeFault(start=1, stop=3, code=7), CodeFault(start=3, stop=5))
    assert both.tolist()[:6] == [100, 7, 7, 7, 7, 105]


def test_missing_samples_hold_the_last_code() -> None:
    codes = np.arange(10_000)
    fault = CodeFault(start=1000, stop=9000, share=0.25)
    shown = with_faults(codes, VOLTAGE, [fault], streams(1))
    lost = shown != codes
    assert lost.sum() == pytest.approx(2000, rel=0.05)
    assert not lost[:1000].any()
    assert not lost[9000:].any()
    np.testing.assert_array_equal(shown[lost], shown[np.flatnonzero(lost) - 1])
    np.testing.assert_array_equal(shown, with_faults(codes, VOLTAGE, [fault], streams(1)))
    other = with_faults(codes, SIGNED, [fault], streams(1))
    assert np.mean((other != codes) == lost) < 0.9  # another channel loses samples of its own
