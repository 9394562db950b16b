"""The SystemVerilog text: names as in our source, equal words of a memory as a loop, read back as the same words."""

import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from amaranth.back import rtlil
from amaranth.hdl import Elaboratable, Module, Signal, unsigned
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Component, In, Out
from tests.gen.designs import EXAMPLES, parallel_design
from tests.gen.output.converter_board import SPEC

import sosmith
from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.output.board_top import board_top
from sosmith.gen.output.naming.kept_bits import with_kept_bits
from sosmith.gen.output.naming.net_names import plain_names
from sosmith.gen.output.verilog import converted, to_rtlil, to_verilog
from sosmith.verify.graph import RejectedError
from sosmith.verify.reader.source import read_modules

WORDS = [3] * 2 + [7] * 20 + [1] + [0] * 30 + [2] * 7
"""Runs of every kind: short ones, long ones, a single word."""

_DECLARED = re.compile(r"^  (?:wire|reg) (?:\[\d+:0\] )?([^ ;]+)", re.MULTILINE)
_NAMELESS = re.compile(r"^ *wire .*(\\\$\S+)$", re.MULTILINE)
"""Signals that Amaranth found no name for in our source."""


class Table(Component):
    """A memory that is read."""

    address: In(6)
    word: Out(unsigned(4))

    def elaborate(self, platform: object) -> Elaboratable:
        m = Module()
        m.submodules.lookup = table = Memory(shape=4, depth=len(WORDS), init=WORDS)
        port = table.read_port()
        m.d.comb += [port.addr.eq(self.address), self.word.eq(port.data)]
        return m


@pytest.fixture(scope="module")
def text() -> str:
    return to_verilog(to_rtlil(Table(), "top"))


def stay_apart(escaped: str, plain: str) -> bool:
    """Whether as many signals of each module have names of their own after renaming as before."""
    declared = [[{*_DECLARED.findall(module)} for module in text.split("endmodule")] for text in (escaped, plain)]
    return [*map(len, declared[0])] == [*map(len, declared[1])]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("options", [{}, {"channels": 3, "protect": "correct", "reload": True}], ids=["plain", "all"])
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
def test_names_need_no_escape_and_stay_apart(architecture: str, options: dict[str, Any]) -> None:
    made = parallel_design("audio_lowpass.toml").architecture
    design = ARCHITECTURES[architecture](made.datapath, **options)
    text = to_rtlil(design.component(), "top")
    assert not _NAMELESS.findall(text)
    escaped = converted(text)
    plain = to_verilog(text)
    assert "$" in "".join(re.findall(r"\\\S+", escaped))
    assert "\\" not in plain
    assert stay_apart(with_kept_bits(escaped), plain)


@pytest.mark.slow
@pytest.mark.parametrize("spec", [EXAMPLES / "audio_lowpass.toml", SPEC], ids=["link", "converters"])
def test_nor_do_those_of_a_board(spec: Path | dict[str, Any]) -> None:
    text = to_rtlil(board_top(sosmith.design(spec).core, clock=Fraction(12_000_000), core="none"), "top")
    assert not _NAMELESS.findall(text)
    assert "\\" not in to_verilog(text)


def test_signals_without_a_name_are_found() -> None:
    m = Module()
    first, second = Signal(4), Signal(4)
    m.d.comb += second.eq(first)
    assert _NAMELESS.findall(rtlil.convert(m, ports=[first, second]))


def test_a_made_up_name_gives_way() -> None:
    text = "module top(a);\n  wire \\$1 ;\n  wire n1;\n  wire \\n$1 ;\n  assign { \\$1 , a } = n1 + \\n$1 ;\nendmodule"
    assert plain_names(text).splitlines()[1:-1] == [
        "  wire n1_2;",
        "  wire n1;",
        "  wire n_1;",
        "  assign { n1_2, a } = n1 + n_1;",
    ]


def test_long_runs_are_loops(text: str) -> None:
    assert len(re.findall(r"^ +for ", text, re.MULTILINE)) == 2
    assert len(re.findall(r"^ +\S+ ?\[\d+\] = ", text, re.MULTILINE)) == 2 + 1 + 7


def test_the_reader_finds_the_words(text: str) -> None:
    (held,) = (module.contents for module in read_modules(text).values() if module.contents)
    assert [words[address] for words in held.values() for address in sorted(words)] == WORDS


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ("for (i = 2; i < 22;", "for (i = 2; i < 23;", r"word 22 of \S+ must be given once, not twice"),
        (
            "for (i = 2; i < 22;",
            "for (i = 2; i < 99999999;",
            "a loop must be over at most 1048576 words, not 99999997",
        ),
    ],
)
def test_a_wrong_loop_is_rejected(right: str, wrong: str, message: str, text: str) -> None:
    assert right in text
    with pytest.raises(RejectedError, match=f"^{message}$"):
        read_modules(text.replace(right, wrong))


def test_a_loop_in_other_steps_is_no_loop(text: str) -> None:
    other = text.replace("i = i + 1", "i = i + 2")
    with pytest.raises(RejectedError, match=r"^a loop over words must go in steps of 1$"):
        read_modules(other)
