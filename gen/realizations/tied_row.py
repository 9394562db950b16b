"""A row of a section whose structure is not chosen for it alone, as hardware that sections share has only one."""

from __future__ import annotations

from collections.abc import Sequence


class TiedRow(tuple[float, ...]):
    """A row, with what others have too that share its hardware.

    Attributes
    ----------
    feedback : tuple of int or None
        Error feedback (k1, k2) of a direct form; None if it is chosen for the section.
    delta_exponent : int or None
        Exponent of the power of two between the states of a section with the delta operator; None likewise.
    """

    feedback: tuple[int, int] | None = None
    delta_exponent: int | None = None

    @classmethod
    def of(
        cls, row: Sequence[float], *, feedback: tuple[int, int] | None = None, delta_exponent: int | None = None
    ) -> TiedRow:
        """Return a row with what it shares."""
        other = cls(row)
        other.feedback, other.delta_exponent = feedback, delta_exponent
        return other
