"""How samples become results in a core that decimates and takes a sample at each clock."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

from sosmith.hdl.plan.rounded_sum import last_node
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Op


@dataclass(frozen=True, kw_only=True)
class DecimatingPlan(ABC):
    """What all such cores have.

    Attributes
    ----------
    factor : int
        R, samples for each result, from 2 on.
    filled : bool
        Whether the first sample goes in before it is accepted, until nothing else is remembered.
    settling : int
        Results that are flagged as settling after a start from zero.
    limits : bool
        Whether results are limited to the range of the output.
    channels : int
        Number of channels. Where there are several, a sample waits in front for what is kept of its channel.
    """

    factor: int
    filled: bool
    settling: int
    limits: bool
    channels: int = 1

    @property
    @abstractmethod
    def fills(self) -> int:
        """Times that R samples go in before the first one is accepted; 0 with a start from zero."""

    @property
    @abstractmethod
    def clocks(self) -> int:
        """Clocks from the edge at which a sample enters to the one that loads its result, before that is limited."""

    @property
    def latency_cycles(self) -> int:
        """Clocks from the edge that accepts a sample to the one that can output its result.

        One more where results are limited, and one for the output buffer. Of several channels, one more, and those of
        a first sample, which may fill the filter before, at every second clock.
        """
        in_front = 1 + 2 * self.fills * self.factor if self.channels > 1 else 0
        return in_front + self.clocks + self.limits + 1

    @property
    def reset_cycles(self) -> int:
        """Clocks after a reset until the first sample is accepted, which is on offer.

        With several channels, a word for each of them is cleared.
        """
        return self.channels if self.channels > 1 else self.fills * self.factor


class Paced(NamedTuple):
    """The attributes of a `DecimatingPlan`, as a datapath has them."""

    factor: int
    filled: bool
    settling: int
    limits: bool


def paced(datapath: Datapath) -> Paced:
    """Return how samples become results in a datapath with an FIR filter and the output.

    Raises
    ------
    ValueError
        If all results leave.
    """
    down = datapath.downsampler
    if down is None or down.factor < 2:
        raise ValueError("datapath must have a downsampler that leaves results out")
    graph = datapath.stages[-1].graph
    counted = next((graph.nodes[index].high for index in graph.delays), 0)
    return Paced(down.factor, down.filled > 0, -(-counted // down.factor), last_node(datapath).op is Op.CLAMP)
