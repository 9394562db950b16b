"""Expressions of a C model: the same integers as in C, or a refusal where C leaves something open."""

from __future__ import annotations

import random

import pytest

from sosmith.verify.c_model.cursor import Cursor
from sosmith.verify.c_model.expressions import Reader, Value
from sosmith.verify.c_model.forms import Forms
from sosmith.verify.graph import RejectedError

RANGES = {
    "a": ("int64_t", -100, 100),
    "b": ("int64_t", 0, 255),
    "s": ("int32_t", -(2**31), 2**31 - 1),
    "i": ("int", -30000, 30000),
    "l": ("int64_t", -(2**62), 2**62),
    "x": ("__int128", -(2**100), 2**100),
}
FORMS = Forms()
NAMES = {name: Value(kind, low, high, FORMS.variable(name, low, high)) for name, (kind, low, high) in RANGES.items()}


def read(text: str) -> Value:
    cursor = Cursor(text, "the text")
    found = Reader(cursor, NAMES, FORMS).expression()
    cursor.end()
    return found


def computed(form: object, values: dict[str, int]) -> int:
    """Return what a form is worth."""
    assert isinstance(form, tuple)
    return sum(factor * worth(FORMS.key(atom), values) for atom, factor in form)


def worth(key: tuple[object, ...], values: dict[str, int]) -> int:
    mark, *parts = key
    if mark == "one":
        return 1
    if mark == "is":
        return values[str(parts[0])]
    if mark == "*":
        return computed(parts[0], values) * computed(parts[1], values)
    if mark == ">>":
        assert isinstance(parts[1], int)
        return computed(parts[0], values) >> parts[1]
    if mark == "/":
        value = computed(parts[0], values)
        assert isinstance(parts[1], int)
        return abs(value) // parts[1] * (1 if value >= 0 else -1)
    _, left, right, then, other = parts
    holds = computed(left, values) < computed(right, values)
    if parts[0] == ">":
        holds = computed(left, values) > computed(right, values)
    return computed(then if holds else other, values)


@pytest.mark.parametrize(
    ("text", "python"),
    [
        ("(int64_t)a + (int64_t)b * INT64_C(8)", "a + b * 8"),
        ("(int64_t)a - (int64_t)b * INT64_C(8) - a", "-b * 8"),
        ("a - b - i", "(a - b) - i"),
        ("a >> 3", "a >> 3"),
        ("a >> 63", "a >> 63"),
        ("a >> 2 >> 1", "a >> 3"),
        ("a + b >> 1", "(a + b) >> 1"),
        ("a / INT64_C(4)", "int(a / 4)"),
        ("a & (INT64_C(16) - 1)", "a & 15"),
        ("a & INT64_C(16) - 1", "a & 15"),
        ("a * INT64_C(-3)", "a * -3"),
        ("a * b + b * a", "2 * a * b"),
        ("a < INT64_C(-5) ? INT64_C(-5) : a > INT64_C(9) ? INT64_C(9) : a", "max(-5, min(9, a))"),
        ("b << 4", "b * 16"),
        ("((__int128)INT64_C(3) * (INT64_C(1) << 62) + INT64_C(7))", "(3 << 62) + 7"),
        ("(__int128)l * INT64_C(4)", "l * 4"),
        ("i * 7 - 5", "i * 7 - 5"),
        ("(int64_t)s * INT32_C(-7)", "s * -7"),
        ("s + a", "s + a"),
        ("s >> 31", "s >> 31"),
        ("(int32_t)(l >> 40)", "l >> 40"),
    ],
)
def test_the_form_is_what_c_computes(text: str, python: str) -> None:
    found, rng = read(text), random.Random(3)
    for _ in range(50):
        values = {name: rng.randint(each.low, each.high) for name, each in NAMES.items()}
        right = eval(python, {"max": max, "min": min, "int": int}, values)
        assert computed(found.form, values) == right
        assert found.low <= right <= found.high


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("i * 99999", r".*: -2999970000\.\.2999970000 is not in int"),
        ("(int)l", ".* must go on with something other than 'int', .*"),
        ("(int32_t)l", r".*: -4611686018427387904\.\.4611686018427387904 is not in int32_t"),
        ("s * INT32_C(2)", r".*: -4294967296\.\.4294967294 is not in int32_t"),
        ("s - i", ".* is not in int32_t"),
        ("INT32_C(2147483648)", ".* must go on with a constant of 32 bits, .*"),
        ("l * INT64_C(4)", ".* is not in int64_t"),
        ("l + l", ".* is not in int64_t"),
        ("(int64_t)x", ".* is not in int64_t"),
        ("l * INT64_C(4) >> 4", ".* is not in int64_t"),
        ("a >> 64", ".* must go on with a shift by fewer places than there are, .*"),
        ("i >> 32", ".* must go on with a shift by fewer places than there are, .*"),
        ("a << 1", ".* must go on with a shift to the left of what is not negative, .*"),
        ("a >> b", ".* must go on with a number of places that is constant, .*"),
        ("a / b", ".* must go on with a divisor that is constant, .*"),
        ("a / INT64_C(-4)", ".* must go on with a positive divisor, .*"),
        ("a / INT64_C(0)", ".* must go on with a positive divisor, .*"),
        ("a & INT64_C(5)", ".* must go on with a mask of the lowest bits, .*"),
        ("a & b", ".* must go on with a mask that is constant, .*"),
        ("a < b & INT64_C(1) ? a : b", ".* must go on with .*"),
        ("a & INT64_C(1) < b ? a : b", ".* must go on with .*"),
        ("a < b", ".* must go on with .?, not with 'its end'"),
        ("INT64_C(9223372036854775808)", ".* must go on with a constant of 64 bits, .*"),
        ("4294967295", ".* must go on with .*"),
        ("c", ".* must go on with something other than 'c', which has no value here, .*"),
        ("f(a)", ".* must go on with something other than 'f', .*"),
        ("a b", ".* must go on with nothing, not with 'b'"),
        ("-a", ".* must go on with .*"),
        ("(short)a", ".* must go on with .*"),
        ("a % INT64_C(4)", ".* must go on with nothing, not with '%'"),
        ("a || b", ".* must go on with nothing, .*"),
    ],
)
def test_what_c_leaves_open_is_refused(text: str, sentence: str) -> None:
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        read(text)
