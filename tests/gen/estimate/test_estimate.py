"""The estimate of cost before synthesis: its error on recorded synthesis, its quantities, and what it is for."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from benchmarks.cost_draws import draw
from benchmarks.cost_estimate_record import designed, nine_in_ten, recorded, rows_of
from benchmarks.cost_fit import errors, fitted

from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.estimate.core import quantities_of
from sosmith.gen.estimate.estimate import FITTED, TITLES, USUAL, estimated, on_board, usual_estimates
from sosmith.gen.estimate.quantities import block_rams, check_bits, of_memory, of_rom
from sosmith.gen.facts.cost_table import cost_table
from sosmith.gen.fpga.boards import BOARDS, find_board
from sosmith.gen.specification.specification import from_text
from sosmith.hdl.check_bits import CheckBits

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
order = 2
cutoff = 100.0
[output]
bits = 12
signed = true
range = [-1.0, 1.0]
unit = ""
max_error = "faithful"
[hardware]
clock = 12.0e6
architecture = "{architecture}"
"""


def design(architecture: str) -> CoreDesign:
    return design_core(from_text(SPEC.format(architecture=architecture), Path("plain.toml")))


@pytest.mark.parametrize("family", TITLES)
def test_nine_in_ten_unseen_designs_are_within_what_is_told(family: str) -> None:
    content = json.loads(FITTED.read_text(encoding="utf-8"))
    unseen = [row for row in rows_of(recorded()) if row.unseen and row.family == family]
    designs, told = content["tested"][family]
    found = errors(unseen, content["factors"])
    assert designs == len(found) > 0
    assert sum(abs(error) <= told for error in found) >= 0.9 * designs
    assert nine_in_ten(found) == told


def test_all_architectures_are_among_the_unseen_designs() -> None:
    unseen = [row for row in rows_of(recorded()) if row.unseen]
    assert {row.architecture for row in unseen} == set(ARCHITECTURES)
    assert not {row.name for row in unseen} & {row.name for row in rows_of(recorded()) if not row.unseen}


def test_the_factors_are_those_of_the_fit() -> None:
    told = json.loads(FITTED.read_text(encoding="utf-8"))["factors"]
    for architecture, families in fitted(rows_of(recorded())).items():
        for family, targets in families.items():
            for target, factors in targets.items():
                assert factors == pytest.approx(told[architecture][family][target], abs=0.01)


@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
def test_quantities_are_those_recorded(architecture: str) -> None:
    row = next(row for row in recorded() if row.get("architecture") == architecture and "seed" in row)
    assert draw(row["seed"]).board == row["board"]
    found = quantities_of(designed(row["seed"]).architecture, find_board(row["board"]).device)
    assert {name: round(amount, 3) for name, amount in found.items() if amount} == row["quantities"]


@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial", "online"])
def test_every_architecture_is_estimated_for_every_family(architecture: str) -> None:
    made = design(architecture)
    found = usual_estimates(made.architecture)
    assert [each.board for each in found] == list(USUAL)
    assert all(100 < each.luts < 2000 and each.flip_flops > 50 for each in found)
    if architecture in {"folded", "serial"}:
        assert {each.multiplier_blocks for each in found[:2]} == {int(architecture == "folded")}
    assert found[2].multiplier_blocks == 0  # the FPGA has none that placers know
    assert usual_estimates(made.architecture, find_board("icebreaker")) == (found[1],)
    assert usual_estimates(made.architecture, find_board("arty_a7")) == ()


def test_products_are_made_of_adders_where_there_are_no_blocks() -> None:
    made = design("parallel").architecture
    with_blocks, without = (estimated(made, find_board(name)) for name in ("ulx3s_25f", "ice40_hx8k_b_evn"))
    assert with_blocks is not None
    assert without is not None
    assert (with_blocks.multiplier_blocks > 0, without.multiplier_blocks) == (True, 0)
    assert without.luts > with_blocks.luts
    assert sum(map(len, on_board(made, BOARDS["ice40_hx8k_b_evn"]).adders)) > 0


def test_what_is_told_of_an_estimate() -> None:
    (found,) = usual_estimates(design("folded").architecture, find_board("ulx3s_25f"))
    within = f"{100 * found.tested.nine_in_ten:.0f} %"
    assert found.sentence == (
        f"about {found.luts:,} LUT4 on ECP5 LFE5U-25F, within {within} for 9 of 10 of {found.tested.designs} designs "
        "tested"
    )
    assert found.clocks is not None
    row = (
        *("ECP5 LFE5U-25F", f"{found.luts:,}", within, f"{found.flip_flops:,}", "1", f"{found.memory_bits:,}"),
        f"{found.clocks.lowest:.0f} to {found.clocks.highest:.0f}",
    )
    table = cost_table([found, replace(found, clocks=None)])
    assert [tuple(each) for each in table.rows] == [row, (*row[:-1], "unknown")]
    assert found.as_dict()["tested"] == found.tested._asdict()


def test_memories_are_made_as_synthesis_makes_them() -> None:
    """As recorded: of flip-flops, LUT4 or block RAM, by their number of bits."""
    up5k, ecp5 = find_board("icebreaker").device, find_board("ulx3s_25f").device
    assert (block_rams(up5k, 256, 16), block_rams(up5k, 512, 16), block_rams(ecp5, 1024, 18)) == (1, 2, 1)
    assert of_memory(up5k, 3, 28)["muxed"] == 56
    assert of_memory(up5k, 16, 16)["rams"] == 1
    assert of_memory(ecp5, 16, 18)["lut_ram"] == 20
    assert of_memory(ecp5, 256, 16)["rams"] == 1
    assert (of_rom(up5k, [1, 0] * 8, 4)["rom"], of_rom(up5k, [1] * 16, 4)["rom"]) == (1, 0)
    assert of_rom(ecp5, list(range(72)), 32)["rams"] == 1


@pytest.mark.parametrize("protect", ["none", "detect", "correct"])
def test_check_bits_are_counted_as_they_are_made(protect: str) -> None:
    for bits in (1, 8, 16, 22, 30, 36):
        assert bits + check_bits(bits, protect) == CheckBits(bits, protect).width
