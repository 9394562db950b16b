"""Hardware whose products are made of adders is proven from its text like any other."""

import re
from dataclasses import replace

import pytest
from tests.verify.parallel.cores import ODD, Made, made, small_design, specified

from sosmith.gen.architectures.blocks import Blocks
from sosmith.gen.core import design_core
from sosmith.verify.graph import RejectedError

WITHOUT = ODD + 'hardware.architecture = "parallel"\nhardware.multipliers = 0\n'


def without_multipliers(realization: str, channels: int = 1) -> Made:
    return made(small_design(WITHOUT, realization), channels, blocks=Blocks(0))


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("realization", "channels"), [("df1_ef2", 1), ("df1", 2), ("state_space", 1), ("df2t", 3), ("lattice_wdf", 1)]
)
def test_the_hardware_is_proven(realization: str, channels: int) -> None:
    core = without_multipliers(realization, channels)
    assert "_times_" in core.text
    assert " * " not in core.text
    core.check()


def test_a_wrong_sum_is_rejected() -> None:
    core = without_multipliers("df1_ef2")
    lines = [line for line in core.text.splitlines() if re.match(r" *assign .*_times_\w+ (\} )?= .* [+-] ", line)]
    assert lines
    for line in lines:
        wrong = line.replace(" - ", " + ") if " - " in line else line.replace(" + ", " - ")
        with pytest.raises(RejectedError):
            core.check(core.text.replace(line, wrong))


def test_the_design_takes_adders_and_says_so() -> None:
    design = design_core(specified(WITHOUT), realization="df1_ef2")
    assert design.architecture.blocks == Blocks(0, asked=0)
    assert design.architecture.cost.multiplications == ()
    assert design.reasons["architecture"] == (
        "parallel: asked for in the specification; without multiplier blocks, 3 products by constants made of adders"
    )
    few = replace(design.architecture, blocks=Blocks(1))
    assert sum(map(len, few.adders)) == 1  # another one is of sums that drop bits
    assert few.cost.multiplier_blocks == 1
