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
    """

    factor: int
    filled: bool
    settling: int
    limits: bool

    @property
    @abstractmethod
    def fills(self) -> int:
        """Times that R samples go in before the first one is accepted; 0 with a start from zero."""

    @property
    @abstractmethod
    def clocks(self) -> int:
        """Clocks from the edge that accepts a sample to the one that loads its result, before that is limited."""

    @property
    def latency_cycles(self) -> int:
        """Clocks from the edge that accepts a sample to the one that can output its result.

        One more where results are limited, and one for the output buffer.
        """
        return self.clocks + self.limits + 1

    @property
    def reset_cycles(self) -> int:
        """Clocks after a reset until the first sample is accepted, which is on offer."""
        return self.fills * self.factor


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
