"""What designs are made small for: the estimates of the search against whole designs."""

import math
import re
from dataclasses import replace
from typing import Any

import pytest
from tests.gen.designs import ALL, example_design, parallel_design

from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.word_lengths import objective
from sosmith.gen.word_lengths.objective import SMALL_AREA, FewSums, Objective, ShortProgram
from sosmith.gen.word_lengths.online_units import OnlineUnits
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding import fold
from sosmith.model.dataflow.graph import GraphBuilder
from sosmith.model.dataflow.program import serial_clocks
from sosmith.model.errors import ShortfallError

OBJECTIVES = [
    SMALL_AREA,
    ShortProgram("folded", 15),
    ShortProgram("folded", 17),
    ShortProgram("serial", 15, bit_serial=True),
]


def estimated(objective: Objective, datapath: Datapath) -> float:
    return sum(objective.of_graph(stage.graph) for stage in datapath.stages)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("objective", OBJECTIVES, ids=str)
def test_estimates_are_near_and_nothing_is_below_the_least(objective: Objective, name: str) -> None:
    datapath = example_design(name).datapath
    size = objective.of_datapath(datapath)
    assert estimated(objective, datapath) == pytest.approx(size, rel=0.12)
    assert 0 < objective.least([stage.graph for stage in datapath.stages]) < size


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", ALL)
def test_each_objective_is_met_best_by_what_was_made_for_it(name: str) -> None:
    parallel, folded = parallel_design(name).datapath, example_design(name).datapath
    short = ShortProgram("folded", 15)
    assert SMALL_AREA.of_datapath(parallel) < SMALL_AREA.of_datapath(folded)
    assert short.of_datapath(folded) < short.of_datapath(parallel)


def test_memory_and_accumulator_decide_between_programs_of_the_same_length() -> None:
    design = example_design("audio_lowpass.toml")
    program = design.architecture.program
    assert program is not None
    size = ShortProgram("folded", 15).of_datapath(design.datapath)
    length = len(program.instructions)
    assert size == length + program.words / 2**16 + program.accumulator_bits / 2**24
    assert program.words / 2**16 > 64 / 2**24  # a word outweighs any accumulator
    assert size < length + 1


def test_a_datapath_is_folded_once_for_its_size_and_its_hardware(monkeypatch: pytest.MonkeyPatch) -> None:
    design, made = example_design("flange_wear_bench.toml"), list[Datapath]()

    def program(datapath: Datapath, *values: Any, **options: Any) -> Any:
        made.append(datapath)
        return fold.program(datapath, *values, **options)

    monkeypatch.setattr(objective, "program", program)
    objective._folded.cache_clear()
    hardware = replace(design.architecture)  # which knows no program yet
    assert ShortProgram("folded", hardware.digit_bits).of_datapath(design.datapath) > 0
    assert hardware.program is not None
    assert made == [design.datapath]


def test_what_cannot_be_folded() -> None:
    g = GraphBuilder()
    x = g.input("x", frac=3, low=-8, high=7)
    graph = g.build([g.floor(g.truncate(x, 1, "cut"), 0, "y")])
    objective = ShortProgram("serial", 15, bit_serial=True)
    assert objective.of_graph(graph) == math.inf
    sentence = (
        "the realization must suit the serial architecture: the datapath must not truncate inside to be folded; "
        "parallel takes every realization"
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(sentence)}$"):
        objective.least([graph])
    assert objective.of_datapath(parallel_design("audio_lowpass.toml", realization="lattice_wdf").datapath) == math.inf


def test_what_cannot_be_on_line() -> None:
    g = GraphBuilder()
    x = g.input("x", frac=3, low=-8, high=7)
    sentence = (
        "the sections must suit the online architecture, as recursive ones in df1, df1_ef1 and df1_ef2 do: a section "
        "must be recursive; parallel takes every realization"
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(sentence)}$"):
        OnlineUnits().least([g.build([g.bound(g.previous(x, "x1"), -8, 7, "y")])])


@pytest.mark.parametrize(("constant", "area"), [(4, 0), (5, 25), (75, 75), (43691, 121)])
def test_a_product_with_look_ahead_takes_sums_where_these_are_smaller_than_blocks(constant: int, area: int) -> None:
    """Of 23 bits, it takes two blocks, counted as 40 LUT4 each, and a sum of their pieces."""
    g = GraphBuilder()
    x = g.input("x", frac=0, low=-(1 << 22), high=(1 << 22) - 1)
    graph = g.build([g.scale(x, constant, 17)])
    assert FewSums(18).of_graph(graph) == area


@pytest.mark.parametrize(
    ("factor", "clocks"), [(0, 1), (1, 1), (2, 2), (3, 2), (4, 3), (-1, 1), (-2, 2), (-3, 3), (-4, 3), (-5, 4)]
)
def test_clocks_of_a_serial_multiplication(factor: int, clocks: int) -> None:
    assert serial_clocks(factor) == clocks


@pytest.mark.parametrize(
    ("architecture", "board", "objective"),
    [
        ("parallel", "ulx3s_85f", SMALL_AREA),
        ("folded", None, ShortProgram("folded", 15)),
        ("folded", "ulx3s_85f", ShortProgram("folded", 17)),
        ("serial", "ulx3s_85f", ShortProgram("serial", 15, bit_serial=True)),
    ],
)
def test_the_objective_is_that_of_the_architecture(architecture: str, board: str | None, objective: Objective) -> None:
    assert ARCHITECTURES[architecture].objective(None if board is None else find_board(board)) == objective
