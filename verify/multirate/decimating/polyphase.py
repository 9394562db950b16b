"""Proves that multipliers which take turns with the phases of samples give every R-th result of a certificate's filter.

::

    sample --> [line0] --> [line1] --> ..                              moves with each sample
                  |            |
                  +-- chosen by phase, times coefficients of the phase --> sum --> + --> [total] --> result
                                                                                   ^        |
                                                       begins with each result ----+--------+

The line, and what goes along with samples, is what `sosmith.verify.multirate.decimating.line` says: while there is a
sample at position 1, line(k) is the one k samples before. What other registers hold of it at each position follows
from there, for each phase: all of that is computed of registers of the position before, and moves with it. `total`
takes over something when a sample is at the last position, and keeps it otherwise. So what it holds behind each of R
samples in turn is a sum of products of the samples up to that, from the first of them on, for which nothing may count
that was there before; behind the last one it is the result. With a start from zero, what a reset leaves in it must be
what it holds where all samples before were 0, as a reset makes the line. Several channels have lines and totals in
memories (`sosmith.verify.multirate.decimating.channel_line`): what is read of a total is what it held behind the sample
before of the channel. Everything else is as for any core that decimates
(`sosmith.verify.multirate.decimating.results`).
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence, Set

from sosmith.verify.certificate_file import Certificate, ItemEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.multirate.decimating.channel_line import TOTALS, ChannelLine, line_found
from sosmith.verify.multirate.decimating.channels import ChannelEntrance, read_of
from sosmith.verify.multirate.decimating.line import Line
from sosmith.verify.multirate.decimating.results import ResultCheck, decimating_netlist
from sosmith.verify.multirate.logic import Logic, MemoryPart, Part, Signals
from sosmith.verify.multirate.ring.verdict import RingVerdict
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import ONE, Form, constant
from sosmith.verify.reader.recursion import deep_recursion

_TOTAL = "total"


def check_polyphase(text: str, certificate: Certificate, item: ItemEntry) -> RingVerdict:
    """Prove that a core whose multipliers take turns computes every R-th result of the graphs of a certificate.

    Parameters
    ----------
    text : str
        SystemVerilog of the core.
    certificate : Certificate
        Its certificate, which `verify` has accepted, with a downsampling.
    item : ItemEntry
        What it is about.

    Raises
    ------
    RejectedError
        If it computes anything else, or has anything that is not known here.
    """
    netlist = decimating_netlist(text, certificate, item.channels)
    with deep_recursion():
        return _Check(netlist, certificate, item).checked()


class _Check(ResultCheck):
    """The check of a core."""

    def __init__(self, netlist: Netlist, certificate: Certificate, item: ItemEntry) -> None:
        super().__init__(netlist, certificate, item)
        positions = 0
        while f"valid{positions + 1}" in self.netlist.registers:
            positions += 1
        require(positions > 0, "the core must have a register valid1")
        several = isinstance(self.entrance, ChannelEntrance)
        # The total is read for a sample at the position before.
        require(positions > 1 or not several, "a core with several channels must have a register valid2")
        require(_TOTAL in self.netlist.registers, f"the core must have a register {_TOTAL}")
        first = self.netlist.registers[_TOTAL].first
        require(several or first is not None, f"{_TOTAL} must have a value before the first clock")
        length, places = line_found(self.netlist, self.port.bits) if several else (0, ())
        while not several and f"line{length}" in self.netlist.registers:
            length += 1
        require(
            length <= self.remembered + 1, f"the line must hold at most {self.remembered + 1} samples, not {length}"
        )
        self._line: Line | ChannelLine
        if isinstance(self.entrance, ChannelEntrance):
            self._line = ChannelLine(self.entrance, length, places, positions, self.netlist.widths[_TOTAL])
        else:
            self._line = Line(self.entrance, length, positions)

    def fills_for(self, factor: int) -> int:
        """Return how often R of the first sample must go in: until all of the line has it, and a total has begun."""
        return max(1, -(-self.remembered // factor))

    @property
    def parts(self) -> Sequence[Part]:
        """The line."""
        return [self._line]

    @property
    def signals(self) -> Signals:
        """What inputs and registers are made of."""
        return self._line.signals if isinstance(self._line, ChannelLine) else self.entrance.signals

    @property
    def memories(self) -> MemoryPart | None:
        """Those of several channels."""
        return self._line if isinstance(self._line, ChannelLine) else None

    @property
    def fresh(self) -> int:
        """All of them."""
        return self.positions

    @property
    def positions(self) -> int:
        """Those that go along with samples."""
        return self._line.positions

    def comes(self, now: Logic) -> bool:
        """Whether there is a sample at the last position that brings a result."""
        last = self.positions
        return bool(now.bit(f"valid{last}")) and now.limits(f"phase{last}") == (0, 0)

    def coming(self) -> Iterator[tuple[Mapping[str, Form], bool]]:
        """Yield whether there is a sample there, and whether it brings a result."""
        valid, phase = f"valid{self.positions}", f"phase{self.positions}"
        other = self.forms.variable("other phase", 1, (1 << self.netlist.widths[phase]) - 1)
        for there in (0, 1):
            for number, brings in (({}, True), (other, False)):
                yield {valid: constant(there), phase: number}, bool(there) and brings

    def last_position(self, inside: Set[str]) -> Mapping[str, Form]:
        """Follow the samples of a result through all positions, one after the other; return what is at the last."""
        held, beside = _TOTAL, dict[str, Form]()
        if isinstance(self._line, ChannelLine):
            held = read_of(TOTALS)
            beside = {} if self.entrance.fills else {f"fresh{self.positions}": {}}
        else:
            self.check_kept_without(_TOTAL, f"valid{self.positions}")
        before: Mapping[str, Form] = {}
        for phase in (*range(1, self.entrance.factor), 0):
            known = {**self._at_last(inside - {_TOTAL}, phase), **before, **beside}
            if phase == 0:
                self._check_start(before[held], known, inside)
                return known
            before = {held: self._a_sample_later(self._totalled(known))}
        raise AssertionError  # as one phase is 0

    def _totalled(self, known: Mapping[str, Form]) -> Form:
        """Return the total behind a sample at the last position."""
        total = self.after({_TOTAL}, {**known, self.buffer.full: {}}).get(_TOTAL)
        if total is None:
            raise RejectedError(f"{_TOTAL} must follow from the samples of a result alone")
        return total

    def _at_last(self, inside: Set[str], phase: int) -> dict[str, Form]:
        """Return what registers hold of a sample with a phase at the last position."""
        known: dict[str, Form] = {f"line{k}": self.sample(k) for k in range(self._line.length)}
        for position in range(1, self.positions + 1):
            if position > 1:
                known = self.after(inside, {**known, self.buffer.full: {}})
            known |= {f"valid{position}": constant(1), f"phase{position}": constant(phase)}
        return known

    def _a_sample_later(self, form: Form) -> Form:
        """Return what a form of samples is to the next sample, for which each of them is one further back.

        Those that are older than all that the graph remembers have names of their own, and none is that of another.
        """
        names: dict[Hashable, Form] = {}
        samples: dict[Hashable, Form] = {}
        low, high = (int(end) for end in self.forms.limits(self.sample(0)))
        low, high = min(low, 0), max(high, 0)
        for ago in range(self.remembered + self.entrance.factor):
            key, own = ("later", ago), (self.input, ago) if ago <= self.remembered else ("older", ago)
            older = self.forms.variable(("older", ago + 1), low, high)
            names[own] = self.forms.variable(key, low, high)
            samples[key] = self.sample(ago + 1) if ago < self.remembered else older
        # By way of other names, as each sample takes the place of the next one.
        return self.forms.settled(self.forms.settled(form, names), samples)

    def _check_start(self, before: Form, known: Mapping[str, Form], inside: Set[str]) -> None:
        """Check what a start from zero leaves in the total, which the first sample finds there."""
        if self.entrance.fills:
            return
        width, register = self.netlist.widths[_TOTAL], self.netlist.registers[_TOTAL]
        zero = self.forms.settled(before, {(self.input, ago): {} for ago in range(self.remembered + 1)})
        require(not zero.keys() - {ONE}, f"{_TOTAL} must be a number where all samples are 0")
        number = int(zero.get(ONE, 0)) % (1 << width)
        if isinstance(self._line, ChannelLine):
            self._check_first(known, number, width, inside)
            return
        require(register.first == number, f"{_TOTAL} must be {number} before the first clock, not {register.first}")
        right = same_word(self.forms, self.after_reset(_TOTAL), constant(number), width)
        require(right, f"{_TOTAL} must be {number} after a reset, not another value")

    def _check_first(self, known: Mapping[str, Form], number: int, width: int, inside: Set[str]) -> None:
        """Check that the first sample of a channel finds what samples that are 0 would have left, whatever is there.

        So must all registers behind it: what they take over is followed for other samples alone.
        """
        anything, last = self.forms.variable("any total", 0, (1 << width) - 1), f"{self.positions}"
        along = [name for name in self._beside.registers if name.endswith(last) and not name.startswith("fresh")]
        beside = {
            name: self.forms.variable(("beside", name), 0, (1 << self.netlist.widths[name]) - 1) for name in along
        }
        first, later = (
            self.after(inside, {**known, **beside, **own, self.buffer.full: {}})
            for own in ({f"fresh{last}": constant(1), read_of(TOTALS): anything}, {read_of(TOTALS): constant(number)})
        )
        right = _TOTAL in first and same_word(self.forms, first[_TOTAL], later[_TOTAL], width)
        require(right, f"{_TOTAL} must begin with {number} for the first sample of a channel, not with another value")
        for name, word in later.items():
            same = name in first and same_word(self.forms, first[name], word, self.netlist.widths[name])
            require(same, f"{name} must take over for the first sample of a channel what it does for others")

    def checked(self) -> RingVerdict:
        """Check everything; return what is proven."""
        return self.verdict(self._line.length + 1)
