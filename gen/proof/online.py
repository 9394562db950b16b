"""Proves that the residuals of on-line arithmetic stay in their range, so that sections give their graphs' results.

Let no increment exceed 1/4 in magnitude. With the selection of `sosmith.model.sections.online`, a residual in
[-3/4, 3/4) is followed by one there; it begins there, since what is rounded is at most ``2**M``, and half of that with
an increment is less than 3/4. From there the last digit is in {-1, 0, 1}, and a residual is known from its value
modulo 4.
"""

from __future__ import annotations

from fractions import Fraction

from sosmith.model.errors import ShortfallError
from sosmith.model.sections.online import LOOP_CLOCKS, MOST_INCREMENT, QUIET_STEPS, OnlineSchedule, OnlineSection

_LIMIT = Fraction(3, 4)


def largest_increment(section: OnlineSection) -> Fraction:
    """Return the largest magnitude of what one step adds to the residual of a section, exact.

    Errors that are fed back enter at a step of their own, which no other digit takes.
    """
    return max(section.gain * Fraction(1, 2**section.delay), section.largest_feedback(section.delay))


def prove_residuals(schedule: OnlineSchedule) -> tuple[Fraction, ...]:
    """Prove the residuals of all sections, and that digits are there when they are taken.

    Returns
    -------
    tuple of Fraction
        Largest increment of each section.

    Raises
    ------
    ShortfallError
        If a delay, the number of digits, the interval or the number of units is too small.
    """
    increments = tuple(map(largest_increment, schedule.sections))
    for section, increment, exponent in zip(schedule.sections, increments, schedule.exponents, strict=False):
        begins = section.largest / 2 ** (section.leading + 1) + increment
        steps = section.digits - min(section.first_step(exponent), -section.delay)
        holds = (
            increment <= MOST_INCREMENT
            and begins <= _LIMIT
            and section.delay >= section.finer + QUIET_STEPS
            and (not section.feedback or section.feedback_step < section.digits - QUIET_STEPS)
            and schedule.interval >= section.delay + LOOP_CLOCKS
            and schedule.period >= steps
        )
        if not holds:
            raise ShortfallError(
                f"{section.name} must keep its residual in [-3/4, 3/4) with a delay of {section.delay} digits, "
                f"increments of at most {float(increment):.4g} and {schedule.period} clocks"
            )
    return increments
