r"""Sections of the same structure in hardware of one, for one channel: a sample goes through it once for each of them.

::

               first ?
    i0 -------->|\                  clock 0          clock 1          clock D-1 of a turn
                | |---> x ---------> taps --[passed]--> product --[passed]--> sum --+
          +---->|/                    ^                    ^                        |  at the last clock of a turn
          |                           |              [constants]                   v
          |                       [state of the section whose turn it is] <--    [state of the section before] <- ..
          |                                                                         |
          +--------------------- output, bits of the newest state <-----------------+---> o0

    i_valid --> [valid1] --> [valid2] -- .. --> [valid K D] --> o_valid

The states of all sections stand in one row of K places for each DELAY; the section whose turn it is finds its own in
the last of them. At the end of its turn the row moves on, so that no place has to be chosen: after K turns all are
where they were. Between samples, each place has the name of the section whose state it then holds.

The constants are those of the section whose turn it is, from registers that change between turns. All of this stays as
it is during a turn, and nothing has a register but what a later clock of the turn needs of an
earlier one. Latency: K D clocks at which `advance` is high; throughput: one sample in as many. The next sample may come
when the first one leaves.
"""

from __future__ import annotations

from functools import reduce
from itertools import pairwise
from operator import or_

from amaranth.hdl import Const, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from sosmith.hdl.constant_banks import NO_CONSTANTS
from sosmith.hdl.pipelined_logic import PipelinedLogic, name_ports, shape_of, unique_names
from sosmith.hdl.plan.pipeline import inner_sums
from sosmith.hdl.plan.sharing.sections import SharedSections
from sosmith.hdl.stages.pipelined import held
from sosmith.model.dataflow.graph import Op


