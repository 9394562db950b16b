"""Reads the `[filter]` table of a specification, with every number exact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction

from sosmith.model.errors import SpecificationError

_FAMILIES = ("butterworth", "chebyshev1", "chebyshev2", "elliptic", "bessel")
FIR_FAMILIES = ("equiripple", "least_squares", "kaiser", "halfband")
"""Families of FIR filters, of which edges and losses do not state all digits."""
_KINDS = ("lowpass", "highpass", "bandpass", "bandstop")
_METHODS = ("bilinear", "impulse_invariant")
_LABELS = ("family", "kind", "method")
_EDGES = ("passband_edge", "stopband_edge")
_LOSSES = ("passband_loss", "stopband_loss")
_RIPPLES = {"chebyshev1": _LOSSES[:1], "chebyshev2": _LOSSES[1:], "elliptic": _LOSSES}
"""Losses that stand beside order and cutoff."""
_FREEDOMS = ("none", "mask")
_MAX_ORDER = 20


@dataclass(frozen=True, kw_only=True)
class FilterTable:
    """What a `[filter]` table states: `order` and `cutoff`, or the two band edges and both losses, or `rows`.

    Attributes
    ----------
    family, kind, method : str
        As in the file; empty where `rows` are given.
    order : int or None
        Order of the prototype.
    cutoff, passband_edge, stopband_edge : tuple of Fraction
        One or two rising frequencies in units of the sample rate, above 0 and below 1/2; empty if not stated.
    losses : mapping of str to Fraction
        "passband_loss" and "stopband_loss" in dB, above 0, as far as they are stated.
    freedom : str
        "mask" if any filter of the family's order that keeps to edges and losses will do, else "none".
    rows : tuple of tuples of Fraction
        Sections (b0, b1, b2, 1, a1, a2), or one of an FIR filter: its taps, and as many of 1, 0, 0, ...; or empty.
    """

    family: str = ""
    kind: str = ""
    method: str = ""
    order: int | None = None
    cutoff: tuple[Fraction, ...] = ()
    passband_edge: tuple[Fraction, ...] = ()
    stopband_edge: tuple[Fraction, ...] = ()
    losses: Mapping[str, Fraction] = field(default_factory=dict)
    freedom: str = "none"
    rows: tuple[tuple[Fraction, ...], ...] = ()

    @property
    def is_fir(self) -> bool:
        """Whether edges and losses state no single filter, but what an FIR filter must keep to."""
        return self.family in FIR_FAMILIES

    @property
    def by_losses(self) -> bool:
        """Whether the filter may be any that keeps to the losses."""
        return self.is_fir or self.freedom == "mask"

    @property
    def max_order(self) -> int:
        """Highest order of a prototype: band-pass and band-stop filters have twice its order."""
        return _MAX_ORDER // 2 if _is_band(self.kind) else _MAX_ORDER


def read_filter_table(table: Mapping[str, object], sample_rate: Fraction) -> FilterTable:
    """Read a `[filter]` table.

    Parameters
    ----------
    table : mapping
        Keys as in the file. Numbers are int, Fraction or Decimal, frequencies one number or a list of two, `sos` a
        list of rows, `taps` one of numbers.
    sample_rate : Fraction
        In Hz, above 0.

    Raises
    ------
    SpecificationError
        If a key is missing, is one that would be ignored, or has a value that it cannot have.

    Examples
    --------
    >>> stated = {"family": "bessel", "kind": "lowpass", "order": 3, "cutoff": Decimal("0.3")}
    >>> read_filter_table(stated, Fraction(100)).cutoff
    (Fraction(3, 1000),)
    """
    if table.get("freedom") == _FREEDOMS[0]:
        table = {key: value for key, value in table.items() if key != "freedom"}
    if "taps" in table:
        _require_only(table, ("taps",), "with taps")
        return FilterTable(rows=(_taps(table["taps"]),))
    if "sos" in table:
        _require_only(table, (*_LABELS, "sos"), "with sos")
        return FilterTable(rows=_rows(table["sos"]))
    family, kind = _word(table, "family", (*_FAMILIES, *FIR_FAMILIES)), _word(table, "kind", _KINDS)
    method = _word({"method": _METHODS[0], **table}, "method", _METHODS)
    by_order = "order" in table or "cutoff" in table
    if family in FIR_FAMILIES:
        _require(not by_order, "family", "another one with order and cutoff", family)
        _require("method" not in table, "method", f"left out for {family}", method)
    if by_order:
        ripples = _RIPPLES.get(family, ())
        _require_only(table, (*_LABELS, "order", "cutoff", *ripples), f"with order and cutoff for {family}")
        read = FilterTable(
            family=family,
            kind=kind,
            method=method,
            order=_order(table),
            cutoff=_frequencies(table, "cutoff", kind, sample_rate),
            losses=_losses(table, ripples),
        )
        _check_order(read)
        return read
    _require_only(table, (*_LABELS, *_EDGES, *_LOSSES, "freedom"), "with edges and losses")
    freedom = _word({"freedom": _FREEDOMS[0], **table}, "freedom", _FREEDOMS)
    _require(method == _METHODS[0], "method", "bilinear with edges and losses", method)
    _require(family != "bessel", "family", "one with a formula for the minimum order", family)
    passband, stopband = (_frequencies(table, key, kind, sample_rate) for key in _EDGES)
    _check_sides(kind, passband, stopband)
    return FilterTable(
        family=family,
        kind=kind,
        method=method,
        passband_edge=passband,
        stopband_edge=stopband,
        losses=_losses(table, _LOSSES),
        freedom=freedom,
    )


def _require(condition: bool, key: str, expected: str, stated: object) -> None:
    if not condition:
        raise SpecificationError(f"filter.{key} must be {expected}, not {stated}")


def _require_only(table: Mapping[str, object], keys: Sequence[str], where: str) -> None:
    """Refuse keys that have no effect: the specification would seem to say something that is not verified."""
    for key, value in table.items():
        _require(key in keys, key, f"left out {where}", value)


def _stated(table: Mapping[str, object], key: str) -> object:
    _require(key in table, key, "given", "missing")
    return table[key]


def _word(table: Mapping[str, object], key: str, words: Sequence[str]) -> str:
    value = _stated(table, key)
    _require(value in words, key, f"one of {', '.join(words)}", value)
    return str(value)


def _is_band(kind: str) -> bool:
    return kind in {"bandpass", "bandstop"}


def _number(value: object, key: str) -> Fraction:
    if isinstance(value, bool) or not isinstance(value, int | Fraction | Decimal):
        raise SpecificationError(f"filter.{key} must be an exact number, not {value!r}")
    _require(not isinstance(value, Decimal) or value.is_finite(), key, "a finite number", value)
    return Fraction(value)


def _order(table: Mapping[str, object]) -> int:
    order = _stated(table, "order")
    if isinstance(order, bool) or not isinstance(order, int):
        raise SpecificationError(f"filter.order must be a whole number, not {order!r}")
    return order


def _check_order(read: FilterTable) -> None:
    order = read.order or 0
    _require(1 <= order <= read.max_order, "order", f"from 1 to {read.max_order} for {read.kind}", order)
    if read.method == "impulse_invariant":
        _require(read.kind == "lowpass", "kind", "lowpass with impulse_invariant", read.kind)
        falls = order % 2 == 1 or read.family not in {"chebyshev2", "elliptic"}
        _require(falls, "order", f"odd for {read.family} with impulse_invariant", order)


def _losses(table: Mapping[str, object], keys: Sequence[str]) -> dict[str, Fraction]:
    losses = {key: _number(_stated(table, key), key) for key in keys}
    for key, loss in losses.items():
        _require(loss > 0, key, "a positive number of dB", loss)
    if len(losses) == 2:
        low, high = losses.values()
        _require(low < high, keys[0], f"below {keys[1]} ({high} dB)", low)
    return losses


def _frequencies(table: Mapping[str, object], key: str, kind: str, sample_rate: Fraction) -> tuple[Fraction, ...]:
    value = _stated(table, key)
    values = tuple(value) if isinstance(value, list | tuple) else (value,)
    count, expected = (2, "two frequencies [low, high]") if _is_band(kind) else (1, "one frequency")
    _require(len(values) == count, key, f"{expected} for {kind}", len(values))
    frequencies = [_number(value, key) for value in values]
    shown = ", ".join(f"{float(frequency):g}" for frequency in frequencies)
    _require(frequencies == sorted(set(frequencies)), key, "rising", shown)
    for frequency in frequencies:
        _require(0 < frequency < sample_rate / 2, key, "above 0 and below half the sample_rate", f"{shown} Hz")
    return tuple(frequency / sample_rate for frequency in frequencies)


def _check_sides(kind: str, passband: tuple[Fraction, ...], stopband: tuple[Fraction, ...]) -> None:
    """Check that the stop band begins beyond each edge of the pass band."""
    low_pass, high_pass, low_stop, high_stop = passband[0], passband[-1], stopband[0], stopband[-1]
    relation, holds = {
        "lowpass": ("below", low_pass < low_stop),
        "highpass": ("above", low_pass > low_stop),
        "bandpass": ("inside", low_stop < low_pass and high_pass < high_stop),
        "bandstop": ("around", low_pass < low_stop and high_stop < high_pass),
    }[kind]
    _require(holds, "passband_edge", f"{relation} stopband_edge for {kind}", "elsewhere")


def _taps(value: object) -> tuple[Fraction, ...]:
    """Read taps, as the row of a section without poles."""
    if not isinstance(value, list | tuple) or not value:
        raise SpecificationError("filter.taps must be a list of numbers, not another value")
    taps = tuple(_number(number, f"taps[{k}]") for k, number in enumerate(value))
    return (*taps, Fraction(1), *[Fraction(0)] * (len(taps) - 1))


def _rows(value: object) -> tuple[tuple[Fraction, ...], ...]:
    rows = [row for row in value if isinstance(row, list | tuple)] if isinstance(value, list | tuple) else []
    if not isinstance(value, list | tuple) or not rows or len(rows) < len(value) or any(len(row) != 6 for row in rows):
        raise SpecificationError("filter.sos must be a list of rows [b0, b1, b2, 1, a1, a2], not another value")
    exact = tuple(tuple(_number(number, f"sos[{k}]") for number in row) for k, row in enumerate(rows))
    for k, row in enumerate(exact):
        _require(row[3] == 1, f"sos[{k}]", "a row with 1 as its fourth number", row[3])
    return exact
