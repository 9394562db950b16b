"""The mask of a filter by edges and losses: its bands, and between which gains it must be in each."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

Band = tuple[Fraction, Fraction]
"""Frequencies in units of the sample rate, from 0 to 1/2."""


class LossMask(NamedTuple):
    """What is asked for.

    Attributes
    ----------
    passbands, stopbands : tuple of Band
        Frequencies in units of the sample rate, from 0 to 1/2.
    passband_loss, stopband_loss : Fraction
        In dB: gains are from -passband_loss to 0 in a pass band, and at most -stopband_loss in a stop band.
    """

    passbands: tuple[Band, ...]
    stopbands: tuple[Band, ...]
    passband_loss: Fraction
    stopband_loss: Fraction


def mask_of(
    kind: str, passband: tuple[Fraction, ...], stopband: tuple[Fraction, ...], losses: tuple[Fraction, Fraction]
) -> LossMask:
    """Return what the edges of a kind of filter ask for; edges are in units of the sample rate, losses in dB."""
    zero, half = Fraction(0), Fraction(1, 2)
    passing: tuple[Band, ...]
    stopping: tuple[Band, ...]
    if kind == "lowpass":
        passing, stopping = ((zero, passband[0]),), ((stopband[0], half),)
    elif kind == "highpass":
        passing, stopping = ((passband[0], half),), ((zero, stopband[0]),)
    elif kind == "bandpass":
        passing, stopping = ((passband[0], passband[1]),), ((zero, stopband[0]), (stopband[1], half))
    else:
        passing, stopping = ((zero, passband[0]), (passband[1], half)), ((stopband[0], stopband[1]),)
    return LossMask(passing, stopping, *losses)
