"""A filter specification from spectra: pass and stop edge, losses, and the smallest Butterworth low-pass for them.

The allowed error at the output is shared among four parts: the loss of wanted signal above and below the passband edge,
and the remaining disturbance below and above the stop edge. By Parseval's theorem, mean squares at different
frequencies add up, so each part may have half of the allowed rms error. `docs/spectrum.md` has the formulas.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from fractions import Fraction

import numpy as np

from sosmith.gen.filter.design import Filter, design, minimum_order, prewarp, unwarp
from sosmith.gen.filter.response import group_delay
from sosmith.gen.specification.rules import MARGIN
from sosmith.gen.specification.schema import MAX_ORDER
from sosmith.gen.specification.specification import FilterSpec
from sosmith.instrument.spectrum.prediction import Content, Prediction, band_rms, predict
from sosmith.instrument.spectrum.settings import PASSBAND_LOSS, Wish
from sosmith.instrument.spectrum.spectra import Array, Spectrum
from sosmith.model.errors import ShortfallError, SpecificationError

MIN_STOPBAND_LOSS = 3.02
"""Smallest loss from the stop edge on, dB, even if the disturbance needs less: keeps the cutoff below the stop edge."""


PARTS_OF_DISTURBANCE = tuple(1 + k / 10 for k in range(20, -1, -1))
"""Shares of the disturbance, below the stopband edge and above it, that are tried, as multiples of an equal one.

