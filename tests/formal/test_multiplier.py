"""The serial multiplier, proven: by an invariant for the words that the hardware has, against `*` for short ones."""

from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from amaranth.hdl import Assert, Module, Mux, Signal, signed
from amaranth.lib.wiring import Component, In, Out
from tests.formal.prover import INDUCTION, Proof, broken, prove

from sosmith.gen.architectures.architecture import DIGIT_BITS
from sosmith.hdl.cores import multiply_accumulate

SHORT_DIGIT_BITS = 3


class SerialMultiplier(Component):
    """The serial core's multiplication by itself: products of any two words, one after the other, added up.

    While `multiplies` is high, ``data * factor`` of the clock at which `advance` was high last is added to `total`.
    """

    def __init__(self, module: ModuleType, digit_bits: int) -> None:
        self.module = module
        self.word, self.total_bits = digit_bits + 1, 2 * digit_bits + 8
        super().__init__(
            {
                "data": In(signed(self.word)),
                "factor": In(signed(self.word)),
                "starts": In(1),
                "clears": In(1),
                "multiplies": Out(1),
                "advance": Out(1),
                "total": Out(signed(self.total_bits)),
            }
        )

    def elaborate(self, platform: object) -> Module:
        """Build the multiplication and what stands for the pipeline around it."""
        m = Module()
        with m.If(self.advance):
            m.d.sync += self.multiplies.eq(self.starts)
        added = Signal(self.total.shape())
        unit: Any = SimpleNamespace(word=self.word)
        control = self.advance, self.multiplies
        multiply = self.module.MultiplyAccumulate._multiply_serially
        multiply(unit, m, (self.total, added), (self.data, self.factor), control)
        with m.If(self.multiplies):
            m.d.sync += self.total.eq(added)
        with m.If(self.advance & self.clears):
            m.d.sync += self.total.eq(0)
        return m


class Multiplication(Proof):
    """Every product ends as ``before + a * b``, after no more clocks than a word has bits.

    After `shift` clocks, ``total = before + sum(bit i of b * a * 2**i for i < shift)``. The proof adds that sum up in
    `partial`, from the factors as they came. When the unit is done, ``rest = b >> shift`` must be -1, 0 or 1, and
    ``rest * a * 2**shift`` must be added: the whole then is ``before + a * b``, since ``b = rest * 2**shift`` plus its
    lower bits. With `whole`, the last step is proven as well, for sums that begin at zero.
    """

    def __init__(self, design: SerialMultiplier, *, whole: bool) -> None:
        super().__init__(design)
        self.whole = whole

    def state(self, m: Module) -> None:
        """State the invariant."""
        d = self.design
        a, b, rest = (Signal(signed(d.word), name=name) for name in ("a", "b", "rest"))
        moved = Signal(signed(2 * d.word))
        partial, sofar, expected = (Signal(d.total.shape(), name=name) for name in ("partial", "sofar", "expected"))
        shift, ended = Signal(range(2 * d.word)), Signal()
        m.d.comb += [sofar.eq(Mux(shift == 0, d.total, partial)), moved.eq(a << shift), rest.eq(b >> shift)]
        m.d.proof += [
            shift.eq(shift + 1),
            partial.eq(sofar + Mux(rest[0], moved, 0)),
            expected.eq(sofar + Mux(rest == -1, -moved, Mux(rest[0], moved, 0))),
            ended.eq(d.multiplies & d.advance & ~d.clears & ~self.reset),
        ]
        with m.If(self.reset | d.advance):
            m.d.proof += [a.eq(d.data), b.eq(d.factor), shift.eq(0)]
        with m.If(self.started & d.multiplies):
            m.d.comb += [
                Assert(shift < d.word),
                Assert(self.inside["left"] == rest),
                Assert(self.inside["shifted"] == moved),
                Assert(d.total == sofar),
            ]
            with m.If(d.advance):
                m.d.comb += Assert((rest >= -1) & (rest <= 1))
        with m.If(self.started & ended):
            m.d.comb += Assert(d.total == expected)
        if self.whole:
            self._state_product(m, a, b, shift, ended)

    def _state_product(self, m: Module, a: Signal, b: Signal, shift: Signal, ended: Signal) -> None:
        """With `clears` at every product's beginning, state that `total` is ``a`` times the lower bits of ``b``."""
        d = self.design
        from_zero, product = Signal(), Signal(d.total.shape())
        m.d.proof += product.eq(a * b)
        with m.If(self.reset | d.advance):
            m.d.proof += from_zero.eq(self.reset | d.clears)
        lower = b.as_unsigned() & ((1 << shift) - 1)
        with m.If(self.started & d.multiplies & from_zero):
            m.d.comb += Assert(d.total == a * lower)
        was_from_zero = Signal()
        m.d.proof += was_from_zero.eq(from_zero)
        with m.If(self.started & ended & was_from_zero):
            m.d.comb += Assert(d.total == product)


def multiplication(
    module: ModuleType = multiply_accumulate, digit_bits: int = DIGIT_BITS, *, whole: bool = False
) -> Proof:
    return Multiplication(SerialMultiplier(module, digit_bits), whole=whole)


@pytest.mark.slow
def test_the_serial_multiplier_adds_up_its_partial_products(tmp_path: Path) -> None:
    assert prove(multiplication(), tmp_path, INDUCTION) == "PASS"


@pytest.mark.slow
def test_a_short_serial_multiplier_multiplies(tmp_path: Path) -> None:
    assert prove(multiplication(digit_bits=SHORT_DIGIT_BITS, whole=True), tmp_path, INDUCTION) == "PASS"


@pytest.mark.slow
@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("Mux(left == -1, total - multiple, total + multiple)", "total + multiple"),  # no subtraction
        ("(left == -1) | ~left[1:].any()", "~left[1:].any()"),  # no end for a negative factor
        ("(left == -1) | ~left[1:].any()", "(left == -1) | ~left[2:].any()"),  # an end too early
        ("shifted.eq(shifted << 1)", "shifted.eq(shifted)"),
    ],
)
def test_a_broken_multiplier_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    # Short words, so that PDR sees the failure from reset on, and not only that a step does not follow.
    assert prove(multiplication(broken(multiply_accumulate, right, wrong), SHORT_DIGIT_BITS), tmp_path) == "FAIL"
