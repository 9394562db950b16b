"""Normal forms of words against numbers, and the reader of SystemVerilog against Icarus."""

import random
import re
import subprocess
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest
from tests.verify.parallel.cores import looking_ahead, small
from tests.verify.parallel.simulated import Inputs, run

from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.forms import Forms, shifted
from sosmith.verify.parallel.netlist import flattened
from sosmith.verify.program.normal_form import ONE, Form, constant, plus
from sosmith.verify.reader.source import read_modules

Value = Callable[[list[int]], int]
LIMITS = [(-8, 7), (0, 15), (-3, 100), (0, 1)]


def random_words(forms: Forms, rng: random.Random, count: int) -> list[tuple[Form, Value]]:
    """Return forms made from four variables by what hardware does, each with the same in Python's integers."""
    words: list[tuple[Form, Value]] = [
        (forms.variable(k, *ends), lambda values, k=k: values[k]) for k, ends in enumerate(LIMITS)
    ]
    for _ in range(count):
        (a, x), (b, y) = rng.choice(words), rng.choice(words)
        n, w = rng.randrange(1, 5), rng.randrange(2, 9)
        c = rng.randrange(-9, 10)
        made: list[tuple[Form, Value]] = [
            (plus(a, b, c), lambda v, x=x, y=y, c=c: x(v) + c * y(v)),
            (forms.floor(shifted(a, -n)), lambda v, x=x, n=n: x(v) >> n),
            (forms.unsigned(a, w), lambda v, x=x, w=w: x(v) % (1 << w)),
            (
                forms.signed(a, w),
                lambda v, x=x, w=w: (x(v) + (1 << (w - 1))) % (1 << w) - (1 << (w - 1)),
            ),
            (forms.negative(plus(a, constant(c))), lambda v, x=x, c=c: int(x(v) + c < 0)),
        ]
        if len(a) * len(b) < 9:
            made.append((forms.times(a, b), lambda v, x=x, y=y: x(v) * y(v)))
        words.append(rng.choice(made))
    return words


def number(forms: Forms, form: Form, values: list[int]) -> int:
    """Value of a form: with all variables known, it is a constant."""
    for k, value in enumerate(values):
        forms = forms.narrowed(forms.variable(k, *LIMITS[k]), value, value)
    found = forms.settled(form)
    assert not found.keys() - {()}
    assert Fraction(found.get((), 0)).denominator == 1
    return int(found.get((), 0))


@pytest.mark.parametrize("seed", range(6))
def test_forms_are_what_python_computes(seed: int) -> None:
    rng, forms = random.Random(seed), Forms()
    words = random_words(forms, rng, 14)
    for _ in range(3):
        values = [rng.choice((low, high, rng.randint(low, high))) for low, high in LIMITS]
        for form, value in words:
            assert number(forms, form, values) == value(values)
            low, high = forms.limits(form)
            assert low <= value(values) <= high


@pytest.mark.parametrize("seed", range(6))
def test_words_said_to_be_the_same_are(seed: int) -> None:
    rng, forms = random.Random(100 + seed), Forms()
    words = random_words(forms, rng, 12)
    samples = [[rng.randint(*ends) for ends in LIMITS] for _ in range(200)]
    for _ in range(30):
        (a, x), (b, y) = rng.choice(words), rng.choice(words)
        if same_word(forms, a, b, 3):
            assert all((x(values) - y(values)) % 8 == 0 for values in samples)


def test_shifts_are_exact() -> None:
    assert shifted({ONE: 3, (0,): Fraction(1, 3)}, 2) == {ONE: 12, (0,): Fraction(4, 3)}
    assert shifted({ONE: 12, (0,): 3}, -2) == {ONE: 3, (0,): Fraction(3, 4)}


def test_a_bit_is_one_atom_and_its_own_square() -> None:
    forms = Forms()
    a, b = (forms.variable(k, *ends) for k, ends in enumerate(LIMITS[:2]))
    for bit in (forms.negative(plus(a, b)), forms.bit(forms.negative(plus(a, b)) | forms.negative(a))):
        assert forms.settled(bit) == bit
        assert forms.limits(bit) == (0, 1)
        assert forms.times(bit, bit) == bit


