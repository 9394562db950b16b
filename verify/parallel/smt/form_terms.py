"""Forms as bit vectors: sums of multiples of products of integers, wide enough to be exact within floors."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from fractions import Fraction
from math import lcm

from sosmith.verify.graph import require
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.smt.script import Script, Term, bits_for, number, sized
from sosmith.verify.program.normal_form import Form, Monomial


class FormTerms:
    """Writes forms into a script.

    Parameters
    ----------
    forms : Forms
        The atoms.
    script : Script
        Where variables are declared, with their ranges.
    definitions : mapping
        Forms that variables stand for, by the variables' keys.
    shown : callable
        Says what a variable is, by its key.
    """

    def __init__(
        self, forms: Forms, script: Script, definitions: Mapping[Hashable, Form], shown: Callable[[Hashable], str]
    ) -> None:
        self._forms, self._script, self._definitions, self._shown = forms, script, definitions, shown
        self._atoms: dict[int, Term] = {}

    def word(self, form: Form, width: int) -> Term:
        """Return a form of integers modulo ``2**width``."""
        total = number(0, width)
        for monomial, coefficient in sorted(form.items()):
            whole = Fraction(coefficient)
            require(whole.denominator == 1, "a word must be a sum of whole multiples")
            product = number(whole.numerator, width)
            for atom in monomial:
                factor = sized(self._atom(atom), width, signed=True)
                product = Term(f"(bvmul {product.text} {factor.text})", width)
            total = self._script.define(Term(f"(bvadd {total.text} {product.text})", width))
        return total

    def exact(self, form: Form) -> Term:
        """Return a form of integers as a signed term that holds it whatever its atoms are."""
        return self.word(form, bits_for(*self._extent(form)))

    def _extent(self, form: Form) -> tuple[int, int]:
        low = high = 0
        for monomial, coefficient in form.items():
            ends = [int(coefficient) * end for end in self._product(monomial)]
            low, high = low + min(ends), high + max(ends)
        return low, high

    def _product(self, monomial: Monomial) -> tuple[int, int]:
        low = high = 1
        for atom in monomial:
            term = self._atom(atom)
            ends = [a * b for a in (low, high) for b in (-(1 << term.width - 1), (1 << term.width - 1) - 1)]
            low, high = min(ends), max(ends)
        return low, high

    def _atom(self, number_: int) -> Term:
        """Return an atom as a signed term that holds it."""
        if number_ not in self._atoms:
            atom = self._forms.atom(number_)
            if atom.inside is None:
                self._atoms[number_] = self._variable(atom.key, atom.low, atom.high)
            else:
                below = lcm(*(Fraction(value).denominator for value in atom.inside.values()))
                require(below & (below - 1) == 0, "a floor must be that of a multiple of a power of two")
                inside = {monomial: value * below for monomial, value in atom.inside.items()}
                term, drop = self._script.define(self.exact(inside)), below.bit_length() - 1
                shifted = Term(f"(bvashr {term.text} {number(drop, term.width).text})", term.width)
                fits = bits_for(-(1 << term.width - 1) >> drop, (1 << term.width - 1) - 1 >> drop)
                self._atoms[number_] = self._script.define(sized(shifted, fits, signed=True))
        return self._atoms[number_]

    def _variable(self, key: Hashable, low: int, high: int) -> Term:
        known = self._script.known(key)
        if known is not None:
            return known
        meaning = self._definitions.get(key)
        exact = None if meaning is None else self.exact(meaning)
        term = self._script.declare(key, bits_for(low, high), f"{self._shown(key)}, {low} to {high}")
        self._script.assume_within(term, low, high)
        if exact is not None:
            width = max(term.width, exact.width)
            a, b = (sized(one, width, signed=True) for one in (term, exact))
            self._script.assume(f"(= {a.text} {b.text})")
        return term
