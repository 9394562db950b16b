"""Proves that integrators and combs give every R-th result of a certificate's FIR filter, which is a CIC filter.

::

    s_axis --> [sum1] --> .. --> [sumN] --> [difference1] --> .. --> [differenceN] --> rounded, limited --> m_axis

1. Each register of integrators and combs takes over what `sosmith.verify.multirate.adders.ladder` says, for all values
   of all registers and inputs. N combs behind N integrators are N moving sums, modulo ``2**width``, once each comb
   holds a result: what the sums held before does not count, as each comb takes away a power of the polynomial that
   comes of it. So the last difference is the sum of the samples times the taps of N moving sums, as that fits so many
   bits.
2. With a steady start, the first sample goes in N R times before it is accepted. The N results that it has by then, in
   which the sums still have what they held before, are left out, as `left` counts them. With a start from zero all sums
   are 0 after a reset, as if all samples before had been, and results count from the first one on.
3. Behind the last difference, and the flag that comes with it, every register that a result is made of holds what is
   computed of them while the result is at its position, and keeps it while the pipeline stands. The output buffer is a
   queue of two. What leaves is the output of the certificate's graph for that sum of samples, with its flags.

Names of registers count in the first step: under a wrong name a proof is not found. The source must keep a sample on
offer until it is accepted, as AXI4-Stream asks.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from sosmith.verify.certificate_file import Certificate, ItemEntry
from sosmith.verify.graph import require
from sosmith.verify.multirate.adders.ladder import READY, Ladder
from sosmith.verify.multirate.logic import Logic, Ranges, RegisterShape, check_parts
from sosmith.verify.multirate.ring.machine import UNKNOWN, Machine, State
from sosmith.verify.multirate.ring.verdict import RingVerdict
from sosmith.verify.parallel.check import CLOCK, FLAGS, OUTPUT
from sosmith.verify.parallel.control import RESET, SINK, Buffer, Search
from sosmith.verify.parallel.dependence import Dependence
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.flags import flags_of, wear_limits
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.graph_codes import GraphCodes
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.parallel.split import split
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.progress import Progress
from sosmith.verify.reader.recursion import deep_recursion
from sosmith.verify.reader.source import read_source

_FLAG_BITS = 8
_IN_LADDER = re.compile(r"(?:sum|comb|difference)\d+|left|phase|filled")
"""Registers that stay whole, whatever they take over."""

_MOST_OPENED = 4
"""Most stages of the graph that are opened, one after the other, for one comparison."""

_MOST_POSITIONS = 8
"""Most positions behind the last difference."""


@dataclass(frozen=True)
class CicVerdict(RingVerdict):
    """The result of the check of a core with integrators and combs.

    Attributes
    ----------
    adder_bits, register_bits : int
        Bits of their sums, and of what they hold.
    """

    adder_bits: int
    register_bits: int


def check_cic(text: str, certificate: Certificate, item: ItemEntry) -> CicVerdict:
    """Prove that a core with integrators and combs computes every R-th result of the graphs of a certificate.

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
    require(item.channels == 1 and not item.hold, "a CIC filter of adders must have one channel, and hold no results")
    modules = read_source(text, certificate.name).modules
    with deep_recursion():
        return _Check(flattened(modules, CLOCK), certificate).checked()


