"""What is asked of a whole chain: its pass band, and what may alias into it, by ``[limits]`` or a stage ``auto``.

Losses are told relative to the largest gain in the pass band: there, no gain is less by more than `passband_loss`, and
no alias into it, nor anything from `stopband_edge` on, is less by less than `stopband_loss`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from sosmith.gen.specification.values import UnfitError, literal, number
from sosmith.model.suggestion import did_you_mean

KEYS = ("passband_edge", "passband_loss", "stopband_loss", "stopband_edge")
"""Keys of ``[limits]``; the last one may be left out."""

SPAN = ("first", "last")
"""Keys of ``[limits]`` with the names of the first and the last stage that they hold of; of all stages without them."""

LIMITS = "limits"
"""Name of the table."""

_LOSSES = {"passband_loss": (Fraction(1, 1000), Fraction(20)), "stopband_loss": (Fraction(1), Fraction(180))}
"""Least and largest of each loss, in dB: a proof tells gains that differ by a thousandth of a decibel apart."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What is asked of a whole chain, or of some of its stages.

    Attributes
    ----------
    passband_edge : Fraction
        Upper edge of the pass band, in Hz; below half the output rate.
    passband_loss : Fraction
        By how much gains in the pass band may differ, in dB: droop and ripple of all stages together.
    stopband_loss : Fraction
        By how much whatever aliases into the pass band must be below the largest gain there, in dB.
    stopband_edge : Fraction or None
        Frequency in Hz from which on everything must be; None if only aliases into the pass band count.
    """

    passband_edge: Fraction
    passband_loss: Fraction
    stopband_loss: Fraction
    stopband_edge: Fraction | None = None


def read_limits(table: Mapping[str, Any], where: str, rate: Fraction, factor: int) -> Limits:
    """Read the limits of a chain that decimates samples of `rate`, in Hz, by `factor`.

    Raises
    ------
    UnfitError
        If a key is missing, or a value cannot be.
    """
    for key in table:
        if key not in KEYS:
            raise UnfitError(
                f"one of the keys {', '.join(KEYS)}", f"an unknown one{did_you_mean(key, KEYS)}", where=f"{where}.{key}"
            )
    values = {key: _number(table, key, where) for key in KEYS if key in table or key != KEYS[-1]}
    edge, half = values["passband_edge"], rate / factor / 2
    if not 0 < edge < half:
        raise UnfitError(
            f"above 0 and below half the output rate ({literal(half)} Hz)",
            literal(edge),
            where=f"{where}.passband_edge",
        )
    for key, (least, most) in _LOSSES.items():
        if not least <= values[key] <= most:
            raise UnfitError(f"from {literal(least)} to {most} dB", literal(values[key]), where=f"{where}.{key}")
    stop = values.get("stopband_edge")
    if stop is not None and not edge < stop < rate / 2:
        raise UnfitError(
            f"above passband_edge ({literal(edge)} Hz) and below half the sample_rate ({literal(rate / 2)} Hz)",
            literal(stop),
            where=f"{where}.stopband_edge",
        )
    return Limits(**values)


def _number(table: Mapping[str, Any], key: str, where: str) -> Fraction:
    units = "a frequency in Hz" if key.endswith("edge") else "a loss in dB"
    if key not in table:
        raise UnfitError(units, "missing", where=f"{where}.{key}")
    try:
        return number(table[key])
    except UnfitError as unfit:
        raise unfit.inside(f"{where}.{key}") from None
