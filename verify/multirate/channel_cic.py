"""What the decimator of several channels is: one adder, and memories with what it holds of each channel.

::

    s_axis --> [closed] --> [idle] --> [takes] --> [adds] --> [gives] --> behind: the core
                               ^                     |  |        |
                               +---------------------+--+--------+

- One register of these five, `clearing` with them, is 1: it begins with that, each clock hands on to one other, and so
  does a reset.
- While `clearing` is 1, the control word of each channel becomes 0. Then, a sample of a channel that exists is kept
  with its channel, while its control word is read: whether the channel has started, the phase, flags, and its first
  sample. Of one that has not, all of this counts as 0, and so do its states, but for its first sample, which is this
  one. So what memories held before does not count.
- `acc` takes over the sample less the first one. At step k, the first N of them, it becomes the k-th sum of the
  channel, which is written back; from N on, where the sample completes a result, its difference with what the k-th
  state held, which takes over what it was. All is modulo ``2**width``: a moving sum, N times, of samples less the first
  one, as if that had been there for ever, since sums and combs begin with 0.
- A result has the first sample added to it, times ``R**N``, and is rounded. It waits until it is taken, and nothing
  else goes on until then. With the last step of a sample its control word is written back. So each sample finds what
  the one before has left.

With a start from zero there is no first sample: none is kept, taken off or added.

The states of step k + 1 are read while step k writes its own; the control word is read only while nothing is written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from sosmith.verify.certificate_file import Certificate, DecimationEntry, PortEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.multirate.calibration import CHANNEL, CODE, FLAGS, Gate, layout_of
from sosmith.verify.multirate.connections import CIC, DATA, DEST, CoreConnections, calibration_connections, passed_on
from sosmith.verify.multirate.logic import (
    BIT,
    Field,
    Logic,
    MemoryShape,
    Part,
    Ranges,
    RegisterShape,
    Signals,
    Written,
    check_parts,
)
from sosmith.verify.parallel.forms import shifted
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.program.normal_form import Form, constant, plus
from sosmith.verify.reader.syntax import Bits, Choice, Module, Statement, Word

STATE = "state of the decimator"
"""Signal: which of the registers in `STATES` is 1."""

STATES = ("clearing", "idle", "takes", "adds", "gives")
_STARTED, _PHASE, _FLAGS, _FIRST = (f"{what} of the channel" for what in ("start", "phase", "flags", "first sample"))
_CONTROL, _STATES = CIC + "control", CIC + "states"


@dataclass(frozen=True)
class Names:
    """Registers of the decimator.

    Attributes
    ----------
    states : tuple of str
        Those of `STATES`.
    control, state : str
        What is read from the two memories.
    dest : str
        The channel of a result.
    """

    states: tuple[str, ...]
    control: str
    state: str
    dest: str


def names_of(netlist: Netlist) -> Names:
    """Find the registers of the decimator.

    Raises
    ------
    RejectedError
        If it has others.
    """
    read: dict[str, list[str]] = {_CONTROL: [], _STATES: []}
    for register in netlist.registers.values():
        for memory in _memories(register.statements):
            read.setdefault(memory, []).append(register.name)
    states = tuple(CIC + name for name in ("clears", "i_ready", "takes", "adds", "gives"))
    missing = [name for name in states if name not in netlist.registers]
    require(not missing, f"the decimator must have a register {', '.join(missing)}")
    dest = set(passed_on(netlist, Bits(CIC + "o_dest")))
    counts = [len(dest), *map(len, read.values())]
    require(counts == [1, 1, 1], f"the decimator must have 3 registers beside its state, not {counts}")
    (control,), (state,) = read[_CONTROL], read[_STATES]
    return Names(states, control, state, dest.pop())


def _memories(statements: Sequence[Statement]) -> Iterator[str]:
    """Yield the memories from which statements load."""
    for statement in statements:
        if isinstance(statement, Choice):
            yield from _memories((*statement.yes, *statement.no))
        elif isinstance(statement.value, Word):
            yield statement.value.name


def check_channels(
    netlist: Netlist,
    box: Module | None,
    certificate: Certificate,
    channels: int,
    connections: CoreConnections,
    names: Names,
    leaving: Part,
) -> int:
    """Check the decimator of several channels, and what is before it, the module `box`; return its number of registers.

    Raises
    ------
    RejectedError
        If there is anything else.
    """
    entry = certificate.decimation
    assert entry is not None
    closed, bits = netlist.registers.get("closed"), (channels - 1).bit_length()
    if closed is None:
        raise RejectedError("there must be a register closed")
    taken = next(name for name, source in connections.entering.items() if source == names.dest)
    whole = -(-bits // 8) * 8
    for port_name, least in ((DEST, whole), ("m_axis_tdest", whole), (taken, bits)):
        width = netlist.widths.get(port_name, 0)
        require(width >= least, f"{port_name} must have {least} bits, not {width}")
    if entry.calibration is None:
        (port,), calibration = certificate.inputs, None
        layout = {DATA: [Field(DATA, port.bits)]}
        enters = _Enters(DATA, DEST, netlist.widths[DEST], ())
    else:
        port = entry.calibration.output
        calibration = calibration_connections(netlist, box, port.bits, bits)
        layout = layout_of(netlist, calibration, port, bits)
        enters = _Enters(CODE, CHANNEL, bits, FLAGS)

    def valid(now: Logic) -> int:
        return gate.offered(now) if calibration is None else now.bit(calibration.valid)

    steady = certificate.ideal.start is not None
    cic = ChannelCic(entry, port, channels, connections, names, enters, valid, netlist.widths[taken], steady=steady)
    gate: Gate = Gate(closed.first, closed.width, cic.ready, calibration, netlist.widths)
    return check_parts(netlist, [leaving, cic, gate], Signals({**layout, **cic.layout}, cic.one_hot), cic)


class _Enters(NamedTuple):
    """Signals that enter the decimator: a code, its channel with a width, and flags, unless the code says of rails."""

    code: str
    dest: str
    dest_width: int
    flags: tuple[str, ...]


@dataclass(frozen=True)
class ChannelCic:
    """The decimator, up to what enters the core.

    Attributes
    ----------
    entry : DecimationEntry
    port : PortEntry
        What it takes.
    channels : int
    connections : CoreConnections
    names : Names
    enters : _Enters
        Signals that enter it.
    valid : callable
        Whether there is a sample.
    dest_width : int
        Width of the port of the core that takes the channel.
    steady : bool
        Whether the first sample of a channel counts as if it had been there for ever.
    """

    entry: DecimationEntry
    port: PortEntry
    channels: int
    connections: CoreConnections
    names: Names
    enters: _Enters
    valid: Callable[[Logic], int]
    dest_width: int
    steady: bool

    # What there is.

    @property
    def nets(self) -> Mapping[str, int]:
        """What enters the core."""
        widths = {CIC + "o_data": self.entry.width - self.entry.dropped, CIC + "o_flags": self._flag_bits}
        widths[self.names.dest] = self.dest_width
        return {name: widths.get(source, 1) for name, source in self.connections.entering.items()}

    @property
    def registers(self) -> Mapping[str, RegisterShape]:
        """The states, what is kept of a sample, the adder's, and a result."""
        width, shapes = self.entry.width, self.memories
        own = {
            "channel": RegisterShape(self._channel_bits, 0),
            "sample": RegisterShape(self.port.bits, None),
            "gathered": RegisterShape(self._flag_bits, None),
            "acc": RegisterShape(width, None),
            "step": RegisterShape(self._step_bits, None),
            "o_valid": RegisterShape(1, 0),
            "o_data": RegisterShape(width - self.entry.dropped, None),
            "o_flags": RegisterShape(self._flag_bits, None),
        }
        return {
            **{CIC + name: shape for name, shape in own.items()},
            **{name: RegisterShape(1, int(not place)) for place, name in enumerate(self.names.states)},
            self.names.control: RegisterShape(shapes[_CONTROL].width, None),
            self.names.state: RegisterShape(width, None),
            self.names.dest: RegisterShape(self._channel_bits, None),
        }

    @property
    def memories(self) -> Mapping[str, MemoryShape]:
        """The control words, and the states."""
        word = 1 + self._phase_bits + self._flag_bits + (self.port.bits if self.steady else 0)
        return {
            _CONTROL: MemoryShape(word, self.channels),
            _STATES: MemoryShape(self.entry.width, self.channels << self._step_bits),
        }

    @property
    def layout(self) -> Mapping[str, list[Field]]:
        """What a control word is made of."""
        fields = [Field(_STARTED, 1), Field(_PHASE, self._phase_bits), Field(_FLAGS, self._flag_bits)]
        return {self.names.control: [*fields, Field(_FIRST, self.port.bits)] if self.steady else fields}

    @property
    def one_hot(self) -> Mapping[str, tuple[str, int]]:
        """The registers that `STATE` says all of."""
        return {name: (STATE, place) for place, name in enumerate(self.names.states)}

    @property
    def ranges(self) -> Mapping[str, Ranges]:
        """Codes by sign and by their ends, the phase by its ends, steps and flags by each value."""
        half, most = 1 << self.port.bits - 1, (1 << self.port.bits) - 1
        sign: Ranges = ((0, half - 1), (half, most)) if self.port.signed else ((0, most),)
        ends = {half - 1, half} if self.port.signed else {0, most}
        starts = sorted({0, half, most + 1, *ends, *(end + 1 for end in ends)})
        last = self.entry.factor - 1
        flags = tuple((k, k) for k in range(1 << self._flag_bits))
        return {
            STATE: tuple((k, k) for k in range(len(STATES))),
            CIC + "channel": _split(self._channel_bits, self.channels - 1, self.channels),
            CIC + "step": tuple((k, k) for k in range(1 << self._step_bits)),
            CIC + "gathered": flags,
            CIC + "sample": sign,
            _STARTED: BIT,
            _PHASE: ((0, 0), (1, last - 1), (last, last)) if last > 1 else BIT,
            _FLAGS: flags,
            _FIRST: sign,
            self.enters.dest: _split(self.enters.dest_width, self.channels),
            self.enters.code: sign
            if self.enters.flags
            else tuple((start, after - 1) for start, after in pairwise(starts)),
            **dict.fromkeys(self.enters.flags, BIT),
        }

    @property
    def _flag_bits(self) -> int:
        return len(self.enters.flags) or 1

    @property
    def _phase_bits(self) -> int:
        return self.entry.factor.bit_length() - 1

    @property
    def _step_bits(self) -> int:
        return (2 * self.entry.stages - 1).bit_length()

    @property
    def _channel_bits(self) -> int:
        return (self.channels - 1).bit_length()

    # What it does.

    def ready(self, now: Logic) -> int:
        """Whether a sample is taken: one of a channel that does not exist is dropped."""
        return int(self._is(now, "idle"))

    def wanted(self, now: Logic, name: str) -> Form:
        """Return what the text at the top of this file says."""
        if name in self.connections.entering:
            return now.word(self.connections.entering[name])
        if name in self.names.states:
            return constant(int(self._next(now) == STATES[self.names.states.index(name)]))
        if name == self.names.control:
            address = now.forms.unsigned(now.signal(self.enters.dest), self._channel_bits)
            return now.read(_CONTROL, address) if self._is(now, "idle") else now.word(name)
        if name == self.names.state:
            following = self._step(now) + 1 if self._is(now, "adds") else 0
            return now.read(_STATES, self._address(now, following % (1 << self._step_bits)))
        kind = "o_dest" if name == self.names.dest else name.removeprefix(CIC)
        loaded = self._result(now, kind) if kind.startswith("o_") else self._kept(now, kind)
        return now.word(name) if loaded is None else loaded

    def written(self, now: Logic, memory: str) -> Written | None:
        """Return what is written to a memory at the clock, if anything is."""
        if memory == _STATES:
            return Written(self._address(now, self._step(now)), self._state(now)) if self._is(now, "adds") else None
        channel = now.word(CIC + "channel")
        if self._is(now, "clearing"):
            return Written(channel, {})
        step_ends = self._is(now, "adds") and self._next(now) == "idle"
        if not step_ends and not self._leaves(now):
            return None
        phase, flags = self._phase(now), 0 if self._completes(now) else self._gathered(now)
        word = plus(constant(1), now.forms.unsigned(plus(phase, constant(1)), self._phase_bits), 2)
        word = plus(word, constant(flags), 2 << self._phase_bits)
        return Written(channel, plus(word, self._first(now), 2 << self._phase_bits + self._flag_bits))

    def _is(self, now: Logic, state: str) -> bool:
        return now.limits(STATE)[0] == STATES.index(state)

    def _next(self, now: Logic) -> str:
        """Return the state after the clock."""
        state = STATES[now.limits(STATE)[0]]
        match state:
            case "clearing" if now.limits(CIC + "channel") == (self.channels - 1,) * 2:
                return "idle"
            case "idle" if self.valid(now) and now.limits(self.enters.dest)[1] < self.channels:
                return "takes"
            case "takes":
                return "adds"
            case "adds" if self._step(now) == 2 * self.entry.stages - 1:
                return "gives"
            case "adds" if self._step(now) == self.entry.stages - 1 and not self._completes(now):
                return "idle"
            case "gives" if self._leaves(now):
                return "idle"
        return state

    def _leaves(self, now: Logic) -> bool:
        """Whether a result comes to the output."""
        return self._is(now, "gives") and bool(not now.bit(CIC + "o_valid") or now.bit(self.connections.taken))

    def _kept(self, now: Logic, kind: str) -> Form | None:
        """Return what a register takes over of a sample, or of a step."""
        idle, adds = self._is(now, "idle"), self._is(now, "adds")
        match kind:
            case "channel" if self._is(now, "clearing"):
                return plus(now.word(CIC + kind), constant(1))
            case "channel" if idle:
                return now.signal(self.enters.dest)
            case "sample" if idle:
                return now.signal(self.enters.code)
            case "gathered" if idle:
                return constant(self._flags_handed_on(now))
            case "acc" if self._is(now, "takes"):
                return plus(self._signed(now, CIC + "sample"), self._signed_first(now), -1)
            case "acc" if adds:
                return self._total(now)
            case "step" if self._is(now, "takes"):
                return {}
            case "step" if adds:
                return constant(self._step(now) + 1)
        return None

    def _result(self, now: Logic, kind: str) -> Form | None:
        """Return what a register of the output takes over."""
        if not self._leaves(now):
            return {} if kind == "o_valid" and now.bit(self.connections.taken) else None
        match kind:
            case "o_data":
                growth = self.entry.stages * self._phase_bits
                total = plus(now.word(CIC + "acc"), self._signed_first(now), 1 << growth)
                half = constant(1 << self.entry.dropped >> 1)
                return now.forms.floor(shifted(plus(total, half), -self.entry.dropped))
            case "o_flags":
                return constant(self._gathered(now))
            case "o_dest":
                return now.word(CIC + "channel")
        return constant(1)

    # Values.

    def _step(self, now: Logic) -> int:
        return now.limits(CIC + "step")[0]

    def _address(self, now: Logic, step: int) -> Form:
        return plus(constant(step), now.word(CIC + "channel"), 1 << self._step_bits)

    def _started(self, now: Logic) -> bool:
        return bool(now.limits(_STARTED)[0])

    def _phase(self, now: Logic) -> Form:
        return now.signal(_PHASE) if self._started(now) else {}

    def _completes(self, now: Logic) -> bool:
        """Whether the sample completes a result."""
        return not self._started(now) or now.limits(_PHASE) == (0, 0)

    def _gathered(self, now: Logic) -> int:
        """Return the flags of the samples since the last result."""
        before = now.limits(_FLAGS)[0] if self._started(now) else 0
        return before | now.limits(CIC + "gathered")[0]

    def _flags_handed_on(self, now: Logic) -> int:
        """Return the flags of the sample that enters."""
        if self.enters.flags:
            return sum(now.bit(flag) << place for place, flag in enumerate(self.enters.flags))
        low, high = now.limits(self.enters.code)
        return int(low == high and low in {self.port.lowest % (1 << self.port.bits), self.port.highest})

    def _first(self, now: Logic) -> Form:
        """Return the bits of the channel's first sample; nothing with a start from zero."""
        if not self.steady:
            return {}
        return now.signal(_FIRST) if self._started(now) else now.word(CIC + "sample")

    def _signed_first(self, now: Logic) -> Form:
        if not self.steady:
            return {}
        return self._signed(now, _FIRST if self._started(now) else CIC + "sample")

    def _signed(self, now: Logic, signal: str) -> Form:
        """Return the value of a code."""
        negative = self.port.signed and now.limits(signal)[0] > self.port.highest
        return plus(now.signal(signal), constant(-(1 << self.port.bits) if negative else 0))

    def _total(self, now: Logic) -> Form:
        """Return what a step makes of the accumulator: a sum, or a difference."""
        state = now.word(self.names.state) if self._started(now) else {}
        return plus(now.word(CIC + "acc"), state, -1 if self._combs(now) else 1)

    def _state(self, now: Logic) -> Form:
        """Return what a step leaves for the next sample of the channel."""
        return now.word(CIC + "acc") if self._combs(now) else self._total(now)

    def _combs(self, now: Logic) -> bool:
        return self._step(now) >= self.entry.stages


def _split(bits: int, *starts: int) -> Ranges:
    """Return the ranges of so many bits that begin at 0 and at the starts."""
    ends = sorted({0, *(start for start in starts if start < 1 << bits), 1 << bits})
    return tuple((start, after - 1) for start, after in pairwise(ends))
