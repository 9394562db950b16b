"""Compares a figure of ours with the printed one, and labels the result."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction

REPRODUCED, NEAR, DIFFERS, NOT_COMPARABLE, NOT_PRINTED = (
    "reproduced",
    "near",
    "differs",
    "not comparable",
    "not printed",
)
LABELS = (REPRODUCED, NEAR, DIFFERS, NOT_COMPARABLE)
"""Labels of printed figures. Figures that we add to those of the paper are labelled `NOT_PRINTED`."""

NEAR_PART = Decimal("0.02")
"""Largest relative difference of a figure that is near."""

LAST_DIGIT_PART = Decimal("0.01")
"""The last digit may be off by one if one unit of it is at most this fraction of the figure: 5 does not reproduce 4."""

UNEXPLAINED = "not explained"

_PRECISION = 80  # digits of the arithmetic


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One figure: printed and ours.

    Attributes
    ----------
    quantity : str
        Description, Markdown.
    unit : str
        Unit; empty for a dimensionless number.
    printed : Decimal or None
        Figure with the printed digits; None if the paper gives none.
    ours : Decimal or None
        Computed figure; None if there is nothing to compute.
    note : str
        Origin, and why it differs or cannot be compared. Markdown.
    comparable : bool
        False if the two are different quantities, or only one of them exists; `note` says why.
    base : Decimal or None
        Reference for the tolerances; the printed figure unless given. For accuracies it is the difference from 100 %:
        98 % is not near 97 %.
    """

    quantity: str
    unit: str = ""
    printed: Decimal | None = None
    ours: Decimal | None = None
    note: str = ""
    comparable: bool = True
    base: Decimal | None = None

    @property
    def label(self) -> str:
        """Reproduced, near, differs, not comparable, or not printed.

        - reproduced: ours, rounded to the printed digits, is the printed figure; or differs from it by one unit of
          the last digit, if that is worth at most `LAST_DIGIT_PART` of the base.
        - near: within `NEAR_PART` of the base.
        - differs: anything else.
        """
        if self.printed is None:
            return NOT_PRINTED
        if not self.comparable or self.ours is None:
            return NOT_COMPARABLE
        base = abs(self.printed if self.base is None else self.base)
        with localcontext(prec=_PRECISION):
            unit = last_digit(self.printed)
            away = abs(self.ours.quantize(unit) - self.printed)
            if away == 0 or (away <= unit <= LAST_DIGIT_PART * base):
                return REPRODUCED
            return NEAR if abs(self.ours - self.printed) <= NEAR_PART * base else DIFFERS

    @property
    def explanation(self) -> str:
        """The note, or a remark if a required note is missing."""
        due = self.label in {DIFFERS, NOT_COMPARABLE}
        return UNEXPLAINED if due and not self.note else self.note

    @property
    def shown(self) -> str:
        """Our figure with one digit more than printed, but at least four; with six if none is printed.

        Figures that end earlier are shorter.
        """
        if self.ours is None:
            return "-"
        if self.printed is None:
            return plain(self.ours, 6)
        with localcontext(prec=_PRECISION):
            unit = last_digit(self.printed)
            finer = min(unit / 10, Decimal(1).scaleb(self.ours.adjusted() - 3)) if self.ours else unit
            written = self.ours.quantize(finer)
            if written == self.ours:
                shortest = written.normalize()
                written = written.quantize(min(unit, last_digit(shortest)))
            return _text(written, like=self.printed)

    @property
    def shown_printed(self) -> str:
        """The printed figure as it was printed."""
        return "-" if self.printed is None else _text(self.printed, like=self.printed)


@dataclass(frozen=True, kw_only=True)
class Part:
    """An equation or a table of the paper.

    Attributes
    ----------
    title : str
        Such as "Table 3".
    where : str
        Place in the paper.
    finding : str
        Result in one sentence for the summary. Markdown.
    comparisons : tuple of Comparison
        Figure by figure.
    before, after : tuple of str
        Paragraphs, lists, tables and pictures around the comparisons. Markdown.
    """

    title: str
    where: str
    finding: str
    comparisons: tuple[Comparison, ...] = ()
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()

    def count(self, label: str) -> int:
        """Count the comparisons with this label."""
        return sum(one.label == label for one in self.comparisons)


def decimal_of(value: float | int | Fraction | Decimal) -> Decimal:
    """Return `value` as a decimal: exactly, a fraction to 80 digits."""
    if isinstance(value, Fraction):
        with localcontext(prec=_PRECISION):
            return Decimal(value.numerator) / Decimal(value.denominator)
    return Decimal(value)


def compare(
    quantity: str,
    printed: Decimal | int | None,
    ours: float | Fraction | Decimal | None,
    unit: str = "",
    *,
    note: str = "",
    comparable: bool = True,
    base: Decimal | None = None,
) -> Comparison:
    """Make a comparison of numbers of any kind; see `Comparison`."""
    return Comparison(
        quantity=quantity,
        unit=unit,
        printed=None if printed is None else Decimal(printed),
        ours=None if ours is None else decimal_of(ours),
        note=note,
        comparable=comparable,
        base=base,
    )


def compare_accuracy(quantity: str, printed: Decimal | None, ours: float | Fraction, *, note: str = "") -> Comparison:
    """Compare accuracies in per cent; tolerances are relative to the difference from 100 %."""
    base = None if printed is None else 100 - printed
    return compare(quantity, printed, ours, "%", note=note, base=base)


def last_digit(value: Decimal) -> Decimal:
    """Return the unit of the last digit of `value`, such as 0.01 for 1.23."""
    exponent = value.as_tuple().exponent
    assert isinstance(exponent, int)  # a figure is finite
    return Decimal(1).scaleb(exponent)


def plain(value: float | Fraction | Decimal, digits: int = 4) -> str:
    """Write a number with `digits` significant digits, with a power of ten if there would be many zeros."""
    return f"{decimal_of(value):.{digits}g}" if value else "0"


def _text(value: Decimal, like: Decimal) -> str:
    """Digits of `value`, with a power of ten if `like` is printed with one."""
    small = like != 0 and like.adjusted() < -5
    return f"{value:e}" if small else f"{value:f}"


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Markdown table."""
    columns = list(head)
    lines = [columns, ["---"] * len(columns), *(list(row) for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
