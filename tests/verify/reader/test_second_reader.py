"""The second reader: what Yosys sees is what is read, and each way to misread a construct is refused."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest
from tests.verify.parallel.cores import small as parallel
from tests.verify.program.programs import small as folded
from tests.verify.reader.example_cores import CORES, NAME, core
from tests.verify.reader.netlists import netlists
from tests.verify.small_specifications import PLAIN

from sosmith.verify.graph import RejectedError
from sosmith.verify.reader import gates, logic, widths
from sosmith.verify.reader.second_reader import Readings, compare_readings
from sosmith.verify.reader.source import read_source
from sosmith.verify.reader.syntax import Bits, Choice, Expression, Joined, Module, Number, Operator, Word

EVERYTHING = """\
module top(a, b, s, q, r, used, aclk);
  input [3:0] a;
  wire [3:0] a;
  input [5:0] b;
  wire [5:0] b;
  input s;
  wire s;
  output [7:0] q;
  wire [7:0] q;
  output [7:0] r;
  reg [7:0] r = 8'h5a;
  input aclk;
  wire aclk;
  output [62:0] used;
  wire [62:0] used;
  wire [8:0] sum;
  wire [8:0] mixed;
  wire [7:0] difference;
  wire [9:0] product;
  wire less;
  wire above;
  wire [6:0] either;
  wire [6:0] joined;
  wire any;
  wire all;
  wire odd;
  wire none;
  wire [6:0] inverse;
  wire [1:0] top;
  wire [1:0] low;
  reg [7:0] unnamed;
  reg [7:0] words [3:0];
  initial begin
    words[0] = 8'h01;
    words[1] = 8'h02;
    words[2] = 8'h03;
    words[3] = 8'h04;
  end
  assign sum = $signed(a) + $signed(b);
  assign mixed = $signed(a) + b;
  assign difference = $signed(a) - $signed(b);
  assign product = $signed(a) * $signed(b);
  assign less = $signed(a) < $signed(b);
  assign above = a >= b;
  assign either = s ? $signed(a) : $signed(b);
  assign joined = { s, $signed(a), b[1:0] };
  assign any = | b[5:2];
  assign all = & a;
  assign odd = ^ b;
  assign none = ! b;
  assign inverse = ~ a;
  assign { top, low } = a;
  assign used = { sum, mixed, difference, product, less, above, either, joined, any, all, odd, none, inverse };
  always_ff @(posedge aclk)
    if (a) r <= q;
    else if (!s) begin
      r[3:0] <= a;
    end
  always_ff @(posedge aclk) begin
    if (s)
      words[low] <= { a, a };
  end
  always_ff @(posedge aclk) begin
    unnamed <= words[top];
  end
  inner inner0 (
    .i(a),
    .o(q)
  );
endmodule
module inner(i, o);
  input [3:0] i;
  wire [3:0] i;
  output [7:0] o;
  wire [7:0] o;
  assign o = { i, i };
