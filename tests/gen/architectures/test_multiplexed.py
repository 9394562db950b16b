"""Sections that share hardware: when they are chosen, what they need, and what is said of them."""

from __future__ import annotations

from typing import Any

import pytest

import sosmith
from sosmith.gen.estimate.estimate import estimated
from sosmith.gen.fpga.boards import find_board


def specification(order: int = 6, kind: str = "lowpass", **hardware: Any) -> sosmith.Specification:
    return sosmith.Specification.load(
        {
            "name": "low",
            "sample_rate": 1e6,
            "input": {"x": {"bits": 12, "range": [-1.0, 1.0], "signed": True}},
            "filter": {"family": "butterworth", "kind": kind, "order": order, "cutoff": 2e4},
            "output": {"bits": 12, "range": [-1.0, 1.0], "signed": True},
            "hardware": {"clock": 10e6, **hardware},
        }
    )


def test_it_is_chosen_between_folded_and_parallel() -> None:
    made = sosmith.design(specification())
    assert made.architecture == "multiplexed"
    assert made.reasons["architecture"].endswith(
        "; takes 3 of 10 clocks a sample; 3 sections share hardware, 1 clock each"
    )
    assert sosmith.design(specification(clock=1e8)).architecture == "folded"
    assert sosmith.design(specification(clock=1e6)).architecture == "parallel"


@pytest.mark.parametrize("other", [{"multipliers": 0}, {"reload": True}, {"protect": "detect"}])
def test_it_is_not_chosen_where_it_lacks_something(other: dict[str, Any]) -> None:
    assert sosmith.design(specification(**other)).architecture == "parallel"


def test_one_section_takes_no_turns() -> None:
    assert sosmith.design(specification(2)).architecture == "parallel"
    sentence = (
        r"the multiplexed architecture must have two sections with the same operations, one behind the other, and has "
        r"none: another realization may have some, and parallel takes every one$"
    )
    with pytest.raises(sosmith.ShortfallError, match=sentence):
        sosmith.design(specification(2, architecture="multiplexed", realization="df1"))


@pytest.mark.parametrize("clock", [1e6, 4e6])
@pytest.mark.parametrize("kind", ["lowpass", "highpass"])
def test_a_section_of_first_order_is_no_obstacle(kind: str, clock: float) -> None:
    made = sosmith.design(specification(3, kind, clock=clock))
    assert made.architecture == ("parallel" if clock == 1e6 else "multiplexed")


SECTIONS = [[1, 0, -1, 1, 0, 0.0755], [1, 0, -1, 1, 0, 0.864], [1, 0, -1, 1, -0.286, 0], [1, 0, -1, 1, -0.756, 0.49]]
"""The third one has one pole."""


@pytest.mark.parametrize("realization", ["df1", "df1_ef1", "df1_ef2", "df2t"])
def test_given_sections_share_hardware(realization: str) -> None:
    tree = specification(architecture="multiplexed", realization=realization, clock=100e6).as_dict()
    tree["filter"] = {"sos": SECTIONS}
    tree["output"] |= {"range": [-64.0, 64.0], "max_error": 0.5}
    made = sosmith.design(tree)
    assert made.core.architecture.plan.shared
    assert float(made.bound) <= 0.5


def test_a_clock_that_is_too_slow_is_told() -> None:
    sentence = (
        r"the multiplexed architecture takes 3 clocks a sample: at a clock of 2,000,000 Hz the sample rate must be at "
        r"most 666,666 Hz, not 1,000,000 Hz"
    )
    with pytest.raises(sosmith.ShortfallError, match=sentence):
        sosmith.design(specification(clock=2e6, architecture="multiplexed", realization="df1_ef2"))


def test_multipliers_that_are_too_few_are_told() -> None:
    asked = {"architecture": "multiplexed", "realization": "df1_ef2"}
    needed = sosmith.design(specification(**asked)).core.architecture.multiplier_blocks
    assert sosmith.design(specification(multipliers=needed, **asked)).core.architecture.multiplier_blocks == needed
    sentence = rf"hardware\.multipliers must be at least {needed} in the multiplexed architecture, not {needed - 1}$"
    with pytest.raises(sosmith.ShortfallError, match=sentence):
        sosmith.design(specification(multipliers=needed - 1, **asked))


def test_a_board_with_too_few_multipliers_is_told() -> None:
    board = "icebreaker"
    asked = specification(architecture="multiplexed", realization="df1_ef2", clock=12e6).as_dict()
    asked["input"]["x"]["bits"] = asked["output"]["bits"] = 30
    sentence = r"the board must have at least \d+ multiplier blocks in the multiplexed architecture, not 8$"
    with pytest.raises(sosmith.ShortfallError, match=sentence):
        sosmith.design(asked, board=board)
    assert sosmith.design(asked | {"hardware": {"clock": 12e6}}, board=board).architecture == "parallel"


def test_multipliers_are_needed_for_constants_that_change() -> None:
    sentence = (
        r"hardware\.multipliers must be 'auto' or at least 1 with hardware\.architecture = \"multiplexed\", as its "
        r"constants change from section to section, not 0$"
    )
    with pytest.raises(sosmith.SpecificationError, match=sentence):
        sosmith.design(specification(architecture="multiplexed", multipliers=0))


def test_it_takes_less_than_sections_by_themselves() -> None:
    board = find_board("ulx3s_25f")
    shared, alone = (
        estimated(sosmith.design(specification(architecture=each)).core.architecture, board)
        for each in ("multiplexed", "parallel")
    )
    assert shared is not None
    assert alone is not None
    assert shared.luts < alone.luts
    assert shared.multiplier_blocks < alone.multiplier_blocks


def test_the_table_counts_shared_operators_once() -> None:
    made = sosmith.design(specification(architecture="multiplexed", realization="df1_ef2"))
    architecture = made.core.architecture
    rows = dict(map(tuple, made.tables()[0].rows))
    assert rows["multipliers"] == architecture.shared_cost.multiplier_sizes
    (unit,) = architecture.plan.shared
    bits = f"{architecture.shared_cost.adder_bits}, {architecture.shared_cost.register_bits}"
    assert rows["adder bits, state and register bits"] == bits
    assert architecture.shared_cost.register_bits > 3 * unit.state_bits
    assert architecture.shared_cost.adder_bits < architecture.cost.adder_bits


def test_it_is_an_instrument_too() -> None:
    tree = specification().as_dict()
    tree["input"] = {
        "voltage": {"bits": 12, "range": [0.0, 5.0], "signed": False},
        "temperature": {"bits": 12, "range": [-20.0, 60.0], "signed": False},
    }
    tree["calibration"] = {"coefficients": [[0.1, 0.001], [0.2, 0.0001]]}
    tree["output"] = {"bits": 12, "range": [-4.0, 4.0], "signed": True, "unit": "mm", "max_error": 0.02}
    made = sosmith.design(tree)
    assert made.architecture == "multiplexed"
    assert float(made.bound) <= 0.02
