"""Finite impulse response (FIR) filters in integers: a delay line, products by constants, and one exact sum.

::

    direct       y(n) = sum_k b_k x(n-k)                                                one product for each tap
    symmetric    y(n) = sum_m c_m (sum of +- x(n-k) over the taps with |b_k| = c_m)     one for each magnitude
    transposed   w_k(n) = b_k x(n) + w_k+1(n-1),  y = w_0                               one for each magnitude

Taps of one magnitude share a product, so that symmetric and antisymmetric filters take half as many, and taps of 0
take none: a half-band filter of N taps has (N + 1) / 4 products and one for its centre. A filter by itself rounds
nothing; the stage behind it rounds once. Its error is therefore that of its coefficients, ``sum |b_k - b'_k| max |x|``,
and half an LSB. In front of recursions with look-ahead, products drop bits (`sosmith.model.sections.floored_products`).
Nothing comes back, so there are no limit cycles, and every range is an interval, exact.

The transposed form keeps sums instead of samples: its states are wider, and each sample goes through one product and
one sum only. The names of the forms are those of Oppenheim and Schafer, Discrete-Time Signal Processing, section 6.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range, Wire
from sosmith.model.sections.floored_products import directions, shortened


class Form(Enum):
    """How the sum of an FIR filter is computed."""

    DIRECT = "direct"
    SYMMETRIC = "symmetric"
    TRANSPOSED = "transposed"


@dataclass(frozen=True)
class TapProduct:
    """A coefficient, and the taps that it stands for.

    Attributes
    ----------
    name : str
        Name of the coefficient.
    coefficient : int
        Integer constant, not zero.
    frac : int
        Fraction bits of the coefficient.
    taps : tuple of (int, int)
        Delay in samples of each tap, rising, and its sign, 1 or -1.
    floored : int or None
        Fraction bits that are kept of the product in a transposed form. None keeps all.
    """

    name: str
    coefficient: int
    frac: int
    taps: tuple[tuple[int, int], ...]
    floored: int | None = None

    @property
    def label(self) -> str:
        """Name of the product."""
        return f"product_{self.name}"

    def __post_init__(self) -> None:
        if self.coefficient == 0:
            raise ValueError(f"coefficient {self.name} must not be zero")
        if not self.taps:
            raise ValueError(f"taps of {self.name} must not be empty")


@dataclass(frozen=True, kw_only=True)
class FirSection:
    """An FIR filter; a stage of a datapath.

    Attributes
    ----------
    name : str
        Name of the stage.
    products : tuple of TapProduct
        The multiplications, at least one; no two have a tap in common.
    form : Form
        How the sum is computed.
    x : Range
        Range of the input.

    Examples
    --------
    >>> section = FirSection(
    ...     name="mean",
    ...     products=(TapProduct("b0", 1, 2, ((0, 1), (2, 1))), TapProduct("b1", 1, 1, ((1, 1),))),
    ...     form=Form.SYMMETRIC,
    ...     x=Range(0, -8, 7),
    ... )
    >>> section.graph.run([[4], [0], [0], [0]])  # in quarters
    [[4], [8], [4], [0]]
    """

    name: str
    products: tuple[TapProduct, ...]
    form: Form
    x: Range

    def __post_init__(self) -> None:
        if not self.products:
            raise ValueError("products must not be empty")

    @property
    def length(self) -> int:
        """Number of taps up to the last one that is not 0."""
        return 1 + max(delay for product in self.products for delay, _ in product.taps)

    @cached_property
    def graph(self) -> Graph:
        """The filter as a dataflow graph with the input ``x`` and the output ``y``."""
        g = GraphBuilder()
        x = g.input("x", *self.x)
        total = self._transposed(g, x) if self.form is Form.TRANSPOSED else self._from_delay_line(g, x)
        return g.build([g.named(total, "y")])

    def _from_delay_line(self, g: GraphBuilder, x: Wire) -> Wire:
        line = [x]
        for k in range(1, self.length):
            line.append(g.previous(line[-1], f"x{k}"))
        terms: list[Wire] = []
        for p in self.products:
            if self.form is Form.SYMMETRIC:
                operand = g.combine([(sign, line[delay]) for delay, sign in p.taps])
                terms.append(g.scale(operand, p.coefficient, p.frac, p.label))
            else:
                # One coefficient, several products: all but the first are named after their taps.
                terms += [
                    g.scale(line[delay], sign * p.coefficient, p.frac, f"product_b{delay}") for delay, sign in p.taps
                ]
        while len(terms) > 1:  # a balanced tree
            pairs = zip(terms[::2], terms[1::2], strict=False)
            terms = [*(g.add(a, b) for a, b in pairs), *terms[len(terms) // 2 * 2 :]]
        return terms[0]

    def _transposed(self, g: GraphBuilder, x: Wire) -> Wire:
        products = {
            delay: (sign * direction, wire)
            for p in self.products
            for direction, wire in [self._scaled(g, x, p)]
            for delay, sign in p.taps
        }
        total: Wire | None = None
        for k in reversed(range(self.length)):
            terms = [] if total is None else [(1, g.previous(total, f"w{k + 1}"))]
            total = g.combine([*terms, *([products[k]] if k in products else [])])
        assert total is not None
        return total

    def _scaled(self, g: GraphBuilder, x: Wire, product: TapProduct) -> tuple[int, Wire]:
        """Return a product of the input, and the sign with which it is a term."""
        direction = self._directions.get(product.name)
        if direction is None or product.floored is None:
            return 1, g.scale(x, product.coefficient, product.frac, product.label)
        return shortened(g, x, product.coefficient, product.frac, product.floored, product.label, direction)

    @cached_property
    def _directions(self) -> dict[str, int]:
        """Whether products that drop bits are rounded down or up, by name; the oldest one, which is first, is added."""
        shorter = [p for p in self.products if p.floored is not None and p.floored < self.x.frac + p.frac]
        shorter.sort(key=lambda p: -p.taps[-1][0])
        constants = [p.coefficient * p.taps[-1][1] for p in shorter]
        constants[:1] = map(abs, constants[:1])
        return dict(zip((p.name for p in shorter), directions(constants), strict=True))

    @property
    def coefficients(self) -> dict[str, tuple[int, int]]:
        """Integer and fraction bits of every coefficient, by name."""
        return {p.name: (p.coefficient, p.frac) for p in self.products}

    @property
    def optional_quantizers(self) -> tuple[str, ...]:
        """Names of the nodes that may be quantized but need not be: the products of a transposed form."""
        return tuple(p.label for p in self.products) if self.form is Form.TRANSPOSED else ()

    @property
    def stated_fracs(self) -> dict[str, int]:
        """Fraction bits of the nodes with a stated range, by name: none."""
        return {}


def grouped(taps: Sequence[float], tolerance: float) -> list[tuple[float, tuple[tuple[int, int], ...]]]:
    """Group taps by their magnitudes.

    Parameters
    ----------
    taps : sequence of float
        b0, b1, and so on.
    tolerance : float
        Largest difference of magnitudes that count as one; taps of no greater magnitude count as 0.

    Returns
    -------
    list of (float, tuple of (int, int))
        Value of the first tap of each magnitude, in the order of the taps, and the delays of all of its taps with
        their signs relative to the first.

    Examples
    --------
    >>> grouped([-0.25, 0.5, 0.0, 0.25], 1e-9)
    [(-0.25, ((0, 1), (3, -1))), (0.5, ((1, 1),))]
    """
    groups: list[tuple[float, list[tuple[int, int]]]] = []
    for delay, tap in enumerate(taps):
        if abs(tap) <= tolerance:
            continue
        for first, members in groups:
            if abs(abs(tap) - abs(first)) <= tolerance:
                members.append((delay, 1 if (tap > 0) == (first > 0) else -1))
                break
        else:
            groups.append((tap, [(delay, 1)]))
    return [(first, tuple(members)) for first, members in groups]
