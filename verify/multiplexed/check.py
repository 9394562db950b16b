"""Proves that hardware which sections share, a turn each, computes the graph of a certificate.

::

    position         0        1           2           3           4            5
    sample n       enters   [x of the] [section0] [section1]  [section2]   [result]          no other sample within
                             [start  ] [ states ] [ states ]  [ states ]                      an interval of these

1. Samples move as `sosmith.verify.multiplexed.turns` says: no two are less than an interval of positions apart.
2. A register is loaded at the positions whose valid bits are among its conditions, and keeps what it holds while there
   is a sample at none of them; at position 0 is one that enters, and none that is offered while `rest` counts. All of
   these lie within an interval, so that one sample has passed all of them before the next one comes to the first.
3. So what registers hold of a sample follows position by position, in whatever order they are loaded: what one holds
   counts from the position on at which the sample loads it, up to the one at which the next sample may. A register of a
   DELAY node holds its code as the sample before has left it; that this is what the graph says of the next sample is
   proven when the last position is passed at which it is loaded. A register that chooses whose turn it is, such as a
   counter or a constant, holds at first what it has after a reset, and must hold that again.
4. What leaves the last position is the output of the graph. It goes through the output buffer, a queue of two.

All is said of one sample after any number of others, for every state that these can leave. A register of a DELAY node
is looked for by the name of its stage and its node; under a wrong name a proof is not found. Sections that share
hardware may have different fraction bits: a register then holds a code with those of the longest.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass

from sosmith.verify.certificate_file import Certificate, ItemEntry
from sosmith.verify.graph import require
from sosmith.verify.multiplexed.turns import REST, Turns, turns_of
from sosmith.verify.multirate.followed import Followed
from sosmith.verify.multirate.ring.machine import Machine, State
from sosmith.verify.parallel.check import CLOCK, HardwareVerdict, check_ports
from sosmith.verify.parallel.control import RESET, SOURCE
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.forms import Forms, shifted
from sosmith.verify.parallel.graph_codes import DATA, GraphCodes, fields_of
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.parallel.split import split
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.progress import Progress
from sosmith.verify.reader.recursion import deep_recursion
from sosmith.verify.reader.source import read_modules

_FEW_OPENED = 3
"""Most stages that are opened to say in few words what a register holds; it may stay in many."""

_ENTRY = ".entry"
"""How the name of the net ends that goes into sections which share hardware: there, what stages hand on is found."""


@dataclass(frozen=True)
class MultiplexedVerdict(HardwareVerdict):
    """The result of the check of a core whose sections take turns.

    Attributes
    ----------
    apart : int
        Clocks between samples at the highest rate.
    """

    apart: int

    @property
    def interval(self) -> int:
        """Clocks between samples at the highest rate."""
        return self.apart

    @property
    def progress(self) -> Progress:
        """Within how many clocks samples are taken and results leave, while the sink is ready."""
        return Progress(1 + self.apart, self.latency, 0)


def check_multiplexed(text: str, certificate: Certificate, item: ItemEntry) -> MultiplexedVerdict:
    """Prove that a core whose sections share hardware computes the graphs of a certificate.

    Parameters
    ----------
    text : str
        SystemVerilog of the core.
    certificate : Certificate
        Its certificate, which `verify` has accepted.
    item : ItemEntry
        What it is about.

    Raises
    ------
    RejectedError
        If it computes anything else, or has anything that is not known here.
    """
    plain = item.channels == item.samples == 1 and not item.hold
    require(plain, "sections that take turns must have one channel, and one sample a beat")
    modules = read_modules(text, certificate.name)
    check_ports(modules)
    netlist = flattened(modules, CLOCK)
    require(not netlist.memories, "the core must have no memory")
    for name, register in netlist.registers.items():
        require(register.first is not None, f"{name} must have a value before the first clock")
    with deep_recursion():
        netlist.inlets |= {name for name in netlist.widths if name.endswith(_ENTRY)}
        graph = GraphCodes(certificate, Forms())
        whole = split(netlist, {name for name, _ in _holders(netlist, graph)})
        return _Check(whole, certificate, turns_of(whole)).checked()


def _holders(netlist: Netlist, graph: GraphCodes) -> Iterator[tuple[str, int]]:
    """Yield the register of each DELAY node: of its stage alone, or of one for several.

    Raises
    ------
    RejectedError
        If there is none, or more than one.
    """
    for index in graph.delays:
        alone, node = netlist.holder(graph.state_name(index)), graph.nodes[index]
        named = f"{node.stage}_{node.name}"
        found = [alone] if alone else [name for name in netlist.registers if name.rpartition(".")[2] == named]
        require(len(found) == 1, f"one register must hold {node.label}, not {len(found)}")
        yield found[0], index


class _Check(Followed):
    """The check of a core."""

    def __init__(self, netlist: Netlist, certificate: Certificate, turns: Turns) -> None:
        super().__init__(netlist, certificate, turns.buffer)
        self.machine = Machine(netlist, self.forms, {}, {}, self._handed_on)
        self._turns = turns
        self._states = dict(_holders(netlist, self.graph))
        self._passed: set[str] = set()
        outputs, inside = self.payload(), netlist.registers.keys() - turns.names
        others = sorted(outputs - (inside - self._states.keys()))
        require(not others, f"a result must be made of registers of the output, not of {', '.join(others)}")
        self._inside = inside - outputs
        self._positions = {name: self._loaded_at(name) for name in sorted(self._inside)}
        fields = fields_of(self.graph, certificate, netlist.widths[DATA], ())
        self._sample: Form = {}
        for field in fields:
            self._sample = plus(self._sample, field.word, 1 << field.offset)

    def checked(self) -> MultiplexedVerdict:
        """Check everything; return what is proven."""
        self._check_when_loaded()
        self._check_reset()
        constants = {name for name in self._inside - self._states.keys() if self._is_reset(name)}
        while True:
            known, others = self._followed(constants)
            if not others:
                break
            constants -= others
        first = self.first_of_two(self._inside | self.payload(), known)
        clock = self.machine.clock(State(dict(first)), {}, self.next())
        self.check_output(clock.net, (), {})
        return MultiplexedVerdict(
            registers=len(self.netlist.registers),
            memories=0,
            states=len(self._states),
            latency=len(self._turns.valid),
            waits=0,
            clearing=0,
            apart=self._turns.interval,
        )

    def _handed_on(self, word: Form, width: int, at_inlet: bool) -> Form:
        """Return the variable for what a stage hands on, also times a power of two; any other word as it is."""
        short = self.graph.shortened(word, width, at_inlet)
        values = [value for value in word.values() if isinstance(value, int)]
        if not at_inlet or short is not word or not values or len(values) < len(word):
            return short
        zeros = min((value & -value).bit_length() - 1 for value in values)
        if zeros >= width:
            return word
        code = {monomial: int(value) >> zeros for monomial, value in word.items()}
        shortest = self.graph.shortened(code, width - zeros, at_inlet)
        return word if shortest is code else shifted(shortest, zeros)

    # When registers are loaded.

    def _loaded_at(self, name: str) -> tuple[int, ...]:
        """Return the positions at which a sample may load a register; none of one that is loaded at each clock."""
        conditions = self.conditions(name)
        return tuple(k for k, valid in enumerate(self._turns.valid) if valid in conditions)

    def _check_when_loaded(self) -> None:
        """Check that registers keep what they hold while the pipeline stands, or no sample is where it loads them."""
        full, valid = self.buffer.full, self._turns.valid
        self.check_kept(self._inside, {full: constant(1)}, "while the pipeline stands")
        for positions in sorted(set(self._positions.values()) - {()}):
            interval = self._turns.interval
            names = {name for name, own in self._positions.items() if own == positions}
            within = positions[-1] - positions[0] < interval
            require(within, f"{min(names)} must be loaded within the {interval} clocks between two samples")
            empty: dict[str, Form] = {full: {}, **{valid[k]: {} for k in positions if k}}
            source: dict[str, Form] = {SOURCE: {}} if 0 in positions else {}
            self.check_kept(names, empty, "while there is no sample for it", source)
            for rest in range(1, interval) if source else ():  # one that is offered does not enter
                self.check_kept(names, {**empty, REST: constant(rest)}, "while no sample may enter")

    def _check_reset(self) -> None:
        """Check that states are 0 before the first sample."""
        for name in self._states:
            first = self.netlist.registers[name].first
            require(first == 0 and self._is_reset(name), f"{name} must be 0 before the first clock and after a reset")

    def _is_reset(self, name: str) -> bool:
        """Whether a register holds after a reset what it does before the first clock, and is loaded by samples."""
        first, width = self.netlist.registers[name].first or 0, self.netlist.widths[name]
        return self._positions[name] != () and same_word(self.forms, self.after_reset(name), constant(first), width)

    # What they hold.

    def _followed(self, constants: Set[str]) -> tuple[dict[str, Form], set[str]]:
        """Follow a sample through all positions.

        Returns
        -------
        known : dict of str to Form
            What registers hold while it is at the last one.
        others : set of str
            Those of the `constants` that do not hold again what they have at first.
        """
        after: dict[str, Form] = {}
        known: dict[str, Form] = {}
        others: set[str] = set()
        self._passed.clear()
        for position in range(len(self._turns.valid)):
            known = self._still_known(after, position) | self._begun(constants, position)
            after = self._moved(known, position)
            for name in self._inside:
                if self._positions[name][-1:] == (position,):
                    if name in self._states:
                        after[name] = self._state_left(name, after.get(name))
                    elif name in constants and not self._is_first(name, after.get(name)):
                        others.add(name)
        return known, others

    def _still_known(self, known: Mapping[str, Form], position: int) -> dict[str, Form]:
        """Return what registers hold that the next sample has not loaded yet, or that lasts from the first one on."""
        interval, positions = self._turns.interval, self._positions
        return {
            name: word
            for name, word in known.items()
            if not positions[name] or position <= positions[name][0] + interval or self._lasts(name)
        }

    def _lasts(self, name: str) -> bool:
        """Whether samples load a register once each, and with the same from the first one on."""
        if len(self._positions[name]) != 1 or name not in self._states:
            return False
        node, ago = self.graph.origin(self._states[name])
        return ago == 1 and self.graph.lasts(node)

    def _begun(self, constants: Set[str], position: int) -> dict[str, Form]:
        """Return what the sample before has left in registers which it has passed for good with this position."""
        begun: dict[str, Form] = {}
        for name in (*self._states, *sorted(constants)):
            positions = self._positions[name]
            require(positions != (), f"{name} must be loaded when a sample comes to it")
            if position != max(0, positions[-1] - self._turns.interval + 1):
                continue
            if name in self._states:
                begun[name] = self._aligned(name, self.graph.past(self.graph.origin(self._states[name])))
            else:
                begun[name] = constant(self.netlist.registers[name].first or 0)
        return begun

    def _moved(self, known: Mapping[str, Form], position: int) -> dict[str, Form]:
        """Return what registers hold after a clock with the sample at a position."""
        turns, interval = self._turns, self._turns.interval
        registers: dict[str, Form] = {**known, self.buffer.full: {}}
        for other in range(1, len(turns.valid)):
            if not turns.apart(position, other):
                registers[turns.valid[other]] = constant(int(other == position))
        inputs: dict[str, Form] = {RESET: constant(1)}
        if position == 0:
            inputs |= {SOURCE: constant(1), DATA: self._sample}
        if position < interval:
            registers[REST] = constant(interval - position) if position else {}
        clock = self.machine.clock(State(registers), inputs, self.next())
        after: dict[str, Form] = {}
        for name in sorted(self._inside):
            positions = self._positions[name]
            if positions and position not in positions:
                if name in known:
                    after[name] = known[name]
                continue
            if self.sources(name) & (registers.keys() | inputs.keys()) - {RESET, self.buffer.full}:
                word = clock.register(name)
                if self.is_known(word):
                    after[name] = self._shortened(name, word)
        return after

    def _shortened(self, name: str, word: Form) -> Form:
        """Return what a register holds, in few words: of a DELAY node as what the sample leaves of the next section."""
        width = self.netlist.widths[name]
        word = self.graph.shortened(word, width)
        if name not in self._states or len(word) < 2:
            return word
        left = next((other for other in self._alike(name) if other not in self._passed), name)
        if not self.is_same(word, self._left(left), width, _FEW_OPENED):
            return word
        self._passed.add(left)
        return self._left(left)

    def _state_left(self, name: str, word: Form | None) -> Form:
        """Check what a sample leaves in the register of a DELAY node; return it."""
        wanted = self._left(name)
        right = word is not None and self.is_same(word, wanted, self.netlist.widths[name])
        label = self.graph.nodes[self.graph.origin(self._states[name])[0]].label
        require(right, f"{name} must take over {label}, not another value")
        return wanted

    def _left(self, name: str) -> Form:
        """Return what the register of a DELAY node must hold behind a sample."""
        node, ago = self.graph.origin(self._states[name])
        return self._aligned(name, self.graph.past((node, ago - 1)))

    def _is_first(self, name: str, word: Form | None) -> bool:
        first, width = self.netlist.registers[name].first or 0, self.netlist.widths[name]
        return word is not None and same_word(self.forms, word, constant(first), width)

    def _aligned(self, name: str, code: Form | None) -> Form:
        """Return the code of a DELAY node with the fraction bits of the longest of those that share its hardware."""
        assert code is not None
        fracs = [self.graph.nodes[self._states[other]].entry.frac for other in self._alike(name)]
        return shifted(code, max(fracs) - self.graph.nodes[self._states[name]].entry.frac)

    def _alike(self, name: str) -> list[str]:
        """Return the registers of the same DELAY node of all sections that share hardware."""
        module, node = name.rpartition(".")[0], self.graph.nodes[self._states[name]]
        return [
            other
            for other, index in self._states.items()
            if other.rpartition(".")[0] == module and self.graph.nodes[index].name == node.name
        ]