class SharedStage(wiring.Component):
    """Sections that share hardware.

    Parameters
    ----------
    sections : SharedSections
        What it computes.
    clocks : int
        D, clocks of a section's turn.

    Members
    -------
    i0 : In(shape)
        Code that goes into the first section, which stays as it is while that has its turn.
    i_valid : In(1)
        Whether a sample comes: no other one may come for K D clocks at which `advance` is high.
    advance : In(1)
        Whether anything moves at this clock.
    o0 : Out(shape)
        Output of the last section; defined from the clock on at which `o_valid` is high, for D clocks.
    o_valid : Out(1)
        Whether a sample has gone through all sections at this clock.
    o_saturated : Out(1)
        0: no section limits anything.
    """

    def __init__(self, sections: SharedSections, clocks: int) -> None:
        self._sections, self._clocks = sections, clocks
        first, *_, last = sections.stages
        self.name = f"{first.name}_to_{last.name}"
        before, behind = first.graph, last.graph
        super().__init__(
            {
                "i0": In(shape_of(before.nodes[before.inputs[0]])),
                "o0": Out(shape_of(behind.nodes[behind.outputs[0]])),
                "i_valid": In(1),
                "advance": In(1),
                "o_valid": Out(1),
                "o_saturated": Out(1),
            }
        )
        self.outputs = name_ports(self, behind)

    def elaborate(self, platform: object) -> Module:
        """Build the logic."""
        m = Module()
        sections, clocks, graph = self._sections, self._clocks, self._sections.graph
        turn = sections.turn(clocks)
        takes, valid = self._control(m)
        member = self._member(m, takes[-1])
        first = Signal(init=1, name="first")
        with m.If(takes[-1]):
            m.d.sync += first.eq(self._is_last(member))
        rows = {index: self._row(index) for index in graph.delays}
        entry = graph.nodes[graph.inputs[0]]
        own = sections.stages[0].graph
        shift = entry.frac - own.nodes[own.inputs[0]].frac
        newest: list[Value] = [rows[index][0] if index in rows else Const(0) for index in range(len(graph.nodes))]
        output = held(graph, graph.outputs[0], newest)
        behind = None
        if output is None:
            output = behind = Signal(shape_of(graph.nodes[graph.outputs[0]]), name="y_register", reset_less=True)
        x = Signal(shape_of(entry), name="entry")
        back = output.shift_left(entry.frac - graph.nodes[graph.outputs[0]].frac)
        m.d.comb += x.eq(Mux(first, self.i0.shift_left(shift), back))
        constants = {
            index: self._constant(m, index, member, takes[-1])
            for index, values in sections.constants.items()
            if len(set(values)) > 1
        }
        sums = {index: value for index, value in constants.items() if graph.nodes[index].op is Op.CONSTANT}
        logic = PipelinedLogic(
            m,
            graph,
            turn,
            constants=NO_CONSTANTS,
            banks=[Const(0, 1)] * clocks,
            takes=takes,
            valid=valid,
            words={index: row[-1] for index, row in rows.items()} | sums,
            kept=sections.kept,
            factors=constants,
        )
        logic.connect([x], inner_sums(graph, turn))
        following = {index: logic.at(graph.nodes[index].operands[0], clocks - 1) for index in rows}
        results = [] if behind is None else [behind.eq(logic.at(graph.outputs[0], clocks - 1))]
        with m.If(takes[-1]):
            for index, row in rows.items():
                m.d.sync += row[0].eq(following[index])
                m.d.sync += [place.eq(before) for before, place in pairwise(row)]
            m.d.sync += results
        last = sections.stages[-1].graph
        longer = graph.nodes[graph.outputs[0]].frac - last.nodes[last.outputs[0]].frac
        m.d.comb += [self.o0.eq(output.shift_right(longer)), self.o_valid.eq(valid[-1])]
        return m

    def _control(self, m: Module) -> tuple[list[Value], list[Value]]:
        """Return whether each clock of a turn is at this clock, and what goes along with a sample."""
        count, clocks = len(self._sections.stages), self._clocks
        valid: list[Value] = [self.i_valid]
        for k in range(1, count * clocks + 1):
            there = Signal(name=f"valid{k}")
            with m.If(self.advance):
                m.d.sync += there.eq(valid[-1])
            valid.append(there)
        takes: list[Value] = []
        for k in range(clocks):
            take = Signal(name=f"take{k}")
            m.d.comb += take.eq(self.advance & reduce(or_, valid[k:-1:clocks]))
            takes.append(take)
        return takes, valid

    def _member(self, m: Module, ends: Value) -> Signal:
        """Count the turns of a sample."""
        member = Signal(range(len(self._sections.stages)), name="member")
        with m.If(ends):
            m.d.sync += member.eq(Mux(self._is_last(member), 0, member + 1))
        return member

    def _is_last(self, member: Signal) -> Value:
        return member == len(self._sections.stages) - 1

    def _row(self, index: int) -> list[Signal]:
        """Return the places of a state, the newest first."""
        graph, sections = self._sections.graph, self._sections
        name, shape = unique_names(graph)[index], shape_of(graph.nodes[index])
        names = [
            f"{stage.name}_{name if own is None else unique_names(stage.graph)[own]}"
            for stage, own in zip(sections.stages, sections.states[index], strict=True)
        ]
        return [Signal(shape, name=each) for each in reversed(names)]

    def _constant(self, m: Module, index: int, member: Signal, ends: Value) -> Signal:
        """Return a constant, of a sum or a product, which changes at the end of a turn to that of the next section."""
        constants = self._sections.constants[index]
        bits = max(value.bit_length() if value >= 0 else (~value).bit_length() for value in constants)
        shape = signed(bits + 1) if min(constants) < 0 else bits
        name = unique_names(self._sections.graph)[index]
        constant = Signal(shape, name=f"own_{name}", init=constants[0])
        following: Value = Const(constants[0], shape)
        for number, value in enumerate(constants[1:]):
            following = Mux(member == number, Const(value, shape), following)
        with m.If(ends):
            m.d.sync += constant.eq(following)
        return constant
