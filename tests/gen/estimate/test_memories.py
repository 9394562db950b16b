"""Memories as synthesis makes them: of block RAM, of LUT4, or of flip-flops."""

import pytest

from sosmith.gen.estimate.memories import block_rams, of_memory, of_rom
from sosmith.gen.fpga.boards import find_board

UP5K, ECP5, GOWIN = (find_board(name).device for name in ("icebreaker", "ulx3s_25f", "tang_nano_9k"))


def test_block_rams_are_as_wide_as_their_number_of_words_lets_them_be() -> None:
    assert (block_rams(UP5K, 256, 16), block_rams(UP5K, 512, 16), block_rams(ECP5, 1024, 18)) == (1, 2, 1)
    assert (block_rams(ECP5, 512, 36), block_rams(ECP5, 513, 36), block_rams(GOWIN, 34, 35)) == (1, 2, 1)


@pytest.mark.parametrize(
    ("family", "depth", "width", "lut_ram"),
    [("ecp5", 256, 2, 64), ("ecp5", 96, 2, 24), ("ecp5", 16, 18, 20), ("gowin", 64, 16, 64), ("gowin", 512, 1, 128)],
)
def test_small_memories_are_made_of_lut4(family: str, depth: int, width: int, lut_ram: int) -> None:
    """As Yosys decides by its log: the costs are 89, 34, 22, 92 and 65.5, against 130 for a block RAM."""
    deep = depth // 16
    chosen = {"lut_ram_chosen": (deep - 1) * width, "lut_ram_written": deep} if deep > 1 else {}
    found = of_memory({"ecp5": ECP5, "gowin": GOWIN}[family], depth, width)
    made = {name: amount for name, amount in found.items() if amount}
    assert made == {"memory_bits": depth * width, "lut_ram": lut_ram, "registers": width, **chosen}


@pytest.mark.parametrize(
    ("family", "depth", "width"),
    [("ecp5", 96, 16), ("ecp5", 512, 1), ("ecp5", 256, 16), ("gowin", 34, 35), ("ice40", 16, 16)],
)
def test_large_memories_are_block_ram(family: str, depth: int, width: int) -> None:
    """As Yosys decides by its log: of LUT4 or flip-flops the costs are 141, 161.5, 386, 143.5 and 256."""
    found = of_memory({"ecp5": ECP5, "gowin": GOWIN, "ice40": UP5K}[family], depth, width)
    assert found == {"memory_bits": depth * width, "rams": 1, "ram_width": width}


def test_small_memories_without_lut_ram_are_flip_flops() -> None:
    assert of_memory(UP5K, 3, 28) == {"memory_bits": 84, "muxed": 56, "registers": 112}
    assert of_memory(UP5K, 3, 28, block=True) == {"memory_bits": 84, "rams": 2, "ram_width": 28}


def test_equal_and_constant_columns_of_a_program_are_made_once() -> None:
    assert (of_rom(UP5K, [1, 0] * 8, 4)["rom"], of_rom(UP5K, [1] * 16, 4)["rom"]) == (1, 0)
    assert of_rom(UP5K, [3, 0] * 8, 4)["rom"] == 1
    assert of_rom(ECP5, list(range(72)), 32)["rams"] == 1


def test_longer_columns_are_chosen_from_those_of_16_words_that_differ() -> None:
    same, others = [1, 0] * 16, [1, 0] * 8 + [0, 1] * 8
    assert (of_rom(UP5K, same, 1)["rom"], of_rom(UP5K, same, 1)["rom_chosen"]) == (1, 0)
    assert (of_rom(UP5K, others, 1)["rom"], of_rom(UP5K, others, 1)["rom_chosen"]) == (2, 1)
    assert (of_rom(UP5K, others + same, 1)["rom"], of_rom(UP5K, others + same, 1)["rom_chosen"]) == (2, 2)
