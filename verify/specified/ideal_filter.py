"""The filter that a specification states, derived from its `[filter]` table in ball arithmetic.

The digital filter is a quotient of polynomials in ``w = 1/z``. Where the frequency transformation and the bilinear one
give ``s = up / down`` for the prototype's s, its factor ``1 - s / pole`` is ``(down - up / pole) / down``, so that no
pole or zero of the digital filter needs to be computed. Analog frequencies are in units in which
``s = (1 - w) / (1 + w)``, and a frequency f becomes ``tan(pi f / sample_rate)``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from math import prod
from typing import NamedTuple

from flint import acb, acb_poly, arb, arb_poly, ctx

from sosmith.model.errors import SpecificationError
from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.specified.analog_prototypes import AnalogPrototype, analog_prototype
from sosmith.verify.specified.balls import ball
from sosmith.verify.specified.filter_table import FilterTable, read_filter_table
from sosmith.verify.specified.smallest_order import edge_from_passband, smallest_order

Taps = Sequence[arb]
"""A real factor in w with one root or two: its coefficients behind the leading 1."""


class Factors(NamedTuple):
    """The true filter: a polynomial in w times the quotient of the products of real factors that begin with 1.

    `first` is the filter's first sample, or all of the numerator of a sampled filter, which has no `zeros`.
    """

    first: Taps
    zeros: list[Taps]
    poles: list[Taps]

    def multiplied(self) -> TransferFunction:
        """Return numerator and denominator."""
        over, under = (prod((arb_poly([1, *taps]) for taps in each), start=arb_poly([1])) for each in self[1:])
        return TransferFunction(arb_poly(list(self.first)) * over, under)


class TransferFunction(NamedTuple):
    """Polynomials in ``w = 1/z`` whose balls contain the true coefficients; the denominator begins with 1."""

    numerator: arb_poly
    denominator: arb_poly


@dataclass(frozen=True)
class StatedFilter:
    """The filter that a specification states, at any precision.

    Behind a decimator whose droop it corrects, it has the factor ``1 + g - g w`` as well, with g the `correction`.
    """

    table: FilterTable
    correction: Fraction = Fraction(0)

    def at(self, bits: int) -> TransferFunction:
        """Enclose the transfer function in ball arithmetic of `bits` bits.

        Raises
        ------
        UndecidedError
            If the precision is too low.
        SpecificationError
            If no supported order meets the stated edges and losses.
        """
        with ctx.workprec(bits):
            stated = _product(self.table.rows) if self.table.rows else self.factors().multiplied()
            return stated._replace(
                numerator=stated.numerator * arb_poly([ball(1 + self.correction), ball(-self.correction)])
            )

    def order(self) -> int:
        """Return the number of poles of the filter by edges and losses, at the present precision.

        Raises
        ------
        UndecidedError
            If the precision is too low.
        SpecificationError
            If no supported order meets them.

        Examples
        --------
        >>> losses = {"passband_loss": 1, "stopband_loss": 20}
        >>> edges = {"passband_edge": [10, 20], "stopband_edge": [5, 30]}
        >>> stated_filter({"family": "butterworth", "kind": "bandpass", **edges, **losses}, Fraction(100)).order()
        6
        """
        order, band = self._order_and_band()
        return order if band.product is None else 2 * order

    def factors(self) -> Factors:
        """Return what a table without `rows` states, but for the correction, at the present precision.

        Raises
        ------
        UndecidedError
            If the precision is too low.
        SpecificationError
            If no supported order meets the stated edges and losses.
        """
        if self.table.method == "impulse_invariant":
            return _impulse_invariant(self._prototype(self.table.order or 0), self.table.cutoff[0])
        order, band = self._order_and_band()
        return _bilinear(self._prototype(order), self.table.kind, band)

    def _prototype(self, order: int) -> AnalogPrototype:
        losses = self.table.losses
        return analog_prototype(self.table.family, order, losses.get("passband_loss"), losses.get("stopband_loss"))

    def _order_and_band(self) -> tuple[int, _Band]:
        table = self.table
        if table.order is not None:
            return table.order, _band(_warped(table.cutoff))
        family, losses = table.family, (table.losses["passband_loss"], table.losses["stopband_loss"])
        passband, stopband = _warped(table.passband_edge), _warped(table.stopband_edge)
        if table.kind == "bandstop":
            passband = _moved_inwards(passband, stopband)
        band = _band(passband)
        transition = reduce(arb.min, (abs(_on_prototype(table.kind, band, edge)) for edge in stopband))
        order = smallest_order(family, transition, *losses, table.max_order)
        if order is None:
            raise SpecificationError(
                f"the edges and losses of filter must be met by an order of at most {table.max_order}, not a higher one"
            )
        edge = edge_from_passband(family, order, *losses)
        falling = table.kind in {"lowpass", "bandpass"}
        return order, band._replace(width=band.width * edge if falling else band.width / edge)


def stated_filter(
    table: Mapping[str, object], sample_rate: Fraction, correction: Fraction = Fraction(0)
) -> StatedFilter:
    """Read the `[filter]` table of a specification.

    Parameters
    ----------
    table : mapping
        Keys as in the file; numbers are int, Fraction or Decimal and are taken exactly, frequencies are in Hz.
    sample_rate : Fraction
        In Hz, above 0.
    correction : Fraction
        Weight of the correction of a decimator's droop; 0 without one.

    Raises
    ------
    SpecificationError
        If a key is missing, is one that would be ignored, or has a value that it cannot have.

    Examples
    --------
    A first-order Butterworth low-pass at a quarter of the sample rate is the mean of two samples:

    >>> table = {"family": "butterworth", "kind": "lowpass", "order": 1, "cutoff": 25}
    >>> numerator, denominator = stated_filter(table, Fraction(100)).at(64)
    >>> numerator[0].contains(0.5), numerator[1].contains(0.5), denominator[1].contains(0)
    (True, True, True)
    """
    return StatedFilter(read_filter_table(table, sample_rate), correction)


# Analog frequencies.


class _Band(NamedTuple):
    """A band of analog frequencies by its width and the product of its ends; from 0 on, the product is None."""

    width: arb
    product: arb | None


def _band(edges: Sequence[arb]) -> _Band:
    return _Band(edges[-1] - edges[0], edges[0] * edges[-1]) if len(edges) == 2 else _Band(edges[0], None)


def _warped(ratios: Sequence[Fraction]) -> list[arb]:
    """Frequencies that the bilinear transformation takes to the given ones, in units of the sample rate."""
    return [(ball(ratio) * arb.pi()).tan() for ratio in ratios]


def _on_prototype(kind: str, band: _Band, edge: arb) -> arb:
    """Frequency of the prototype that becomes `edge`, with a sign."""
    ratio = edge / band.width if band.product is None else (edge**2 - band.product) / (edge * band.width)
    return ratio if kind in {"lowpass", "bandpass"} else 1 / ratio


def _moved_inwards(passband: Sequence[arb], stopband: Sequence[arb]) -> list[arb]:
    """Move one edge of a band-stop filter's pass band until both edges of the stop band are equally demanding."""
    product = stopband[0] * stopband[1]
    low, high = passband
    return [low.max(product / high), high.min(product / low)]


