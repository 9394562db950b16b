"""Theorems on what folds at a decimator: how much of the bands around the multiples of the lower rate comes through."""

from __future__ import annotations

import cmath
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from math import ceil, floor, log2, pi, sin

from sosmith.verify.certificate_file import BandEntry, Certificate, DecimationEntry, SectionEntry
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.exact import sections_of
from sosmith.verify.rocq.polynomials import number

_DIGITS = 128
"""Bits that the smallest denominator keeps in the search over intervals."""

_PLACES = 1 << 10
"""Frequencies of a whole turn at which it is looked for."""

_MORE = 168
"""Bits of sines, beside those that the smallest magnitudes need: a gain is rounded in the 64th one."""

_TINY = 2.0**-60
"""What is taken for a magnitude of 0."""


def folding_claims(certificate: Certificate) -> Iterator[Claim]:
    """Write the theorems for the gains of a decimator alone and with its filter; none without a decimator.

    They use the definitions `decimator_` and `exact_sections`. What precision they are given decides whether they can
    be proven, not what they say.
    """
    entry = certificate.decimation
    if entry is None:
        return
    sections = certificate.ideal.sections
    levels = max(entry.factor.bit_length() - 1, 1)
    edge = entry.edge * entry.factor
    most = max(entry.aliasing, default=Fraction(0))
    words = f"of what folds into the pass band the decimator lets through at most {float(most):.6g}"
    yield Claim("decimator_folds", words, _alone(entry, levels, edge))
    passing, anywhere = (max(band.gain for band in bands) for bands in (entry.passing, entry.bands))
    words = f"with the filter at most {float(passing):.6g}, and of all that folds anywhere {float(anywhere):.6g}"
    yield Claim("filter_folds", words, _with_filter(entry, sections, levels))
    words = "the last section of the exact filter corrects the droop of the decimator"
    yield Claim("droop_is_corrected", words, _correction(entry.correction))


def _alone(entry: DecimationEntry, levels: int, edge: Fraction) -> str:
    bits = _MORE + ceil(2 * entry.stages * -log2(min(max(float(edge), _TINY), 0.5)))
    terms = f"decimator_ {levels} {bits} pass_edge aliasing"
    return f"""\
(* The upper edge of the pass band, in units of the lower rate, and the gains that are claimed of the bands around each
   multiple of that: of the decimator alone, with the filter into the pass band, and with it to any frequency. *)
Definition pass_edge : ratio := {_ratio(edge)}.
Definition aliasing : list ratio := {_ratios(entry.aliasing)}.
Definition passing_gains : list ratio := {_ratios(band.gain for band in entry.passing)}.
Definition band_gains : list ratio := {_ratios(band.gain for band in entry.bands)}.
Theorem decimator_folds : folds_at_most decimator_ [] (real pass_edge) aliasing.
Proof. apply (aliasing_folds {terms}). vm_cast_no_check (eq_refl true). Qed.
Lemma aliasing_is_next : aliasing_follows {terms} = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
"""


def _with_filter(entry: DecimationEntry, sections: Sequence[SectionEntry], levels: int) -> str:
    above, below = _Magnitudes(entry, sections, over=True), _Magnitudes(entry, sections, over=False)
    digits = max(0, below.smallest() - _DIGITS)
    head = f"decimator_ exact_sections {levels}"
    follows = ""
    for name, bands, end in (("passing", entry.passing, "(edge_above pass_edge)"), ("band", entry.bands, "(2 ^ 15)")):
        lost = max(one.lost(band) for one in (above, below) for band in bands)
        size = min(one.bits(float(band.at)) for one in (above, below) for band in bands)
        bits = max(0, floor(size) - _MORE)
        terms = f"{head} {_MORE + lost} {bits} {end} {name}_gains {name}_places"
        follows += f"""\
(* Where hardly less is reached, in units of the lower rate. *)
Definition {name}_places : list ratio := {_ratios(band.at for band in bands)}.
Lemma {name}_gains_follow : gains_follow {terms} = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
"""
    return f"""\
{follows}\
Theorem filter_folds : folds_at_most decimator_ exact_sections (real pass_edge) passing_gains
  /\\ folds_at_most decimator_ exact_sections (1 / 2) band_gains.
Proof. apply (bands_fold {head} {digits}). vm_cast_no_check (eq_refl true). Qed.
"""


class _Magnitudes:
    """Squared magnitudes of all numerators, the decimator's means among them, or of all denominators: their bits.

    They are those of integers, as Rocq takes them.
    """

    def __init__(self, entry: DecimationEntry, sections: Sequence[SectionEntry], *, over: bool) -> None:
        self._stages = entry.stages if over else 0
        self._taps = [pair[0 if over else 1] for pair in sections_of(sections)]
        self._sizes = [max(sum(map(abs, taps)), 1) for taps in self._taps]
        self._shares = [
            [float(Fraction(tap, size)) for tap in taps] for taps, size in zip(self._taps, self._sizes, strict=True)
        ]

    def smallest(self) -> int:
        """Those of the smallest, nearly."""
        return floor(min(self.bits(k / _PLACES) for k in range(_PLACES // 2 + 1)))

    def lost(self, band: BandEntry) -> int:
        """Those that are lost where they are computed from the sine's square."""
        largest = sum(2 * (size.bit_length() + len(taps)) for size, taps in zip(self._sizes, self._taps, strict=True))
        return max(0, ceil(largest + 2 * self._stages - self.bits(float(band.at))))

    def bits(self, place: float) -> float:
        """Those at a frequency in units of the lower rate."""
        result = 2 * self._stages * log2(max(abs(sin(pi * place)), _TINY))
        for shares, size in zip(self._shares, self._sizes, strict=True):
            value = sum(share * cmath.exp(-2j * pi * place * k) for k, share in enumerate(shares))
            result += 2 * (log2(size) + log2(max(abs(value), _TINY)))
        return result


def _correction(weight: Fraction) -> str:
    return f"""\
Theorem droop_is_corrected : corrects decimator_ exact_sections {_ratio(weight)} = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
"""


def _ratio(value: Fraction) -> str:
    return f"({number(value.numerator)}, {value.denominator})"


def _ratios(values: Iterable[Fraction]) -> str:
    return "[" + "; ".join(map(_ratio, values)) + "]"