class _Check:
    """The check of a core."""

    def __init__(self, netlist: Netlist, certificate: Certificate) -> None:
        self._certificate = certificate
        self._netlist = split(netlist, {name for name in netlist.registers if _IN_LADDER.fullmatch(name)})
        self.forms = Forms()
        self._graph, (self._port,) = GraphCodes(certificate, self.forms), certificate.inputs
        (self._input,) = self._graph.lanes[0].inputs
        self._counter: int | None = None
        self._remembered = self._memory()
        self._search = Search(self._netlist)
        self._buffer = self._find_buffer()
        self._ladder = self._find_ladder()
        self._machine = Machine(self._netlist, self.forms, {}, {})
        self._limits = wear_limits(self, self._netlist, certificate, "")
        self._number = 0

    def constant_word(self, name: str) -> Form:
        """Return the word of a memory that never changes."""
        return self.forms.variable(("constant", name), 0, (1 << self._netlist.memories[name].width) - 1)

    # What there is.

    def _memory(self) -> int:
        """Return how many samples the graph remembers; find the node that counts those since a start, if one does."""
        remembered = 0
        for index in self._graph.delays:
            node, ago = self._graph.origin(index)
            if node == self._input:
                remembered = max(remembered, ago)
            else:
                require(self._counter is None and ago == 1, "the graph must remember samples alone, and their number")
                self._counter = index
        return remembered

    def _find_buffer(self) -> Buffer:
        """Find the control of the output buffer, and check that it is a queue of two."""
        search = self._search
        valid = search.register(search.net("m_axis_tvalid", {}), "m_axis_tvalid")
        ready = search.inverted(search.net(READY, {"filling": 0}))
        full = search.register(ready, f"not {READY}")
        comes = search.loaded(valid, {RESET: 1, full: 0, valid: 0})
        buffer = Buffer(valid, full, search.register(comes, f"what {valid} takes over"), SINK)
        search.check_buffer(buffer)
        return buffer

    def _find_ladder(self) -> Ladder:
        """Return the integrators and combs that there must be, by what the graph remembers."""
        down = self._certificate.downsampling
        assert down is not None
        factor = down.factor
        order, rest = divmod(self._remembered, factor - 1) if factor > 1 else (0, 1)
        require(
            order > 0 and not rest,
            f"a CIC filter must remember a multiple of {factor - 1} samples, not {self._remembered}",
        )
        width = self._netlist.widths.get("sum1", 0)
        most = factor**order
        low, high = (-(1 << width - 1), (1 << width - 1) - 1) if self._port.signed and width else (0, (1 << width) - 1)
        fits = low <= self._port.lowest * most and self._port.highest * most <= high
        require(fits, f"sum1 must have bits for {most} times the range of the input, not {width} bits")
        counted = 0 if self._counter is None else self._graph.nodes[self._counter].entry.high
        require(not (down.filled and counted), "no result must be settling where the first sample fills the filter")
        left = order if down.filled else -(-counted // factor)
        return Ladder(self._port, factor, order, width, down.filled > 0, left, self._buffer.full)

    # All of it.

    def checked(self) -> CicVerdict:
        """Check everything; return what is proven."""
        ladder = self._ladder
        for name in ladder.registers:
            require(name in self._netlist.registers, f"the core must have a register {name}")
        control = {self._buffer.valid, self._buffer.full}
        valid = self._positions()
        others = self._netlist.registers.keys() - ladder.registers.keys() - control
        check_parts(self._netlist, [ladder, _Others(others | control)], ladder.signals)
        for case in self._cases():
            self._check_result(case, valid, others - {*valid})
        factor, order = ladder.factor, ladder.order
        latency = 2 * order + len(valid) + 1
        cleared = order * factor if ladder.filled else 0
        return CicVerdict(
            registers=len(self._netlist.registers),
            memories=len(self._netlist.memories),
            states=2 * order,
            latency=latency,
            waits=0,
            clearing=cleared,
            result_clocks=factor,
            factor=factor,
            pace=Progress(2, latency, cleared),
            adder_bits=2 * order * ladder.width,
            register_bits=3 * order * ladder.width,
        )

    def _positions(self) -> list[str]:
        """Return the registers that say whether there is a result behind the last difference, one for each position.

        Each follows the one before, and the first of them the last difference; the last one is what comes to the output
        buffer.
        """
        search, full, moved = self._search, self._buffer.full, self._ladder.moved
        chain = [self._buffer.coming]
        while len(chain) < _MOST_POSITIONS:
            before = search.one_register(search.loaded(chain[0], {RESET: 1, full: 0, chain[0]: 0, "left": 0}))
            if before in {None, moved}:
                break
            assert before is not None
            chain.insert(0, before)
        search.check_chain(chain, full)
        first = chain[0]
        search.expect_empty(first)
        skipped = self._ladder.left if self._ladder.filled else 0
        for left in range(1 << skipped.bit_length()):
            for comes in (0, 1):
                for own in (0, 1):
                    case = {RESET: 1, first: own, moved: comes, "left": left}
                    search.expect(first, case | {full: 1}, own)
                    search.expect(first, case | {full: 0}, int(comes and not left))
        return chain

    def _cases(self) -> list[_Case]:
        """Return what is known of a result that counts: that it has settled, or that it has not."""
        ladder = self._ladder
        left: Mapping[str, Form] = {"left": {}} if ladder.left else {}
        if self._counter is None:
            return [_Case(left, None)]
        most = self._graph.nodes[self._counter].entry.high
        some = self.forms.variable("left", 1, ladder.left)
        return [_Case(left, constant(most)), _Case({"left": some}, self.forms.variable("counted", 0, most - 1))]

    # A result.

    def _check_result(self, case: _Case, valid: Sequence[str], registers: set[str]) -> None:
        """Follow a result from the last difference to the output."""
        ladder, full = self._ladder, self._buffer.full
        rail = self.forms.variable("rail", 0, 1)
        known: dict[str, Form] = {ladder.last: self._sum(), ladder.rail: rail, ladder.moved: constant(1), **case.left}
        inside = registers - self._payload()
        self._check_kept(inside, {full: constant(1)}, "while the pipeline stands")
        for name in valid:
            known = self._after(inside, known | {full: {}}) | {name: constant(1)}
        first = self._first_of_two(registers, known)
        clock = self._machine.clock(State(dict(first)), {}, self._next())
        self._check_output(clock.net, case, rail)

    def _sum(self) -> Form:
        """Return the samples times the taps of as many moving sums."""
        taps = [1]
        for _ in range(self._ladder.order):
            ends = [0] * (self._ladder.factor - 1)
            padded = [*ends, *taps, *ends]
            taps = [sum(padded[k : k + self._ladder.factor]) for k in range(len(padded) - len(ends))]
        total: Form = {}
        for ago, tap in enumerate(taps):
            code = self._graph.past((self._input, ago)) if ago else self._graph.codes[self._input]
            assert code is not None
            total = plus(total, code, tap)
        return total

    def _first_of_two(self, registers: set[str], known: Mapping[str, Form]) -> dict[str, Form]:
        """Return what registers hold of the result that leaves the output buffer next, whichever way it came there."""
        valid, full, ready = self._buffer.valid, self._buffer.full, self._buffer.ready
        heads = self._payload()
        require(heads <= registers, f"a result must be made of registers of the output, not of {sorted(heads)}")
        comes: dict[str, Form] = {**known, full: {}, self._buffer.coming: constant(1)}
        at_once = [
            self._after(heads, comes | {valid: constant(there)}, {ready: constant(leaves)})
            for there, leaves in ((0, 0), (0, 1), (1, 1))
        ]
        for name in sorted(heads):
            same = all(name in each and each[name] == at_once[0][name] for each in at_once)
            require(same, f"{name} must take over a result whenever there is room for it")
        waits: dict[str, Form] = {ready: {}}
        seconds = self._after(registers - heads, comes | {valid: constant(1)}, waits)
        moved = self._after(heads, seconds | {valid: constant(1), full: constant(1)}, {ready: constant(1)})
        for name in sorted(heads):
            same = name in moved and self._is(moved[name], at_once[0][name], self._netlist.widths[name])
            require(same, f"{name} must take over the second result when the first leaves")
        for number in (0, 1):
            waiting = {valid: constant(1), full: constant(number)}
            self._check_kept(heads, waiting, "while a result waits for the sink", waits)
        dependence = Dependence(self._netlist, frozenset())
        second = {name for head in heads for name in dependence.of_loads(self._netlist.registers[head].statements)}
        both = {valid: constant(1), full: constant(1)}
        self._check_kept(second & seconds.keys(), both, "while two results wait for the sink", waits)
        return {name: at_once[0][name] for name in heads}

    def _payload(self) -> set[str]:
        """Return the registers that a result is made of at the output."""
        dependence = Dependence(self._netlist, frozenset())
        return {name for port in (OUTPUT, FLAGS) for name in dependence.of_net(port)}

    def _after(
        self, names: set[str], registers: Mapping[str, Form], inputs: Mapping[str, Form] | None = None
    ) -> dict[str, Form]:
        """Return what registers hold after a clock, of those where it follows from what is known."""
        clock = self._machine.clock(State(dict(registers)), {RESET: constant(1), **(inputs or {})}, self._next())
        words = {name: clock.register(name) for name in sorted(names)}
        return {name: word for name, word in words.items() if self._is_known(word)}

    def _check_kept(
        self,
        names: set[str],
        registers: Mapping[str, Form],
        when: str,
        inputs: Mapping[str, Form] | None = None,
    ) -> None:
        """Check that registers keep what they hold."""
        own = {name: self.forms.variable(("kept", name), 0, (1 << self._netlist.widths[name]) - 1) for name in names}
        clock = self._machine.clock(State({**own, **registers}), {RESET: constant(1), **(inputs or {})}, self._next())
        for name in sorted(names):
            right = self._is(clock.register(name), own[name], self._netlist.widths[name])
            require(right, f"{name} must keep what it holds {when}")

    def _check_output(self, net: Callable[..., Form], case: _Case, rail: Form) -> None:
        """Check the code and the flags of a result."""
        graph, lane = self._graph, self._graph.lanes[0]
        whole = -(-self._certificate.output.bits // 8) * 8
        for name, width in ((OUTPUT, whole), (FLAGS, _FLAG_BITS)):
            require(self._netlist.widths[name] == width, f"the port {name} must have {width} bits")
        code, label = graph.seen(lane.output, ""), graph.nodes[lane.output].label
        require(self._is(net(OUTPUT), code, whole), f"{OUTPUT} must be {label}, not another value")
        for flag in flags_of(graph, lane, self._certificate, (rail,), self._limits):
            value = flag.value
            if self._counter is not None and case.counted is not None:
                value = self.forms.settled(value, {graph.origin(self._counter): case.counted})
            what = flag.name or "0, as there is no such flag"
            right = self._is(net(FLAGS, flag.place, 1), value, 1)
            require(right, f"bit {flag.place} of {FLAGS} must be {what}, not another value")

    def _is(self, word: Form, wanted: Form, width: int) -> bool:
        """Whether two words are the same, if need be by opening what stages of the graph hand on."""
        pair: tuple[Form, Form] | None = word, wanted
        for _ in range(_MOST_OPENED):
            if pair is None or same_word(self.forms, *pair, width):
                break
            pair = self._graph.opened(*pair)
        else:
            return False
        return pair is not None

    def _is_known(self, word: Form) -> bool:
        return not any(isinstance(key, tuple) and key[0] == UNKNOWN for key in self.forms.keys(word))

    def _next(self) -> int:
        """Return a number of its own for a clock."""
        self._number += 1
        return self._number


@dataclass(frozen=True)
class _Case:
    """What is known of a result: `left` with it, and how many samples the graph has counted, if it counts."""

    left: Mapping[str, Form]
    counted: Form | None


@dataclass(frozen=True)
class _Others:
    """Registers of which it is checked elsewhere what they hold."""

    names: set[str]

    @property
    def nets(self) -> Mapping[str, int]:
        """None."""
        return {}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """All of them, in any form."""
        return dict.fromkeys(sorted(self.names), RegisterShape(None, None))

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """None."""
        return {}

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what it takes over."""
        return now.after(name)