def test_a_missing_extension_is_another_word() -> None:
    forms = Forms()
    x = forms.variable("x", -8, 7)
    assert same_word(forms, forms.signed(forms.unsigned(x, 4), 4), x, 9)
    assert same_word(forms, forms.unsigned(x, 4), x, 4)
    assert not same_word(forms, forms.unsigned(x, 4), x, 5)
    assert not same_word(forms, forms.signed(plus(x, x), 4), plus(x, x), 5)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (r"always_ff", "always_latch", r"the SystemVerilog must have a name after .*, not 'always_latch'"),
        (r" & valid1;", " & valid1 & valid2;", r"the SystemVerilog must have ; after .*, not '&'"),
        (r"8'h80", "8'hx0", r"the SystemVerilog must have a number with its width after .*, not \"8'hx0\""),
        (r"8'h80", "8'h180", r"the number 8'h180 must fit 8 bits"),
        (r"reg \[7:0\] x1", "reg signed [7:0] x1", r"the SystemVerilog must have a name after .*, not 'signed'"),
        (r" x1 <= x;", " x1[6:0] <= x;", r"a process must load one register, not x1, x1\[6:0\]"),
        (r"valid1 <= i_valid", "valid1 = i_valid", r"the SystemVerilog must have <= after .*, not '='"),
    ],
)  # fmt: skip
def test_what_is_not_in_the_subset_is_refused(old: str, new: str, sentence: str) -> None:
    text, count = re.subn(old, new, small().text, count=1)
    assert count == 1
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        flattened(read_modules(text), "aclk")


@pytest.mark.sweep(1)
@pytest.mark.parametrize("channels", [1, 3])
def test_the_reader_understands_what_icarus_does(channels: int, tmp_path: Path) -> None:
    core = small(channels=channels)
    inputs = Inputs(core.text, clocks=200, seed=5, channels=channels)
    widths = {name: inputs.netlist.widths[name] for name in inputs.netlist.ports}
    given = [name for name in inputs.netlist.ports if inputs.netlist.ports[name] == "input" and name != "aclk"]
    seen = [name for name in inputs.netlist.ports if inputs.netlist.ports[name] == "output"]
    nets = "\n".join(f"{'reg' if name in given else 'wire'} [{widths[name] - 1}:0] {name};" for name in (*given, *seen))
    driven = "\n".join(
        " ".join(f"{name} = {widths[name]}'d{row[name]};" for name in given)
        + f' #1 $display("{" ".join("%0d" for _ in seen)}", {", ".join(seen)}); aclk = 1; #1 aclk = 0;'
        for row in inputs.rows
    )
    ports = ", ".join(f".{name}({name})" for name in inputs.netlist.ports)
    bench = (
        f"module bench;\nreg aclk;\n{nets}\nplain core({ports});\ninitial begin aclk = 0;\n{driven}\nend\nendmodule\n"
    )
    (tmp_path / "bench.sv").write_text(core.text + bench, encoding="utf-8")
    program = str(tmp_path / "bench.vvp")
    subprocess.run(["iverilog", "-g2012", "-s", "bench", "-o", program, str(tmp_path / "bench.sv")], check=True)
    shown = subprocess.run(["vvp", "-n", program], check=True, capture_output=True, text=True).stdout.splitlines()
    rows_shown = [line.split() for line in shown if re.fullmatch(r"[0-9xX ]+", line)]
    expected = run(inputs)
    assert len(rows_shown) == len(expected)
    for found, row in zip(rows_shown, expected, strict=True):
        assert all(
            cell == str(row[name]) or (cell in {"x", "X"} and not row["m_axis_tvalid"])  # memories' registers at first
            for name, cell in zip(seen, found, strict=True)
        )
    assert len({row["m_axis_tdata"] for row in expected}) > 30


def test_what_was_taken_apart_ranges_no_further_than_the_whole() -> None:
    """``6 (x mod 8) + x`` is as large as its parts allow, though its form has x seven times and a floor 48 times."""
    forms = Forms()
    x = forms.variable("x", -32, 31)
    assert forms.limits(plus(x, forms.unsigned(x, 3), 6)) == (-32, 31 + 6 * 7)
    assert forms.limits(plus(x, forms.unsigned(x, 3), -6)) == (-32 - 6 * 7, 31)
    assert forms.unsigned(plus(plus(x, forms.unsigned(x, 3), 6), constant(32)), 7) == plus(
        plus(x, forms.unsigned(x, 3), 6), constant(32)
    )


def test_parts_of_several_numbers_in_one_sum_range_no_further_than_the_numbers() -> None:
    """A sum of lower parts of two states: each floor alone leaves the other state too wide for the word."""
    forms = Forms()
    x, z = forms.variable("x", -32, 31), forms.variable("z", -64, 63)
    total = plus(shifted(forms.unsigned(x, 3), 1), forms.unsigned(z, 4), -1)
    assert forms.limits(total) == (-15, 14)
    assert forms.signed(total, 5) == total
    assert not same_word(forms, forms.signed(total, 4), total, 5)


