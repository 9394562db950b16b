"""Exact readers of single values in a specification, and the error they raise.

A reader takes a value as `tomllib` gives it (every TOML float as `decimal.Decimal`) and returns it checked,
numbers as `Fraction`. A value that does not fit raises `UnfitError`, from which the message to the user is made.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from typing import TypeVar

from sosmith.gen.specification.verilog_names import KEYWORDS, MAX_NAME, OBEYED, is_identifier
from sosmith.model.suggestion import did_you_mean

Item = TypeVar("Item")

IDENTIFIER = f"a Verilog identifier of at most {MAX_NAME} letters, digits and underscores"

MAX_SHOWN = 12
"""Most errors that are shown beside the first one."""

MAX_DIGITS = 130
"""Enough for any double whose magnitude is allowed, written out."""

MAX_EXPONENT = 30
"""Magnitudes are zero or from 1e-30 to below 1e30: `Fraction` would store ``1e999999999`` in full."""


class UnfitError(ValueError):
    """A value that is not valid in a specification.

    Parameters
    ----------
    expected : str
        What is expected; follows "must be" in the message.
    found : str
        What was found.
    where : str
        Path of the key, such as ``filter.sos[2]``.
    later : bool
        Whether the value is known, but not supported in this version yet.
    """

    def __init__(self, expected: str, found: str, *, where: str = "", later: bool = False) -> None:
        self.expected = expected
        self.found = found
        self.where = where
        self.later = later
        prefix = "not yet available: " if later else ""
        super().__init__(f"{prefix}{where} must be {expected}, not {found}")

    def inside(self, where: str) -> UnfitError:
        """Return the same error with `where` prepended to its path."""
        return UnfitError(self.expected, self.found, where=where + self.where, later=self.later)


def together(findings: Sequence[UnfitError]) -> UnfitError:
    """Return one error for all findings: a sentence each, on lines of their own, the first one first.

    A typing error often makes two: a wrong key and a missing one.
    """
    first, *others = findings
    rest = "".join(f"\n  {other}" for other in others[:MAX_SHOWN])
    rest += f"\n  and {len(others) - MAX_SHOWN} more" if len(others) > MAX_SHOWN else ""
    return UnfitError(first.expected, first.found + rest, where=first.where, later=first.later)


def literal(value: object) -> str:
    """Return `value` as messages show it, on one line of bounded length."""
    match value:
        case bool():
            shown = "true" if value else "false"
        case int() if value.bit_length() > 128:  # str() itself refuses thousands of digits
            shown = f"a whole number of {value.bit_length()} bits"
        case Decimal() if not value.is_finite() or not -300 < value.adjusted() < 300:
            shown = str(value).lower()
        case Decimal():
            shown = repr(float(value))
        case Fraction():
            shown = repr(float(value)).removesuffix(".0")
        case int() | str():
            shown = repr(value)
        case list() | tuple() if len(value) > 6 or any(isinstance(item, list | tuple) for item in value):
            shown = f"a list of {len(value)} values"
        case list() | tuple():
            return f"[{', '.join(map(literal, value))}]"
        case dict():
            shown = "a table"
        case _:
            shown = f"a {type(value).__name__}"
    return shown if len(shown) <= 60 else f"{shown[:56]} ..."


_PREFIXES: dict[str, int | Fraction] = {"k": 1000, "K": 1000, "M": 10**6, "G": 10**9, "m": Fraction(1, 1000)}
_NUMBER = r"[-+]?[0-9]{1,18}(?:[.,][0-9]{1,18})?(?:[eE][-+]?[0-9]{1,2})?"
_WITH_UNIT = re.compile(rf"({_NUMBER})\s*([kKMGm]?)(?:[Hh]z|dB|V|mm|degC|sps|S/s|bits?)?")


def as_number(value: object) -> str:
    """Return how to write a text such as ``1 kHz`` as a number, for the end of a sentence; empty for other values."""
    match = _WITH_UNIT.fullmatch(value.strip()) if isinstance(value, str) else None
    if match is None:
        return ""
    exact = Fraction(match[1].replace(",", ".")) * _PREFIXES.get(match[2], 1)
    return f": write {repr(float(exact)).removesuffix('.0')}, without quotes and unit"


def number(value: object, expected: str = "a number") -> Fraction:
    """Read a finite number exactly: 0.0036 becomes ``Fraction(36, 10000)``.

    `expected` describes the value in the message if it is not a number.

    Raises
    ------
    UnfitError
        If `value` is not a finite number, has more than `MAX_DIGITS` digits or is too large or small.
    """
    if isinstance(value, bool) or not isinstance(value, int | Decimal):
        raise UnfitError(expected, literal(value) + as_number(value))
    exact = Decimal(value)
    if not exact.is_finite():
        raise UnfitError("a finite number", literal(value))
    if not exact:
        return Fraction(0)
    if len(exact.as_tuple().digits) > MAX_DIGITS or not -MAX_EXPONENT <= exact.adjusted() < MAX_EXPONENT:
        raise UnfitError(
            f"a number of at most {MAX_DIGITS} digits, zero or"
            f" from 1e-{MAX_EXPONENT} to below 1e{MAX_EXPONENT} in size",
            literal(value),
        )
    return Fraction(exact)


def positive(unit: str) -> Callable[[object], Fraction]:
    """Return the reader of a positive number of `unit`."""
    expected = f"a positive number of {unit}"

    def read(value: object) -> Fraction:
        exact = number(value, expected)
        if exact <= 0:
            raise UnfitError(expected, literal(value))
        return exact

    return read


def between(low: Fraction, high: Fraction, unit: str) -> Callable[[object], Fraction]:
    """Return the reader of a number of `unit` from `low` to `high`."""
    expected = f"a number of {unit} from {literal(low)} to {literal(high)}"

    def read(value: object) -> Fraction:
        exact = number(value, expected)
        if not low <= exact <= high:
            raise UnfitError(expected, literal(value))
        return exact

    return read


def whole(low: int, high: int) -> Callable[[object], int]:
    """Return the reader of a whole number from `low` to `high`, written without a point."""

    def read(value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise UnfitError(f"a whole number from {low} to {high}", literal(value) + as_number(value))
        return value

    return read


def flag(value: object) -> bool:
    """Read true or false."""
    if not isinstance(value, bool):
        known = str(value).strip().lower() if isinstance(value, str | int) else ""
        meant = {"true": "true", "yes": "true", "1": "true", "false": "false", "no": "false", "0": "false"}.get(known)
        raise UnfitError("true or false", literal(value) + (f": write {meant}" if meant else ""))
    return value


def text(longest: int) -> Callable[[object], str]:
    """Return the reader of a printable text of at most `longest` characters."""

    def read(value: object) -> str:
        if not isinstance(value, str) or not value.isprintable() or len(value) > longest:
            raise UnfitError(f"a printable text of at most {longest} characters", literal(value))
        return value

    return read


def file_name(value: object) -> str:
    """Read the name of a file, which is not empty."""
    if not isinstance(value, str) or not value.isprintable() or not value:
        raise UnfitError("the name of a file", literal(value))
    return value


_NO_HINTS: Mapping[str, str] = {}


def choice(names: Sequence[str], hints: Mapping[str, str] = _NO_HINTS) -> Callable[[object], str]:
    """Return the reader of one of `names`; `hints` tells what to do instead of others, in small letters."""

    def read(value: object) -> str:
        if not isinstance(value, str) or value not in names:
            hint = hints.get(value.lower()) or did_you_mean(value, names) if isinstance(value, str) else ""
            raise UnfitError(one_of(names), f"{literal(value)}{hint}")
        return value

    return read


def one_of(names: Sequence[str]) -> str:
    """Return `names` as a phrase, such as "one of bilinear, impulse_invariant"."""
    return f"one of {', '.join(names)}" if len(names) > 1 else names[0]


def listed(names: Sequence[str]) -> str:
    """Return one or more `names` as a list in a sentence, such as "order, cutoff and sos"."""
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def key_text(key: str) -> str:
    """Return `key` as TOML writes it: bare if that is allowed, otherwise quoted."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else literal(key)


