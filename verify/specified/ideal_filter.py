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
            stated = self._transfer_function()
            return stated._replace(
                numerator=stated.numerator * arb_poly([ball(1 + self.correction), ball(-self.correction)])
            )

    def _transfer_function(self) -> TransferFunction:
        """Return what the table itself states, at the present precision."""
        if self.table.rows:
            return _product(self.table.rows)
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
        prod((arb_poly([ball(b) for b in row[:3]]) for row in rows), start=one),
        prod((arb_poly([ball(a) for a in row[3:]]) for row in rows), start=one),
    )


def _real(polynomial: acb_poly) -> arb_poly:
    """Real part of a polynomial whose true coefficients are real."""
    return arb_poly([value.real for value in polynomial.coeffs()])


def _normalized(numerator: acb_poly, denominator: acb_poly) -> TransferFunction:
    above, below = _real(numerator), _real(denominator)
    first = below[0]
    if first.contains(0):
        raise UndecidedError("the stated filter could not be enclosed")
    coefficients = [value / first for value in below.coeffs()]
    return TransferFunction(arb_poly([value / first for value in above.coeffs()]), arb_poly([1, *coefficients[1:]]))


def _bilinear(prototype: AnalogPrototype, kind: str, band: _Band) -> TransferFunction:
    minus, plus = acb_poly([1, -1]), acb_poly([1, 1])
    up, down = minus, plus * acb(band.width)
    if band.product is not None:
        up, down = minus**2 + plus**2 * acb(band.product), minus * plus * acb(band.width)
    if kind in {"highpass", "bandstop"}:
        up, down = (plus * acb(band.width), minus) if band.product is None else (down, up)
    numerator = prod((down - up * (1 / zero) for zero in prototype.zeros), start=acb_poly([prototype.gain]))
    denominator = prod((down - up * (1 / pole) for pole in prototype.poles), start=acb_poly([1]))
    return _normalized(numerator * down ** (len(prototype.poles) - len(prototype.zeros)), denominator)


def _impulse_invariant(prototype: AnalogPrototype, ratio: Fraction) -> TransferFunction:
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
    return _normalized(numerator, prod(factors, start=acb_poly([1])))
