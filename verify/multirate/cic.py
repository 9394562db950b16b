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
  with those that it stands for. With a start from zero there is no `filling`: sums and combs are 0 before the first
  clock and after a reset, as if all samples before had been 0, and every result counts.
- A sample is accepted with the phase 0 only when no result is `waiting`, from the sample that completes it until it is
  taken. So each result finds `o_data` free, and stays until it is taken.
- The holder takes a word when it is empty or hands out the last of its copies, and hands out R of each.

Above the bits of a result there are zeros, or its sign again (`sosmith.verify.multirate.repeated_sign`). Flags are
made by the core behind: here they are passed on (`sosmith.verify.multirate.passed_flags`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from sosmith.verify.certificate_file import Certificate, DecimationEntry, PortEntry
from sosmith.verify.graph import require
from sosmith.verify.multirate.calibration import CODE, FLAGS, CalibrationPorts, layout_of
from sosmith.verify.multirate.channel_cic import Names, check_channels, names_of
from sosmith.verify.multirate.connections import (
    CIC,
    CLOCK,
    DATA,
    HOLDER,
    CoreConnections,
    calibration_connections,
    core_connections,
    passed_on,
    read_core,
    read_shell,
)
from sosmith.verify.multirate.logic import BIT, Field, Logic, Part, Ranges, RegisterShape, Signals, check_parts
from sosmith.verify.multirate.passed_flags import check_passed
from sosmith.verify.multirate.repeated_sign import check_signs
from sosmith.verify.parallel.control import SINK, SOURCE
from sosmith.verify.parallel.forms import shifted
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.reader.syntax import Bits, Module
from sosmith.verify.specified.words import table_of, words_of

_DATA_REGISTERS = frozenset({"sum", "comb", "difference", "o_data"})
_NAME = re.compile(r"(\w*?)(\d*)(?:_control(\d))?")


@dataclass(frozen=True)
class DecimatorVerdict:
    """The result of the check of a decimator's hardware.

    Attributes
    ----------
    registers : int
        Number of registers that were proven to be loaded as they must.
    copies : int
        How often each result is handed out.
    channels : int
        Number of channels.
    """

    registers: int
    copies: int
    channels: int = 1


def check_decimator(text: str, certificate: Certificate, channels: int = 1) -> DecimatorVerdict:
    """Prove the hardware before and behind a core that filters at a lower rate.

    Parameters
    ----------
    text : str
        SystemVerilog of the core.
    certificate : Certificate
        Its certificate, with a decimator, which `verify` has accepted. If it has the specification, that says whether
        results are held.
    channels : int
        Number of channels.

    Raises
    ------
    RejectedError
        If a register is loaded with anything else, a port is connected otherwise, or the text has anything that cannot
        be read; the sentence names the first register or port that is wrong.
    """
    shell, output = multirate_top(text, certificate, channels), certificate.output
    entry = certificate.decimation
    assert entry is not None
    netlist, connections, word = shell.netlist, shell.connections, shell.word
    leaving = _Holder(connections, output, word, entry.factor) if word else _Passing(connections, output)
    box = shell.modules.get(f"{certificate.name}_ahead")
    if shell.names is None:
        registers = _check_one(netlist, box, certificate, connections, leaving)
    else:
        registers = check_channels(netlist, box, certificate, channels, connections, shell.names, leaving)
    settles = certificate.claims.settling is not None
    check_passed(netlist, connections, word, (channels - 1).bit_length(), settles=settles)
    check_signs(shell.modules, output, CLOCK)
    return DecimatorVerdict(registers, entry.factor if word else 1, channels)


class MultirateTop(NamedTuple):
    """The shell around a core: all modules, a netlist without the core, its connections, and what has no own names.

    `flags` is the net with the flags of a result of the decimator, and `word` the register that holds results, "" if
    they leave at once.
    """

    modules: dict[str, Module]
    netlist: Netlist
    connections: CoreConnections
    names: Names | None
    flags: str
    word: str


def multirate_top(text: str, certificate: Certificate, channels: int) -> MultirateTop:
    """Read the shell around a core; the rest is as of `check_decimator`."""
    entry = certificate.decimation
    assert entry is not None
    modules = read_core(text, certificate.name)
    netlist, has_holder = read_shell(modules, certificate.name), f"{certificate.name}_holder" in modules
    if certificate.about is not None:
        stated = table_of(words_of(certificate.about.specification), "filter").get("hold", False)
        require(has_holder == stated, f"results must {'' if stated else 'not '}be held, as specified")
    names = names_of(netlist) if channels > 1 else None
    flags = "o_rail" if entry.calibration is None and names is None else "o_flags"
    connections = core_connections(netlist, flags, has_holder=has_holder, dest=None if names is None else names.dest)
    return MultirateTop(modules, netlist, connections, names, CIC + flags, _held_word(netlist) if has_holder else "")


def _check_one(
    netlist: Netlist, box: Module | None, certificate: Certificate, connections: CoreConnections, leaving: Part
) -> int:
    """Check the decimator of one channel, and what is before it."""
    entry, steady = certificate.decimation, certificate.ideal.start is not None
    assert entry is not None
    if entry.calibration is None:
        (port,) = certificate.inputs
        cic = _Cic(entry, port, connections, _Source(SOURCE, DATA, ()), {"s_axis_tready": 1}, steady=steady)
        return check_parts(netlist, [leaving, cic], Signals({DATA: [Field(DATA, port.bits)]}))
    port = entry.calibration.output
    calibration = calibration_connections(netlist, box, port.bits)
    cic = _Cic(entry, port, connections, _Source(calibration.valid, CODE, FLAGS), {}, steady=steady)
    parts = [leaving, cic, CalibrationPorts(calibration, cic.ready, netlist.widths[DATA], fills=steady)]
    return check_parts(netlist, parts, Signals(layout_of(netlist, calibration, port)))


def _held_word(netlist: Netlist) -> str:
    """Return the register that holds a result: ``o_data``, or what is left of it without bits that are always 0."""
    names = {name for name in passed_on(netlist, Bits("m_axis_tdata")) if name in netlist.registers}
    require(len(names) == 1, f"m_axis_tdata must have bits of one register, not of {len(names)}")
    return names.pop()


class _Source(NamedTuple):
    """Signals that enter the decimator: whether there is a sample, its code, and its flags, if there are any."""

    valid: str
    code: str
    flags: tuple[str, ...]


@dataclass(frozen=True)
class _Cic:
    """The decimator, up to what enters the core.

    `accepting` are nets that say whether it takes a sample, and `steady` says whether the first one fills it.
    """

    entry: DecimationEntry
    port: PortEntry
    connections: CoreConnections
    source: _Source
    accepting: Mapping[str, int]
    steady: bool

    @property
    def nets(self) -> Mapping[str, int]:
        """Whether a sample is taken, and what enters the core."""
        code = self.entry.width - self.entry.dropped
        widths = {CIC + "o_data": code, CIC + "o_flags": len(self.source.flags)}
        return {**self.accepting, **{name: widths.get(source, 1) for name, source in self.connections.entering.items()}}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """Control, N sums, N combs and differences, and the output."""
        bits, flags, width = self.entry.factor.bit_length() - 1, len(self.source.flags), self.entry.width
        shapes = {"phase": RegisterShape(bits, 0), "waiting": RegisterShape(1, 0)}
        if self.steady:
            shapes |= {"filled": RegisterShape(self.entry.stages.bit_length(), 0), "filling": RegisterShape(1, 1)}
        for k in range(1, self.entry.stages + 1):
            shapes |= dict.fromkeys((f"integrator{k}_control0", f"comb{k}_control0"), RegisterShape(1, 0))
            counting = (f"integrator{k}_control2", f"comb{k}_control1") if self.steady else ()
            shapes |= dict.fromkeys((f"integrator{k}_control1", *counting), RegisterShape(1, None))
            shapes |= dict.fromkeys((f"sum{k}", f"comb{k}"), RegisterShape(width, None if self.steady else 0))
            shapes[f"difference{k}"] = RegisterShape(width, None)
        shapes |= {"o_valid": RegisterShape(1, 0), "o_data": RegisterShape(width - self.entry.dropped, None)}
        flag_shapes = {"found": RegisterShape(flags, 0), "o_flags": RegisterShape(flags, None)}
        shapes |= flag_shapes if flags else {"rail": RegisterShape(1, 0), "o_rail": RegisterShape(1, None)}
        return {CIC + name: shape for name, shape in shapes.items()}

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """The phase and the pattern of the code by their ends, the count of results while filling by each value."""
        half = 1 << self.port.bits - 1
        ends = {half - 1, half} if self.port.signed else {0, 2 * half - 1}
        starts = {0, 2 * half} | ({half} if self.port.signed else set())
        if not self.source.flags:  # else the code is not asked for its rails
            starts |= {0, half, *ends, *(end + 1 for end in ends)}
        code = tuple((start, after - 1) for start, after in pairwise(sorted(starts)))
        last, count = self.entry.factor - 1, 1 << self.entry.stages.bit_length()
        phase = ((0, 0), (1, last - 1), (last, last)) if last > 1 else BIT
        ranges: dict[str, Ranges] = {CIC + "phase": phase}
        if self.steady:
            ranges[CIC + "filled"] = tuple((k, k) for k in range(count))
        if self.source.flags:
            ranges[CIC + "found"] = tuple((k, k) for k in range(1 << len(self.source.flags)))
            ranges |= dict.fromkeys(self.source.flags, BIT)
        return {**ranges, self.source.code: code}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        if name in self.accepting:
            return constant(self.ready(now))
        if name in self.connections.entering:
            return now.word(self.connections.entering[name])
        parts = _NAME.fullmatch(name.removeprefix(CIC))
        assert parts is not None  # as it is for all names in `first`
        kind, k, what = parts.groups()
        stage = int(k or 0)
        if what is not None:
            holds = self._summed if kind == "integrator" else self._combed
            return constant(holds(now, stage - 1, int(what)))
        loaded = self._data(now, kind, stage) if kind in _DATA_REGISTERS else self._control(now, kind)
        return now.word(name) if loaded is None else loaded

    def _control(self, now: Logic, kind: str) -> Form | None:
        """Return what a register of the control takes over, if it does."""
        match kind:
            case "phase" if self._enters(now):
                return plus(now.word(CIC + kind), constant(1))
            case "filled" if self._enters(now) and self._ends(now):
                return plus(now.word(CIC + kind), constant(1))
            case "filling" if self._enters(now) and self._ends(now) and self._filled(now):
                return constant(0)
            case "waiting" if self._accepted(now) and self._completes(now):
                return constant(1)
            case "waiting" if self._bit(now, "o_valid") and now.bit(self.connections.taken):
                return constant(0)
            case "rail" | "found" if self._accepted(now):
                return constant(0 if self._completes(now) else self._gathered(now))
            case "o_rail" | "o_flags" if self._accepted(now) and self._completes(now):
                return constant(self._gathered(now))
            case "o_valid" if self._leaves(now):
                return constant(1)
            case "o_valid" if now.bit(self.connections.taken):
                return constant(0)
        return None

    def _data(self, now: Logic, kind: str, k: int) -> Form | None:
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

    def _before(self, now: Logic, kind: str, k: int) -> Form:
        """Return what stands before a sum or a difference: the one before it, the last sum, or the code."""
        if k > 1:
            return now.word(f"{CIC}{kind}{k - 1}")
        if kind == "difference":
            return now.word(f"{CIC}sum{self.entry.stages}")
        low, _ = now.limits(self.source.code)
        negative = self.port.signed and low > self.port.highest
        return plus(now.signal(self.source.code), constant(-(1 << self.port.bits) if negative else 0))

    def _bit(self, now: Logic, name: str) -> int:
        return now.bit(CIC + name)

    def ready(self, now: Logic) -> int:
        """Whether a sample would be accepted."""
        return int(not self._filling(now) and not (self._completes(now) and self._bit(now, "waiting")))

    def _filling(self, now: Logic) -> int:
        """Whether the first sample still fills the decimator."""
        return self._bit(now, "filling") if self.steady else 0

    def _enters(self, now: Logic) -> int:
        """Whether a sample goes in."""
        return int(now.bit(self.source.valid) and (self._filling(now) or self.ready(now)))

    def _accepted(self, now: Logic) -> int:
        """Whether it is accepted as well."""
        return int(self._enters(now) and not self._filling(now))

    def _completes(self, now: Logic) -> int:
        """Whether it would complete a result."""
        return int(now.limits(CIC + "phase") == (0, 0))

    def _ends(self, now: Logic) -> int:
        """Whether the sample after it would."""
        return int(now.limits(CIC + "phase") == (self.entry.factor - 1,) * 2)

    def _filled(self, now: Logic) -> int:
        """Whether R samples less than N R have gone in since the reset."""
        return int(now.limits(CIC + "filled") == (self.entry.stages - 1,) * 2)

    def _gathered(self, now: Logic) -> int:
        """Return the flags of the samples since the last result, with those of the one that goes in."""
        if self.source.flags:
            (before, _), flags = now.limits(CIC + "found"), (now.bit(flag) for flag in self.source.flags)
            return before | sum(flag << place for place, flag in enumerate(flags))
        low, high = now.limits(self.source.code)
        at_rail = low == high and low in {self.port.lowest % (1 << self.port.bits), self.port.highest}
        return self._bit(now, "rail") | at_rail

    def _summed(self, now: Logic, stage: int, what: int) -> int:
        """Of the sample behind a sum: whether there is one, whether it completes a result, and whether that counts."""
        if what == 2 and not self.steady:
            return 1
        if stage:
            return self._bit(now, f"integrator{stage}_control{what}")
        if what == 2:
            return 1 - self._filling(now)
        return self._completes(now) if what else self._enters(now)

    def _combed(self, now: Logic, stage: int, what: int) -> int:
        """Of the sample behind a comb: whether there is one, and whether the result counts."""
        if what and not self.steady:
            return 1
        if stage:
            return self._bit(now, f"comb{stage}_control{what}")
        last = self.entry.stages
        return self._summed(now, last, 2) if what else self._summed(now, last, 0) and self._summed(now, last, 1)

    def _leaves(self, now: Logic) -> int:
        """Whether a result that counts comes to the output."""
        return self._combed(now, self.entry.stages, 0) and self._combed(now, self.entry.stages, 1)


def _leaving(connections: CoreConnections, port: PortEntry) -> Mapping[str, int]:
    return {connections.ready: 1, "m_axis_tvalid": 1, "m_axis_tdata": -(-port.bits // 8) * 8}


@dataclass(frozen=True)
class _Passing:
    """What leaves the core leaves at once."""

    connections: CoreConnections
    port: PortEntry

    @property
    def nets(self) -> Mapping[str, int]:
        """Whether a result is taken, whether there is one, and the result."""
        return _leaving(self.connections, self.port)

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """There is no register."""
        return {}

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """Nor anything to tell apart."""
        return {}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what is on the other side."""
        if name == "m_axis_tdata":
            return now.result(now.net(name), self.port.bits)
        return now.word(SINK if name == self.connections.ready else self.connections.valid)


@dataclass(frozen=True)
class _Holder:
    """What hands out each result, held in the register `word`, `copies` times."""

    connections: CoreConnections
    port: PortEntry
    word: str
    copies: int

    @property
    def nets(self) -> Mapping[str, int]:
        """Whether a result is taken, whether there is one, and the result."""
        return _leaving(self.connections, self.port)

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """A word with its valid bit, and a counter."""
        count = self.copies.bit_length() - 1
        return {
            HOLDER + "o_valid": RegisterShape(1, 0),
            HOLDER + "left": RegisterShape(count, None),
            self.word: RegisterShape(None, None),
        }

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """The counter by whether it is 0."""
        return {HOLDER + "left": ((0, 0), (1, self.copies - 1))}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return a new word where one can be taken, else one copy less where one leaves."""
        valid, left = HOLDER + "o_valid", HOLDER + "left"
        if name == "m_axis_tvalid":
            return now.word(valid)
        if name == "m_axis_tdata":
            above = now.forms.floor(shifted(now.net(name), -self.port.bits))
            return plus(now.forms.unsigned(now.word(self.word), self.port.bits), above, 1 << self.port.bits)
        takes = not now.bit(valid) or (now.bit(SINK) and now.limits(left) == (0, 0))
        if name in self.nets:
            return constant(int(takes))
        if not takes:
            return plus(now.word(left), constant(-1)) if name == left and now.bit(SINK) else now.word(name)
        if name == self.word:  # with the flags above
            return now.result(now.after(name), self.port.bits)
        return constant(self.copies - 1) if name == left else now.word(self.connections.valid)
