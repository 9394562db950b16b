"""Proves that a core which keeps its samples in rings computes every N-th result of a certificate's graphs, or all.

The graphs are those of an FIR filter: all that they remember is samples, and how many there were since the start. The
core is read from its SystemVerilog, and its clocks are followed one by one (`sosmith.verify.multirate.ring.machine`)::

    reset --> the ring is filled --> waits for a sample --> takes it --> sums its products --> gives the result --+
                                       ^     ^                 | brings none                                      |
                                       |     +-----------------+                                                  |
                                       +--------------------------------------------------------------------------+

1. From a reset on, clock by clock, all words of the ring are filled: with zeros, or with the first sample.
2. While the core waits for sample n, the word k places before the pointer is sample n - k, for all k that the graphs
   remember; `phase` is n modulo N, `rail` whether a sample since the last result was at an end of its range, `counted`
   what the graphs have counted. Nothing else is known: what is proven holds whatever the other registers hold.
3. When a sample is taken, this holds again for the next one: it is shown of every phase, by its ends and what is
   between. Where it brings a result, the clocks up to that are followed, and the code that leaves is that of the
   graphs, with its flags, and its channel.
4. A result is kept while the sink is not ready, leaves as often as it must, and is not overwritten before. At each
   clock of all this the sink may be ready or not, there may be a result before, and there may be a sample on offer:
   nothing but the last clock of a sum depends on it. There the core waits until the result before has left.

With several channels, all this is shown of any one of them: what is kept of it is in its control word, and no clock of
its samples writes a word of another channel. Names of registers count: under a wrong name a proof is not found. The
source must keep a sample on offer until it is accepted, as AXI4-Stream asks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from sosmith.verify.certificate_file import Certificate, ItemEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.multirate.ring.machine import UNKNOWN, Machine, Sink, State
from sosmith.verify.multirate.ring.results import Result, Results
from sosmith.verify.multirate.ring.verdict import RingVerdict
from sosmith.verify.parallel.check import CLOCK, FLAGS, OUTPUT, OUTPUT_DEST
from sosmith.verify.parallel.control import RESET, SINK, SOURCE
from sosmith.verify.parallel.dependence import Dependence
from sosmith.verify.parallel.equality import same_word
from sosmith.verify.parallel.flags import flags_of, wear_limits
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.graph_codes import GraphCodes
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.progress import Progress
from sosmith.verify.reader.recursion import deep_recursion
from sosmith.verify.reader.source import read_source

DATA, DEST, READY, VALID = "s_axis_tdata", "s_axis_tdest", "s_axis_tready", "m_axis_tvalid"
_RINGS, _CONTROL = ("ring_first_memory", "ring_second_memory"), "control_memory"
_FLAG_BITS = 8
_MOST_CLOCKS = 1 << 14
"""Most clocks that are followed from one sample to the next."""

_MOST_OPENED = 4
"""Most variables that are replaced by what they stand for, one after the other, for one comparison."""

_OUTPUT = ("has left", "waits or comes")


class _Fields(NamedTuple):
    """What is kept of a channel between samples: where the next one goes, and what the text above says."""

    pointer: Form
    phase: Form
    rail: Form
    counted: Form


class _Way(NamedTuple):
    """The clocks of a sample: until the next one is taken, and until each of its results can leave."""

    clocks: int
    latencies: Sequence[int]


def check_rings(text: str, certificate: Certificate, item: ItemEntry) -> RingVerdict:
    """Prove that a core computes every N-th result of the graphs of a certificate.

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
        If it computes anything else, or has anything that cannot be followed.
    """
    (verdict,) = check_rings_in_turn(text, certificate.name, [certificate], item)
    return verdict


def check_rings_in_turn(
    text: str, top: str, certificates: Sequence[Certificate], item: ItemEntry
) -> Sequence[RingVerdict]:
    """Prove that a core computes the results of certificates in turn, one of each for each sample.

    Parameters
    ----------
    text : str
        SystemVerilog of the core.
    top : str
        Name of its module.
    certificates : sequence of Certificate
        Certificates, which `verify` accepts, with a downsampling; by 1 if there are several.
    item : ItemEntry
        What all of them are about.

    Raises
    ------
    RejectedError
        If it computes anything else, or has anything that cannot be followed.
    """
    modules = read_source(text, top).modules
    with deep_recursion():
        return _Check(flattened(modules, CLOCK), certificates, item).checked()


class _Check:
    """The check of a core."""

    def __init__(self, netlist: Netlist, certificates: Sequence[Certificate], item: ItemEntry) -> None:
        certificate = certificates[0]
        entry = certificate.downsampling
        assert entry is not None
        self._netlist, self._certificate, self._entry = netlist, certificate, entry
        self._channels, self._hold = item.channels, entry.factor if item.hold else 1
        self.forms = Forms()
        self._results = Results(certificates, self.forms)
        self._graph, (self._port,) = self._results.first.graph, certificate.inputs
        self._input = self._results.input
        self._remembered, self._counter = self._results.remembered, self._results.first.counter
        self._rings, self._words = self._find_rings()
        self._bits = (self._words - 1).bit_length()
        self._channel = self.forms.variable("channel", 0, self._channels - 1)
        control = {_CONTROL: 1} if self._several else {}
        self._machine = Machine(netlist, self.forms, dict.fromkeys(self._rings, self._words) | control, self._channel)
        self._held = self._payload()
        self._apart = self._without_sink()
        self._limits = wear_limits(self, netlist, certificate, "")
        self._number = 0

    @property
    def _several(self) -> bool:
        return self._channels > 1

    def constant_word(self, name: str) -> Form:
        """Return the word of a memory that never changes, for the channel of a sample."""
        return self.forms.variable(("constant", name), 0, (1 << self._netlist.memories[name].width) - 1)

    # What there is.

    def _find_rings(self) -> tuple[list[str], int]:
        """Return the memories of samples, and how many words each has for a channel."""
        memories = self._netlist.memories
        rings = [name for name in _RINGS if name in memories]
        require(bool(rings), f"the core must have a memory {_RINGS[0]}")
        written = {name for name, memory in memories.items() if memory.statements}
        wanted = {*rings, *([_CONTROL] if self._several else [])}
        require(written == wanted, f"what is written must be {', '.join(sorted(wanted))}, not {sorted(written)}")
        depth = len(memories[rings[0]].first)
        words = depth // self._channels
        whole = words >= 2 and not words & (words - 1) and depth == words * self._channels
        require(whole, f"a ring must have a power of two of words for each of {self._channels} channels, not {depth}")
        require(self._remembered < words, f"a ring must have at least {self._remembered + 1} words, not {words}")
        for name in rings:
            shape = len(memories[name].first), memories[name].width
            require(shape == (depth, self._port.bits), f"{name} must have {depth} words of {self._port.bits} bits")
        return rings, words

    def _payload(self) -> frozenset[str]:
        """Return the registers that a result is made of while it waits for the sink."""
        dependence = Dependence(self._netlist, frozenset())
        sources = frozenset[str]().union(*map(dependence.of_net, self._outputs))
        outside = sorted(sources - self._netlist.registers.keys())
        require(not outside, f"a result must be made of registers alone, not of {', '.join(outside)}")
        return sources

    def _without_sink(self) -> frozenset[str]:
        """Return the registers that nothing of the output takes part in."""
        dependence = Dependence(self._netlist, frozenset())
        sink = self._held | {VALID, "copies", SINK}
        return frozenset(
            name
            for name, register in self._netlist.registers.items()
            if name not in sink
            and not sink & (dependence.of_conditions(register.statements) | dependence.of_loads(register.statements))
        )

    @property
    def _outputs(self) -> list[str]:
        return [OUTPUT, FLAGS, *([OUTPUT_DEST] if self._several else [])]

    # All of it.

    def checked(self) -> list[RingVerdict]:
        """Check everything; return what is proven of each result."""
        cleared = self._check_reset()
        fills = self._check_first()
        ways = [self._check_sample(phase) for phase in self._phases]
        self._check_waiting()
        clocks = ways[0].clocks + (self._entry.factor - 1) * max((way.clocks for way in ways[1:]), default=0)
        latencies = [max(times) for times in zip(fills.latencies, ways[0].latencies, strict=True)]
        taken = max(fills.clocks, *(way.clocks for way in ways)) + self._hold
        return [
            RingVerdict(
                registers=len(self._netlist.registers),
                memories=len(self._netlist.memories),
                states=len(self._rings) + self._several,
                latency=latency,
                waits=0,
                clearing=cleared,
                result_clocks=clocks,
                factor=self._entry.factor,
                pace=Progress(taken, latency + self._hold, cleared),
            )
            for latency in latencies
        ]

    @property
    def _phases(self) -> list[Form]:
        """Phases of a sample: 0, the last, and all that are between."""
        last = self._entry.factor - 1
        if last == 0:
            return [{}]
        return [{}, constant(last), *([self.forms.variable("phase", 1, last - 1)] if last > 1 else [])]

    @property
    def _sinks(self) -> list[Sink]:
        """All cases of the sink, that without a result first."""
        most = self._hold - 1
        copies: list[Form] = [{}, *([self.forms.variable("copies", 1, most)] if most else [])]
        return [Sink(0, {}, ready) for ready in (0, 1)] + [Sink(1, left, ready) for left in copies for ready in (0, 1)]

    # What is known of words.

    def _is(self, word: Form, wanted: Form, width: int, graph: GraphCodes | None = None) -> bool:
        """Whether two words are the same, if need be by opening what stages of a graph hand on."""
        pair: tuple[Form, Form] | None = word, wanted
        for _ in range(_MOST_OPENED):
            if pair is None or same_word(self.forms, *pair, width):
                break
            pair = (graph or self._graph).opened(*pair)
        else:
            return False
        return pair is not None

    def _sample(self, ago: int = 0) -> Form:
        """Return the code of a sample, as an unsigned word."""
        code = self._graph.past((self._input, ago)) if ago else self._graph.codes[self._input]
        assert code is not None
        return self.forms.unsigned(code, self._port.bits)

    @property
    def _bus(self) -> Form:
        """What the stream has: the sample, and anything above it."""
        beside = self._netlist.widths[DATA] - self._port.bits
        require(beside == -self._port.bits % 8, f"the port {DATA} must have whole bytes for {self._port.bits} bits")
        return plus(self._sample(), self.forms.variable("padding", 0, (1 << beside) - 1), 1 << self._port.bits)

    @property
    def _counted(self) -> Form:
        return {} if self._counter is None else self._graph.codes[self._counter]

    @property
    def _at_rail(self) -> Form:
        """Whether the sample is at an end of its range."""
        flags = flags_of(self._graph, self._graph.lanes[0], self._certificate, (), None)
        return next(flag.value for flag in flags if flag.name == "input_at_rail")

    def _gathered(self, rail: Form) -> Form:
        """Whether it is, or one since the last result was."""
        here = self._at_rail
        return plus(plus(rail, here), self.forms.times(rail, here), -1)

    def _control(self, fields: _Fields) -> Form:
        """Return the control word of a channel that has started."""
        counted = 0 if self._counter is None else self._graph.nodes[self._counter].entry.high.bit_length()
        sizes = (self._bits, (self._entry.factor - 1).bit_length(), 1, counted)
        word, place = constant(1), 1
        for value, bits in zip(fields, sizes, strict=True):
            word, place = plus(word, self.forms.unsigned(value, bits), 1 << place) if bits else word, place + bits
        width = self._netlist.memories[_CONTROL].width
        require(width == place, f"{_CONTROL} must have words of {place} bits, not of {width}")
        return word

    @property
    def _names(self) -> tuple[str, ...]:
        """Registers of one channel that `_Fields` says all of."""
        left_out = {"counted"} if self._counter is None else set()
        left_out |= {"phase", "rail"} if self._entry.factor == 1 else set()  # every sample brings a result
        return tuple(name for name in _Fields._fields if name not in left_out)

    def _check_fields(self, state: State, wanted: _Fields) -> None:
        """Check what is kept for the next sample."""
        if self._several:
            right = self._is(state.words[_CONTROL][0], self._control(wanted), self._netlist.memories[_CONTROL].width)
            require(right, f"{_CONTROL} must have what is kept of a channel behind its sample, not another word")
            return
        for name in self._names:
            right = self._is(state.register(name), getattr(wanted, name), self._netlist.widths[name])
            require(right, f"{name} must be what follows from the sample, not another value")

    # Clocks.

    def _clocks(
        self, state: State, inputs: Mapping[str, Form], *, control: bool = False
    ) -> tuple[State, State | None, int]:
        """Follow one clock for all cases of the sink; of registers that these don't reach, `control` alone if asked.

        Return the state after it, as far as it does not depend on the sink; what a result that comes to the output is
        made of, if one does: it waits for the one before; and whether a sample is taken.
        """
        self._number += 1
        cases: list[tuple[Sink, State, int]] = []
        for sink in self._sinks:
            before = state.copy()
            before.registers[VALID] = constant(sink.valid)
            if self._hold > 1 and sink.valid:
                before.registers["copies"] = sink.copies
            for name in self._held if sink.valid else ():
                before.registers[name] = self.forms.variable(("result", name), 0, (1 << self._netlist.widths[name]) - 1)
            clock = self._machine.clock(
                before, {RESET: constant(1), SINK: constant(sink.ready), **inputs}, self._number
            )
            alike = cases[0][1].registers if cases else {}
            after = State(
                {
                    name: alike[name] if name in alike and name in self._apart else clock.register(name)
                    for name in self._netlist.registers
                    if not control or name in self._reset_values or name not in self._apart
                }
            )
            after.words = {name: clock.words(name) for name in state.words}
            cases.append((sink, after, clock.bit(READY)))
        (_, first, ready), *_ = cases
        brings = first.registers[VALID] == constant(1)
        if brings:  # it may wait here, and then only what stays is known
            waited = next(after for sink, after, _ in cases if not sink.free)
            stays = {name: word for name, word in state.registers.items() if waited.registers[name] == word}
            if len(stays) < len(state.registers):
                return self._clocks(State(stays, state.words), inputs, control=control)
        inner = [name for name in first.registers if name not in {VALID, "copies", *self._held}]
        for sink, after, own in cases:
            require(own == ready, f"{READY} must not depend on the sink")
            if brings and not sink.free:
                self._check_stays(state, after)
            else:
                same = all(after.registers[name] == first.registers[name] for name in inner)
                require(same and after.words == first.words, "only the last clock of a sum may depend on the sink")
            self._check_output(sink, after, comes=brings and sink.free)
        kept = State(
            {name: first.registers[name] for name in inner if self._is_known(first.registers[name])}, first.words
        )
        return kept, first if brings else None, ready

    def _is_known(self, word: Form) -> bool:
        """Whether a word is made of samples alone, and what is kept of them."""
        return not any(isinstance(key, tuple) and key[0] == UNKNOWN for key in self.forms.keys(word))

    def _check_stays(self, before: State, after: State) -> None:
        """Check that nothing that is known changes."""
        for name, word in before.registers.items():
            right = name in {VALID, "copies", *self._held} or self._is(
                after.register(name), word, self._netlist.widths[name]
            )
            require(right, f"{name} must stay while nothing happens")
        require(before.words == after.words, "no word must be written while nothing happens")

    def _check_output(self, sink: Sink, after: State, *, comes: bool) -> None:
        """Check whether there is a result after a clock, how many copies follow, and that it is the one before."""
        valid = int(comes or (sink.valid and not sink.leaves))
        require(after.registers[VALID] == constant(valid), f"{VALID} must be {valid} where a result {_OUTPUT[valid]}")
        if not valid:
            return
        if self._hold > 1:
            left = constant(self._hold - 1) if comes else plus(sink.copies, constant(sink.ready), -1)
            right = self._is(after.registers["copies"], left, self._netlist.widths["copies"])
            require(right, "copies must be those of a result that have not left")
        if not comes:
            for name in self._held:
                stays = after.registers[name] == self.forms.variable(
                    ("result", name), 0, (1 << self._netlist.widths[name]) - 1
                )
                require(stays, f"{name} must stay while a result waits for the sink")

    # From a reset to the first sample.

    @property
    def _reset_values(self) -> dict[str, int]:
        """What registers of the control hold after a reset."""
        values = {"running": 0, VALID: 0} | ({"turn": 0} if len(self._results.all) > 1 else {})
        if self._several:
            return values | {"clearing": 1, "filling": 0, "waits": 0, "channel": 0}
        return values | {"filling": 1} | dict.fromkeys(self._names, 0)

    def _check_reset(self) -> int:
        """Check what a reset does in any state; return the clocks until a sample is taken."""
        clock = self._machine.clock(State(), {RESET: {}}, 0)
        for name, value in self._reset_values.items():
            register = self._netlist.registers.get(name)
            if register is None:
                raise RejectedError(f"the core must have a register {name}")
            require(register.first == value, f"{name} must be {value} before the first clock, not {register.first}")
            right = self._is(clock.register(name), constant(value), register.width)
            require(right, f"{name} must be {value} after a reset, not another value")
        if not self._several:
            return self._words
        state, machine = self._after_reset(), self._machine
        for channel in range(self._channels):
            self._machine = Machine(
                self._netlist, self.forms, {**dict.fromkeys(self._rings, self._words), _CONTROL: 1}, constant(channel)
            )
            state.words = {_CONTROL: {}}
            require(state.register("clearing") == constant(1), f"{_CONTROL} must be cleared for all channels")
            state, result, ready = self._clocks(state, {})
            quiet = result is None and not ready and state.words[_CONTROL] == {0: {}}
            require(quiet, f"{_CONTROL} of channel {channel} must be cleared, and no sample taken")
        self._machine = machine
        for name, value in self._reset_values.items():
            if name not in {VALID, "channel"}:
                wanted = 0 if name == "clearing" else value
                require(state.register(name) == constant(wanted), f"{name} must be {wanted} once all is cleared")
        return self._channels

    def _after_reset(self) -> State:
        return State({name: constant(value) for name, value in self._reset_values.items()})

    def _check_first(self) -> _Way:
        """Check that a ring is filled before the first sample of a channel counts."""
        steady, self._machine.pointer = self._entry.filled > 0, {}
        if self._several:
            state = self._waiting(_Fields({}, {}, {}, {}))
            state.words = {**{name: {} for name in self._rings}, _CONTROL: {0: {}}}
            return self._followed(state, _Fields({}, {}, {}, {}), fills=True)
        state = self._after_reset()
        state.words = {name: {} for name in self._rings}
        for _ in range(self._words):
            require(state.register("filling") == constant(1), f"a ring must be filled in {self._words} clocks")
            state = self._known(state)
            if steady:
                stays, result, ready = self._clocks(state, {SOURCE: {}, DATA: self._bus}, control=True)
                require(result is None and not ready, "no sample must be taken while a ring is filled")
                self._check_stays(state, stays)
            inputs = {DATA: self._bus, **({SOURCE: constant(1)} if steady else {})}
            state, result, ready = self._clocks(state, inputs, control=True)
            require(result is None and not ready, "no sample must be taken while a ring is filled")
        self._check_filled(state)
        for name, value in self._reset_values.items():
            right = name == VALID or state.register(name) == {}
            require(right, f"{name} must be 0 once the ring is filled, as {value} was after a reset")
        return _Way(0, [0] * len(self._results.all))

    def _check_filled(self, state: State) -> None:
        """Check that a ring is full of zeros, or of the first sample: then that is what all samples before were."""
        fill: Form = self._sample() if self._entry.filled else {}
        for name in self._rings:
            words = state.words[name]
            right = all(
                place in words and self._is(words[place], fill, self._port.bits) for place in range(self._words)
            )
            require(right, f"{name} must be filled before the first sample counts")

    def _known(self, state: State) -> State:
        """Return a state with what is known of the control alone."""
        return State(
            {name: state.registers[name] for name in self._reset_values if name in state.registers}, state.words
        )

    # Samples.

    def _waiting(self, fields: _Fields) -> State:
        """Return the state in which the core waits for a sample."""
        self._machine.pointer = fields.pointer
        ring = {-ago % self._words: self._sample(ago) for ago in range(1, self._remembered + 1)}
        turn: dict[str, Form] = {"turn": {}} if len(self._results.all) > 1 else {}
        state = State({"running": {}, "filling": {}, **turn}, {name: dict(ring) for name in self._rings})
        if self._several:
            state.registers |= {"clearing": {}, "waits": {}}
            state.words[_CONTROL] = {0: self._control(fields)}
        else:
            state.registers |= {name: getattr(fields, name) for name in self._names}
        return state

    def _fields(self, phase: Form) -> _Fields:
        pointer = self.forms.variable("pointer", 0, self._words - 1)
        rail = {} if self._entry.factor == 1 else self.forms.variable("rail", 0, 1)
        return _Fields(pointer, phase, rail, self._counted)

    def _check_waiting(self) -> None:
        """Check that nothing happens while the core waits for a sample, or is offered one of no channel."""
        for phase in self._phases:
            state = self._waiting(self._fields(phase))
            others = [{SOURCE: constant(0)}]
            if self._several and self._channels < 1 << self._netlist.widths[DEST]:
                none = self.forms.variable("no channel", self._channels, (1 << self._netlist.widths[DEST]) - 1)
                others.append({SOURCE: constant(1), DEST: none})
            for inputs in others:
                after, result, _ = self._clocks(state, inputs)
                require(result is None, "no result must come without a sample")
                self._check_stays(state, after)

    def _check_sample(self, phase: Form) -> _Way:
        """Check all clocks of a sample in the midst of others."""
        fields = self._fields(phase)
        return self._followed(self._waiting(fields), fields)

    def _followed(self, state: State, fields: _Fields, *, fills: bool = False) -> _Way:
        """Follow the clocks of a sample from where it is taken; `fills` says that the ring is filled before it counts.

        From then on, samples before it may have been any: those that fill the ring are among them.
        """
        brings = not fields.phase
        inputs = {SOURCE: constant(1), DATA: self._bus, **({DEST: self._channel} if self._several else {})}
        state, result, ready = self._clocks(state, inputs)
        require(bool(ready) and result is None, f"{READY} must be 1 while the core waits for a sample")
        clocks, latencies = 1, list[int]()
        results = self._results.all if brings else []
        while True:
            require(clocks < _MOST_CLOCKS, f"a sample must be done within {_MOST_CLOCKS} clocks")
            if self._machine.clock(state, {RESET: constant(1)}, self._number).bit(READY):
                break
            state, result, ready = self._clocks(state, {})
            require(not ready, f"{READY} must not depend on the sink")
            clocks += 1
            if fills and state.register("filling") == {} and all(state.words[name] for name in self._rings):
                self._check_filled(state)
                state.words |= {name: self._waiting(fields).words[name] for name in self._rings}
                fills = False
            if result is not None:
                require(not fills, "no result must come while a ring is filled")
                if len(latencies) < len(results):
                    self._check_result(results[len(latencies)], result, fields)
                latencies.append(clocks)
        told = tuple(f"{len(each) or 'no'} result{'s' * (len(each) != 1)}" for each in (results, latencies))
        require(len(latencies) == len(results), f"a sample must bring {told[0]}, not {told[1]}")
        last, rail = constant(self._entry.factor - 1), self._gathered(fields.rail)
        counted: Form = {}
        if self._counter is not None:
            (operand,) = self._graph.nodes[self._counter].operands
            counted = self._counting(self._graph.codes[operand], fields)
        self._check_fields(
            state,
            _Fields(
                plus(fields.pointer, constant(1)),
                {} if fields.phase == last else plus(fields.phase, constant(1)),
                {} if brings else rail,
                counted,
            ),
        )
        for name in self._rings:
            for ago in range(self._remembered):
                word = state.words[name].get(-ago % self._words)
                right = word is not None and self._is(word, self._sample(ago), self._port.bits)
                require(right, f"{name} must have the last {self._remembered} samples behind a sample")
        waits = self._waiting(fields).registers
        for name in waits.keys() - {*self._names}:
            require(state.register(name) == {}, f"{name} must be 0 while the core waits for a sample")
        return _Way(clocks, latencies)

    def _counting(self, form: Form, fields: _Fields) -> Form:
        """Return a form with the count of a sample, which for the first one is 0."""
        if self._counter is None or fields.counted == self._counted:
            return form
        return self.forms.settled(form, {self._graph.origin(self._counter): fields.counted})

    def _check_result(self, wanted: Result, state: State, fields: _Fields) -> None:
        """Check the code, the flags and the channel of a result."""
        clock = self._machine.clock(State({name: state.registers[name] for name in self._held}), {}, self._number)
        whole = -(-self._certificate.output.bits // 8) * 8
        for name, width in ((OUTPUT, whole), (FLAGS, _FLAG_BITS)):
            require(self._netlist.widths[name] == width, f"the port {name} must have {width} bits")
        graph, lane = wanted.graph, wanted.lane
        rail, code = self._gathered(fields.rail), graph.seen(lane.output, "")
        label = graph.nodes[lane.output].label
        require(self._is(clock.net(OUTPUT), code, whole, graph), f"{OUTPUT} must be {label}, not another value")
        for flag in flags_of(graph, lane, wanted.certificate, (rail,), self._limits):
            value = self._counting(self._results.with_one_count(wanted, flag.value), fields)
            right = self._is(clock.net(FLAGS, flag.place, 1), value, 1, graph)
            what = flag.name or "0, as there is no such flag"
            require(right, f"bit {flag.place} of {FLAGS} must be {what}, not another value")
        if self._several:
            right = self._is(clock.net(OUTPUT_DEST), self._channel, self._netlist.widths[OUTPUT_DEST])
            require(right, f"{OUTPUT_DEST} must be the channel of the sample, not another value")
