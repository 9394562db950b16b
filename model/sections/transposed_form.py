"""Transposed direct form II sections in integers, in the shift operator or in the delta operator.

The section of `sosmith.model.sections.direct_form` is written in powers of ``z - g`` instead of z, and transposed.
With (b0, B1, B2) and (1, A1, A2) for its numerator and denominator in these powers::

    y    = quantized(b0 x + s1)
    s1'  = quantized(g s1 + B1 x - A1 y + Delta s2)
    s2'  = quantized(g s2 + (B2 x - A2 y) / Delta)

g = 0 is the transposed direct form II proper. g = 1 is the delta operator, for poles near z = 1: A1 = 2 + a1
and A2 = 1 + a1 + a2 are then small, and keep their relative precision in few bits. g = -1 does the same for
poles near z = -1. Delta, a power of two, sets the binary point of s2, so that s2 can have about the range
of s1. A first-order section has s1 alone.

The quantization errors reach the output through ``(1 - g w)**2 / A`` from y, ``w (1 - g w) / A`` from s1 and
``Delta w**2 / A`` from s2, with ``w = 1 / z``; one power of ``1 - g w`` less in a first-order section. (Delta
form of Kauraniemi, Laakso, Hartimo and Ovaska 1998.) A half is added before a quantizer to centre its error, unless
the path has a zero at z = 1 already.

With exact states and g = 0 or 1, the output equals that of the direct form I with the error feedback
``(-2 g, g**2)``, or ``(-g, 0)`` in a first-order section, bit for bit: `TransposedForm.direct`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range, Wire
from sosmith.model.sections.direct_form import DirectForm1, Product, check_products

Limits = tuple[int, int]
"""Smallest and largest code."""

_Terms = list[tuple[int, Wire]]


@dataclass(frozen=True, kw_only=True)
class TransposedForm:
    """A first- or second-order section in transposed direct form II; a stage of a datapath.

    Attributes
    ----------
    name : str
        Name of the section.
    products : tuple of Product
        The coefficients with their taps in the direct form; one that taps both x and y is multiplied with each.
    integer_part : tuple of int
        (m1, m2), the multiplier-free part of (a1, a2).
    operator : int
        The g above: 0, 1 or -1.
    delta_exponent : int
        Base-2 logarithm of Delta.
    x : Range
        Range of the input.
    y_frac : int
        Fraction bits of the output.
    state_fracs : tuple of int or None
        Most fraction bits that s1 and s2 keep; None keeps all.
    v_range, t1_range, t2_range : tuple of int
        Ranges of the codes of y, s1 and s2 before their quantizers, from peak gains.
    """

    name: str
    products: tuple[Product, ...]
    integer_part: tuple[int, int]
    operator: int
    delta_exponent: int
    x: Range
    y_frac: int
    state_fracs: tuple[int | None, int | None]
    v_range: Limits
    t1_range: Limits
    t2_range: Limits

    def __post_init__(self) -> None:
        if self.operator not in {-1, 0, 1}:
            raise ValueError(f"operator must be -1, 0 or 1, not {self.operator!r}")
        check_products(self.products, self.integer_part)

    @property
    def order(self) -> int:
        """Order of the section, 1 or 2."""
        return 2 if self.integer_part[1] or any(p.y[1] or p.x[2] for p in self.products) else 1

    @property
    def coefficients(self) -> dict[str, tuple[int, int]]:
        """Integer and fraction bits of every coefficient, by name."""
        return {p.name: (p.coefficient, p.frac) for p in self.products}

    @property
    def optional_quantizers(self) -> tuple[str, ...]:
        """Names of the nodes that may be quantized but need not be: none."""
        return ()

    @property
    def stated_fracs(self) -> dict[str, int]:
        """Fraction bits of the nodes with a stated range, by name, which follow without the graph."""
        states = self._state_fracs
        fracs = {"v": max([*self._fracs_added(0), states[0][1]])}
        return fracs | {name: exact for name, (exact, _) in zip(("t1", "t2"), states, strict=False)}

    @cached_property
    def direct(self) -> DirectForm1:
        """The direct form I with the same coefficients, formats of x and y, and error path of y."""
        g = self.operator
        section = DirectForm1(
            name=self.name,
            products=self.products,
            integer_part=self.integer_part,
            feedback=(-2 * g, g * g) if self.order == 2 else (-g, 0),
            x=self.x,
            y_frac=self.y_frac,
            v_range=(0, 0),
        )
        finer = section.total_frac - self.stated_fracs["v"]
        return replace(section, v_range=(self.v_range[0] << finer, self.v_range[1] << finer))

    @cached_property
    def graph(self) -> Graph:
        """The section as a dataflow graph with the input ``x`` and the output ``y``."""
        g = GraphBuilder()
        x = g.input("x", *self.x)
        states = [
            g.delay(f"s{k}", kept, limits[0] >> (exact - kept), limits[1] >> (exact - kept))
            for k, limits, (exact, kept) in zip((1, 2), self._state_ranges, self._state_fracs, strict=False)
        ]
        carries = [g.shift(state, exponent) for state, exponent in zip(states, self._exponents, strict=True)]
        totals = self._products_of(g, "x", x)
        for total, carry in zip(totals, carries, strict=False):
            total.append((1, carry))
        y = self._quantized(g, g.combine(totals[0]), 0, self.y_frac)
        for total, terms, weight in zip(totals, self._products_of(g, "y", y), self._integers, strict=True):
            total += [*terms, *((-power, y) for power in _powers(weight))]
        for k, (state, carry, exponent) in enumerate(zip(states, carries, self._exponents, strict=True), start=1):
            t = g.shift(g.combine([*totals[k], (self.operator, carry)]), -exponent)
            g.connect(state, self._quantized(g, t, k, self._state_fracs[k - 1][1]))
        return g.build([y])

    def _products_of(self, g: GraphBuilder, operand: str, wire: Wire) -> list[_Terms]:
        """Multiply x or y by its coefficients; return the products as terms of v, t1 and t2."""
        totals: list[_Terms] = [[] for _ in range(self.order + 1)]
        for p in self.products:
            weights = self._weights(p, operand)
            if any(weights):
                suffix = f"_{operand}" if any(p.x) and any(p.y) else ""
                product = g.scale(wire, p.coefficient, p.frac, f"product_{p.name}{suffix}")
                for total, weight in zip(totals, weights, strict=True):
                    total += [(power, g.shift(product, -p.shift)) for power in _powers(weight)]
        return totals

    def _quantized(self, g: GraphBuilder, total: Wire, k: int, frac: int) -> Wire:
        """State the range of v (k = 0), t1 or t2, and quantize it; centre the error unless its path does."""
        passes_constants = self.operator != 1 or k == self.order
        if passes_constants and g[total].frac > frac:
            total = g.add(total, g.constant(1, frac + 1, f"half{k}"))
        name, limits = (("v", self.v_range), *zip(("t1", "t2"), self._state_ranges, strict=False))[k]
        return g.floor(g.bound(total, *limits, name), frac, "" if k else "y")

    def _weights(self, product: Product, operand: str) -> tuple[int, ...]:
        """Return the factors of a product in v, t1 and t2."""
        return self._rewritten(*product.x) if operand == "x" else self._rewritten(0, *product.y)

    @property
    def _integers(self) -> tuple[int, ...]:
        """The integer part in powers of ``z - g``, without its leading one."""
        return 0, *self._rewritten(1, *self.integer_part)[1:]

    def _rewritten(self, p0: int, p1: int, p2: int) -> tuple[int, ...]:
        """Return ``p0 z**2 + p1 z + p2``, or ``p0 z + p1`` at first order, in powers of ``z - g``."""
        g = self.operator
        return (p0, g * p0 + p1) if self.order == 1 else (p0, 2 * g * p0 + p1, g * g * p0 + g * p1 + p2)

    @property
    def _exponents(self) -> tuple[int, ...]:
        """Base-2 logarithms of the weights of the states: 1 and Delta."""
        return (0, self.delta_exponent)[: self.order]

    @property
    def _state_ranges(self) -> tuple[Limits, ...]:
        return (self.t1_range, self.t2_range)[: self.order]

    @cached_property
    def _state_fracs(self) -> tuple[tuple[int, int], ...]:
        """Fraction bits of the exact t1 and t2, and those that s1 and s2 keep."""
        fracs: list[tuple[int, int]] = []
        carried: list[int] = []
        for k in range(self.order, 0, -1):
            exponent, most = self._exponents[k - 1], self.state_fracs[k - 1]
            exact = max([*self._fracs_added(k), *carried]) + exponent
            kept = exact if most is None else min(exact, most)
            fracs.insert(0, (exact, kept))
            carried = [kept - exponent]
        return tuple(fracs)

    def _fracs_added(self, k: int) -> list[int]:
        """Return the fraction bits of all products of x and y in v (k = 0), t1 or t2."""
        fracs = [self.y_frac - _trailing_zeros(self._integers[k])] if self._integers[k] else []
        for operand, frac in (("x", self.x.frac), ("y", self.y_frac)):
            for p in self.products:
                if weight := self._weights(p, operand)[k]:
                    fracs.append(frac + p.frac + p.shift - _trailing_zeros(weight))
        return fracs


def _trailing_zeros(number: int) -> int:
    return (number & -number).bit_length() - 1


def _powers(number: int) -> list[int]:
    """Return the non-adjacent form of `number`: the fewest signed powers of two that add up to it."""
    powers = []
    unit = 1
    while number:
        if number % 2:
            digit = 2 - number % 4
            powers.append(digit * unit)
            number -= digit
        number //= 2
        unit *= 2
    return powers
