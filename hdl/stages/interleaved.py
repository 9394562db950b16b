"""A stage of a datapath for several channels that take turns: its recursion is pipelined through them.

The states lie in memories, one word for each channel. While one channel's sample is in the recursion, those of the
others follow, so that the recursion may take several clocks. `schedule` spreads the operations over pipeline stages: it
makes these as short as it can while the same channel may still come again once every other one has had its turn. A
memory is addressed a pipeline stage before its state is used, and written once the next value is there.

As an example, the recursion of `sosmith.hdl.stages.pipelined`, for 3 channels, with widths in bits,
``v(n) = x(n) + x(n-1) - floor(v(n-2) / 4) + floor(v(n-1) / 2)``::

    stage 0             stage 1                  stage 2                   stage 3

    i0 --------------[x_passed1]---> + -----[early_passed2]--> - ---[older_passed3]--> + ---[v_register]---> o0
     2                               ^      3                  ^    4                  ^  |            5
      |                              | 2                   floor(/4)               floor(/2)
      v data                         |                         | 5                     | 5|
    +----------+  read               |        +----------+     |       +----------+    |  |
    | x1, 3x2  |---------------------+        | v2, 3x5  |-----+       | v1, 3x5  |----+  |
    +----------+                              +----------+             +----------+       |
      ^ address                                 ^      ^                 ^      ^ data    |
      i_channel                    address in 1 |      | data: v1        |      +-[v_passed4]
                                   [channel1] --+                        +-- [channel2], address in 2

The memory of v2 is written in stage 3, that of v1 with the output, behind stage 3: a choice lies before it, between the
next state and 0 to clear it. Both are addressed by [channel3] and [channel4]. As each is written two stages after it is
addressed, a channel may come again 2 + 1 = 3 samples later, `Schedule.distance`; `sosmith.hdl.cores.parallel` holds
back a sample that comes too soon. A product that one multiplier block computes gets a stage of its own, where the loop
has clocks for it: the registers on both sides can be those of the block.
The channels 0, 1, 2, 0, 1 with the codes 1, 1, -2, 1, 1 give::

    clock            0    1    2    3    4    5    6    7    8
    i_channel        0    1    2    0    1
    i0               1    1   -2    1    1
    o_channel                            0    1    2    0    1
    o0                                   1    1   -2    2    2

With protection, each memory has check bits, and what a sample found wrong goes with it. A scrub goes through the stages
like a sample of its channel, but that each memory is written with what it has read::

    +----------+                                          scrub?
    | v2, 3x5+ |--> check bits --> corrected --+--> ..      |
    |  check   |        |                      +--[passed]--> Mux --> check bits --> data of the memory
    +----------+        +--> failed --> or -->[fault2]..    ^
                                               the next state

The latency is 4 clocks. The same recursion takes 3 pipeline stages for 2 channels, whose states are registers and read
without a clock (`sosmith.hdl.stages.register_words`), and 5 for 17, whose block RAM has a register before it and one
behind.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from amaranth.hdl import Const, Module, Mux, Shape, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.hdl.check_bits import CheckBits, Read
from sosmith.hdl.constant_banks import NO_CONSTANTS, Pair
from sosmith.hdl.memory_ports import read_port, write_port
from sosmith.hdl.pipelined_logic import PipelinedLogic, banks_in_use, limits, name_ports, shape_of
from sosmith.hdl.plan.interleaving import schedule
from sosmith.hdl.plan.pipeline import inner_sums
from sosmith.hdl.plan.streams import channel_bits
from sosmith.hdl.stages.register_words import two_words
from sosmith.model.dataflow.graph import Op
from sosmith.model.dataflow.structure import Stage

_BLOCK_RAM = {"ram_style": "block", "no_rw_check": 1}
"""Attributes of memories in block RAM. A sample's states are read at least a clock before they are written, so that
nobody uses a word that is read while it is being written."""


class InterleavedStage(wiring.Component):
    """A datapath stage for several channels.

    Latency: `Schedule.depth` in clocks at which `advance` is high. Throughput: one sample at each of these clocks, of
    any channel whose last sample came at least `Schedule.distance` of them before.

    Parameters
    ----------
    stage : Stage
        What it computes.
    channels : int
        Number of channels, at least 2.
    constants : dict of int to Pair
        Constants that come from one of two banks, by node.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`, for the memories of the states.
    adders : collection of int
        Products by constants that are made of adders, by node.

    Members
    -------
    i0, i1, .. : In(shape)
        Input codes, in the order of the graph's inputs.
    i_valid : In(1)
        Whether the inputs hold a sample. The states change with valid samples only.
    i_channel : In(channel_bits)
        Number of its channel.
    i_bank, o_bank, uses : In(1), Out(1), Out(2)
        As in `sosmith.hdl.stages.pipelined.PipelinedStage`.
    advance : In(1)
        Whether the pipeline moves at this clock.
    clear, clear_channel : In(1), In(channel_bits)
        While `clear` is high, the states of the channel `clear_channel` are set to 0; the pipeline must be empty.
    o0, o1, .. : Out(shape)
        Output codes, in the order of the graph's outputs; defined while `o_valid` is high.
    o_valid, o_channel : Out(1), Out(channel_bits)
        Whether the outputs hold a sample, and of which channel.
    o_saturated : Out(1)
        Whether the output had to be limited to its range.
    i_scrub, o_scrub : In(1), Out(1)
        Whether the states of `i_channel` are to be written as they are read, and whether that is done for `o_channel`;
        never with `i_valid`, and by the same rule for channels that come again. Only with protection.
    i_fault, o_fault : In(1), Out(1)
        Whether a wrong bit that could not be corrected was found for what is at the inputs, and at the outputs; only
        with protection.
    corrected : Out(1)
        Whether a wrong bit is corrected at this clock; only with protection.
    """

    def __init__(
        self,
        stage: Stage,
        channels: int,
        constants: Mapping[int, Pair] = NO_CONSTANTS,
        *,
        protect: str = "none",
        adders: Collection[int] = (),
    ) -> None:
        self.name = stage.name
        self.stage = stage
        self.adders = adders
        self.protect = protect
        self.constants = constants
        self.channels = channels
        self.schedule = schedule(stage.graph, channels, rewrites=protect != "none", adders=adders)
        graph, bits = stage.graph, channel_bits(channels)
        members = {f"i{k}": In(shape_of(graph.nodes[i])) for k, i in enumerate(graph.inputs)}
        members |= {f"o{k}": Out(shape_of(graph.nodes[i])) for k, i in enumerate(graph.outputs)}
        members |= {"i_valid": In(1), "i_channel": In(bits), "advance": In(1)}
        members |= {"i_bank": In(1), "o_bank": Out(1), "uses": Out(2)}
        members |= {"clear": In(1), "clear_channel": In(bits)}
        if protect != "none":
            members |= {"i_scrub": In(1), "o_scrub": Out(1), "i_fault": In(1), "o_fault": Out(1), "corrected": Out(1)}
        super().__init__({**members, "o_valid": Out(1), "o_channel": Out(bits), "o_saturated": Out(1)})
        self.outputs = name_ports(self, graph)

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        graph, plan = self.stage.graph, self.schedule
        valid, channel, banks = self._control(m)
        logic = PipelinedLogic(
            m,
            graph,
            plan.pipeline_stages,
            constants=self.constants,
            banks=banks,
            takes=[self.advance] * plan.depth,
            valid=valid,
            adders=self.adders,
        )
        logic.connect(
            [getattr(self, f"i{k}") for k in range(len(graph.inputs))], inner_sums(graph, plan.pipeline_stages)
        )
        scrub = self._scrub(m)
        reads = self._connect_memories(m, logic, valid, channel, scrub)
        if self.protect != "none":
            self._judge(m, reads, [there | scrubs for there, scrubs in zip(valid, scrub, strict=True)])
        last = plan.depth - 1
        for k, i in enumerate(graph.outputs):
            register = Signal(shape_of(graph.nodes[i]), name=f"{logic.names[i]}_register", reset_less=True)
            m.d.comb += getattr(self, f"o{k}").eq(register)
            with m.If(self.advance):
                m.d.sync += register.eq(logic.at(i, last))
                if graph.nodes[i].op is Op.CLAMP:
                    below, above = limits(graph.nodes[i], logic.at(graph.nodes[i].operands[0], last))
                    m.d.sync += self.o_saturated.eq(below | above)
        return m

    def _connect_memories(
        self, m: Module, logic: PipelinedLogic, valid: list[Value], channel: list[Value], scrub: list[Value]
    ) -> dict[int, Read]:
        """Give each state a memory with one word for each channel; return what is read, by the node of the state."""
        graph, plan = self.stage.graph, self.schedule
        at, wires, names = logic.at, logic.wires, logic.names
        reads: dict[int, Read] = {}
        for index in graph.delays:
            node, written = graph.nodes[index], plan.writes[index]
            check = CheckBits(node.width, self.protect)
            following, writes = at(node.operands[0], written), valid[written]
            if self.protect != "none":
                state = Signal(shape_of(node), name=f"{names[index]}_next")
                m.d.comb += state.eq(Mux(scrub[written], at(index, written), following))
                following, writes = state.as_unsigned(), valid[written] | scrub[written]
            word = self._word(
                m,
                shape_of(node) if self.protect == "none" else Shape(check.width),
                names[index],
                address=channel[plan.pipeline_stages[index] - plan.reading],
                write=self.advance & writes,
                write_address=channel[written],
                data=check.written(following),
            )
            reads[index] = check.read(m, word, names[index])
            m.d.comb += wires[index].eq(reads[index].data)
        return reads

    def _word(
        self, m: Module, shape: Shape, name: str, *, address: Value, write: Value, write_address: Value, data: Value
    ) -> Value:
        """Keep a word of a state for each channel; return the one at `address`, `Schedule.reading` clocks later."""
        if not self.schedule.reading:
            return two_words(
                m,
                shape,
                name,
                address=address,
                write=write,
                write_address=write_address,
                data=data,
                clear=self.clear,
                clear_address=self.clear_channel,
            )
        reading = self.schedule.reading
        m.submodules[f"{name}_memory"] = memory = Memory(
            shape=shape, depth=self.channels, init=[0] * self.channels, attrs=_BLOCK_RAM if reading > 1 else {}
        )
        read, written = read_port(memory, f"{name}_memory"), write_port(memory, f"{name}_memory")
        m.d.comb += [
            read.en.eq(self.advance),
            read.addr.eq(address),
            written.addr.eq(Mux(self.clear, self.clear_channel, write_address)),
            written.data.eq(Mux(self.clear, 0, data)),
            written.en.eq(self.clear | write),
        ]
        if reading < 2:
            return read.data
        word = Signal(read.data.shape(), name=f"{name}_read", reset_less=True)
        with m.If(self.advance):
            m.d.sync += word.eq(read.data)
        return word

    def _scrub(self, m: Module) -> list[Value]:
        """Return for each pipeline stage, and for the outputs, whether it holds a scrub."""
        if self.protect == "none":
            return [Const(0, 1)] * (self.schedule.depth + 1)
        scrub: list[Value] = [self.i_scrub]
        for k in range(1, self.schedule.depth + 1):
            scrub.append(Signal(name=f"scrub{k}"))
            with m.If(self.advance):
                m.d.sync += scrub[k].eq(scrub[k - 1])
        m.d.comb += self.o_scrub.eq(scrub[-1])
        return scrub

    def _judge(self, m: Module, reads: Mapping[int, Read], there: list[Value]) -> None:
        """Let each sample and each scrub take along what was found wrong in the states that it has read."""
        fault: Value = self.i_fault
        corrected: Value = Const(0, 1)
        for k in range(self.schedule.depth):
            own = [read for index, read in reads.items() if self.schedule.pipeline_stages[index] == k]
            for read in own:
                fault = fault | read.failed
                corrected = corrected | (read.corrected & there[k])
            later = Signal(name=f"fault{k + 1}", reset_less=True)
            with m.If(self.advance):
                m.d.sync += later.eq(fault)
            fault = later
        m.d.comb += [self.o_fault.eq(fault), self.corrected.eq(corrected & self.advance)]

    def _control(self, m: Module) -> tuple[list[Value], list[Value], list[Value]]:
        """Return for each pipeline stage, and for the outputs, whether it holds a sample, its channel, and its bank."""
        valid: list[Value] = [self.i_valid]
        channel: list[Value] = [self.i_channel]
        banks: list[Value] = [self.i_bank]
        for k in range(1, self.schedule.depth + 1):
            valid.append(Signal(name=f"valid{k}"))
            channel.append(Signal(len(self.i_channel), name=f"channel{k}", reset_less=True))
            banks.append(Signal(name=f"bank{k}", reset_less=True))
            with m.If(self.advance):
                m.d.sync += [valid[k].eq(valid[k - 1]), channel[k].eq(channel[k - 1])]
                m.d.sync += banks[k].eq(banks[k - 1])
        m.d.comb += [self.o_valid.eq(valid[-1]), self.o_channel.eq(channel[-1]), self.o_bank.eq(banks[-1])]
        m.d.comb += self.uses.eq(banks_in_use(valid[:-1], banks[:-1]))
        return valid, channel, banks
