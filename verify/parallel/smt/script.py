"""A text in SMT-LIB, of bit vectors: constants, definitions, what is assumed, and one goal."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import NamedTuple


class Term(NamedTuple):
    """A bit vector: its text, and its width in bits."""

    text: str
    width: int


def number(value: int, width: int) -> Term:
    """Return a constant modulo ``2**width``."""
    return Term(f"(_ bv{value % (1 << width)} {width})", width)


def cut(term: Term, low: int, width: int) -> Term:
    """Return bits of a term from `low` on."""
    if low == 0 and width == term.width:
        return term
    return Term(f"((_ extract {low + width - 1} {low}) {term.text})", width)


def sized(term: Term, width: int, *, signed: bool) -> Term:
    """Return a term of another width: its lowest bits, or with its sign or zeros above it."""
    if width <= term.width:
        return cut(term, 0, width)
    return Term(f"((_ {'sign' if signed else 'zero'}_extend {width - term.width}) {term.text})", width)


def joined(parts: Sequence[Term]) -> Term:
    """Return a concatenation; the first part is the highest."""
    total, *rest = parts
    for part in rest:
        total = Term(f"(concat {total.text} {part.text})", total.width + part.width)
    return total


def chosen(condition: Term, yes: Term, no: Term) -> Term:
    """Return `yes` where the one bit `condition` is 1, else `no`."""
    return Term(f"(ite (= {condition.text} #b1) {yes.text} {no.text})", yes.width)


class Script:
    """What is declared, defined and assumed so far, each once."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._defined: dict[str, Term] = {}
        self._declared: dict[Hashable, Term] = {}

    def define(self, term: Term) -> Term:
        """Give a term a name, so that it is written once."""
        if term.text[0] != "(" or term.text.startswith("(_ bv"):
            return term
        if term.text not in self._defined:
            name = f"t{len(self._defined)}"
            self._lines.append(f"(define-fun {name} () (_ BitVec {term.width}) {term.text})")
            self._defined[term.text] = Term(name, term.width)
        return self._defined[term.text]

    def known(self, key: Hashable) -> Term | None:
        """Return the constant of a key; None if there is none yet."""
        return self._declared.get(key)

    def declare(self, key: Hashable, width: int, about: str) -> Term:
        """Declare a constant that may be anything, with a comment on what it is."""
        constant = Term(f"v{len(self._declared)}", width)
        self._declared[key] = constant
        self._lines.append(f"; {constant.text}: {about}")
        self._lines.append(f"(declare-const {constant.text} (_ BitVec {width}))")
        return constant

    def assume(self, formula: str) -> None:
        """Assume a formula."""
        self._lines.append(f"(assert {formula})")

    def assume_within(self, term: Term, low: int, high: int) -> None:
        """Assume that a signed term is in low..high, both of which it can have."""
        self.assume(f"(bvsle {number(low, term.width).text} {term.text})")
        self.assume(f"(bvsle {term.text} {number(high, term.width).text})")

    def refuting(self, title: str, goals: Sequence[tuple[Term, Term]]) -> str:
        """Return the text: it is satisfiable if two terms of any pair can be different."""
        wrong = " ".join(f"(distinct {a.text} {b.text})" for a, b in goals)
        head = [f"; {title}", "; unsat: proven; sat: there is a counterexample", "(set-logic QF_BV)"]
        return "\n".join([*head, *self._lines, f"(assert (or {wrong} false))", "(check-sat)", ""])


def bits_for(low: int, high: int) -> int:
    """Return the width of a signed word that holds low..high."""
    return 1 + max(high, -low - 1, 0).bit_length()
