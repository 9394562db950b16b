"""What is proven of any core that decimates and takes a sample at each clock: its entrance, and the way of its results.

::

    s_axis --> entrance --> inside, position by position --> result --> limited --> buffer --> m_axis

1. Each register of the entrance, and those that go along with samples, take over what
   `sosmith.verify.multirate.decimating.entrance` says, for all values of all registers and inputs; so do those of the
   inside that have names there.
2. With a steady start, the first sample goes in so often before it is accepted that all that the inside remembers is
   that sample. The results that it has by then are left out, as `left` counts them. With a start from zero, all that is
   remembered is 0 after a reset, and results count from the first one on. Of several channels, each has a first sample
   and a count of its own (`sosmith.verify.multirate.decimating.channels`); a result is followed of any one.
3. From what the inside has at its last position, and the flag there, every register that a result is made of holds what
   is computed of them while the result is at its position, and keeps it while the pipeline stands. The output buffer is
   a queue of two. What leaves is the output of the certificate's graph, with its flags; a result that is held stays
   there until it has been handed out R times (`sosmith.verify.multirate.decimating.held`).

Names of registers count in the first step: under a wrong name a proof is not found. The source must keep a sample on
offer until it is accepted, as AXI4-Stream asks.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Hashable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass

from sosmith.verify.certificate_file import Certificate, ItemEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.multirate.decimating.channels import ChannelBeside, ChannelEntrance, read_of, with_near
from sosmith.verify.multirate.decimating.entrance import READY, Beside, Entrance, Others
from sosmith.verify.multirate.decimating.held import LEAVES, Held, let_out
from sosmith.verify.multirate.followed import Followed
from sosmith.verify.multirate.logic import Logic, MemoryPart, Part, Signals, check_parts
from sosmith.verify.multirate.ring.machine import State
from sosmith.verify.multirate.ring.verdict import RingVerdict
from sosmith.verify.parallel.channels import DEST
from sosmith.verify.parallel.check import CLOCK, OUTPUT_DEST, check_ports
from sosmith.verify.parallel.control import RESET, SINK, Buffer, Search
from sosmith.verify.parallel.graph_codes import DATA
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.parallel.split import split
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.progress import Progress
from sosmith.verify.reader.source import read_modules

_WHOLE = re.compile(
    r"(?:sum|comb|difference|line|phase|channel)\d+|left|phase|filled|total|sample|channel|copies|\w+_memory_read"
)
"""Registers that stay whole, whatever they take over."""

_FULL = "output_buffer.full"
"""The register of the output buffer of several channels that is 1 while it has no room."""

_COUNT_BITS = 64
"""Bits in which counts are compared: more than any has."""

_MOST_POSITIONS = 8
"""Most positions behind the inside."""


@dataclass(frozen=True)
class Case:
    """What is known of a result: `left` with it, and how many samples the graph has counted, if it counts."""

    left: Mapping[str, Form]
    counted: Form | None


def decimating_netlist(text: str, certificate: Certificate, channels: int) -> Netlist:
    """Read the SystemVerilog of a core for so many channels.

    Raises
    ------
    RejectedError
        If it has other ports, or anything that cannot be read.
    """
    modules = read_modules(text, certificate.name)
    check_ports(modules, channels)
    return flattened(modules, CLOCK)


class ResultCheck(Followed, ABC):
    """The check of a core.

    Parameters
    ----------
    netlist : Netlist
    certificate : Certificate
        Its certificate, with a downsampling.
    item : ItemEntry
        What it is about.
    """

    def __init__(self, netlist: Netlist, certificate: Certificate, item: ItemEntry) -> None:
        down = certificate.downsampling
        assert down is not None
        (self.port,) = certificate.inputs
        self._whole = split(netlist, {name for name in netlist.registers if _WHOLE.fullmatch(name)})
        self._copies, self._channels = down.factor if item.hold else 1, item.channels
        self._whole = with_near(self._whole) if self._several else self._whole
        followed, sink = (let_out(self._whole), LEAVES) if self._copies > 1 else (self._whole, SINK)
        self._search = Search(followed)
        full = _FULL if self._several else None
        require(full is None or full in followed.registers, f"a core with several channels must have a register {full}")
        super().__init__(followed, certificate, _buffer_found(self._search, sink, full), self._channels)
        (self.input,) = self.graph.lanes[0].inputs
        self._counter: int | None = None
        self.remembered = self._memory()
        width, bits = self.netlist.widths[DATA], -(-self.port.bits // 8) * 8
        require(width == bits, f"the port {DATA} must have {bits} bits, not {width}")
        require(down.factor > 1, f"a filter that decimates must leave results out, not {down.factor} of each")
        counted = 0 if self._counter is None else self.graph.nodes[self._counter].entry.high
        require(not (down.filled and counted), "no result must be settling where the first sample fills the filter")
        fills = self.fills_for(down.factor) if down.filled else 0
        self.left = fills or -(-counted // down.factor)
        self.entrance: Entrance | ChannelEntrance = Entrance(self.port, down.factor, fills, self.buffer.full)
        if self._several:
            settling, dest = self.left * (not fills), self.netlist.widths[DEST]
            whole = -(-(self._channels - 1).bit_length() // 8) * 8
            for port in (DEST, OUTPUT_DEST):
                require(self.netlist.widths[port] == whole, f"the port {port} must have {whole} bits")
            self.entrance = ChannelEntrance(
                self.port, down.factor, fills, self.buffer.full, self._channels, settling, dest
            )

    @property
    def _several(self) -> bool:
        """Whether there are several channels."""
        return self._channels > 1

    # What the inside is.

    @abstractmethod
    def fills_for(self, factor: int) -> int:
        """Return how often so many of the first sample must go in until nothing else is remembered."""

    @property
    @abstractmethod
    def parts(self) -> Sequence[Part]:
        """Parts of the hardware inside."""

    @property
    def signals(self) -> Signals:
        """What inputs and registers are made of."""
        return self.entrance.signals

    @property
    def memories(self) -> MemoryPart | None:
        """That of the parts inside that has memories."""
        return None

    @property
    @abstractmethod
    def positions(self) -> int:
        """Positions of a sample before the register of its result, but for the one in front of several channels."""

    @property
    @abstractmethod
    def fresh(self) -> int:
        """At how many positions it counts whether a sample of several channels is the first one of its own."""

    @abstractmethod
    def comes(self, now: Logic) -> bool:
        """Whether a result leaves the last position."""

    @abstractmethod
    def coming(self) -> Iterable[tuple[Mapping[str, Form], bool]]:
        """Yield what control registers at the last position may hold, and whether a result leaves it then."""

    @abstractmethod
    def last_position(self, inside: Set[str]) -> Mapping[str, Form]:
        """Return what registers hold while a result is at the last position."""

    # Samples.

    def sample(self, ago: int) -> Form:
        """Return the code of the sample so many before the one of the result."""
        code = self.graph.past((self.input, ago)) if ago else self.graph.codes[self.input]
        assert code is not None
        return code

    def _memory(self) -> int:
        """Return how many samples the graph remembers; find the node that counts those since a start, if one does."""
        remembered = 0
        for index in self.graph.delays:
            node, ago = self.graph.origin(index)
            if node == self.input:
                remembered = max(remembered, ago)
            else:
                require(self._counter is None and ago == 1, "the graph must remember samples alone, and their number")
                self._counter = index
        return remembered

    # All of it.

    def check(self) -> int:
        """Check everything; return the clocks from the edge that accepts a sample to the one that gives its result."""
        held = [Held(self._copies, self.buffer.valid)] if self._copies > 1 else []
        parts: list[Part] = [self.entrance, self._beside, *held, *self.parts]
        named = dict.fromkeys(name for part in parts for name in part.registers)
        for name in named:
            register = self.netlist.registers.get(name)
            if register is None:
                raise RejectedError(f"the core must have a register {name}")
            known = register.first is not None or name in {read_of(memory) for memory in self.netlist.memories}
            require(known, f"{name} must have a value before the first clock")
        valid = self._positions_of_results()
        others = self.netlist.registers.keys() - named.keys()
        check_parts(self._whole, [*parts, Others(frozenset(others))], self.signals, self.memories)
        inside = others - {self.buffer.valid, self.buffer.full, *valid}
        for case in self._cases():
            self._check_result(case, valid, inside)
        return self._several + self.positions + len(valid) + 1

    @property
    def _beside(self) -> Part:
        """What goes along with samples."""
        if isinstance(self.entrance, ChannelEntrance):
            return ChannelBeside(self.entrance, self.positions, self.fresh)
        return Beside(self.entrance, self.positions, self.left, self.comes)

    def verdict(self, states: int) -> RingVerdict:
        """Check everything; return what is proven, of a core with so many states."""
        latency, factor = self.check(), self.entrance.factor
        filled = self.entrance.fills * factor
        cleared, waits = (self._channels, 2 * filled) if self._several else (filled, 0)
        # Results that may all have to leave before one: of one channel, that in the output buffer; of several, one at
        # each position, as many as there are clocks on the way.
        ahead = latency if self._several else 1
        stands = self._copies + (self._copies - 1) * ahead
        return RingVerdict(
            registers=len(self.netlist.registers),
            memories=len(self.netlist.memories),
            states=states,
            latency=latency + waits,
            waits=int(self._several),
            clearing=cleared,
            result_clocks=factor,
            factor=factor,
            pace=Progress(1 + waits + self._several + stands, latency + waits + stands - 1 + self._several, cleared),
        )

    def _positions_of_results(self) -> list[str]:
        """Return the registers that say whether there is a result behind the inside, one for each position.

        Each follows the one before, and the first of them the inside; the last one is what comes to the output buffer.
        """
        search, full = self._search, self.buffer.full
        chain = [self.buffer.coming]
        inner = {name for case, _ in self.coming() for name in case}
        counted = self._that_counts
        while len(chain) < _MOST_POSITIONS:
            before = search.one_register(search.loaded(chain[0], {RESET: 1, full: 0, chain[0]: 0, **counted}))
            if before is None or before in inner:
                break
            chain.insert(0, before)
        search.check_chain(chain, full)
        search.expect_empty(chain[0])
        self._check_first_position(chain[0])
        return chain

    def _check_first_position(self, first: str) -> None:
        """Check that the first position behind the inside takes over all results that count, and nothing else.

        With a start from zero, all of them do, whatever is left of those that are flagged.
        """
        full = self.buffer.full
        self.check_kept({first}, {full: constant(1)}, "while the pipeline stands")
        for count, counts in self._counting():
            for inside, comes in self.coming():
                word = self.after({first}, {**inside, **count, full: {}}).get(first)
                right = word is not None and self.is_same(word, constant(int(comes and counts)), 1)
                require(right, f"{first} must be 1 behind a result that counts, and 0 otherwise")

    @property
    def _that_counts(self) -> Mapping[str, int]:
        """What control registers hold with a result that counts, where the first ones do not."""
        if not self.entrance.fills:
            return {}
        return {f"counts{self.positions}": 1} if self._several else {"left": 0}

    def _counting(self) -> list[tuple[Mapping[str, Form], bool]]:
        """Return what may be known of whether a result counts, and whether it does."""
        skips, top = self.entrance.fills > 0, (1 << self.left.bit_length()) - 1
        if self._several:
            name = f"counts{self.positions}"
            return [({name: constant(counts)}, bool(counts)) for counts in (0, 1)] if skips else [({}, True)]
        if not self.left:
            return [({}, True)]
        return [({"left": {}}, True), ({"left": self.forms.variable("some left", 1, top)}, not skips)]

    def _cases(self) -> list[Case]:
        """Return what is known of a result that counts: that it has settled, or that it has not."""
        settled: Mapping[str, Form] = {"left": {}} if self.left else {}
        not_settled: Mapping[str, Form] = {}
        if self._several:
            settled = {f"settling{self.positions}": {}} if self.left and not self.entrance.fills else {}
            not_settled = dict.fromkeys(settled, constant(1))
        if self._counter is None:
            return [Case(settled, None)]
        most = self._counted()
        not_settled = not_settled or {"left": self.forms.variable("left", 1, self.left)}
        return [Case(settled, constant(most)), Case(not_settled, self.forms.variable("counted", 0, most - 1))]

    def _counted(self) -> int:
        """Return how many samples the graph counts, one by one, and flags while it does.

        Of any other way to count them, the samples that are flagged are not told from what is counted.
        """
        assert self._counter is not None
        node, origin = self.graph.nodes[self._counter], self.graph.origin(self._counter)
        (operand,), settling = node.operands, self.graph.lanes[0].settling
        most, counted = node.entry.high, self.forms.variable("counted", 0, node.entry.high - 1)
        right = most > 0 and settling is not None
        for before, after, flagged in ((counted, plus(counted, constant(1)), 1), (constant(most), constant(most), 0)):
            codes = [self.graph.codes[index] for index in (operand, settling) if index is not None]
            counts, flag = (self.forms.settled(code, {origin: before}) for code in codes) if right else ({}, {})
            flag = self.forms.negative(flag)
            right = right and self.is_same(counts, after, _COUNT_BITS) and self.is_same(flag, constant(flagged), 1)
        require(right, f"{node.label} must count samples one by one, up to as many as are flagged")
        return most

    # A result.

    def _check_result(self, case: Case, valid: Sequence[str], registers: Set[str]) -> None:
        """Follow a result from the last position of the inside to the output."""
        full = self.buffer.full
        rail = self.forms.variable("rail", 0, 1)
        inside = registers - self.payload()
        self.check_kept(inside, {full: constant(1)}, "while the pipeline stands")
        known = {**self.last_position(inside), f"rail{self.positions}": rail, **case.left}
        known |= {f"channel{self.positions}": self.channel} if self._several else {}
        for name in valid:
            known = self.after(inside, {**known, full: {}}) | {name: constant(1)}
        first = self.first_of_two(registers, known)
        clock = self.machine.clock(State(dict(first)), {}, self.next())
        counted: dict[Hashable, Form] = {}
        if self._counter is not None and case.counted is not None:
            counted[self.graph.origin(self._counter)] = case.counted
        self.check_output(clock.net, (rail,), counted)
        if self._several:
            right = self.is_same(clock.net(OUTPUT_DEST), self.channel, self.netlist.widths[OUTPUT_DEST])
            require(right, f"{OUTPUT_DEST} must be the channel of the sample, not another value")

    def check_kept_without(self, name: str, valid: str) -> None:
        """Check that a register keeps what it holds while no sample is at its position."""
        self.check_kept({name}, {self.buffer.full: {}, valid: {}}, "while no sample comes to it")


def _buffer_found(search: Search, sink: str, full: str | None) -> Buffer:
    """Find the control of the output buffer, and check that it is a queue of two, which a result leaves with `sink`.

    `full` is its register that is 1 while it has no room, if it is known by name.
    """
    valid = search.register(search.net("m_axis_tvalid", {}), "m_axis_tvalid")
    if full is None:
        full = search.register(search.inverted(search.net(READY, {"filling": 0})), f"not {READY}")
    comes = search.loaded(valid, {RESET: 1, full: 0, valid: 0})
    buffer = Buffer(valid, full, search.register(comes, f"what {valid} takes over"), sink)
    search.check_buffer(buffer)
    return buffer
