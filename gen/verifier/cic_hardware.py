"""Proves from the SystemVerilog that the decimator of a core, and what hands out its results, do what they must.

::

    s_axis --> [decimator] --> [behind: the core] --> [holder, if results are held] --> m_axis

The modules of decimator and holder, and the top that connects them, are read as they are written; of the core behind,
only the ports. Every register has a name by which it is known here, and there is no other. For each of them it is
proven, for all values of all registers and inputs, that a clock loads what is said below, and that resets and the time
before the first clock leave no sample and no result. That this is a CIC filter follows from there:

- A stage of the filter holds one sample, and moves on at each clock. Of N sums, ``sum(k)`` adds what ``sum(k-1)`` holds
  of the same sample, and of N differences, ``difference(k)`` takes from every R-th the one before it, all modulo
  ``2**width``: N combs behind N integrators are a moving sum, N times, once each comb holds a result. What the sums
  held before does not count, as each comb takes away a power of the polynomial that comes of it.
- While `filling` is 1, no sample is accepted, but the one that is offered goes in at each clock, N R times: N of them
  move the combs, and no result counts. Then every sum that counts is of samples since the reset, the first of them
  with those that it stands for.
- A sample is accepted with the phase 0 only when no result is `waiting`, from the sample that completes it until it is
  taken. So each result finds `o_data` free, and stays until it is taken.
- The holder takes a word when it is empty or hands out the last of its copies, and hands out R of each.

Above the bits of a result there are zeros, or its sign again (`sosmith.gen.verifier.repeated_sign`), and flags, which
the core behind makes: here they are passed on.

An undefined value, ``1'hx``, may be either: what is said holds for both.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

from sosmith.gen.verifier.around_core import (
    BEHIND,
    CIC,
    CLOCK,
    HOLDER,
    Seams,
    passed_on,
    read_around,
    read_core,
    seams_of,
)
from sosmith.gen.verifier.certificate_file import Certificate, DecimationEntry, PortEntry
from sosmith.gen.verifier.graph import RejectedError, require
from sosmith.gen.verifier.parallel.control import RESET, SINK, SOURCE, Case, UndecidedError, about, cases
from sosmith.gen.verifier.parallel.equality import same_word
from sosmith.gen.verifier.parallel.evaluation import Evaluation
from sosmith.gen.verifier.parallel.forms import Forms, shifted
from sosmith.gen.verifier.parallel.netlist import Netlist
from sosmith.gen.verifier.parallel.text import Bits
from sosmith.gen.verifier.program.normal_form import Form, constant, plus
from sosmith.gen.verifier.repeated_sign import check_signs

_DATA = "s_axis_tdata"
_DATA_REGISTERS = frozenset({"sum", "comb", "difference", "o_data"})
_NAME = re.compile(r"(\w*?)(\d*)(?:_control(\d))?")


@dataclass(frozen=True)
class DecimatorVerdict:
    """What the check of a decimator's hardware has found.

    Attributes
    ----------
    registers : int
        Number of registers that were proven to be loaded as they must.
    copies : int
        How often each result is handed out.
    """

    registers: int
    copies: int


def check_decimator(text: str, certificate: Certificate) -> DecimatorVerdict:
    """Prove the hardware before and behind a core that filters at a lower rate.

    Parameters
    ----------
    text : str
        SystemVerilog of the core.
    certificate : Certificate
        Its certificate, with a decimator, which `verify` has accepted. If it has the specification, that says whether
        results are held.

    Raises
    ------
    RejectedError
        If a register is loaded with anything else, a port is connected otherwise, or the text has anything that cannot
        be read; the sentence names the first register or port that is wrong.
    """
    entry, (port,) = certificate.decimation, certificate.inputs
    assert entry is not None
    modules = read_core(text, certificate.name)
    netlist, held = read_around(modules, certificate.name)
    if certificate.about is not None:
        stated = tomllib.loads(certificate.about.specification).get("filter", {}).get("hold", False)
        require(held == stated, f"results must {'' if stated else 'not '}be held, as specified")
    seams = seams_of(netlist, held=held)
    output = certificate.output
    word = _held_word(netlist) if held else ""
    leaving = _Holder(seams, output, word, entry.factor) if held else _Passing(seams, output)
    parts: list[_Part] = [_Cic(entry, port, seams), leaving]
    first = {name: value for part in parts for name, value in part.first.items()}
    require(
        netlist.registers.keys() == first.keys() and not netlist.memories,
        f"the registers around the core must be {', '.join(sorted(first))}, not "
        f"{', '.join(sorted({*netlist.registers, *netlist.memories}))}",
    )
    ranges = {name: found for part in parts for name, found in part.ranges.items()}
    for name, value in first.items():
        found = netlist.registers[name].first
        require(value in {None, found}, f"{name} must be {value} before the first clock, not {found}")
    for part in parts:
        for name in (*part.nets, *part.first):
            _check(netlist, ranges, part, name)
    for stream in ("m_axis_tdata", "m_axis_tuser"):
        for name in passed_on(netlist, Bits(stream)):
            own = name == word if held else name.startswith(BEHIND)
            require(own, f"{stream} must have bits of what leaves the core, not of {name}")
    check_signs(modules, output, CLOCK)
    return DecimatorVerdict(len(first), entry.factor if held else 1)


def _held_word(netlist: Netlist) -> str:
    """Return the register that holds a result: ``o_data``, or what is left of it without bits that are always 0."""
    names = {name for name in passed_on(netlist, Bits("m_axis_tdata")) if name in netlist.registers}
    require(len(names) == 1, f"m_axis_tdata must have bits of one register, not of {len(names)}")
    return names.pop()


def _check(netlist: Netlist, ranges: Mapping[str, _Ranges], part: _Part, name: str) -> None:
    """Check a register after a clock, or a net within one, in all cases."""

    def right(case: Case) -> bool:
        now = _Logic(netlist, case, ranges)
        register = name in netlist.registers
        found = now.after(name) if register else now.net(name)
        if register and not now.bit(RESET):
            first = part.first[name]
            return first is None or same_word(now.forms, found, constant(first), netlist.widths[name])
        return same_word(now.forms, found, part.wanted(now, name), netlist.widths[name])

    def values(signal: str) -> range:
        return range(len(ranges.get(signal, _BIT)))

    for case, same in cases({}, right, values):
        if not same:
            stated = ", ".join(f"{signal} = {_told(ranges.get(signal, _BIT)[k])}" for signal, k in case.items())
            after = "after a clock with" if name in netlist.registers else "with"
            raise RejectedError(f"{name} must be what a decimator has there {after} {stated}, not another value")


def _told(limits: tuple[int, int]) -> str:
    low, high = limits
    return f"{low}" if low == high else f"{low}..{high}"


_Ranges = Sequence[tuple[int, int]]
"""Ranges that make up all values of a signal, told apart by the cases."""

_BIT: _Ranges = ((0, 0), (1, 1))


class _Logic:
    """All nets of the core but for what is behind, in one case: each control signal lies in one of its ranges."""

    def __init__(self, netlist: Netlist, case: Case, ranges: Mapping[str, _Ranges]) -> None:
        self.forms = Forms()
        self._netlist, self._case, self._ranges = netlist, case, ranges
        undriven = {name for name in netlist.widths if name not in netlist.drivers and name not in netlist.registers}
        self._nets = Evaluation(netlist, self.forms, self.word, cuts=undriven)

    def limits(self, name: str) -> tuple[int, int]:
        """Return the limits of a register, an input, or what leaves the core behind, in this case.

        Raises
        ------
        UndecidedError
            If the case says nothing of this signal, and it is one that must be told apart.
        """
        width = self._netlist.widths.get(name)
        if width is None:
            raise RejectedError(f"there must be a {name}")
        if name not in self._ranges and width > 1:
            return 0, (1 << width) - 1
        if name not in self._case:
            raise UndecidedError(name)
        return self._ranges.get(name, _BIT)[self._case[name]]

    def width(self, name: str) -> int:
        """Return the width of a net."""
        return self._netlist.widths[name]

    def word(self, name: str) -> Form:
        """Return what it holds."""
        low, high = self.limits(name)
        form = self.forms.variable(name, low, high)
        if name != _DATA:
            return form
        _, most = self._ranges[name][-1]  # above the code there are bits that do not count
        rest = self.forms.variable("padding", 0, (1 << self._netlist.widths[name]) // (most + 1) - 1)
        return plus(form, rest, most + 1)

    def bit(self, name: str) -> int:
        """Return a signal of one bit."""
        low, high = self.limits(name)
        require(low == high, f"{name} must have one bit")
        return low

    def net(self, name: str) -> Form:
        """Return what a net has within the clock."""
        require(name in self._netlist.widths, f"there must be a {name}")
        return self._nets.net(name)

    def result(self, word: Form, bits: int) -> Form:
        """Return a word whose low bits are the result: that of the core as it leaves it, low among those of one output.

        What is above them, signs and flags, is left as it is.

        Raises
        ------
        RejectedError
            If there is more than one such output in it.
        """
        names = self.forms.keys(self.forms.unsigned(word, bits))
        name = next(iter(names), None)
        if len(names) != 1 or not isinstance(name, str) or not name.startswith(BEHIND):
            raise RejectedError("the result must be one output of the core")
        return plus(self.forms.unsigned(self.word(name), bits), self.forms.floor(shifted(word, -bits)), 1 << bits)

    def after(self, name: str) -> Form:
        """Return what a register holds after the clock."""
        require(name in self._netlist.registers, f"there must be a register {name}")
        try:
            loaded = self._nets.loaded(self._netlist.registers[name].statements)
        except RejectedError as error:
            raise about(name, error) from None
        return self.word(name) if loaded is None else loaded[1]


class _Part(Protocol):
    """What is checked of a part of the hardware."""

    @property
    def first(self) -> Mapping[str, int | None]:
        """Its registers, and what they hold before the first clock and after a reset; None where it does not count."""

    @property
    def nets(self) -> Sequence[str]:
        """Its nets that are checked."""

    @property
    def ranges(self) -> Mapping[str, _Ranges]:
        """Signals of several bits whose values are told apart."""

    def wanted(self, now: _Logic, name: str) -> Form:
        """Return what a register must hold after the clock if there is no reset, or a net within the clock."""


@dataclass(frozen=True)
class _Cic:
    """The decimator, up to what enters the core."""

    entry: DecimationEntry
    port: PortEntry
    seams: Seams

    @property
    def nets(self) -> Sequence[str]:
        """Whether a sample is taken, and what enters the core."""
        return ("s_axis_tready", *self.seams.entering)

    @property
    def first(self) -> Mapping[str, int | None]:
        """Control, N sums, N combs and differences, and the output."""
        found: dict[str, int | None] = {"phase": 0, "filled": 0, "filling": 1, "waiting": 0, "rail": 0}
        for k in range(1, self.entry.stages + 1):
            found |= {f"integrator{k}_control0": 0, f"comb{k}_control0": 0}
            found |= dict.fromkeys((f"integrator{k}_control1", f"integrator{k}_control2", f"comb{k}_control1"))
            found |= dict.fromkeys((f"sum{k}", f"comb{k}", f"difference{k}"))
        found |= {"o_valid": 0, "o_data": None, "o_rail": None}
        return {CIC + name: value for name, value in found.items()}

    @property
    def ranges(self) -> Mapping[str, _Ranges]:
        """The phase and the pattern of the code by their ends, the count of results while filling by each value."""
        half = 1 << self.port.bits - 1
        ends = (half - 1, half) if self.port.signed else (0, 2 * half - 1)
        starts = sorted({0, half, 2 * half, *ends, *(end + 1 for end in ends)})
        code = tuple((start, after - 1) for start, after in pairwise(starts))
        last, count = self.entry.factor - 1, 1 << self.entry.stages.bit_length()
        phase = ((0, 0), (1, last - 1), (last, last)) if last > 1 else _BIT
        return {CIC + "phase": phase, CIC + "filled": tuple((k, k) for k in range(count)), _DATA: code}

    def wanted(self, now: _Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        if name == "s_axis_tready":
            return constant(self._ready(now))
        if name in self.seams.entering:
            return now.word(self.seams.entering[name])
        parts = _NAME.fullmatch(name.removeprefix(CIC))
        assert parts is not None  # as it is for all names in `first`
        kind, k, what = parts.groups()
        stage = int(k or 0)
        if what is not None:
            holds = self._summed if kind == "integrator" else self._combed
            return constant(holds(now, stage - 1, int(what)))
        loaded = self._data(now, kind, stage) if kind in _DATA_REGISTERS else self._control(now, kind)
        return now.word(name) if loaded is None else loaded

    def _control(self, now: _Logic, kind: str) -> Form | None:
        """Return what a register of the control takes over, if it does."""
        rail = self._bit(now, "rail") if kind in {"rail", "o_rail"} else 0
        match kind:
            case "phase" if self._enters(now):
                return plus(now.word(CIC + kind), constant(1))
            case "filled" if self._enters(now) and self._ends(now):
                return plus(now.word(CIC + kind), constant(1))
            case "filling" if self._enters(now) and self._ends(now) and self._filled(now):
                return constant(0)
            case "waiting" if self._accepted(now) and self._completes(now):
                return constant(1)
            case "waiting" if self._bit(now, "o_valid") and now.bit(self.seams.taken):
                return constant(0)
            case "rail" if self._accepted(now):
                return constant(0 if self._completes(now) else rail | self._at_rail(now))
            case "o_rail" if self._accepted(now) and self._completes(now):
                return constant(rail | self._at_rail(now))
            case "o_valid" if self._leaves(now):
                return constant(1)
            case "o_valid" if now.bit(self.seams.taken):
                return constant(0)
        return None

    def _data(self, now: _Logic, kind: str, k: int) -> Form | None:
        """Return what a register of the filter takes over, if it does."""
        match kind:
            case "sum" if self._summed(now, k - 1, 0):
                return plus(now.word(f"{CIC}sum{k}"), self._before(now, "sum", k))
            case "comb" if self._combed(now, k - 1, 0):
                return self._before(now, "difference", k)
            case "difference" if self._combed(now, k - 1, 0):
                return plus(self._before(now, "difference", k), now.word(f"{CIC}comb{k}"), -1)
            case "o_data" if self._leaves(now):
                half = constant(1 << self.entry.dropped >> 1)
                last = now.word(f"{CIC}difference{self.entry.stages}")
                return now.forms.floor(shifted(plus(last, half), -self.entry.dropped))
        return None

    def _before(self, now: _Logic, kind: str, k: int) -> Form:
        """Return what stands before a sum or a difference: the one before it, the last sum, or the code."""
        if k > 1:
            return now.word(f"{CIC}{kind}{k - 1}")
        if kind == "difference":
            return now.word(f"{CIC}sum{self.entry.stages}")
        low, high = now.limits(_DATA)
        negative = self.port.signed and low > self.port.highest
        return plus(now.forms.variable(_DATA, low, high), constant(-(1 << self.port.bits) if negative else 0))

    def _bit(self, now: _Logic, name: str) -> int:
        return now.bit(CIC + name)

    def _ready(self, now: _Logic) -> int:
        """Whether a sample would be accepted."""
        return int(not self._bit(now, "filling") and not (self._completes(now) and self._bit(now, "waiting")))

    def _enters(self, now: _Logic) -> int:
        """Whether a sample goes in."""
        return int(now.bit(SOURCE) and (self._bit(now, "filling") or self._ready(now)))

    def _accepted(self, now: _Logic) -> int:
        """Whether it is accepted as well."""
        return int(self._enters(now) and not self._bit(now, "filling"))

    def _completes(self, now: _Logic) -> int:
        """Whether it would complete a result."""
        return int(now.limits(CIC + "phase") == (0, 0))

    def _ends(self, now: _Logic) -> int:
        """Whether the sample after it would."""
        return int(now.limits(CIC + "phase") == (self.entry.factor - 1,) * 2)

    def _filled(self, now: _Logic) -> int:
        """Whether R samples less than N R have gone in since the reset."""
        return int(now.limits(CIC + "filled") == (self.entry.stages - 1,) * 2)

    def _at_rail(self, now: _Logic) -> int:
        """Whether the code is at an end of its range."""
        low, high = now.limits(_DATA)
        return int(low == high and low in {self.port.lowest % (1 << self.port.bits), self.port.highest})

    def _summed(self, now: _Logic, stage: int, what: int) -> int:
        """Of the sample behind a sum: whether there is one, whether it completes a result, and whether that counts."""
        if stage:
            return self._bit(now, f"integrator{stage}_control{what}")
        if what == 2:
            return 1 - self._bit(now, "filling")
        return self._completes(now) if what else self._enters(now)

    def _combed(self, now: _Logic, stage: int, what: int) -> int:
        """Of the sample behind a comb: whether there is one, and whether the result counts."""
        if stage:
            return self._bit(now, f"comb{stage}_control{what}")
        last = self.entry.stages
        return self._summed(now, last, 2) if what else self._summed(now, last, 0) and self._summed(now, last, 1)

    def _leaves(self, now: _Logic) -> int:
        """Whether a result that counts comes to the output."""
        return self._combed(now, self.entry.stages, 0) and self._combed(now, self.entry.stages, 1)


@dataclass(frozen=True)
class _Passing:
    """What leaves the core leaves at once."""

    seams: Seams
    port: PortEntry

    @property
    def nets(self) -> Sequence[str]:
        """Whether a result is taken, whether there is one, and the result."""
        return (self.seams.ready, "m_axis_tvalid", "m_axis_tdata")

    @property
    def first(self) -> Mapping[str, int | None]:
        """There is no register."""
        return {}

    @property
    def ranges(self) -> Mapping[str, _Ranges]:
        """Nor anything to tell apart."""
        return {}

    def wanted(self, now: _Logic, name: str) -> Form:
        """Return what is on the other side."""
        if name == "m_axis_tdata":
            return now.result(now.net(name), self.port.bits)
        return now.word(SINK if name == self.seams.ready else self.seams.valid)


@dataclass(frozen=True)
class _Holder:
    """What hands out each result, held in the register `word`, `copies` times."""

    seams: Seams
    port: PortEntry
    word: str
    copies: int

    @property
    def nets(self) -> Sequence[str]:
        """Whether a result is taken, whether there is one, and the result."""
        return (self.seams.ready, "m_axis_tvalid", "m_axis_tdata")

    @property
    def first(self) -> Mapping[str, int | None]:
        """A word with its valid bit, and a counter."""
        return {HOLDER + "o_valid": 0, HOLDER + "left": None, self.word: None}

    @property
    def ranges(self) -> Mapping[str, _Ranges]:
        """The counter by whether it is 0."""
        return {HOLDER + "left": ((0, 0), (1, self.copies - 1))}

    def wanted(self, now: _Logic, name: str) -> Form:
        """Return a new word where one can be taken, else one copy less where one leaves."""
        valid, left = HOLDER + "o_valid", HOLDER + "left"
        if name == "m_axis_tvalid":
            return now.word(valid)
        if name == "m_axis_tdata":
            bits = now.width(name) if self.word == HOLDER + "o_data" else self.port.bits  # else zeros are left out
            return now.forms.unsigned(now.word(self.word), bits)
        takes = not now.bit(valid) or (now.bit(SINK) and now.limits(left) == (0, 0))
        if name in self.nets:
            return constant(int(takes))
        if not takes:
            return plus(now.word(left), constant(-1)) if name == left and now.bit(SINK) else now.word(name)
        if name == self.word:  # with the flags above
            return now.result(now.after(name), self.port.bits)
        return constant(self.copies - 1) if name == left else now.word(self.seams.valid)
