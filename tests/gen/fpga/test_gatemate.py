"""GateMate: what its platform writes for the board."""

import re

from sosmith.gen.fpga.boards import find_board
from sosmith.gen.fpga.platform_plan import board_plan, text_of
from sosmith.gen.fpga.wiring import PLAIN

TOP = "module tiny(input clk, rst, rx, output tx, output [2:0] leds); assign tx = rx; endmodule\n"


def test_constraints_name_each_pin_and_nothing_else() -> None:
    plan = board_plan(TOP, "tiny", "tiny_board", find_board("olimex_gatemate"), PLAIN)
    lines = {line for line in text_of(plan, "tiny_board.ccf").splitlines() if line.startswith("NET")}
    assert lines == {
        'NET "clk10_0__io" Loc = "IO_SB_A8" | SCHMITT_TRIGGER=true;',
        'NET "led_0__io" Loc = "IO_SB_B6";',
        'NET "uart_0__rx__io" Loc = "IO_SA_A6" | PULLUP=true;',
        'NET "uart_0__tx__io" Loc = "IO_SA_B6" | PULLUP=true;',
    }
    ports = set(re.findall(r"wire width 1 (?:in|out)put \d+  \\(\w+__io)", text_of(plan, "tiny_board.il")))
    assert ports == {line.split('"')[1] for line in lines}


def test_the_reset_lasts_until_the_fpga_is_configured() -> None:
    netlist = text_of(board_plan(TOP, "tiny", "tiny_board", find_board("olimex_gatemate"), PLAIN), "tiny_board.il")
    assert "cell \\CC_USR_RSTN " in netlist


def test_its_multipliers_are_not_counted_as_luts() -> None:
    device = find_board("olimex_gatemate").device
    cells = {"CC_L2T4": 10, "CC_L2T5": 3, "CC_ADDF": 5, "CC_MX4": 1, "CC_LUT1": 2, "CC_MULT": 4, "CC_DFF": 9}
    assert device.luts(cells) == 10 + 6 + 5 + 2 + 2
    assert device.excess({"CC_L2T5": 20481, "CC_BRAM_20K": 65}) == ["40,962 LUT4 of 40,960", "65 CC_BRAM_20K of 64"]
