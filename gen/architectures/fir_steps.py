"""What coefficients of an FIR filter are chosen for where one multiplier takes its steps: few steps, and short ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from sosmith.hdl.plan.tap_steps import TapSteps
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, Op
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.fir import FirSection, Form

_BIT = Fraction(1, 1 << 10)
"""Weight of a bit of the coefficients: it decides between filters of as many steps."""


@dataclass(frozen=True)
class FewSteps:
    """Steps for each result, by one multiplier, of samples in a ring."""

    best = "the fewest steps"
    beyond = "more steps"
    unsuited = "they keep no samples"
    hopeless = math.inf
    negligible = 0.0
    few_digits = False
    floors_products = False
    exact_taps = False
    tied = False
    factor_bits = None

    def of_graph(self, graph: Graph) -> float:
        """Return 0: the output takes no step."""
        del graph
        return 0

    def of_datapath(self, datapath: Datapath) -> float:
        """Return the number of steps, and little more for long coefficients."""
        section = datapath.stages[0]
        if not isinstance(section, FirSection) or (section.form is Form.TRANSPOSED and section.length > 1):
            return math.inf
        plan = TapSteps(section)
        return float(len(plan.steps) + _BIT * max(abs(step.coefficient) for step in plan.steps).bit_length())

    def least(self, graphs: Sequence[Graph]) -> float:
        """Return half of the number of taps that have a product, as a step adds two.

        Raises
        ------
        ShortfallError
            If a filter keeps sums in place of samples.
        """
        for graph in graphs:
            repeats = {Op.INPUT, Op.DELAY}
            if any(graph.nodes[graph.nodes[i].operands[0]].op not in repeats for i in graph.delays):
                raise ShortfallError("the realization must be one that keeps samples where an FIR filter decimates")
        return sum(node.op is Op.SCALE for graph in graphs for node in graph.nodes)

    def size_text(self, datapath: Datapath) -> str:
        """Return the number of steps in words."""
        count = int(self.of_datapath(datapath))
        return f"{count} step{'s' * (count > 1)} for each result"


@dataclass(frozen=True)
class ExactTaps(FewSteps):
    """Taps as they are, for hardware that has no coefficients: of those, what takes software the fewest steps."""

    exact_taps = True
    tied = False

    def size_text(self, datapath: Datapath) -> str:
        """Return the number of steps in software in words."""
        return f"{super().size_text(datapath)} in software, none in hardware"