def identifier(value: object) -> str:
    """Read a Verilog identifier that is neither a keyword nor a word that tools obey."""
    if not isinstance(value, str) or not is_identifier(value):
        raise UnfitError(IDENTIFIER, literal(value))
    if value in KEYWORDS:
        raise UnfitError(f"{IDENTIFIER}, and no keyword of SystemVerilog", literal(value))
    if OBEYED.fullmatch(value):
        raise UnfitError(f"{IDENTIFIER}, and no word that tools obey in comments", literal(value))
    return value


def list_of(
    read: Callable[[object], Item], shortest: int, longest: int, items: str = "numbers"
) -> Callable[[object], tuple[Item, ...]]:
    """Return the reader of a list of `shortest` to `longest` values, each read by `read`."""
    count = str(shortest) if shortest == longest else f"{shortest} to {longest}"

    def read_list(value: object) -> tuple[Item, ...]:
        if not isinstance(value, list) or not shortest <= len(value) <= longest:
            raise UnfitError(f"a list of {count} {items}", literal(value))
        return tuple(_read_item(read, value, k) for k in range(len(value)))

    return read_list


def _read_item(read: Callable[[object], Item], values: Sequence[object], k: int) -> Item:
    try:
        return read(values[k])
    except UnfitError as unfit:
        raise unfit.inside(f"[{k}]") from None


ABOVE_ZERO = "a positive number in the unit of the output"
"""What `above_zero` expects."""


def above_zero(value: object) -> Fraction:
    """Read a positive number in the unit of the output."""
    exact = number(value, ABOVE_ZERO)
    if exact <= 0:
        raise UnfitError(ABOVE_ZERO, literal(value))
    return exact


ONE_OR_MORE = "a number in the unit of the output, or a list of one for each channel"
"""What `one_or_more` expects; follows "must be" in the message."""


def one_or_more(value: object) -> tuple[Fraction, ...]:
    """Read one number for all channels, or a list with one for each channel."""
    if isinstance(value, list):
        if not value:
            raise UnfitError(ONE_OR_MORE, literal(value))
        return list_of(number, 1, len(value))(value)
    return (number(value, ONE_OR_MORE),)


def rising_pair(value: object) -> tuple[Fraction, Fraction]:
    """Read two rising numbers ``[low, high]``."""
    low, high = list_of(number, 2, 2)(value)
    if low >= high:
        raise UnfitError("rising, [low, high]", literal(value))
    return low, high


def edges(value: object) -> tuple[Fraction, ...]:
    """Read one frequency, or a list of two."""
    if isinstance(value, list):
        return list_of(number, 2, 2)(value)
    return (number(value, "a number of Hz, or a list of 2 numbers for a band"),)