The largest comes first: what the wanted signal does not need of the error goes to the disturbance. The loss is asked
for at the edge, from which it rises, so that less may remain than the share; the predicted error decides.
"""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """One number of the proposal and its origin.

    Attributes
    ----------
    key : str
        Key in ``[filter]``.
    value : float
        Value in `unit`.
    unit : str
        Hz or dB.
    reason : str
        Formula with numbers, or who set it.
    """

    key: str
    value: float
    unit: str
    reason: str


@dataclass(frozen=True, eq=False, kw_only=True)
class Proposal:
    """A proposed filter.

    Attributes
    ----------
    wish : Wish
        The requirements.
    choices : tuple of Choice
        passband_edge, stopband_edge (Hz), passband_loss, stopband_loss (dB).
    filter : Filter
        The Butterworth low-pass of minimum order that `sosmith design` makes from them.
    needed : float
        Passband edge that the true signals need, or that was requested, Hz; at most the chosen one.
    delay : float
        Group delay at zero frequency, s.
    predictions : tuple of Prediction
        One for each content.
    """

    wish: Wish
    choices: tuple[Choice, ...]
    filter: Filter
    needed: float
    delay: float
    predictions: tuple[Prediction, ...]

    def __getitem__(self, key: str) -> float:
        """Value of the choice `key`."""
        return next(choice.value for choice in self.choices if choice.key == key)


def propose(contents: Sequence[Content], wish: Wish, sample_rate: float) -> Proposal:
    """Propose the smallest Butterworth low-pass that keeps the error of every content within the tolerance.

    Without a passband edge in `wish`, the order is the lowest whose response, including phase, keeps the predicted
    error within the tolerance. The edge is then as high as this order allows, and at least as high as the
    true signal needs.
    With a passband edge, the true signal above it may be lost, and the tolerance applies to the disturbance.

    Parameters
    ----------
    contents : sequence of Content
        At least one; the filter must be sufficient for each of them.
    wish : Wish
        Requirements, in the unit of the contents.
    sample_rate : float
        Hz.

    Raises
    ------
    SpecificationError
        If no passband edge is given and none can be derived, or it is beyond half the sample rate.
    ShortfallError
        If no filter is needed, or none is sufficient.
    """
    passband = _pass_edge(contents, wish, sample_rate)
    slowest = max(contents, key=lambda one: one.slow)
    if wish.coverage * slowest.slow > wish.tolerance:
        raise ShortfallError(
            f"tolerance must be above {wish.coverage:g} times the {slowest.slow:.3g} rms of the disturbance that is "
            f"slower than segments of {1 / slowest.disturbance.step:.3g} s, which counts as let through, not "
            f"{wish.tolerance:g}: longer segments may tell it apart{_of(slowest.name, contents)}"
        )
    if _harmless(contents, wish):
        most = max(band_rms(one.disturbance, 0) for one in contents)
        raise ShortfallError(
            f"the disturbance must be worth a filter: without one, {wish.coverage:g} times its {most:.3g} rms is well "
            f"within the tolerance of {wish.tolerance:g}"
        )
    made = _best(contents, wish, sample_rate, passband)
    if made is None:
        raise _too_tight(contents, wish, sample_rate)
    return made


def _harmless(contents: Sequence[Content], wish: Wish) -> bool:
    return all(band_rms(one.disturbance, 0) <= wish.share for one in contents)


def _best(contents: Sequence[Content], wish: Wish, sample_rate: float, passband: Choice) -> Proposal | None:
    """Make the proposal of the lowest order for equal shares, with the most for the disturbance, which delays least.

    None if there is none up to `MAX_ORDER`.
    """
    masks = [mask for part in PARTS_OF_DISTURBANCE if (mask := _mask(contents, wish, part * wish.share)) is not None]
    least = [
        minimum_order(passband.value, stop.value, passing.value, stopping.value, sample_rate)[0]
        if passband.value < stop.value
        else MAX_ORDER + 1
        for stop, passing, stopping in masks
    ]
    if wish.passband is not None:
        for mask, order in zip(masks, least, strict=True):  # the most first, and with it the lowest order
            if order <= MAX_ORDER:
                made = _made(contents, wish, sample_rate, (passband, *mask), passband.value)
                left = [math.hypot(one.disturbance, one.slow) for one in made.predictions]
                if wish.coverage * max(left) <= wish.tolerance:
                    return made
        return None
    for order in range(least[-1], MAX_ORDER + 1):  # of equal shares
        for mask in masks:
            stop, passing, stopping = mask
            edge = _highest_pass_edge(order, stop.value, passing.value, stopping.value, sample_rate)
            reason = (
                f"as high as order {order} allows, for the least delay; at least {passband.value:.5g} Hz: "
                f"{passband.reason}"
            )
            choices = (replace(passband, value=edge, reason=reason), *mask)
            made = _made(contents, wish, sample_rate, choices, passband.value)
            if all(wish.coverage * one.rms <= wish.tolerance for one in made.predictions):
                return made
    return None


def _mask(contents: Sequence[Content], wish: Wish, share: float) -> tuple[Choice, Choice, Choice] | None:
    """Choose stopband edge, passband loss and stopband loss; None if all of the disturbance is within `share`."""
    if all(band_rms(one.disturbance, 0) <= share for one in contents):
        return None
    stopband = _stop_edge(contents, share)
    losses = _pass_loss(contents, wish), _stop_loss(contents, share, stopband.value)
    if losses[0].value >= losses[1].value:
        if share > wish.share:
            return None
        raise SpecificationError(
            f"passband-loss must be below the {losses[1].value:g} dB of the stop band, not {losses[0].value:g}"
        )
    return stopband, *losses


def _highest_pass_edge(order: int, stop_edge: float, pass_loss: float, stop_loss: float, sample_rate: float) -> float:
    """Passband edge in Hz for which `order` is just sufficient: equation 12 of the paper solved for it."""
    ratio = (10 ** (0.1 * pass_loss) - 1) / (10 ** (0.1 * stop_loss) - 1)
    return _down(unwarp(prewarp(stop_edge, sample_rate) * ratio ** (1 / (2 * order)), sample_rate))


def _made(
    contents: Sequence[Content], wish: Wish, sample_rate: float, choices: tuple[Choice, ...], needed: float
) -> Proposal:
    value = {choice.key: Fraction(repr(choice.value)) for choice in choices}
    spec = FilterSpec(
        family="butterworth",
        kind="lowpass",
        method="bilinear",
        order=None,
        cutoff=None,
        passband_edge=(value["passband_edge"],),
        stopband_edge=(value["stopband_edge"],),
        passband_loss=value["passband_loss"],
        stopband_loss=value["stopband_loss"],
        sos=None,
    )
    made = design(spec, sample_rate)
    delay = float(group_delay(made.sos, np.zeros(1), sample_rate)[0])
    predictions = tuple(predict(one, made, delay) for one in contents)
    return Proposal(wish=wish, choices=choices, filter=made, needed=needed, delay=delay, predictions=predictions)


def _pass_edge(contents: Sequence[Content], wish: Wish, sample_rate: float) -> Choice:
    """Choose the lowest frequency above which no true signal exceeds its share of the error."""
    if wish.passband is not None:
        # The stop edge must fit between it and half the sample rate minus a margin.
        if not MARGIN * sample_rate <= wish.passband < sample_rate / 2:
            raise SpecificationError(
                f"passband must be above 0 and below half the sample rate, {sample_rate / 2:g} Hz, "
                f"not {wish.passband:g} Hz"
            )
        return Choice(key="passband_edge", value=wish.passband, unit="Hz", reason="as asked")
    known = [(one.name, one.wanted) for one in contents if one.has_truth and one.wanted is not None]
    if not known:
        raise SpecificationError(
            "the passband edge must be given, by --passband in Hz or --time-constant in s, if no trace has its truth"
        )
    edge, lost, name = max(
        (found.frequency[index], band_rms(found, index + 1), name)
        for name, found in known
        for index in [max(1, int(np.argmax(_above(found) <= wish.share)))]
    )
    reason = f"above it the true signal has {_brief(lost, wish)} rms, at most {wish.share:.3g}{_of(name, contents)}"
    return Choice(key="passband_edge", value=_up(float(edge)), unit="Hz", reason=reason)


def _above(spectrum: Spectrum) -> Array:
    """Rms above each frequency, falling to 0 at the last."""
    return np.sqrt(np.append(np.cumsum(spectrum.density[:0:-1])[::-1], 0.0) * spectrum.step)


def _up_to(spectrum: Spectrum) -> Array:
    """Rms up to and including each frequency, rising from 0 at the first."""
    return np.sqrt(np.append(0.0, np.cumsum(spectrum.density[1:])) * spectrum.step)


def _stop_edge(contents: Sequence[Content], share: float) -> Choice:
    """Choose the highest frequency up to which no disturbance exceeds its share of the error; 0 if there is none."""
    edge, kept, name = min(
        (one.disturbance.frequency[index], band_rms(one.disturbance, 0, index + 1), one.name)
        for one in contents
        if band_rms(one.disturbance, 0) > share
        for index in [int(np.argmax(_up_to(one.disturbance) > share)) - 1]
    )
    reason = f"up to it the disturbance has {kept:.3g} rms, at most {share:.3g}{_of(name, contents)}"
    return Choice(key="stopband_edge", value=_down(float(edge)), unit="Hz", reason=reason)


def _pass_loss(contents: Sequence[Content], wish: Wish) -> Choice:
    """Choose the loss that, applied to the whole wanted signal, would use up its share of the error."""
    if wish.passband_loss is not None:
        return Choice(key="passband_loss", value=wish.passband_loss, unit="dB", reason="as asked")
    known = [(band_rms(one.wanted, 0), one.name) for one in contents if one.wanted is not None]
    amplitude, name = max(known, default=(0.0, ""))
    loss = -20 * math.log10(1 - wish.share / amplitude) if amplitude > wish.share else math.inf
    if loss >= PASSBAND_LOSS:
        reason = f"the paper's; the wanted signal, {_brief(amplitude, wish)} rms, would bear more"
        return Choice(key="passband_loss", value=PASSBAND_LOSS, unit="dB", reason=reason)
    reason = f"-20 log10(1 - {wish.share:.3g} / {amplitude:.3g} rms of the wanted signal){_of(name, contents)}"
    return Choice(key="passband_loss", value=_down(loss), unit="dB", reason=reason)


def _stop_loss(contents: Sequence[Content], share: float, edge: float) -> Choice:
    """Choose the loss that reduces the worst disturbance above the stop edge to its share of the error."""
    above, name = max(
        (band_rms(one.disturbance, int(np.searchsorted(one.disturbance.frequency, edge, "right"))), one.name)
        for one in contents
    )
    loss = 20 * math.log10(above / share) if above > 0 else -math.inf
    if loss < MIN_STOPBAND_LOSS:
        reason = (
            f"the least that puts the cutoff below the stop edge; {above:.3g} rms disturb above it{_of(name, contents)}"
        )
        return Choice(key="stopband_loss", value=MIN_STOPBAND_LOSS, unit="dB", reason=reason)
    reason = f"20 log10({above:.3g} rms of the disturbance above the edge / {share:.3g}){_of(name, contents)}"
    return Choice(key="stopband_loss", value=_up(loss), unit="dB", reason=reason)


def _of(name: str, contents: Sequence[Content]) -> str:
    """Name the content that decides, if there are several."""
    return f" ({name})" if len(contents) > 1 else ""


def _brief(rms: float, wish: Wish) -> str:
    """Write with three digits; rounding residues count as zero."""
    return f"{rms:.3g}" if rms > 1e-9 * wish.tolerance else "0"


def _up(value: float, digits: int = 5) -> float:
    """Round up to `digits` significant digits."""
    return float(Context(prec=digits, rounding=ROUND_CEILING).create_decimal_from_float(value))


def _down(value: float) -> float:
    """Round down to five significant digits."""
    return float(Context(prec=5, rounding=ROUND_FLOOR).create_decimal_from_float(value))


def _too_tight(contents: Sequence[Content], wish: Wish, sample_rate: float) -> ShortfallError:
    """Say which tolerance would be feasible, to three digits."""

    def feasible(tolerance: float) -> bool:
        asked = replace(wish, tolerance=tolerance)
        if _harmless(contents, asked):
            return True
        return _best(contents, asked, sample_rate, _pass_edge(contents, asked, sample_rate)) is not None

    low, high = wish.tolerance, 2 * wish.tolerance
    while not feasible(high):  # ends: some tolerance exceeds the unfiltered disturbance, and no filter is needed
        low, high = high, 2 * high
    while high > 1.01 * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if feasible(middle) else (middle, high)
    advice = "; a true signal with steps takes a --passband that gives up their edges" if wish.passband is None else ""
    return ShortfallError(
        f"tolerance must be at least about {_up(high, 3):g} for a Butterworth low-pass of order {MAX_ORDER} at most, "
        f"not {wish.tolerance:g}, as the disturbance comes too close to what is to pass{advice}"
    )