endmodule
"""


@cache
def seen(text: str, top: str) -> str:
    return netlists([text], top)[0]


def compared(text: str = EVERYTHING, top: str = "top") -> Readings:
    return compare_readings(read_source(text, top).modules, seen(text, top))


def test_every_construct_is_seen_alike() -> None:
    assert compared() == Readings(modules=2, register_bits=16, words=4)


def test_small_cores_are_seen_alike() -> None:
    texts = [parallel().text, parallel(channels=3).text, folded(PLAIN).text]
    for text, netlist in zip(texts, netlists(texts, "plain"), strict=True):
        assert compare_readings(read_source(text, "plain").modules, netlist).register_bits > 100


@pytest.mark.slow
@pytest.mark.parametrize("kind", CORES)
def test_a_core_of_every_architecture_is_seen_alike(kind: str) -> None:
    found = compare_readings(read_source(core(kind), NAME).modules, seen(core(kind), NAME))
    assert found.register_bits > 100


def swapped(old: Callable[..., Any], when: Callable[[Expression], bool], new: Callable[[Any], Expression]) -> Any:
    """Let a method read another expression instead of those for which `when` holds."""
    return lambda self, value, *more, **named: old(self, new(value) if when(value) else value, *more, **named)


def is_operator(symbol: str, operands: int = 2) -> Callable[[Expression], bool]:
    return lambda value: isinstance(value, Operator) and value.symbol == symbol and len(value.operands) == operands


def turned(value: Any) -> Expression:
    return Operator(value.symbol, value.operands[::-1])


def of_another_kind(symbol: str) -> Callable[[Any], Expression]:
    return lambda value: Operator(symbol, value.operands)


def extended_by_zeros(word: list[int], width: int, *, signed: bool) -> list[int]:
    return gates.extended(word, width, signed=False)


def extended_by_sign(word: list[int], width: int, *, signed: bool) -> list[int]:
    return gates.extended(word, width, signed=True)


def signed_if_any(value: Expression) -> bool:
    if not isinstance(value, Operator) or widths.is_one_bit(value):
        return False
    return value.symbol == "signed" or any(signed_if_any(of) for of in value.operands[value.symbol == "?" :])


READING = logic._Reading


def misread(method: str, when: Callable[[Expression], bool], new: Callable[[Any], Expression]) -> tuple[Any, str, Any]:
    return READING, method, swapped(getattr(READING, method), when, new)


def is_joined(value: Expression) -> bool:
    return isinstance(value, Joined)


def other_sides(value: Any) -> Expression:
    return Operator("?", (value.operands[0], *value.operands[:0:-1]))


def is_high(value: Expression) -> bool:
    return isinstance(value, Bits) and value.low > 1


def is_word(value: Expression) -> bool:
    return isinstance(value, Word)


def cut_to_itself(self: Any, value: Expression, width: int) -> list[int]:
    return gates.extended(self._whole(value), width, signed=False)


def without_sign(g: Any, symbol: str, a: list[int], b: list[int], *, signed: bool) -> int:
    return COMPARED(g, symbol, a, b, signed=False)


def written_always(self: Any, load: Any, when: int, *rest: Any) -> Any:
    return LOAD(self, load, gates.HIGH, *rest)


def executed(change: Callable[[Any], Any]) -> Callable[..., Any]:
    return lambda self, statements, *rest: EXECUTED(self, [change(of) for of in statements], *rest)


def lowest(statement: Any) -> Any:
    condition = getattr(statement, "condition", None)
    if isinstance(condition, Bits) and condition.width is None:
        return Choice(Bits(condition.name, 0, 1), statement.yes, statement.no)
    return statement


def emptied(statement: Any) -> Any:
    if isinstance(statement, Choice) and not statement.no and isinstance(statement.yes[0].target, Bits):
        return Choice(statement.condition, (dataclasses.replace(statement.yes[0], value=Number(0, 1)),), ())
    return statement


LOAD, EXECUTED, COMPARED = READING._load, READING._executed, logic.compared
BREAKS: dict[str, tuple[Any, str, Any]] = {
    "signedness: one operand is enough": (logic, "is_signed", signed_if_any),
    "signedness: of an operand, not of what is made of it": (logic, "is_signed", is_operator("signed", 1)),
    "width extension: by zeros always": (logic, "extended", extended_by_zeros),
    "width extension: by the sign always": (logic, "extended", extended_by_sign),
    "context: operands are cut to their own width": (READING, "_in_context", cut_to_itself),
    "order of operands": misread("_sized", is_operator("-"), turned),
    "precedence: what is inverted": misread("_sized", is_operator("~", 1), of_another_kind("!")),
    "sides of a choice": misread("_sized", is_operator("?", 3), other_sides),
    "part select: one bit lower": misread("_places", is_high, lambda v: Bits(v.name, v.low - 1, v.width)),
    "concatenation: the first part is the lowest": misread("_own", is_joined, lambda v: Joined(v.parts[::-1])),
    "target: the first part is the lowest": misread("_places", is_joined, lambda v: Joined(v.parts[::-1])),
    "memory: another word is read": misread("_own", is_word, lambda v: Word(v.name, Operator("~", (v.address,)))),
    "memory: read a clock later": misread("_own", is_word, lambda v: Bits("unnamed")),
    "memory: written always": (READING, "_load", written_always),
    "comparison without sign": (logic, "compared", without_sign),
    "not less is more": misread("_own", is_operator(">="), of_another_kind(">")),
    "reduction: any for all": misread("_own", is_operator("&", 1), of_another_kind("|")),
    "reduction: odd for any": misread("_own", is_operator("|", 1), of_another_kind("^")),
    "condition: the lowest bit counts": (READING, "_executed", executed(lowest)),
    "a register becomes 0": (READING, "_executed", executed(emptied)),
}  # fmt: skip


@pytest.mark.parametrize("misreading", BREAKS)
def test_a_broken_reader_is_refused(misreading: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compared()
    owner, name, wrong = BREAKS[misreading]
    monkeypatch.setattr(owner, name, wrong)
    with pytest.raises(
        RejectedError, match=r"^the second reader must see the (register|memory|input|output) \w+\S* of "
    ):
        compared()


@pytest.mark.parametrize(
    ("forget", "sentence"),
    [
        (lambda top: top.registers.update(r=0), "the second reader must see the register r .*"),
        (lambda top: top.registers.update(unnamed=0), "the second reader must see the register unnamed .*"),
        (lambda top: top.registers.pop("r"), ".*"),
        (lambda top: top.contents["words"].update({2: 0}), "the second reader must see the memory words .*"),
        (lambda top: top.ports.update(b="output"), ".*"),
        (lambda top: top.widths.update(r=7), ".*"),
        (lambda top: top.clocked.pop(), ".*"),
        (lambda top: top.instances.pop(), ".*"),
    ],
)  # fmt: skip
def test_what_is_left_out_or_declared_otherwise_is_refused(forget: Callable[[Module], object], sentence: str) -> None:
    modules = read_source(EVERYTHING, "top").modules
    forget(modules["top"])
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        compare_readings(modules, seen(EVERYTHING, "top"))


@pytest.mark.parametrize("netlist", ["", "[]", "{}", '{"modules": {"top": {}}}', '{"modules": {"top": 1, "inner": 2}}'])
def test_another_file_is_no_netlist(netlist: str) -> None:
    with pytest.raises(RejectedError, match=r"^the netlist of the second reader must be one of Yosys, not with .*$"):
        compare_readings(read_source(EVERYTHING, "top").modules, netlist)
