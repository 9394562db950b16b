"""The states of a core with several channels: memories with a word for the DELAY node of each channel.

Samples of one channel are kept apart where they enter the pipeline, and all words are cleared before the first sample.
"""

from __future__ import annotations

from collections.abc import Mapping

from sosmith.verify.graph import require
from sosmith.verify.parallel.control import Case, Control, Entrance
from sosmith.verify.parallel.graph_codes import GraphCodes
from sosmith.verify.parallel.netlist import Netlist
from sosmith.verify.parallel.state_memories import NOWHERE, Registers, State, StateMemories, address_of
from sosmith.verify.program.normal_form import Form, constant


class ChannelMemories(StateMemories):
    """The memories of a core with several channels; see `StateMemories`, of which it proves the same.

    Parameters
    ----------
    registers, netlist, control, graph
        As those of `StateMemories`.
    entrance : Entrance
        That of `control`.
    """

    def __init__(
        self, registers: Registers, netlist: Netlist, control: Control, graph: GraphCodes, entrance: Entrance
    ) -> None:
        super().__init__(registers, netlist, control, graph, "channel")
        self._entrance = entrance
        self._apart: int | None = None

    def words(self, name: str) -> int:
        return self._entrance.channels

    def distance(self, name: str) -> int:
        if self._apart is None:
            self._apart = 1 + self._positions_without_the_channel()
        return self._apart

    def address(self, name: str) -> Form:
        return self._registers.channel

    def read(self, name: str, state: State, unknown: Form) -> Form:
        return self._graph.codes[state.node]

    def written(self, name: str, state: State) -> tuple[Form, str]:
        (source,) = self._graph.nodes[state.node].operands
        return self._graph.codes[source], self._graph.nodes[source].label

    @property
    def moving(self) -> Case:
        return {self._entrance.clearing: 0}

    def check_beginning(self, name: str, what: str) -> None:
        """Check that the word of one channel becomes 0 at each clock while states are cleared."""
        memory = self._netlist.memories[name]
        address = address_of(memory)
        for logic, loaded in self.each_written(memory, NOWHERE, {self._entrance.clearing: 1}):
            require(
                loaded is not None and self._registers.same(loaded, {}, memory.width), f"{what} and be cleared to 0"
            )
            require(
                self._registers.same(logic.word(address), logic.net(self._entrance.word), self._netlist.width(address)),
                f"{what} and be cleared for one channel after the other",
            )

    def _positions_without_the_channel(self) -> int:
        """Return how many first positions hold no sample of the channel of one that enters."""
        enters, channel = self._control.valid[0], self._registers.channel
        for count, near in enumerate(self._entrance.near):
            repeated = near.replace("near", "near_channel")
            require(repeated in self._netlist.registers, f"{near} must come with a register {repeated}")
            width = self._netlist.widths[repeated]
            here = self._registers.behind(repeated) == count
            require(
                here and self._registers.same(self._registers.content_of(repeated), channel, width),
                f"{repeated} must hold the channel of the sample at position {count + 1}",
            )
            met: Mapping[str, Form] = {
                self._entrance.buffer.valid: constant(1), near: constant(1), repeated: channel
            }  # fmt: skip
            if self._registers.in_front(met, enters).net(enters):
                return count
        return len(self._entrance.near)