# Transfer functions.


def _product(rows: Sequence[Sequence[Fraction]]) -> TransferFunction:
    one = arb_poly([1])
    return TransferFunction(
        prod((arb_poly([ball(b) for b in row[: len(row) // 2]]) for row in rows), start=one),
        prod((arb_poly([ball(a) for a in row[len(row) // 2 :]]) for row in rows), start=one),
    )


def _one_of_each(roots: Sequence[acb]) -> list[acb]:
    """Return the roots that are real and, of each conjugate pair, the one above the real axis."""
    return [root for root in roots if root.imag.is_zero() or root.imag > 0]


def _bilinear(prototype: AnalogPrototype, kind: str, band: _Band) -> Factors:
    minus, plus = acb_poly([1, -1]), acb_poly([1, 1])
    up, down = minus, plus * acb(band.width)
    infinite = [plus]
    if band.product is not None:
        up, down = minus**2 + plus**2 * acb(band.product), minus * plus * acb(band.width)
        infinite = [minus, plus]
    if kind in {"highpass", "bandstop"}:
        up, down = (plus * acb(band.width), minus) if band.product is None else (down, up)
        infinite = [down]
    zeros, poles = (
        [(root, down - up * (1 / root)) for root in _one_of_each(roots)] for roots in (prototype.zeros, prototype.poles)
    )
    beyond = len(prototype.poles) - len(prototype.zeros)
    first = prototype.gain * down[0].real ** beyond
    for factors, power in ((zeros, 1), (poles, -1)):
        for root, factor in factors:
            first *= factor[0].real ** power if root.imag.is_zero() else _square(factor[0]) ** power
    if not first.is_finite():
        raise UndecidedError("the stated filter could not be enclosed")
    at_infinity = [_taps(factor) for factor in infinite] * beyond
    return Factors(
        [first],
        [*at_infinity, *(taps for root, factor in zeros for taps in _real_factors(root, factor))],
        [taps for root, factor in poles for taps in _real_factors(root, factor)],
    )


def _real_factors(root: acb, factor: acb_poly) -> list[Taps]:
    """Return the real factors that become of one real root of the prototype, or of a conjugate pair.

    `factor` is what becomes of the root itself: it has the degree 1, or 2 in a band.
    """
    if root.imag.is_zero():
        return [_taps(factor)]
    first, second = factor[1] / factor[0], factor[2] / factor[0]
    if factor.degree() == 1:
        return [_pair(-first)]
    middle, apart = -first / 2, _root(first**2 / 4 - second)
    return [_pair(middle + apart), _pair(middle - apart)]


def _pair(place: acb) -> Taps:
    """Return the factor ``(1 - p w)(1 - p' w)`` of a place p in the z-plane and its conjugate."""
    return [-2 * place.real, _square(place)]


def _taps(factor: acb_poly) -> Taps:
    """Return what is behind the leading 1 of a polynomial whose true coefficients are real."""
    return [(value / factor[0]).real for value in factor.coeffs()[1:]]


def _root(value: acb) -> acb:
    """Return a square root, away from the negative real axis, where those of a ball would be both."""
    return (-value).sqrt() * acb(0, 1) if value.real < 0 else value.sqrt()


def _square(value: acb) -> arb:
    return value.real**2 + value.imag**2


def _impulse_invariant(prototype: AnalogPrototype, ratio: Fraction) -> Factors:
    """Return ``T sum(R / (1 - exp(p T) w))`` over the poles p and residues R of the filter with its edge at `ratio`."""
    edge = 2 * arb.pi() * ball(ratio)  # rad per sample
    poles = prototype.poles
    factors = [acb_poly([1, -(edge * pole).exp()]) for pole in poles]
    numerator = acb_poly([0])
    for k, pole in enumerate(poles):
        others = [*range(k), *range(k + 1, len(poles))]
        over = prod((1 - pole / zero for zero in prototype.zeros), start=-edge * pole * prototype.gain)
        under = prod((1 - pole / poles[i] for i in others), start=acb(1))
        numerator += prod((factors[i] for i in others), start=acb_poly([over / under]))
    places = [(pole, (edge * pole).exp()) for pole in _one_of_each(poles)]
    return Factors(
        [numerator[k].real for k in range(len(poles))],
        [],
        [[-place.real] if pole.imag.is_zero() else _pair(place) for pole, place in places],
    )
