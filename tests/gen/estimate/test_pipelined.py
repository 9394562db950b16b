"""Registers of pipeline stages: states, what is passed on, outputs that no state holds, and the first sample."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from sosmith.gen.core import design_core
from sosmith.gen.estimate.core import quantities_of
from sosmith.gen.estimate.graphs import of_pipelined, of_start
from sosmith.gen.estimate.pipelined import Pipelined
from sosmith.gen.estimate.quantities import Quantities
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.specification.specification import from_text
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range
from sosmith.model.sections.start import PassingStage, StartStage

DEVICE = find_board("ulx3s_25f").device

SPEC = """
name = "plain"
sample_rate = 1000.0
[input.x]
bits = 12
signed = true
range = [-1.0, 1.0]
[filter]
family = "butterworth"
kind = "lowpass"
order = 4
cutoff = 100.0
[output]
bits = 12
signed = true
range = [-1.0, 1.0]
unit = ""
max_error = 0.001
[hardware]
clock = 12.0e6
architecture = "parallel"
realization = "df1"
"""


def counted(graph: Graph) -> Quantities:
    return of_pipelined(Pipelined.of_one(graph, ()), DEVICE)


def drawn_in_the_hardware(*, limited: bool = False) -> Graph:
    """Return the graph that `sosmith.hdl.stages.pipelined` draws with its registers."""
    g = GraphBuilder()
    x = g.input("x", frac=0, low=-2, high=1)
    v1 = g.delay("v1", frac=0, low=-12, high=11)
    v2 = g.previous(v1, "v2")
    early = g.add(x, g.previous(x, "x1"), "early")
    older = g.subtract(early, g.floor(g.shift(v2, -2), frac=0), "older")
    v = g.bound(g.add(older, g.floor(g.shift(v1, -1), frac=0)), -12, 11, "v")
    g.connect(v1, v)
    return g.build([g.clamp(v, -8, 7)] if limited else [v])


def test_registers_are_those_that_the_picture_of_the_hardware_has() -> None:
    """x1, passed1, passed2, v1 and v2, and two bits beside each of three pipeline stages."""
    assert counted(drawn_in_the_hardware())["registers"] == 2 + 3 + 4 + 5 + 5 + 2 * 3


def test_an_output_that_is_no_part_of_a_state_has_a_register() -> None:
    assert counted(drawn_in_the_hardware(limited=True))["registers"] == 2 + 3 + 4 + 5 + 5 + 2 * 3 + 4


@pytest.mark.parametrize("passes", [True, False])
def test_the_start_is_one_subtractor_and_three_registers(*, passes: bool) -> None:
    """Of the change, the first sample, and whether there is one; two bits go with a sample."""
    stage = StartStage(x=Range(0, -128, 127), passes=passes)
    assert of_start(stage) == Counter(sums=9, logic=2, registers=9 + 8 + 1 + 2)


def test_no_stage_passes_on_the_first_sample_where_none_checks_it() -> None:
    architecture = design_core(from_text(SPEC, Path("plain.toml"))).architecture
    start, *sections = architecture.datapath.stages[:3]
    assert isinstance(start, StartStage)
    passing = [stage for stage in sections if isinstance(stage, PassingStage)]
    assert len(passing) == 2
    without = sum(counted(stage.section.graph)["registers"] for stage in passing)
    passed = sum(counted(stage.graph)["registers"] for stage in passing)
    depths = [Pipelined.of_one(stage.graph, ()).depth for stage in passing]
    assert passed == without + 12 * sum(depths)
    once = quantities_of(architecture, DEVICE)["registers"]
    guarded = quantities_of(replace(architecture, protect="detect"), DEVICE)["registers"]
    parities = sum(len(stage.graph.delays) for stage in architecture.datapath.stages)
    of_samples = counted(start.graph)["registers"] + 2 * Pipelined.of_one(start.graph, ()).depth
    fault = 2  # a flag in both words of the buffer
    assert guarded - once == 12 * sum(depths) + of_samples - (of_start(start)["registers"] + 2) + parities + fault