def test_a_word_of_one_repeated_bit_selects_another_word() -> None:
    """``{ 4{ bit } } & word`` is a product, however many bits the word has."""
    core = looking_ahead()
    whole = re.search(r"y_6_memory_read_data & \{ (warm1(?:, warm1)*) \}", core.text)
    assert whole is not None
    assert whole[1].count("warm1") == 13
    core.check()


def test_of_several_floors_in_one_that_of_the_finest_argument_is_left_out() -> None:
    forms = Forms()
    x, z = forms.variable("x", -100, 100), forms.variable("z", -100, 100)
    coarse = forms.floor(shifted(x, -2))
    for last in (forms.floor(shifted(z, -4)), forms.floor(plus(shifted(z, -4), constant(Fraction(1, 2))))):
        ((monomial, _),) = last.items()
        inside = forms.atom(monomial[0]).inside
        assert inside is not None
        assert forms.floor(shifted(plus(coarse, last), -3)) == forms.floor(shifted(plus(coarse, inside), -3))


def test_upper_bits_are_those_of_what_was_rounded_where_the_lower_ones_round_off() -> None:
    forms = Forms()
    total = plus({}, forms.variable("change", -510, 510), 2)
    total = plus(plus(total, forms.variable("first", -128, 127), Fraction(4095, 1024)), constant(Fraction(1, 2)))
    rounded = forms.floor(total)
    assert not forms.keys(rounded) - {"change", "first"}
    for bits in (1, 9, 10, 11):
        assert forms.floor(shifted(total, -bits)) == forms.floor(shifted(rounded, -bits))


@pytest.mark.parametrize(("high", "coarse"), [(7, True), (8, False)])
def test_what_never_reaches_a_step_is_left_out(high: int, coarse: bool) -> None:
    """``floor((8 i + r) / 16)`` is ``floor(i / 2)`` as long as r is below 8."""
    forms = Forms()
    i, r = forms.variable("i", 0, 1000), forms.variable("r", 0, high)
    assert (forms.floor(plus(shifted(i, -1), shifted(r, -4))) == forms.floor(shifted(i, -1))) == coarse


def test_a_limit_of_a_multiple_is_one_of_an_integer() -> None:
    """Where ``16 - 423 n`` is not negative, n is not above 0, as it has no fraction."""
    forms = Forms()
    n = plus(forms.variable("x", 0, 31), forms.variable("z", 0, 31))
    not_negative = forms.narrowed(plus(constant(16), n, -423), 0, 16)
    assert not_negative.limits(n) == (0, 0)
    assert not_negative.settled(forms.negative(plus({}, n, -1))) == {}


def test_what_is_beside_a_floor_may_as_well_be_inside() -> None:
    """``floor((5 x + z) / 16) - x`` is ``floor((z - 11 x) / 16)``."""
    forms = Forms()
    x, z = forms.variable("x", -16, 15), forms.variable("z", 0, 7)
    floor = forms.floor(shifted(plus(z, x, 5), -4))
    for sign in (1, -1):
        form = plus(plus({}, floor, sign), x, -sign)
        case = forms.narrowed(form, *sorted((-4 * sign, -sign)))
        assert case.limits(plus(z, x, -11)) == (-64, -1)


def test_a_word_that_one_integer_nearly_fills_is_limited_by_its_upper_bits() -> None:
    """Limits by comparisons, and by the upper bits of a sum that a step of x moves by more than half of its range."""
    forms = Forms()
    x, z = forms.variable("x", -16, 15), forms.variable("z", 0, 7)
    total = plus(z, x, -11)
    upper = forms.floor(shifted(total, -3))

    def limited(below: Form, above: Form, code: Form) -> Form:
        between = plus(plus(constant(1), below, -1), above, -1)
        return plus(plus(forms.times(between, code), below, -8), above, 7)

    by_bits = limited(
        forms.negative(plus(upper, constant(1))), forms.negative(plus({}, upper, -1)), forms.signed(total, 4)
    )
    for high, same in ((7, True), (6, False)):
        below, above = forms.negative(plus(total, constant(8))), forms.negative(plus(constant(high), total, -1))
        assert same_word(forms, limited(below, above, total), by_bits, 8) == same
