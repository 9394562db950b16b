"""Products as synthesis makes them, in multiplier blocks or in LUT4."""

import pytest
from benchmarks.cost_estimate_record import recorded

from sosmith.gen.estimate.products import of_product, product_in
from sosmith.gen.estimate.quantities import Quantities
from sosmith.gen.fpga.boards import find_board
from sosmith.model.dataflow.graph import GraphBuilder


def counted(board: str, coefficient: int, bits: int, *, loads: bool = False) -> Quantities:
    """Return what the product of a signed value and a coefficient takes."""
    g = GraphBuilder()
    a = g.input("a", 0, -(1 << bits - 1), (1 << bits - 1) - 1)
    graph = g.build([g.scale(a, coefficient, 0)])
    product = product_in(graph, graph.nodes[1], loads=loads)
    assert product is not None
    return of_product(product, find_board(board).device)


def test_a_power_of_two_is_wires_or_a_change_of_sign() -> None:
    assert counted("ulx3s_25f", 8, 12) == {}
    assert counted("ulx3s_25f", -8, 12) == {"sums": 12}
    assert counted("ulx3s_25f", 8, 12, loads=True) == {"blocks": 1, "joined": 0}


@pytest.mark.parametrize(
    ("bits", "coefficient", "blocks", "joined"),
    [(18, 0x2FFFF, 1, 0), (20, 0x2FFFF, 2, 20), (20, 0xFFFFF, 4, 22 + 20 + 4), (14, 0xFFFFF, 2, 16)],
)
def test_blocks_that_make_one_product_are_joined_by_sums(bits: int, coefficient: int, blocks: int, joined: int) -> None:
    """Each sum begins where the upper block does, as in ``techlibs/common/mul2dsp.v`` of Yosys."""
    assert counted("ulx3s_25f", coefficient, bits) == {"blocks": blocks, "joined": joined}


def test_zeros_of_a_constant_add_nothing_without_blocks() -> None:
    assert counted("tang_nano_9k", 0b1011, 8) == {"soft_products": 3 * 8}
    assert counted("tang_nano_9k", 0b1000_0001, 8) == {"soft_products": 2 * 8}


def test_a_constant_that_is_loaded_has_its_sign_and_spare_bits() -> None:
    assert counted("ulx3s_25f", 0x2FFFF, 21)["blocks"] == 2
    assert counted("ulx3s_25f", 0x2FFFF, 21, loads=True)["blocks"] == 4


def test_a_part_of_two_bits_takes_no_block() -> None:
    """Of 38 bits, as of -1862 times 8 bits on an ECP5, which synthesis makes of one block: 20 bits."""
    assert counted("ulx3s_25f", 0x2FFFF, 20, loads=True)["blocks"] == 3


@pytest.mark.parametrize(("constant", "blocks", "joined"), [(962, 1, 0), (-339, 2, 22 - 18)])
def test_a_negative_constant_has_all_bits_of_an_unsigned_product(constant: int, blocks: int, joined: int) -> None:
    """-339 times 12 bits is emitted as ``22'h3ffead * temperature``: two blocks, of which four bits are added up."""
    g = GraphBuilder()
    temperature = g.input("temperature", 0, 0, 4095)
    graph = g.build([g.multiply(g.constant(constant, 0), temperature)])
    product = product_in(graph, graph.nodes[-1], loads=False)
    assert product is not None
    assert of_product(product, find_board("ulx3s_25f").device) == {"blocks": blocks, "joined": joined}


def test_counted_blocks_are_those_of_synthesis() -> None:
    """In 99 of 100 designs: a product of few bits is made of LUT4 on the UP5K."""
    rows = [row for row in recorded() if "refused" not in row]
    right = sum(row["quantities"].get("blocks", 0) == row["multiplier_blocks"] for row in rows)
    assert len(rows) > 90
    assert right >= 0.99 * len(rows)
