"""Proves that the hardware of a parallel core computes the graph of its certificate, for all inputs, stalls and resets.

The core is read from its SystemVerilog, which is what tools synthesize, and nothing else is needed to read it
(`sosmith.verify.reader.syntax`). All its logic is then followed with normal forms in place of numbers::

    certificate --> graph --> code of each node, a form of inputs and of what DELAY nodes hold ---+
                                                                                                  v
    core.sv --> netlist --> control: which clock moves which sample                             equal?
                   |                          |                                                   ^
                   +--> logic ----------------+--> what each register holds, for its sample ------+

1. The valid bits and the output buffer move samples as a queue does: none is lost, repeated or overtaken, whatever
   source, sink and reset do (`sosmith.verify.parallel.control`).
2. What a register holds is a form of its own sample, and it is loaded exactly when a sample moves there; a register of
   a recursion holds the code of a DELAY node, by induction over the clocks (`sosmith.verify.parallel.pipeline`).
3. What leaves is the output of the graph, extended to whole bytes, with its flags, and 0 for those that the core does
   not have.

Sums and products are those of the hardware, modulo the width of each net; extensions by a sign or by zeros, and bits
that are left out, change a value unless its range says otherwise. The only ranges are those of the certificate, which
`sosmith.verify.verification` proves. Names of nets count in one place: the register of a recursion is looked for
by the name of its DELAY node. Under a wrong name a proof is not found.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.channels import DEST, find_channels
from sosmith.verify.parallel.control import find_control
from sosmith.verify.parallel.evaluation import Evaluation
from sosmith.verify.parallel.fault import fault
from sosmith.verify.parallel.flags import flags_of, wear_limits
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.graph_codes import DATA, GraphCodes
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.parallel.pipeline import Pipeline
from sosmith.verify.parallel.register_words import with_memories
from sosmith.verify.parallel.split import split
from sosmith.verify.progress import Progress
from sosmith.verify.reader.recursion import deep_recursion
from sosmith.verify.reader.source import read_modules
from sosmith.verify.reader.syntax import Module

CLOCK = "aclk"
OUTPUT, FLAGS, OUTPUT_DEST = "m_axis_tdata", "m_axis_tuser", "m_axis_tdest"
_PORTS = frozenset(
    {CLOCK, "aresetn", DATA, "s_axis_tvalid", "s_axis_tready", OUTPUT, FLAGS, "m_axis_tvalid", "m_axis_tready"}
)
_FLAG_BITS = 8


@dataclass(frozen=True)
class Reading:
    """A core as it was read: its netlist, what its registers hold, and the graph that it computes."""

    netlist: Netlist
    pipeline: Pipeline
    graph: GraphCodes


@dataclass(frozen=True)
class HardwareVerdict:
    """The result of the check of the hardware.

    Attributes
    ----------
    registers, memories, states : int
        Number of registers whose content is known, of memories, and of those of both that hold a DELAY node.
    latency : int
        Clocks from the edge that accepts a sample to the edge that can hand its result on, without a stall.
    waits : int
        Clocks that a sample may have to wait at the entrance for one before it, of its channel.
    clearing : int
        Clocks after a reset in which no sample is taken.
    reading : Reading or None
        What was read; None where it was in parts.
    """

    registers: int
    memories: int
    states: int
    latency: int
    waits: int
    clearing: int
    reading: Reading | None = field(default=None, repr=False, compare=False, kw_only=True)

    @property
    def interval(self) -> int:
        """Clocks between samples at the highest rate."""
        return 1

    @property
    def progress(self) -> Progress:
        """Within how many clocks samples are taken and results leave, while the sink is ready.

        At the first clock the output buffer may be full. From the second on all samples in the pipeline move at each
        clock, and one in front enters after `waits` clocks at most; then the input buffer has room, if there is one.
        Behind an input buffer a sample may wait for itself and for the one before it.
        """
        buffered = int(self.clearing > 0)
        return Progress(2 + buffered * (1 + self.waits), self.latency + 2 * self.waits, self.clearing)


def check_hardware(text: str, certificate: Certificate, channels: int = 1, lanes: int = 1) -> HardwareVerdict:
    """Prove that the hardware in a core's SystemVerilog computes the graph of a certificate.

    Parameters
    ----------
    text : str
        SystemVerilog of a parallel core.
    certificate : Certificate
        Its certificate, which `verify` has accepted.
    channels : int
        Number of channels, each of which has states of its own.
    lanes : int
        Samples of a beat; with several of them, there is one channel.

    Returns
    -------
    HardwareVerdict
        The result.

    Raises
    ------
    RejectedError
        If the hardware computes anything else, or the text has anything that cannot be checked; the sentence names the
        first node that is wrong, or the register that moves samples wrongly.
    """
    require("s_axil_" not in text, "the constants must be fixed to be checked, not loadable at run time")
    modules = read_modules(text, certificate.name)
    require(channels == 1 or lanes == 1, f"several samples a clock must be those of one channel, not of {channels}")
    return check_modules(modules, certificate, channels, Inside(lanes=lanes))


@dataclass(frozen=True)
class Inside:
    """What a core has inside.

    Attributes
    ----------
    prefix : str
        Prefix of its nets.
    flag_count : int
        Number of flags of the inputs that come with a sample, above its fields, in place of what the ports say.
    lanes : int
        Samples of a beat.
    """

    prefix: str = ""
    flag_count: int = 0
    lanes: int = 1


def check_ports(modules: Mapping[str, Module], channels: int = 1) -> None:
    """Check that the first of some modules has the ports of a core, and no others.

    Raises
    ------
    RejectedError
        If it has not.
    """
    ports = set(next(iter(modules.values())).ports)
    wanted = _PORTS if channels == 1 else _PORTS | {DEST, OUTPUT_DEST}
    require(ports == wanted, f"the ports must be {', '.join(sorted(wanted))}, not {', '.join(sorted(ports))}")


def check_modules(
    modules: Mapping[str, Module], certificate: Certificate, channels: int, inside: Inside
) -> HardwareVerdict:
    """Prove what modules compute, the top first; the rest is as of `check_hardware`."""
    check_ports(modules, channels)
    with deep_recursion():
        return _checked(flattened(modules, CLOCK), certificate, channels, inside)


def _checked(netlist: Netlist, certificate: Certificate, channels: int, inside: Inside) -> HardwareVerdict:
    forms = Forms()
    prefix = inside.prefix
    netlist = with_memories(netlist) if channels == 2 else netlist
    words = {name: len(memory.first) for name, memory in netlist.memories.items()} if channels == 1 else {}
    graph = GraphCodes(certificate, forms, inside.lanes, words, prefix)
    netlist = split(netlist, {netlist.holder(graph.state_name(node)) or "" for node in graph.delays})
    control = find_control(netlist) if channels == 1 else find_channels(netlist, channels, prefix)
    pipeline = Pipeline(netlist, control, graph, forms, certificate, inside.flag_count)
    try:
        pipeline.check_states()
        _check_output(pipeline.buffered(), netlist, pipeline, graph, certificate, prefix)
        pipeline.check_followed()
        if channels > 1:
            dest = pipeline.buffered().net(OUTPUT_DEST)
            right = pipeline.same(dest, pipeline.channel, netlist.widths[OUTPUT_DEST])
            require(right, f"{OUTPUT_DEST} must be the channel of the sample, not another value")
    except RejectedError as error:
        raise fault(netlist, pipeline, graph) or error from None
    memories = 0 if pipeline.memories is None else len(pipeline.memories.states)
    latency = len(control.valid) + (channels > 1)
    waits, clearing = (0, 0) if control.entrance is None else (len(control.entrance.near), channels)
    states, reading = len(pipeline.states) + memories, Reading(netlist, pipeline, graph)
    return HardwareVerdict(pipeline.registers, memories, states, latency, waits, clearing, reading=reading)


def _check_output(
    logic: Evaluation,
    netlist: Netlist,
    pipeline: Pipeline,
    graph: GraphCodes,
    certificate: Certificate,
    prefix: str,
) -> None:
    """Check what leaves the core while `m_axis_tvalid` is 1."""
    width = -(-certificate.output.bits // 8) * 8
    for name, each in ((OUTPUT, width), (FLAGS, _FLAG_BITS)):
        wanted = each * len(graph.lanes)
        require(netlist.widths[name] == wanted, f"the port {name} must have {wanted} bits, not {netlist.widths[name]}")
    limits = None if certificate.about is None else wear_limits(pipeline, netlist, certificate, prefix)
    for number, lane in enumerate(graph.lanes):
        label = graph.nodes[lane.output].label
        data = logic.net(OUTPUT, width * number, width)
        what = OUTPUT if len(graph.lanes) == 1 else f"sample {number} of {OUTPUT}"
        require(pipeline.same(data, graph.seen(lane.output, ""), width), f"{what} must be {label}, not another value")
        for bit in range(_FLAG_BITS * number, _FLAG_BITS * (number + 1)):
            logic.net(FLAGS, bit, 1)  # of the sample whose beat it leaves with, also where nothing is said of its value
        for flag in flags_of(graph, lane, certificate, pipeline.input_flags, limits):
            bit = _FLAG_BITS * number + flag.place
            why = f", as the ports and {label} say" if flag.name else ""
            require(
                pipeline.same(logic.net(FLAGS, bit, 1), flag.value, 1),
                f"bit {bit} of {FLAGS} must be {flag.name or '0, as there is no such flag'}{why}, not another value",
            )
