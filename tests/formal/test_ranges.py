"""No node of a small section leaves the range that its graph states, whatever the input, proven on the hardware."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from amaranth.hdl import Assert, Assume, Module
from tests.formal.prover import Proof, prove
from tests.formal.small import port, resonator
from tests.gen.proven_stages import Ranges, proven_cascade

from sosmith.gen.realizations.section_format import WIDE
from sosmith.hdl.pipelined_logic import unique_names
from sosmith.hdl.plan.pipeline import pipeline_stages
from sosmith.hdl.stages.pipelined import PipelinedStage
from sosmith.model.dataflow.graph import Op, Range
from sosmith.model.dataflow.structure import Stage
from sosmith.model.sections.direct_form import DirectForm1, Product


class StatedRanges(Proof):
    """Every node's code is in its range while its pipeline stage holds a sample; of a BOUND, the operand's code is.

    Parameters
    ----------
    stage : Stage
        With input codes free in their range.
    """

    def __init__(self, stage: Stage) -> None:
        super().__init__(PipelinedStage(stage))
        self.graph = stage.graph

    def state(self, m: Module) -> None:
        """State the ranges."""
        for k, index in enumerate(self.graph.inputs):
            node, code = self.graph.nodes[index], getattr(self.design, f"i{k}")
            m.d.comb += Assume((code >= node.low) & (code <= node.high))
        names, stages = unique_names(self.graph), pipeline_stages(self.graph)
        for index, node in enumerate(self.graph.nodes):
            if node.op in {Op.INPUT, Op.CONSTANT, Op.SHIFT}:
                continue
            source = node.operands[0] if node.op is Op.BOUND else index
            while self.graph.nodes[source].op is Op.SHIFT:
                source = self.graph.nodes[source].operands[0]
            code = self.inside[names[source]]
            valid = self.inside[f"valid{stages[index]}"] if stages[index] else self.design.i_valid
            with m.If(self.started & valid):
                m.d.comb += Assert((code >= node.low) & (code <= node.high))


def section(entry: Range, ranges: Ranges, y_frac: int) -> DirectForm1:
    """Make a section with error feedback of second order and poles at 0.71; its state has a guard of 4 bits."""
    return DirectForm1(
        name="section",
        products=(Product("A1", 5, 2, (0, 0, 0), (-1, 1)), Product("A2", 3, 2, (1, 2, 1), (0, -4), 2)),
        integer_part=(-2, 1),
        feedback=(-2, 1),
        x=entry,
        y_frac=y_frac,
        v_range=ranges.get("v", (-WIDE, WIDE)),
    )


def proven_section(bits: int, y_frac: int) -> DirectForm1:
    (stage,) = proven_cascade([partial(section, y_frac=y_frac)], port("x", bits))
    assert isinstance(stage, DirectForm1)
    return stage


@pytest.mark.slow
def test_a_resonator_stays_in_its_range(tmp_path: Path) -> None:
    assert prove(StatedRanges(resonator(-7, 5).stages[0]), tmp_path) == "PASS"


@pytest.mark.slow
def test_a_section_stays_in_its_ranges(tmp_path: Path) -> None:
    assert prove(StatedRanges(proven_section(bits=2, y_frac=0)), tmp_path) == "PASS"


@pytest.mark.slow
def test_a_section_of_three_bits_stays_in_its_ranges(tmp_path: Path) -> None:
    assert prove(StatedRanges(proven_section(bits=3, y_frac=0)), tmp_path, timeout=1800) == "PASS"


@pytest.mark.slow
def test_a_range_that_is_one_too_narrow_is_found_out(tmp_path: Path) -> None:
    assert prove(StatedRanges(resonator(-6, 5).stages[0]), tmp_path) == "FAIL"


@pytest.mark.slow
def test_a_section_that_overflows_is_found_out(tmp_path: Path) -> None:
    stage = proven_section(bits=2, y_frac=0)
    narrow = replace(stage, v_range=(stage.v_range[0] // 2, stage.v_range[1] // 2))
    assert prove(StatedRanges(narrow), tmp_path) == "FAIL"
