"""FIR filters with short taps inside a mask: the gains of each, by scipy and by both proofs, and what they cost."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from sosmith.gen.core import design_core
from sosmith.gen.filter import short_taps as module
from sosmith.gen.filter.fir_design import designed_taps, taps_of_length
from sosmith.gen.filter.gain_limits import keeps_to
from sosmith.gen.filter.loss_mask import LossMask, mask_of
from sosmith.gen.filter.short_coefficients import digits
from sosmith.gen.filter.short_taps import short_taps
from sosmith.gen.output.certificate import certificate
from sosmith.gen.specification.specification import from_text
from sosmith.model.errors import ShortfallError
from sosmith.verify.certificate_file import Certificate, SectionEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.specified.filter_table import read_filter_table
from sosmith.verify.specified.fir_mask import keeps_to_losses
from sosmith.verify.specified.stated_specification import check_specification
from sosmith.verify.verification import verify

Case = tuple[str, str, tuple[str, ...], tuple[str, ...], str, str]
SMALL: Case = ("equiripple", "lowpass", ("0.1",), ("0.3",), "3", "20")
CASES: dict[str, tuple[Case, int, int]] = {
    "low-pass": (("equiripple", "lowpass", ("0.0833",), ("0.1667",), "1", "50"), 26, 32),
    "high-pass": (("least_squares", "highpass", ("0.3",), ("0.2",), "1", "40"), 21, 18),
    "band-pass": (("equiripple", "bandpass", ("0.15", "0.25"), ("0.05", "0.35"), "1", "40"), 20, 18),
    "band-stop": (("kaiser", "bandstop", ("0.1", "0.4"), ("0.2", "0.3"), "1", "30"), 17, 7),
    "half-band": (("halfband", "lowpass", ("0.1",), ("0.4",), "0.1", "60"), 11, 12),
    "of four taps": (SMALL, 4, 4),
}
"""A mask, and how many taps and digits the filter inside it has."""


def mask(case: Case) -> LossMask:
    _, kind, passband, stopband, loss, stop = case
    edges = tuple(map(Fraction, passband)), tuple(map(Fraction, stopband))
    return mask_of(kind, *edges, (Fraction(loss), Fraction(stop)))


def designed(case: Case) -> tuple[Fraction, ...]:
    return short_taps(case[0], mask(case))


@pytest.mark.parametrize(
    "name", [*(pytest.param(name, marks=pytest.mark.slow) for name in [*CASES][:4]), *[*CASES][4:]]
)
def test_the_gains_keep_to_the_mask(name: str) -> None:
    case, length, short = CASES[name]
    taps = designed(case)
    assert taps == taps[::-1]
    assert (len(taps), sum(digits(tap) for tap in taps[: (len(taps) + 1) // 2])) == (length, short)
    assert length >= len(designed_taps(case[0], mask(case))) or 0 in designed_taps(case[0], mask(case))

    asked = mask(case)
    frequencies = np.linspace(0, 0.5, 20_001)
    _, response = signal.freqz([float(tap) for tap in taps], worN=frequencies, fs=1.0)
    gains = 20 * np.log10(np.maximum(np.abs(response), 1e-30))
    for low, high in asked.passbands:
        inside = gains[(frequencies >= low) & (frequencies <= high)]
        assert -float(asked.passband_loss) - 1e-9 <= inside.min()
        assert inside.max() <= 1e-9
    for low, high in asked.stopbands:
        assert gains[(frequencies >= low) & (frequencies <= high)].max() <= -float(asked.stopband_loss) + 1e-9

    family, kind, passband, stopband, loss, stop = case
    edges = {"passband_edge": [*map(Decimal, passband)], "stopband_edge": [*map(Decimal, stopband)]}
    losses = {"passband_loss": Decimal(loss), "stopband_loss": Decimal(stop), "freedom": "mask"}
    assert keeps_to_losses(taps, read_filter_table({"family": family, "kind": kind, **edges, **losses}, Fraction(1)))


def test_a_half_band_filter_keeps_its_zeros() -> None:
    taps = designed(CASES["half-band"][0])
    middle = len(taps) // 2
    assert all((tap == 0) == (abs(k - middle) % 2 == 0 and k != middle) for k, tap in enumerate(taps))


def test_the_last_digits_of_the_start_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted, generator = designed(SMALL), np.random.default_rng(1)

    def nearly(family: str, length: int, asked: LossMask) -> tuple[float, ...] | None:
        taps = taps_of_length(family, length, asked)
        return taps and tuple(tap * (1 + 1e-13 * generator.standard_normal()) for tap in taps)

    monkeypatch.setattr(module, "taps_of_length", nearly)
    assert short_taps.__wrapped__("equiripple", mask(SMALL)) == wanted


def test_what_is_not_proven_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[list[Fraction]] = []

    def keeps(taps: list[Fraction], asked: LossMask) -> bool:
        tried.append(taps)
        return len(tried) == 3 and keeps_to(taps, asked)

    monkeypatch.setattr(module, "keeps_to", keeps)
    assert short_taps.__wrapped__("equiripple", mask(SMALL)) == tried[2]


def test_where_nothing_is_found_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "keeps_to", lambda taps, asked: False)
    message = (
        "filter.freedom must be left out for these edges and losses: no filter with short taps was found that keeps to "
        "them"
    )
    with pytest.raises(ShortfallError) as raised:
        short_taps.__wrapped__("equiripple", mask(SMALL))
    assert str(raised.value) == message


SPECIFICATION = """
name = "short"
sample_rate = 1000
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
output = { bits = 8, signed = true, range = [-1.0, 1.0], max_error = "faithful" }
hardware = { architecture = "parallel", multipliers = 0 }

[filter]
family = "equiripple"
kind = "lowpass"
passband_edge = 100.0
stopband_edge = 300.0
passband_loss = 3.0
stopband_loss = 20.0
freedom = "mask"
"""


def with_taps(made: Certificate, taps: tuple[Fraction, ...]) -> Certificate:
    assert made.ideal is not None
    section = SectionEntry(numerator=taps, denominator=made.ideal.sections[0].denominator)
    return made.model_copy(update={"ideal": made.ideal.model_copy(update={"sections": (section,)})})


def test_another_filter_inside_the_mask_is_accepted_and_none_outside() -> None:
    design = design_core(from_text(SPECIFICATION, Path("short.toml")))
    assert design.quantized.bound == Fraction(1, 2)  # of the output's rounding alone
    made = certificate(design.quantized, design.spec.max_error)
    assert made.ideal is not None
    taps, margin = tuple(made.ideal.sections[0].numerator), verify(made).margin
    assert taps == designed(SMALL)
    check_specification(made, SPECIFICATION, margin)
    other = designed(("equiripple", "lowpass", ("0.1",), ("0.3",), "1", "20"))
    check_specification(with_taps(made, other), SPECIFICATION, margin)
    message = "^the filter must keep to the edges and losses of the specification with symmetric taps$"
    for wrong in (tuple(2 * tap for tap in taps), (*taps[:-1], taps[-1] + Fraction(1, 1 << 40))):
        with pytest.raises(RejectedError, match=message):
            check_specification(with_taps(made, wrong), SPECIFICATION, margin)
