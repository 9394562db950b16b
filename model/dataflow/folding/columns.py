"""Sums as columns of products: digit by digit, by their weight.

A sum is computed column by column, the lowest first. The last product of a column ends it: its low digit is stored,
dropped or handed out, and the rest is carried on.
"""

from __future__ import annotations

from collections.abc import Iterator

from sosmith.model.dataflow.folding.values import FoldingError, Form, Term, Total, Values, fraction_bits, shifted
from sosmith.model.dataflow.program import Opcode
from sosmith.model.dataflow.scheduling import ONE, Column, Digit, Product


def columns_of_sum(values: Values, total: Total, form: Form, value: int) -> tuple[Column, ...]:
    """Return the columns of a sum, the lowest first: those below its lowest digit are dropped, others are stored.

    If the value is -1, they are handed out, the last of them with all that is carried on from it.
    """
    fracs = [values.frac_of(term) for term in total.weights]
    exact = max(
        [fraction_bits(total.constant, total.frac)]
        + [frac + fraction_bits(weight, total.frac) for frac, weight in zip(fracs, total.weights.values(), strict=True)]
    )
    below = max(0, -(-(exact - form.frac) // values.bits))
    finest = form.frac + values.bits * below - total.frac
    products = [
        placed
        for frac, (term, weight) in zip(fracs, total.weights.items(), strict=True)
        for placed in _products(values, term, shifted(weight, finest - frac))
    ]
    products += [
        (Product(ONE, digit), column)
        for column, digit in enumerate(_constant_digits(values.bits, shifted(total.constant, finest)))
        if digit
    ]
    count = form.digits if value >= 0 else max([column + 1 - below for _, column in products] + [1])
    columns: list[list[Product]] = [[] for _ in range(below + count)]
    for product, column in products:
        _add_to_column(values.bits, product, column, columns)
    finished = []
    for number, in_column in enumerate(columns):
        k = number - below
        if k < 0:
            finished.append(Column(tuple(in_column), Opcode.DROP))
        elif value < 0:
            finished.append(Column(tuple(in_column), Opcode.GIVE, part=k))
        else:
            finished.append(Column(tuple(in_column), Opcode.STORE if k < count - 1 else Opcode.FINISH, Digit(value, k)))
    return tuple(finished)


def _add_to_column(bits: int, product: Product, column: int, columns: list[list[Product]]) -> None:
    """Add a product to a column.

    The value is known to fit its digits, and FINISH keeps ``digit_bits + 1`` bits of the top column. So of a
    product one column above that, only the lowest bit counts, and nothing of those farther up.
    """
    if column < len(columns):
        columns[column].append(product)
    elif column == len(columns):
        if product.other is not None:
            raise FoldingError("a product of two values must end below its sum's top digit to be folded")
        if product.constant % 2:
            columns[-1].append(product._replace(constant=-1 << bits))


def _products(values: Values, term: Term, factor: int) -> Iterator[tuple[Product, int]]:
    """Yield the products of a term times a constant, and the column of each."""
    if term.other < 0:
        for j, digit in enumerate(_constant_digits(values.bits, factor)):
            for i in range(term.length if digit else 0):
                yield Product(Digit(term.value, term.first + i), digit), i + j
        return
    shift = factor.bit_length() - 1
    if factor != 1 << shift or shift % values.bits:
        raise FoldingError("a product of two values must fall on a digit to be folded")
    for i in range(term.length):
        for j in range(values.forms[term.other].digits):
            one, other = Digit(term.value, term.first + i), Digit(term.other, j)
            yield Product(one, other=other), i + j + shift // values.bits


def _constant_digits(bits: int, value: int) -> list[int]:
    """Return the digits of a constant: just one if it fits, otherwise balanced about zero."""
    base, half = 1 << bits, 1 << (bits - 1)
    digits = []
    while value:
        if -base <= value < base:
            digits.append(value)
            break
        digit = (value + half) % base - half
        digits.append(digit)
        value = (value - digit) >> bits
    return digits
