"""The words of a bank, and ranges that hold whatever a loadable constant may make."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.gen.designs import example_design
from tests.model.reload.unpacking import unpacked
from tests.verify.small_specifications import PLAIN

from sosmith.gen.core import design_core
from sosmith.gen.specification.specification import load
from sosmith.model.dataflow.graph import Op
from sosmith.model.reload.constants import Constant, constants, packed, values_of, with_room

NARROW, WIDE = Constant(0, 1, "a", 20), Constant(0, 2, "b", 40)


@given(st.integers(-(1 << 19), (1 << 19) - 1), st.integers(-(1 << 39), (1 << 39) - 1))
def test_words_give_the_values_back(a: int, b: int) -> None:
    words = packed([a, b], (NARROW, WIDE))
    assert len(words) == 3
    assert all(0 <= word < 1 << 32 for word in words)
    assert unpacked(words, (NARROW, WIDE)) == [a, b]


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^a must fit 20 bits, not 524288$"):
        packed([1 << 19, 0], (NARROW, WIDE))


def test_constants_are_the_coefficients_of_polynomial_and_sections() -> None:
    made = example_design("flange_wear_bench.toml", realization="df1_ef2")
    found = constants(made.datapath)
    names = {f"{s.name}.product_{name}" for s in made.quantized.sections for name in s.coefficients}
    assert {constant.name for constant in found if constant.name.startswith("section")} == names
    assert {"row_power1.c00", "column_power1.c00"} & {constant.name for constant in found}
    assert all(packed(values_of(made.datapath, found), found))


@pytest.mark.parametrize("example", ["audio_lowpass.toml", "flange_wear_bench.toml"])
def test_room_holds_every_constant_that_fits(example: str) -> None:
    """With the extreme values of all constants at once, every product and sum stays in the roomy ranges."""
    datapath = example_design(example, realization="df1_ef2").datapath
    roomy = with_room(datapath)
    for place, (stage, wide) in enumerate(zip(datapath.stages, roomy.stages, strict=True)):
        here = {constant.node: constant.bits for constant in constants(datapath) if constant.stage == place}
        for old, new in zip(stage.graph.nodes, wide.graph.nodes, strict=True):
            assert new.low <= old.low <= old.high <= new.high
            assert new._replace(low=old.low, high=old.high) == old
        for index, bits in here.items():
            node = wide.graph.nodes[index]
            if node.op is Op.SCALE:
                operand = wide.graph.nodes[node.operands[0]]
                extremes = [
                    x * c for x in (operand.low, operand.high) for c in (-1 << (bits - 1), (1 << (bits - 1)) - 1)
                ]
                assert (node.low, node.high) == (min(extremes), max(extremes))


@pytest.mark.parametrize("core", ["instrument", "calibration"])
def test_hardware_with_room_has_the_same_constants(core: str) -> None:
    datapath = example_design("flange_wear_bench.toml", core=core, realization="df1_ef2").datapath
    assert constants(with_room(datapath)) == constants(datapath)


def test_an_output_that_nothing_limits_keeps_its_width() -> None:
    datapath = example_design("flange_wear_bench.toml", core="calibration").datapath
    graph = with_room(datapath).stages[-1].graph
    assert graph.nodes[graph.outputs[0]].op is not Op.CLAMP
    assert graph.nodes[graph.outputs[0]].width <= datapath.output.bits


def test_an_output_that_is_only_handed_on_keeps_its_width(tmp_path: Path) -> None:
    """A filter that starts from zero counts samples behind it, while its output goes by."""
    path = tmp_path / "plain.toml"
    output = 'output = { bits = 11, signed = true, range = [-1.5, 1.5], unit = "", max_error = 0.05 }'
    path.write_text(
        re.sub("output = .*", output, PLAIN) + 'hardware.reload = true\nhardware.architecture = "parallel"\n', "utf-8"
    )
    datapath = design_core(load(path)).datapath
    *_, before, last = with_room(datapath).stages
    assert [last.graph.nodes[i].op for i in last.graph.inputs] == [Op.INPUT]
    assert last.graph.outputs[0] == last.graph.inputs[0]
    for node in (before.graph.nodes[before.graph.outputs[0]], last.graph.nodes[last.graph.outputs[0]]):
        assert datapath.output.lowest <= node.low <= node.high <= datapath.output.highest
