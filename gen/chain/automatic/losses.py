"""Whether proven gains keep to the limits of a whole chain: comparisons in dB, decided in ball arithmetic."""

from __future__ import annotations

from fractions import Fraction

from flint import arb

from sosmith.gen.chain.automatic.limits import Limits
from sosmith.gen.quantity import decibels
from sosmith.model.arithmetic.correct_rounding import ball, evaluate, nearest_double, sign


def compared(gain: Fraction, reference: Fraction, loss: Fraction) -> int:
    """Compare a gain with a reference less a loss in dB: 1 if it is more, -1 if it is less."""
    return evaluate(lambda: sign(ball(gain) - ball(reference) * arb(10) ** (-ball(loss) / 20)))


def loss_of(gain: Fraction, reference: Fraction) -> float:
    """Return by how much a gain is below a reference, in dB, correctly rounded."""
    return evaluate(lambda: nearest_double(20 * (ball(reference) / ball(gain)).log() / arb(10).log()))


def why_not(
    limits: Limits, *, least: Fraction, most: Fraction, passing: Fraction, stopped: Fraction | None
) -> tuple[str, ...]:
    """Say which limits gains that are proven do not keep to; nothing if they keep to all.

    Parameters
    ----------
    limits : Limits
    least, most : Fraction
        Gains in the pass band.
    passing : Fraction
        Largest gain of what aliases into it.
    stopped : Fraction or None
        Largest gain from `stopband_edge` on.
    """
    found = []
    if compared(least, most, limits.passband_loss) < 0:
        reached = decibels(loss_of(least, most)) if least > 0 else "a gain of 0"
        found.append(f"passband_loss: {reached}, not at most {_db(limits.passband_loss)}")
    if compared(passing, most, limits.stopband_loss) > 0:
        found.append(
            f"stopband_loss: aliases into the pass band are {decibels(loss_of(passing, most))} down, "
            f"not {_db(limits.stopband_loss)}"
        )
    if stopped is not None and compared(stopped, most, limits.stopband_loss) > 0:
        found.append(
            f"stopband_loss: gains from stopband_edge on are {decibels(loss_of(stopped, most))} down, "
            f"not {_db(limits.stopband_loss)}"
        )
    return tuple(found)


def _db(loss: Fraction) -> str:
    return f"{float(loss):g} dB"
