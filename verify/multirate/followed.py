"""A core whose registers are followed clock by clock, and the way of a result through its output buffer.

What registers hold of a sample at one clock follows from what they held a clock before. That they keep it while nothing
moves, and what they hold of a result behind the output buffer, is asked here of any core; where samples are, and when
they move, is said by those who follow them.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence, Set

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import require
from sosmith.verify.multirate.ring.machine import UNKNOWN, Machine, State
from sosmith.verify.parallel.check import FLAGS, OUTPUT
from sosmith.verify.parallel.control import RESET, Buffer
from sosmith.verify.parallel.dependence import Dependence
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.flags import flags_of, wear_limits
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.graph_codes import GraphCodes
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant

_FLAG_BITS = 8

_MOST_OPENED = 8
"""Most stages of the graph that are opened, one after the other, for one comparison."""


class Followed:
    """What can be asked of a core while its registers are followed.

    Parameters
    ----------
    netlist : Netlist
    certificate : Certificate
    buffer : Buffer
        Its output buffer.
    channels : int
        Number of channels, of which a result is followed of any one.

    Attributes
    ----------
    netlist, certificate, buffer
        As given.
    forms : Forms
    graph : GraphCodes
        What it must compute.
    machine : Machine
    channel : Form
        The channel of the result; 0 if there is only one.
    """

    def __init__(self, netlist: Netlist, certificate: Certificate, buffer: Buffer, channels: int = 1) -> None:
        self.netlist, self.certificate, self.buffer = netlist, certificate, buffer
        self.forms = Forms()
        self.graph = GraphCodes(certificate, self.forms)
        self.channel = self.forms.variable("channel", 0, channels - 1) if channels > 1 else {}
        self.machine = Machine(netlist, self.forms, {}, self.channel)
        self._limits = wear_limits(self, netlist, certificate, "")
        self._dependence = Dependence(netlist, frozenset())
        self._number = 0

    def constant_word(self, name: str) -> Form:
        """Return the word of a memory that never changes."""
        return self.forms.variable(("constant", name), 0, (1 << self.netlist.memories[name].width) - 1)

    def first_of_two(self, registers: Set[str], known: Mapping[str, Form]) -> dict[str, Form]:
        """Return what registers hold of the result that leaves the output buffer next, whichever way it came there."""
        valid, full, ready = self.buffer.valid, self.buffer.full, self.buffer.ready
        heads = self.payload()
        require(heads <= registers, f"a result must be made of registers of the output, not of {sorted(heads)}")
        comes: dict[str, Form] = {**known, full: {}, self.buffer.coming: constant(1)}
        at_once = [
            self.after(heads, comes | {valid: constant(there)}, {ready: constant(leaves)})
            for there, leaves in ((0, 0), (0, 1), (1, 1))
        ]
        for name in sorted(heads):
            same = all(name in each and each[name] == at_once[0][name] for each in at_once)
            require(same, f"{name} must take over a result whenever there is room for it")
        waits: dict[str, Form] = {ready: {}}
        seconds = self.after(registers - heads, comes | {valid: constant(1)}, waits)
        moved = self.after(heads, seconds | {valid: constant(1), full: constant(1)}, {ready: constant(1)})
        for name in sorted(heads):
            same = name in moved and self.is_same(moved[name], at_once[0][name], self.netlist.widths[name])
            require(same, f"{name} must take over the second result when the first leaves")
        for number in (0, 1):
            waiting = {valid: constant(1), full: constant(number)}
            self.check_kept(heads, waiting, "while a result waits for the sink", waits)
        second = {name for head in heads for name in self.sources(head)}
        both = {valid: constant(1), full: constant(1)}
        self.check_kept(second & seconds.keys(), both, "while two results wait for the sink", waits)
        return {name: at_once[0][name] for name in heads}

    def payload(self) -> Set[str]:
        """Return the registers that a result is made of at the output."""
        return {name for port in (OUTPUT, FLAGS) for name in self._dependence.of_net(port)}

    def sources(self, name: str) -> frozenset[str]:
        """Return the registers and inputs that a register takes over something of."""
        statements = self.netlist.registers[name].statements
        return self._dependence.of_loads(statements) | self._dependence.of_conditions(statements)

    def after(
        self, names: Set[str], registers: Mapping[str, Form], inputs: Mapping[str, Form] | None = None
    ) -> dict[str, Form]:
        """Return what registers hold after a clock, of those where it follows from what is known."""
        clock = self.machine.clock(State(dict(registers)), {RESET: constant(1), **(inputs or {})}, self.next())
        sources = {name: self.sources(name) for name in names}
        near = {name for name, own in sources.items() if own & registers.keys() or not own}
        words = {name: clock.register(name) for name in sorted(near)}
        return {name: word for name, word in words.items() if self.is_known(word)}

    def after_reset(self, name: str) -> Form:
        """Return what a register holds after a reset."""
        return self.machine.clock(State(), {RESET: {}}, self.next()).register(name)

    def check_kept(
        self,
        names: Set[str],
        registers: Mapping[str, Form],
        when: str,
        inputs: Mapping[str, Form] | None = None,
    ) -> None:
        """Check that registers keep what they hold."""
        own = {name: self.forms.variable(("kept", name), 0, (1 << self.netlist.widths[name]) - 1) for name in names}
        clock = self.machine.clock(State({**own, **registers}), {RESET: constant(1), **(inputs or {})}, self.next())
        for name in sorted(names):
            right = self.is_same(clock.register(name), own[name], self.netlist.widths[name])
            require(right, f"{name} must keep what it holds {when}")

    def is_same(self, word: Form, wanted: Form, width: int, most: int = _MOST_OPENED) -> bool:
        """Whether two words are the same, if need be by opening what stages of the graph hand on, at most so many."""
        pair: tuple[Form, Form] | None = word, wanted
        for _ in range(most):
            if pair is None or same_word(self.forms, *pair, width):
                break
            pair = self.graph.opened(*pair)
        else:
            return False
        return pair is not None

    def check_output(
        self, net: Callable[..., Form], input_flags: Sequence[Form], counted: Mapping[Hashable, Form]
    ) -> None:
        """Check the code and the flags of a result.

        Parameters
        ----------
        net : callable
            Returns what a net has with the result.
        input_flags : sequence of Form
            Flags of the inputs that come with a sample, in place of what the ports say.
        counted : mapping of Hashable to Form
            What is known of numbers that the graph counts.
        """
        graph, lane = self.graph, self.graph.lanes[0]
        whole = -(-self.certificate.output.bits // 8) * 8
        for name, width in ((OUTPUT, whole), (FLAGS, _FLAG_BITS)):
            require(self.netlist.widths[name] == width, f"the port {name} must have {width} bits")
        code, label = graph.seen(lane.output, ""), graph.nodes[lane.output].label
        require(self.is_same(net(OUTPUT), code, whole), f"{OUTPUT} must be {label}, not another value")
        for flag in flags_of(graph, lane, self.certificate, input_flags, self._limits):
            value = self.forms.settled(flag.value, counted) if counted else flag.value
            what = flag.name or "0, as there is no such flag"
            right = self.is_same(net(FLAGS, flag.place, 1), value, 1)
            require(right, f"bit {flag.place} of {FLAGS} must be {what}, not another value")

    def dependent(self, name: str) -> frozenset[str]:
        """Return the registers and inputs that a net depends on within a clock."""
        return self._dependence.of_net(name)

    def conditions(self, name: str) -> frozenset[str]:
        """Return the registers and inputs that it depends on whether a register loads anything."""
        return self._dependence.of_conditions(self.netlist.registers[name].statements)

    def is_known(self, word: Form) -> bool:
        """Whether a word follows from what is known."""
        return not any(isinstance(key, tuple) and key[0] == UNKNOWN for key in self.forms.keys(word))

    def next(self) -> int:
        """Return a number of its own for a clock."""
        self._number += 1
        return self._number
