r"""Normal forms of what hardware computes from integers, with what is known about their ranges.

A form is a sum of rational multiples of products of atoms, as in `sosmith.verify.program.normal_form`; an atom is
a variable, the floor of a form, or a form of integers that is known to be 0 or 1. A word of w bits is the form of any
integer that leaves the same remainder modulo ``2**w``. Everything that hardware does with words is then a form::

    bits from l on         floor(a / 2**l)
    unsigned value         a - 2**w floor(a / 2**w)
    signed value           a - 2**w floor(a / 2**w + 1/2)
    a < 0                  -floor(a / 2**k)           for any k with -2**k <= a < 2**k
    select ? a : b         b + select (a - b)

Floors whose argument is known to stay between two integers are constants; this is where ranges come in, and where a
sign extension that was not needed disappears. Beside the limits that follow from those of the atoms, a form may have
limits that are known otherwise: those of the certificate's nodes. They hold for its multiples with any offset too.

>>> forms = Forms()
>>> x = forms.variable("x", -8, 7)
>>> pattern = forms.unsigned(x, 4)
>>> forms.signed(pattern, 4) == x
True
>>> forms.signed(plus(x, x), 4) == plus(x, x)
False
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Hashable, Iterator, Mapping
from fractions import Fraction
from math import gcd, lcm
from types import MappingProxyType
from typing import NamedTuple

from sosmith.verify.graph import check_product, require
from sosmith.verify.program.normal_form import ONE, Form, Monomial, constant, degree, plus

Limits = tuple[int | Fraction, int | Fraction]
"""Smallest and largest value."""

_Key = frozenset[tuple[Monomial, int]]


NOTHING: Mapping[Hashable, Form] = MappingProxyType({})


_MOST_WORK = 1 << 22
"""Terms that may be looked at in a proof; the examples take some thousands, 128 pairs of taps of 24 bits a million."""


class Atom(NamedTuple):
    """An integer: a variable, whose `inside` is None, the floor of a form, or a form that is 0 or 1."""

    low: int
    high: int
    inside: Form | None
    key: Hashable


def shifted(form: Form, exponent: int) -> Form:
    """Return ``form * 2**exponent``; integers stay integers where they can."""
    if exponent >= 0:
        return {
            monomial: value << exponent if isinstance(value, int) else value * (1 << exponent)
            for monomial, value in form.items()
        }
    below = 1 << -exponent
    return {
        monomial: value // below if isinstance(value, int) and not value % below else Fraction(value) / below
        for monomial, value in form.items()
    }


class _Primitive(NamedTuple):
    """A form as ``scale * p + offset``, where the coefficients of p are integers without a common divisor."""

    key: _Key
    scale: Fraction
    offset: int | Fraction


def _primitive(form: Form) -> _Primitive | None:
    """Return the primitive part of a form; None for a constant."""
    items = sorted((monomial, coefficient) for monomial, coefficient in form.items() if monomial)
    if not items:
        return None
    below = lcm(*(value.denominator for _, value in items))
    whole = [value.numerator * (below // value.denominator) for _, value in items]
    content = gcd(*whole) * (-1 if whole[0] < 0 else 1)
    key = frozenset((monomial, value // content) for (monomial, _), value in zip(items, whole, strict=True))
    return _Primitive(key, Fraction(content, below), form.get(ONE, 0))


class Forms:
    """The atoms of all forms that are to be compared, and what is known about them."""

    def __init__(self) -> None:
        self._numbers: dict[Hashable, int] = {}
        self._atoms: list[Atom] = []
        self._known: ChainMap[_Key, Limits] = ChainMap()
        self._limits: dict[int, tuple[int, int]] = {}
        self._always = self
        self._work = [0]

    def narrowed(self, form: Form, low: int | Fraction, high: int | Fraction) -> Forms:
        """Return the same atoms, where in addition `form` lies in low..high."""
        other = Forms()
        other._numbers, other._atoms, other._known = self._numbers, self._atoms, self._known.new_child()
        other._always, other._work = self._always, self._work
        other.know(form, low, high)
        return other

    def variable(self, key: Hashable, low: int, high: int) -> Form:
        """Return the integer variable `key`, which lies in low..high."""
        return self._settled(self._atom(key, low, high, None))

    def atom(self, number: int) -> Atom:
        """Return an atom by its number."""
        return self._atoms[number]

    def is_variable(self, form: Form) -> bool:
        """Whether a form is a variable by itself."""
        return list(form.values()) == [1] and all(
            len(monomial) == 1 and self._atoms[monomial[0]].inside is None for monomial in form
        )

    def know(self, form: Form, low: int | Fraction, high: int | Fraction) -> None:
        """Take it for known that `form` lies in low..high; of a floor and an integer, the argument is known too."""
        primitive = _primitive(form)
        if primitive is None:
            return
        least, most = sorted(((low - primitive.offset) / primitive.scale, (high - primitive.offset) / primitive.scale))
        ends = least.__ceil__(), most.__floor__()  # what is without a common divisor is an integer
        before = self._known.get(primitive.key, ends)
        self._known[primitive.key] = max(ends[0], before[0]), min(ends[1], before[1])
        self._limits.clear()
        inner = [(m, value) for m, value in primitive.key if len(m) == 1 and self._atoms[m[0]].inside is not None]
        if len(inner) == 1 and abs(inner[0][1]) == 1:
            # What is beside the floor is an integer, so that it may as well be inside.
            ((monomial, sign),) = inner
            low, high = ends if sign > 0 else (-ends[1], -ends[0])
            inside = self._atoms[monomial[0]].inside
            assert inside is not None
            whole = plus(inside, {m: value * sign for m, value in primitive.key if m != monomial})
            step = Fraction(1, lcm(*(value.denominator for value in whole.values())))
            self.know(whole, low, high + 1 - step)

    def _spend(self, terms: int) -> None:
        """Count terms that were looked at, all of a proof together: a short text must not ask for ever more."""
        self._work[0] += terms
        require(self._work[0] <= _MOST_WORK, f"the hardware must be proven by looking at {_MOST_WORK} terms, not more")

    def limits(self, form: Form) -> Limits:
        """Return limits of a form."""
        low, high = self._limits_by_atoms(form)
        primitive = _primitive(form)
        if primitive is not None and primitive.key in self._known:
            ends = sorted(end * primitive.scale + primitive.offset for end in self._known[primitive.key])
            low, high = max(low, ends[0]), min(high, ends[1])
        for whole_low, whole_high in self._limits_without_floors(form):
            low, high = max(low, whole_low), min(high, whole_high)
        if self._always is not self:
            for known_low, known_high in self._limits_by_floors(form):
                low, high = max(low, known_low), min(high, known_high)
        return low, high

    def _limits_without_floors(self, form: Form) -> Iterator[Limits]:
        """Yield limits of a form with floors of what else is in it: ``c floor(a)`` is ``c a`` less c times a remainder.

        Each by itself, the parts of a number that was taken apart seem to range further than what is made of them. A
        sum may have parts of several numbers: each floor is replaced alone, and all of them together.
        """
        atoms = {atom for monomial in form for atom in monomial}
        floors = [
            (monomial, inside)
            for monomial in form
            if len(monomial) == 1 and self._is_floor(monomial[0])
            for inside in [self._atoms[monomial[0]].inside]
            if inside is not None and atoms & {atom for inner in inside for atom in inner}
        ]
        alone = [[floor] for floor in floors]
        for replaced in alone if len(alone) < 2 else [*alone, floors]:
            gone = {monomial for monomial, _ in replaced}
            whole: Form = {m: value for m, value in form.items() if m not in gone}
            below: int | Fraction = 0
            above: int | Fraction = 0
            for monomial, inside in replaced:
                factor = form[monomial]
                whole = plus(whole, inside, factor)
                remainder = factor * (1 - Fraction(1, lcm(*(value.denominator for value in inside.values()))))
                below, above = below + max(remainder, Fraction(0)), above + min(remainder, Fraction(0))
            low, high = self._limits_by_atoms(whole)
            yield low - below, high - above

    def _limits_by_atoms(self, form: Form) -> Limits:
        """Return limits of a form from those of its atoms, as if each were by itself."""
        self._spend(len(form))
        below = lcm(*(value.denominator for value in form.values()))
        low = high = 0
        # All in steps of 1 / below: integers are ten times as fast as fractions, and most of a proof is this.
        for monomial, coefficient in form.items():
            ends = [coefficient.numerator * (below // coefficient.denominator)]
            for atom in monomial:
                ends = [end * limit for end in ends for limit in self._limits_of(atom)]
            low, high = low + min(ends), high + max(ends)
        return (low, high) if below == 1 else (Fraction(low, below), Fraction(high, below))

    def _limits_by_floors(self, form: Form) -> Iterator[Limits]:
        """Yield limits of ``c floor(a) + c j + k`` with an integer j from those that are known of ``a + j``."""
        for monomial, factor in form.items():
            if len(monomial) != 1 or not self._is_floor(monomial[0]):
                continue
            others = {m: Fraction(value) / factor for m, value in form.items() if m not in {monomial, ONE}}
            if any(value.denominator != 1 for value in others.values()):
                continue
            inside = self._atoms[monomial[0]].inside
            assert inside is not None
            primitive = _primitive(plus(inside, others))
            if primitive is not None and primitive.key in self._known:
                ends = sorted(end * primitive.scale + primitive.offset for end in self._known[primitive.key])
                rest = form.get(ONE, 0)
                low, high = sorted((factor * ends[0].__floor__() + rest, factor * ends[1].__floor__() + rest))
                yield low, high

    def times(self, a: Form, b: Form) -> Form:
        """Return the product; of an atom that is 0 or 1, or 0 or -1, there are no powers."""
        check_product(len(a) * len(b), degree(a) + degree(b))
        self._spend(len(a) * len(b))
        total: dict[Monomial, int | Fraction] = {}
        for p, x in a.items():
            for q, y in b.items():
                monomial, sign = self._reduced(tuple(sorted((*p, *q))))
                total[monomial] = total.get(monomial, 0) + x * y * sign
        return {monomial: coefficient for monomial, coefficient in total.items() if coefficient}

    def floor(self, form: Form) -> Form:
        """Return the largest integer that is not above `form`."""
        low, high = (end.__floor__() for end in self.limits(form))
        if low == high:
            return constant(low)
        whole: dict[Monomial, int | Fraction] = {}
        rest: dict[Monomial, int | Fraction] = {}
        for monomial, coefficient in form.items():
            # The integer that is nearest, of two the lower one.
            nearest = -((coefficient.denominator - 2 * coefficient.numerator) // (2 * coefficient.denominator))
            if nearest:
                whole[monomial] = nearest
            if coefficient != nearest:
                rest[monomial] = coefficient - nearest
        outer, rest = rest, dict(self._coarse(dict(self._unnested(rest))))
        for inside in (outer, rest):
            low, high = (end.__floor__() for end in self.limits(inside))
            if low == high:
                return plus(whole, constant(low))
        ends = self._always.limits(rest)
        if ends[0] >= -1 and ends[1] < 1:
            return plus(whole, self._settled(self._sign(rest)))
        low, high = (end.__floor__() for end in ends)
        return plus(whole, self._settled(self._atom(("floor", frozenset(rest.items())), low, high, rest)))

    def negative(self, form: Form) -> Form:
        """Return 1 where an integer form is below 0, else 0."""
        low, high = self.limits(form)
        bits = max(int(-low), int(high) + 1, 1).bit_length()
        return plus({}, self.floor(shifted(form, -bits)), -1)

    def bit(self, form: Form) -> Form:
        """Return a form that is known to be 0 or 1 as one atom, unless it is as simple as that."""
        low, high = self.limits(form)
        if low == high or (len(form.keys() - {ONE}) == 1 and low >= 0 and high <= 1):
            return constant(low) if low == high else form
        return self._settled(self._atom(("bit", frozenset(form.items())), 0, 1, form))

    def unsigned(self, form: Form, width: int) -> Form:
        """Return the value of an unsigned word."""
        return self._remainder(form, width, 0)

    def signed(self, form: Form, width: int) -> Form:
        """Return the value of a signed word."""
        return self._remainder(form, width, 1 << (width - 1))

    def settled(self, form: Form, meant: Mapping[Hashable, Form] = NOTHING) -> Form:
        """Return a form again with all that is known now, which may be more than when it was made.

        Variables whose keys are in `meant` are replaced by these forms, in which the same is done.
        """
        return self._settled_form(form, meant, {})

    def floors(self, form: Form) -> Iterator[Form]:
        """Yield the floors in a form that are not constant, each once, those inside others first."""
        yield from self._floors(form, set())

    def grain(self, floor: Form) -> int:
        """Return the number of steps in 1 of what a floor is taken of."""
        ((monomial, _),) = floor.items()
        inside = self._atoms[monomial[0]].inside
        return 1 if inside is None else lcm(*(value.denominator for value in inside.values()))

    def keys(self, form: Form) -> set[Hashable]:
        """Return the keys of all variables in a form."""
        keys: set[Hashable] = set()
        seen: set[int] = set()
        left = [form]
        while left:
            for atom in {atom for monomial in left.pop() for atom in monomial} - seen:
                seen.add(atom)
                inside = self._atoms[atom].inside
                if inside is None:
                    keys.add(self._atoms[atom].key)
                else:
                    left.append(inside)
        return keys

    def _floors(self, form: Form, seen: set[int]) -> Iterator[Form]:
        for monomial in form:
            for atom in monomial:
                inside = self._atoms[atom].inside
                if inside is not None and atom not in seen:
                    seen.add(atom)
                    yield from self._floors(inside, seen)
                    yield {(atom,): 1}

    def _remainder(self, form: Form, width: int, offset: int) -> Form:
        size = 1 << width
        low, high = self.limits(form)
        if -offset <= low and high < size - offset:
            return form
        remainder = plus(form, self.floor(shifted(plus(form, constant(offset)), -width)), -size)
        if self._always is self:
            self.know(remainder, -offset, size - 1 - offset)
        return remainder

    def _unnested(self, form: Form) -> Form:
        """Use ``floor((floor(a) + j) / m) = floor((a + j) / m)`` for an integer j, if there is such a floor.

        Of several, it is that of the finest argument: a value that is floored after others were that went into it.
        """
        below = lcm(*(value.denominator for value in form.values())) if form else 1
        unit = Fraction(1, below)
        inner = [
            monomial
            for monomial, value in form.items()
            if len(monomial) == 1 and value == unit and self._is_floor(monomial[0])
        ]
        if not inner:
            return form
        finest = max(inner, key=lambda monomial: (self.grain({monomial: 1}), monomial))
        if any(finest[0] in monomial for monomial in form.keys() - {finest}):
            return form
        inside = self._atoms[finest[0]].inside
        assert inside is not None
        others = {monomial: value for monomial, value in form.items() if monomial != finest}
        return plus(others, inside, unit)

    def _coarse(self, form: Form) -> Form:
        """Leave out what never reaches a step of 1 / m: ``floor((i + r) / m) = floor(i / m)`` where 0 <= r < 1.

        So a value whose lower bits are known to round off has the same upper bits as one that was rounded before. Of
        all powers of two m, the smallest is taken.
        """
        below = lcm(*(value.denominator for value in form.values())) if form else 1
        if below & (below - 1):
            return form
        spans: dict[Monomial, int | Fraction] = {}
        for monomial in form.keys() - {ONE}:
            low, high = self._limits_by_atoms({monomial: 1})
            spans[monomial] = high - low
        whole = {x: value.numerator * (below // value.denominator) for x, value in form.items()}
        for bits in range(1, below.bit_length() - 1):
            # In steps of 1 / below, of which 1 / m has this many.
            step = below >> bits
            rounded = {x: (value + step // 2) // step * step for x, value in whole.items()}
            rest = {x: value - rounded[x] for x, value in whole.items() if value != rounded[x]}
            if sum(abs(value) * spans.get(x, 0) for x, value in rest.items()) >= step:
                continue
            low, high = (end.__floor__() // step for end in self._limits_by_atoms(rest))
            if low == high:
                kept = {x: Fraction(value, below) for x, value in rounded.items() if value}
                return plus(kept, constant(Fraction(low * step, below)))
        return form

    def _sign(self, rest: Form) -> int:
        """Return the atom of ``floor(rest)``, which is -1 or 0: the same for all multiples of what is inside."""
        below = lcm(*(value.denominator for value in rest.values()))
        content = gcd(*(int(value * below) for value in rest.values()))
        integer = {monomial: int(value * below) // content for monomial, value in rest.items()}
        low, high = self._always.limits(integer)
        inside = shifted(integer, -max(int(-low), int(high) + 1).bit_length())
        return self._atom(("sign", frozenset(integer.items())), -1, 0, inside)

    def _atom(self, key: Hashable, low: int, high: int, inside: Form | None) -> int:
        if key not in self._numbers:
            self._numbers[key] = len(self._atoms)
            self._atoms.append(Atom(low, high, inside, key))
        return self._numbers[key]

    def _settled_form(self, form: Form, meant: Mapping[Hashable, Form], done: dict[int, Form]) -> Form:
        """Return a form again; `done` has the atoms whose turn has come, many of which are in several others."""
        total: Form = {}
        for monomial, coefficient in form.items():
            product: Form = constant(coefficient)
            for atom in monomial:
                if atom not in done:
                    done[atom] = self._settled_atom(atom, meant, done)
                product = self.times(product, done[atom])
            total = plus(total, product)
        return total

    def _settled_atom(self, atom: int, meant: Mapping[Hashable, Form], done: dict[int, Form]) -> Form:
        inside, key = self._atoms[atom].inside, self._atoms[atom].key
        if inside is not None:
            own = self._settled_form(inside, meant, done)
            return self.floor(own) if self._is_floor(atom) else self.bit(own)
        return self._settled_form(meant[key], meant, done) if key in meant else self._settled(atom)

    def _settled(self, atom: int) -> Form:
        low, high = self._limits_of(atom)
        return constant(low) if low == high else {(atom,): 1}

    def _is_floor(self, atom: int) -> bool:
        key = self._atoms[atom].key
        return self._atoms[atom].inside is not None and not (isinstance(key, tuple) and key[0] == "bit")

    def _limits_of(self, atom: int) -> tuple[int, int]:
        if atom not in self._limits:
            low, high, inside, _ = self._atoms[atom]
            limits = self._known.get(frozenset({((atom,), 1)}))
            if limits is not None:
                low, high = max(low, limits[0].__ceil__()), min(high, limits[1].__floor__())
            if inside is not None:
                ends = self.limits(inside)
                low, high = max(low, ends[0].__floor__()), min(high, ends[1].__floor__())
            self._limits[atom] = low, high
        return self._limits[atom]

    def _reduced(self, monomial: Monomial) -> tuple[Monomial, int]:
        kept: list[int] = []
        sign = 1
        for atom in monomial:
            if kept and kept[-1] == atom and self._atoms[atom].low >= -1 and self._atoms[atom].high <= 1:
                if (self._atoms[atom].low, self._atoms[atom].high) == (0, 1):
                    continue
                if (self._atoms[atom].low, self._atoms[atom].high) == (-1, 0):
                    sign = -sign
                    continue
            kept.append(atom)
        return tuple(kept), sign
