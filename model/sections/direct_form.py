"""Direct form I sections in integers, with error feedback at the one quantizer.

Sign convention, here and everywhere in this package, scipy's: a section is
``H(z) = (b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2)``.

The recursion is split into a multiplier-free integer part and products whose constants are small::

    v(n) = - m1 y(n-1) - m2 y(n-2) + sum_i c_i 2^-s_i (taps_i . x + taps_i . y)
             - k1 e(n-1) - k2 e(n-2) + h (1 + k1 + k2)
    y(n) = floor(v(n)),  e(n) = v(n) - y(n)

with h half an LSB of y. The constant centres the error, so that the quantizer rounds on average. It vanishes where
the error feedback has a zero at z = 1: dropping bits costs nothing there. Where (m1, m2) = (k1, k2), the state y + e is
v itself, one register and one addition.

A low-pass section with unity gain at zero frequency needs two products only::

    v(n) = 2 v(n-1) - v(n-2) - A1 (y(n-1) - y(n-2)) + A2 ((x(n) + 2 x(n-1) + x(n-2)) / 4 - y(n-2))
    A1 = 2 + a1,  A2 = 1 + a1 + a2

The tap sum of a product may be quantized too, with first-order error feedback, to fit the operand of a hardware
multiplier. As c_i is small and the error is differenced, next to nothing of it reaches the output.

A product may drop bits as well, below those that the total keeps. What that costs grows with the peak gain of
1 / A(z), and the words of v, and all that is added to it, get as much shorter. Where there is room below the bits of
``-m1 y(n-1)``, a constant centres it. Its operand is a state of its own if it is a sum of y alone with all its bits: it
is added up as soon as y(n) is there, so that the next sample begins with the multiplication.

A1 and A2 keep their relative precision in few bits however low the cutoff, and the gain at zero
frequency is exactly one whatever they are rounded to.

The quantization error reaches the section's output through ``-(1 + k1 z^-1 + k2 z^-2) / A(z)``:
(k1, k2) = (0, 0) is the plain direct form, (-1, 0) and (-2, 1) are error feedback of first and
second order for poles near z = 1 (Laakso and Hartimo 1992; residue feedback after Williamson).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import ceil

from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range, Wire
from sosmith.model.sections.truncated_products import mean_error, truncated


@dataclass(frozen=True)
class Product:
    """One multiplication: ``coefficient * 2**-frac * 2**-shift * (sum x[k] x(n-k) + sum y[k-1] y(n-k))``.

    Attributes
    ----------
    name : str
        Name of the coefficient.
    coefficient : int
        Integer constant, not zero.
    frac : int
        Fraction bits of the coefficient.
    x : tuple of int
        Taps on x(n), x(n-1), x(n-2); each 0 or plus or minus a power of two.
    y : tuple of int
        Taps on y(n-1), y(n-2), likewise.
    shift : int
        Right shift of the tap sum, exact.
    kept : int or None
        Fraction bits that are kept of the tap sum; what is dropped is added at the next sample. None keeps all.
    range : tuple of int or None
        Smallest and largest code of the tap sum before bits are dropped, from peak gains.
    floored : int or None
        Fraction bits that are kept of the product. None keeps all.
    sums : int or None
        Fraction bits of the product that are kept in the sums which it is made of, at least `floored`. None leaves open
        what it is made of, and keeps all.
    """

    name: str
    coefficient: int
    frac: int
    x: tuple[int, int, int]
    y: tuple[int, int]
    shift: int = 0
    kept: int | None = None
    range: tuple[int, int] | None = None
    floored: int | None = None
    sums: int | None = None

    def __post_init__(self) -> None:
        if self.coefficient == 0:
            raise ValueError(f"coefficient {self.name} must not be zero")
        if not (any(self.x) or any(self.y)):
            raise ValueError(f"taps of {self.name} must not all be zero")

    @cached_property
    def value(self) -> Fraction:
        """Exact value of the coefficient, without the shift."""
        return Fraction(self.coefficient << max(-self.frac, 0), 1 << max(self.frac, 0))

    @property
    def operand(self) -> str:
        """Name of the tap sum."""
        return f"taps_{self.name}"

    @property
    def label(self) -> str:
        """Name of the product."""
        return f"product_{self.name}"

    @property
    def sums_label(self) -> str:
        """Name of what its sums keep."""
        return f"{self.label}_sums"

    @property
    def is_sum(self) -> bool:
        """Whether it has more than one tap."""
        return sum(map(bool, (*self.x, *self.y))) > 1


@dataclass(frozen=True, kw_only=True)
class DirectForm1:
    """A first- or second-order section in direct form I with error feedback; a stage of a datapath.

    Attributes
    ----------
    name : str
        Name of the section.
    products : tuple of Product
        The multiplications.
    integer_part : tuple of int
        (m1, m2), the multiplier-free part of (a1, a2).
    feedback : tuple of int
        (k1, k2), the error feedback.
    x : Range
        Range of the input.
    y_frac : int
        Fraction bits of the output.
    v_range : tuple of int
        Smallest and largest code of v, from peak gains; v has `total_frac` fraction bits.
    adds_early : bool
        Whether the operand of a product of outputs alone is added up at the sample before: the loop is shorter then,
        but a word more is remembered.
    """

    name: str
    products: tuple[Product, ...]
    integer_part: tuple[int, int]
    feedback: tuple[int, int]
    x: Range
    y_frac: int
    v_range: tuple[int, int]
    adds_early: bool = True

    def __post_init__(self) -> None:
        check_products(self.products, self.integer_part)

    @cached_property
    def numerator(self) -> tuple[Fraction, Fraction, Fraction]:
        """Exact (b0, b1, b2) of the integer coefficients."""
        b = [Fraction(0)] * 3
        for product in self.products:
            for k, tap in enumerate(product.x):
                if tap:
                    b[k] += product.value * tap / 2**product.shift
        return b[0], b[1], b[2]

    @cached_property
    def denominator(self) -> tuple[Fraction, Fraction]:
        """Exact (a1, a2) of the integer coefficients."""
        a1, a2, frac = _denominator(self.products, self.integer_part)
        return Fraction(a1, 1 << frac), Fraction(a2, 1 << frac)

    @cached_property
    def graph(self) -> Graph:
        """The section as a dataflow graph with the input ``x`` and the output ``y``."""
        g = GraphBuilder()
        x = g.input("x", *self.x)
        taps_x = _delay_line(g, x, "x", reach=max(_reach(p.x) for p in self.products))
        frac = self.total_frac
        v1 = g.delay("v1", frac, *self.v_range)
        past = [v1, g.previous(v1, "v2")] if self._order > 1 else [v1]
        taps_y = [g.floor(v, self.y_frac, f"y{i}") for i, v in enumerate(past, start=1)]
        # States are there first, and products that need y(n-1) last: so they are added.
        products: list[tuple[bool, tuple[int, Wire]]] = []
        early: list[tuple[Wire, Product]] = []
        for product in self.products:
            taps = [*zip(product.x, taps_x, strict=False)], [*zip(product.y, taps_y, strict=False)]
            if self._is_early(product):
                operand = g.delay(f"{product.operand}_1", self._operand_frac(product), *(product.range or (0, 0)))
                early.append((operand, product))
            else:
                operand = _operand(g, product, *taps)
            constant = product.coefficient, product.frac
            if product.sums is None:
                scaled = g.scale(operand, *constant, product.label)
            else:
                scaled = truncated(g, operand, *constant, product.sums, product.label)
            if product.floored is not None:
                scaled = g.floor(scaled, min(g[scaled].frac, product.floored))
            products.append((product.y[0] != 0, (1, scaled)))
        terms: list[tuple[int, Wire]] = []
        centre = 1 + sum(self.feedback)
        if self.drops and centre:
            terms.append((1, g.constant(centre, self.y_frac + 1, "centre")))
        for number, (v, y, m, k) in enumerate(zip(past, taps_y, self.integer_part, self.feedback, strict=False)):
            term = (-m, v if m == k else y)
            terms.append(term if number else self._centred(g, term))
            if m != k:
                terms.append((-k, g.fraction(v, self.y_frac)))
        terms += [term for _, term in sorted(products, key=lambda each: each[0])]
        v = g.bound(g.floor(g.combine(terms), frac), *self.v_range, "v")
        g.connect(v1, v)
        y = g.floor(v, self.y_frac, "y")
        for operand, product in early:
            newer = [*zip(product.y, [y, *taps_y], strict=False)]
            g.connect(operand, _operand(g, product, (), newer))
        return g.build([y])

    def _centred(self, g: GraphBuilder, term: tuple[int, Wire]) -> tuple[int, Wire]:
        """Return a term with what centres the errors of the products, if there is room below its bits."""
        factor, wire = term
        frac = self.total_frac
        halves = sum(Fraction(2) ** (frac - 1 - kept) for kept in self._floored_fracs)
        halves -= sum(self._mean_error(p) * 2**frac for p in self.products)
        nearest = ceil(halves - Fraction(3, 4))  # half a unit stays, whatever little the sums lose beside it
        if factor <= 0 or nearest < 1:
            return term
        shifted, constant = g.shift(wire, factor.bit_length() - 1), g.constant(nearest, frac, "centre_of_products")
        fits = g[constant].width - frac <= -g[shifted].frac
        return (1, g.add(shifted, constant)) if fits else term

    def _is_early(self, p: Product) -> bool:
        """Whether the operand of a product is added up at the sample before."""
        drops = p.floored is not None and p.floored < self._product_frac(p)
        whole = p.kept is None or p.kept >= self._operand_frac(p)
        return self.adds_early and drops and whole and p.range is not None and all(p.y) and not any(p.x)

    @property
    def _floored_fracs(self) -> list[int]:
        """Fraction bits of the products that drop some."""
        exact = [(p, self._product_frac(p)) for p in self.products]
        return [p.floored for p, frac in exact if p.floored is not None and p.floored < frac]

    def _mean_error(self, p: Product) -> Fraction:
        """Error on average of the sums that a product is made of."""
        if p.sums is None:
            return Fraction(0)
        return mean_error(self.kept_frac(p), p.coefficient, p.frac, p.sums)

    def _product_frac(self, p: Product) -> int:
        """Fraction bits of a product before it drops any."""
        return self.kept_frac(p) + p.frac

    def kept_frac(self, p: Product) -> int:
        """Fraction bits of a tap sum once it has dropped bits."""
        exact = self._operand_frac(p)
        return exact if p.kept is None else min(exact, p.kept)

    def _operand_frac(self, p: Product) -> int:
        """Fraction bits of a tap sum before it drops any."""
        taps = [(self.x.frac, tap) for tap in p.x if tap] + [(self.y_frac, tap) for tap in p.y if tap]
        return p.shift + max(frac - abs(tap).bit_length() + 1 for frac, tap in taps)

    @property
    def drops(self) -> bool:
        """Whether the output has fewer fraction bits than the exact total."""
        return self.total_frac > self.y_frac

    @property
    def error_feedback(self) -> tuple[int, int] | None:
        """The error feedback; None where no bits are dropped or nothing is fed back, so that it means nothing."""
        return self.feedback if self.drops and any(self.denominator) else None

    @property
    def coefficients(self) -> dict[str, tuple[int, int]]:
        """Integer and fraction bits of every coefficient, by name."""
        return {p.name: (p.coefficient, p.frac) for p in self.products}

    @property
    def fracs(self) -> dict[str, int]:
        """Fraction bits that are kept, by the names that formats have for them."""
        each = [((p.operand, p.kept), (p.label, p.floored), (p.sums_label, p.sums)) for p in self.products]
        return {"v": self.y_frac} | {name: kept for names in each for name, kept in names if kept is not None}

    @property
    def optional_quantizers(self) -> tuple[str, ...]:
        """Names of the nodes that may be quantized but need not be."""
        return (*(p.operand for p in self.products if p.is_sum), *(p.label for p in self.products))

    @property
    def stated_fracs(self) -> dict[str, int]:
        """Fraction bits of the nodes with a stated range, by name, which follow without the graph."""
        fracs = {"v": self.total_frac}
        for p in self.products:
            if p.range is not None:
                fracs[p.operand] = self._operand_frac(p)
        return fracs

    @property
    def _order(self) -> int:
        second = self.integer_part[1] or self.feedback[1] or any(p.y[1] for p in self.products)
        return 2 if second else 1

    @property
    def total_frac(self) -> int:
        """Fraction bits that hold the exact total of all products."""
        fracs = [self.y_frac]
        for p in self.products:
            exact = self._product_frac(p)
            fracs.append(exact if p.floored is None else min(exact, p.floored))
        return max(fracs)


def check_products(products: Sequence[Product], integer_part: tuple[int, int]) -> None:
    """Check that there are products, and that both poles lie inside the unit circle, which integers decide.

    Raises
    ------
    ValueError
        If there are none, or a pole does not.
    """
    if not products:
        raise ValueError("products must not be empty")
    a1, a2, frac = _denominator(products, integer_part)
    unit = 1 << frac
    if not (abs(a2) < unit and abs(a1) < unit + a2):
        raise ValueError(f"poles must lie inside the unit circle, not at a1 = {a1 / unit}, a2 = {a2 / unit}")


def _denominator(products: Sequence[Product], integer_part: tuple[int, int]) -> tuple[int, int, int]:
    """Return (a1, a2) as integers with common fraction bits, and these."""
    fed_back = [(p, p.frac + p.shift) for p in products if any(p.y)]
    frac = max([0, *(exact for _, exact in fed_back)])
    a1, a2 = (part << frac for part in integer_part)
    for p, exact in fed_back:
        a1 -= p.coefficient * p.y[0] << (frac - exact)
        a2 -= p.coefficient * p.y[1] << (frac - exact)
    return a1, a2, frac


def _operand(g: GraphBuilder, product: Product, x: Sequence[tuple[int, Wire]], y: Sequence[tuple[int, Wire]]) -> Wire:
    """Add up taps, state the range of the sum, and drop the bits that are not kept.

    What was dropped at the sample before is added to the taps on x, or else to the older one on y: it may fit below
    their bits, and what comes later, as y does, is added after it.
    """
    first, later = ([(tap, g.shift(wire, -product.shift)) for tap, wire in taps if tap] for taps in (x, y[::-1]))
    if not first:
        first, later = later[:1], later[1:]
    shifts = [abs(tap).bit_length() - 1 for tap, _ in (*first, *later)]
    frac = max(g[wire].frac - shift for (_, wire), shift in zip((*first, *later), shifts, strict=True))
    kept = frac if product.kept is None else min(frac, product.kept)
    terms = [(1, g.combine(first)), *later] if any(tap > 0 for tap, _ in first) else [*first, *later]
    if kept < frac:
        error = g.delay(f"error_{product.name}", frac, 0, (1 << (frac - kept)) - 1)
        terms = [(1, g.add(terms[0][1], error)), *terms[1:]] if terms[0][0] == 1 else [*terms, (1, error)]
    taps = g.combine(terms)
    if product.range is not None:
        taps = g.bound(taps, *product.range)
    taps = g.named(taps, product.operand)
    if kept < frac:
        g.connect(error, g.fraction(taps, kept))
    return g.floor(taps, kept)


def _reach(taps: tuple[int, int, int]) -> int:
    return max((k for k in range(3) if taps[k]), default=0)


def _delay_line(g: GraphBuilder, source: Wire, name: str, *, reach: int) -> list[Wire]:
    line = [source]
    for k in range(1, reach + 1):
        line.append(g.previous(line[-1], f"{name}{k}"))
    return line
