"""What the nodes of a chain of stages and the expressions of a C model are worth, in one form for all ways to write it.

A form is a sum of atoms times whole numbers. Atoms are codes that come in, sums that feed themselves back, and what is
not linear in such: shifts to the right, quotients, choices and products of forms; each has a number, and equal atoms
have the same one. Two equal forms have the same value at every sample, whatever comes in. Identities of whole numbers
that are used, with floor for a shift to the right by k places:

- ``x & (2**k - 1) == x - 2**k * (x >> k)``;
- ``(x + 2**k y) >> k == (x >> k) + y``, and ``(2**j x) >> k == x >> k - j``;
- a shift by more places than a value has bits leaves its sign;
- the past of ``x >> k`` is the past of x, shifted by k places.

The past of a form is its value a sample before, and 0 at the first sample. Where a form is 0 if all of its atoms are,
its past is the form of the pasts of its atoms: each of them is 0 at the first sample, and so is the form.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from sosmith.verify.graph import require

Form = tuple[tuple[int, int], ...]
"""Pairs of an atom's number and its factor, sorted; atom 0 is the number 1."""

ONE = 0

_MOST_BITS = 1024
"""Widest product; no type of C holds a tenth of it."""


@dataclass
class Forms:
    """The atoms of forms that are compared with each other."""

    _numbers: dict[tuple[object, ...], int] = field(default_factory=lambda: {("one",): ONE})
    _atoms: list[tuple[object, ...]] = field(default_factory=lambda: [("one",)])
    _ranges: list[tuple[int, int]] = field(default_factory=lambda: [(1, 1)])
    _rests: dict[int, int] = field(default_factory=lambda: {ONE: 1})
    _pasts: dict[int, Form] = field(default_factory=lambda: {ONE: ((ONE, 1),)})

    def _atom(self, key: tuple[object, ...], low: int, high: int, rest: int = 0) -> Form:
        """Return an atom; `rest` is what it is worth where all that it is made of is 0."""
        known = self._numbers.setdefault(key, len(self._atoms))
        if known == len(self._atoms):
            self._atoms.append(key)
            self._ranges.append((low, high))
            self._rests[known] = rest
        return ((known, 1),)

    def variable(self, name: object, low: int, high: int) -> Form:
        """Return the form of what is not made of anything else."""
        return self._atom(("is", name), low, high)

    def key(self, atom: int) -> tuple[object, ...]:
        """Return what an atom is made of: a mark, and forms and numbers."""
        return self._atoms[atom]

    def range_of(self, form: Form) -> tuple[int, int]:
        """Return limits of what a form is worth."""
        low = high = 0
        for atom, factor in form:
            ends = [factor * end for end in self._ranges[atom]]
            low, high = low + min(ends), high + max(ends)
        return low, high

    def rest(self, form: Form) -> int:
        """Return what a form is worth where all variables are 0, as before the first sample."""
        return sum(factor * self._rests[atom] for atom, factor in form)

    def product(self, a: Form, b: Form) -> Form:
        """Return the product of two forms.

        Raises
        ------
        RejectedError
            If it is wider than any that is computed.
        """
        for one, other in ((a, b), (b, a)):
            if is_number(one):
                return scaled(other, one[0][1] if one else 0)
        (a, in_a), (b, in_b) = _without_factor(a), _without_factor(b)
        ends = [x * y for x in self.range_of(a) for y in self.range_of(b)]
        bits = max(map(abs, ends)).bit_length()
        require(bits <= _MOST_BITS, f"a product must have at most {_MOST_BITS} bits, not {bits}")
        rest = self.rest(a) * self.rest(b)
        return scaled(self._atom(("*", *sorted((a, b))), min(ends), max(ends), rest), in_a * in_b)

    def shifted(self, form: Form, places: int) -> Form:
        """Return the form of a shift to the right that rounds down."""
        if places == 0:
            return form
        half = 1 << places - 1
        whole = {atom: -((half - factor) >> places) for atom, factor in form}
        outside = tuple((atom, count) for atom, count in whole.items() if count)
        form = total((form, 1), (outside, -1 << places))
        while form and places and all(factor % 2 == 0 for _, factor in form):
            form, places = tuple((atom, factor // 2) for atom, factor in form), places - 1
        if not form or not places:
            return total((outside, 1), (form, 1))
        if len(form) == 1 and form[0][1] == 1 and self._is_whole_past(form[0][0]):
            (inner,) = self._atoms[form[0][0]][1:]
            assert isinstance(inner, tuple)
            return total((outside, 1), (self.past(self.shifted(inner, places)), 1))
        low, high = self.range_of(form)
        rest = self.rest(form)
        places = min(places, max(end.bit_length() for end in (low, high, rest, 1)))
        inner = self._atom((">>", form, places), low >> places, high >> places, rest >> places)
        return total((outside, 1), (inner, 1))

    def masked(self, form: Form, bits: int) -> Form:
        """Return the form of so many lowest bits."""
        return total((form, 1), (self.shifted(form, bits), -1 << bits))

    def quotient(self, form: Form, divisor: int) -> Form:
        """Return the form of a division that rounds towards zero."""
        if divisor == 1:
            return form
        low, high = (towards_zero(end, divisor) for end in self.range_of(form))
        return self._atom(("/", form, divisor), low, high, towards_zero(self.rest(form), divisor))

    def choice(self, mark: str, left: Form, right: Form, then: Form, other: Form) -> Form:
        """Return the form of ``left mark right ? then : other``, where `mark` is < or >."""
        ends = [end for form in (then, other) for end in self.range_of(form)]
        a, b = self.rest(left), self.rest(right)
        rest = self.rest(then if (a < b if mark == "<" else a > b) else other)
        return self._atom(("?", mark, left, right, then, other), min(ends), max(ends), rest)

    def past(self, form: Form) -> Form:
        """Return what a form was a sample before."""
        if self.rest(form) == 0:
            return self._back(form)
        low, high = self.range_of(form)
        return self._atom(("past", form), min(low, 0), max(high, 0))

    def _is_whole_past(self, atom: int) -> bool:
        """Whether an atom is the past of a form that is not 0 where its atoms are, or the past of such a past."""
        mark, *parts = self._atoms[atom]
        if mark != "past":
            return False
        (form,) = parts
        assert isinstance(form, tuple)
        return self.rest(form) != 0 or self._is_whole_past(form[0][0])

    def _back(self, form: Form) -> Form:
        return total(*((self._past_of(atom), factor) for atom, factor in form))

    def _past_of(self, atom: int) -> Form:
        if atom not in self._pasts:
            mark, *parts = self._atoms[atom]
            rebuilt: Mapping[object, Callable[..., Form]] = {
                "*": self.product,
                ">>": self.shifted,
                "/": self.quotient,
                "?": self.choice,
            }
            if mark in rebuilt:
                back = [self._back(part) if isinstance(part, tuple) else part for part in parts]
                self._pasts[atom] = rebuilt[mark](*back)
            else:
                low, high = self._ranges[atom]
                self._pasts[atom] = self._atom(("past", ((atom, 1),)), min(low, 0), max(high, 0))
        return self._pasts[atom]


def number(value: int) -> Form:
    """Return the form of a number."""
    return ((ONE, value),) if value else ()


def is_number(form: Form) -> bool:
    """Whether a form is a number, whatever the atoms are worth."""
    return not form or (len(form) == 1 and form[0][0] == ONE)


def scaled(form: Form, factor: int) -> Form:
    """Return a form times a number."""
    return tuple((atom, value * factor) for atom, value in form) if factor else ()


def total(*terms: tuple[Form, int]) -> Form:
    """Return the sum of forms times numbers."""
    sums: dict[int, int] = {}
    for form, factor in terms:
        for atom, value in form:
            sums[atom] = sums.get(atom, 0) + factor * value
    return tuple(sorted((atom, value) for atom, value in sums.items() if value))


def towards_zero(value: int, divisor: int) -> int:
    """Return the quotient as C99 rounds it."""
    return value // divisor if value >= 0 else -(-value // divisor)


def _without_factor(form: Form) -> tuple[Form, int]:
    """Return a form without the power of two that all of its factors have, and that."""
    common = 0
    for _, factor in form:
        common |= factor
    common &= -common
    return tuple((atom, factor // common) for atom, factor in form), common
