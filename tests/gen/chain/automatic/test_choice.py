"""Stages that are chosen: they keep to the limits, cost what is stated, and are an ordinary chain from then on."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import log10
from pathlib import Path
from typing import Any

import pytest
from tests.gen.chain.automatic.asked import TREE, asked, draw, losses

import sosmith
from sosmith.gen.chain.automatic import choice
from sosmith.gen.chain.automatic.choice import cost_of
from sosmith.gen.chain.automatic.structures import structures
from sosmith.gen.fpga.boards import find_board
from sosmith.model.errors import ShortfallError, SpecificationError

CIC = ("cic", "fir")


@pytest.fixture(scope="module")
def chosen() -> sosmith.Chain:
    return sosmith.design_chain(TREE)


def check_losses(chain: sosmith.Chain, tree: dict[str, Any]) -> None:
    (stage,), (ripple, alias, stopped) = tree["stage"], losses(chain, tree)
    assert ripple <= stage["passband_loss"]
    assert alias >= stage["stopband_loss"]
    assert stopped is None or stopped >= stage["stopband_loss"]


def check_costs(chain: sosmith.Chain) -> None:
    """Check that the stages by themselves, designed again, cost what is stated of those that were taken."""
    (taken,) = (row for row in chain.structures if row["verdict"] == "taken")
    again = sosmith.design_chain(sosmith.ChainSpecification.load(chain.specification.as_dict()))
    luts, blocks, bits = cost_of(again.core.stages, find_board("ulx3s_25f"))
    assert taken["designed"]
    assert (taken["luts"], taken["multipliers"], taken["memory_bits"]) == (luts, blocks, bits)
    assert again.choice is None


def test_what_is_chosen_keeps_to_the_limits_and_costs_what_is_stated(chosen: sosmith.Chain) -> None:
    assert chosen.factor == 8
    assert chosen.structures[0]["verdict"] == "taken"
    assert len(chosen.structures) > 5
    check_losses(chosen, TREE)
    check_costs(chosen)
    ripple, _, _ = losses(chosen, TREE)
    least, most = chosen.passband or (0.0, 0.0)
    assert 0 < least < most <= 1
    assert chosen.as_dict()["passband"] == {"least": least, "most": most}
    assert ripple == pytest.approx(20 * log10(most / least), abs=1e-3)


def test_the_stages_are_written_beside_the_files_and_read_back_the_same(chosen: sosmith.Chain, tmp_path: Path) -> None:
    names = {path.name for path in chosen.generate(tmp_path)}
    text = (tmp_path / "rx.toml").read_text(encoding="utf-8")
    assert "rx.toml" in names
    assert text == chosen.specification.toml()
    assert text.startswith("# The stages were chosen for down, of the kind auto.\n")
    assert "[limits]\npassband_edge = 150.0\npassband_loss = 0.5\nstopband_loss = 40.0\nstopband_edge = 900.0\n" in text
    again = sosmith.design_chain(tmp_path / "rx.toml")
    assert again.certificate.text() == chosen.certificate.text()
    assert {path.name for path in again.generate(tmp_path / "again")} == names - {"rx.toml"}


def test_the_same_request_gives_the_same_stages(chosen: sosmith.Chain) -> None:
    again = sosmith.design_chain(TREE)
    assert again.specification.toml() == chosen.specification.toml()
    assert again.structures == chosen.structures


def test_the_table_says_why_others_were_not_taken(chosen: sosmith.Chain) -> None:
    table = chosen.tables()[0]
    assert table.title == "rx: structures, for the ECP5 LFE5U-25F"
    verdicts = [row[-1] for row in map(tuple, table.rows)]
    assert verdicts[0] == "taken"
    assert any(re.fullmatch(r"dearer, \d\.\d\d ×", verdict) for verdict in verdicts)
    assert [each.title for each in chosen.tables()][-1] == "Pass band of the whole, up to 150 Hz, proven"


def test_a_cic_filter_is_made_up_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Samples of two bits at a high rate: a CIC filter takes them, and the last taps have its droop in them."""
    monkeypatch.setattr(choice, "structures", lambda *asked: [s for s in structures(*asked) if s.family == CIC])
    tree = asked(decimate=16, stopband_edge=None, passband_loss=0.1)
    chain = sosmith.design_chain(tree)
    first, *_, last = chain.specification.as_dict()["stage"]
    assert first["kind"] == "cic"
    assert "taps" in last
    check_losses(chain, tree)


def test_a_structure_that_does_not_keep_to_the_limits_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """With stages that stop 10 dB less than they should, nothing is proven, and the message says what is missing."""
    own = choice.Wanted.stopband_loss.fget
    assert own is not None
    monkeypatch.setattr(choice.Wanted, "stopband_loss", property(lambda wanted: own(wanted) - 10))
    with pytest.raises(ShortfallError) as refused:
        sosmith.design_chain(asked(stopband_edge=None, decimate=3))
    assert re.fullmatch(
        r"specification: stage down: its limits must be such that a structure of stages keeps to them, and none does: "
        r"the closest is [^:]*, stopband_loss: aliases into the pass band are 3\d\.\d\d dB down, not 40 dB",
        str(refused.value),
    )


def test_a_clock_as_slow_as_the_samples_is_enough() -> None:
    """Where a ring is too slow, multipliers take turns, or adders alone take a sample at each clock."""
    made = sosmith.design_chain(asked(stopband_edge=None) | {"hardware": {"clock": 8000.0}})
    assert made.stages[0].architecture == "parallel"
    assert made.clocks_per_sample == 1


def test_that_is_so_of_several_channels() -> None:
    made = sosmith.design_chain(asked(stopband_edge=None) | {"channels": 2, "hardware": {"clock": 16000.0}})
    assert made.stages[0].architecture == "parallel"
    assert made.clocks_per_sample == 1


def test_an_iir_filter_takes_turns_or_more_where_one_multiplier_is_too_slow() -> None:
    made = sosmith.design_chain(asked(stopband_edge=None) | {"hardware": {"clock": 8000.0}})
    rows = [tuple(row) for row in made.tables()[0].rows]
    with_iir = [row[-1] for row in rows if "IIR" in row[0]]
    assert with_iir
    assert not any("too slow" in verdict for verdict in with_iir)


HEAD = "specification: stage down: its limits must be such that a structure of stages keeps to them, and none does: "


def clock(hertz: float) -> Callable[[], dict[str, Any]]:
    return lambda: asked(stopband_edge=None) | {"channels": 2, "hardware": {"clock": hertz}}


@pytest.mark.parametrize(
    ("tree", "sentence"),
    [
        (
            lambda: asked(passband_edge=1320.0, stopband_edge=None, decimate=3),
            "the closest is FIR 3, too long: 466 taps at 8000 Hz, of at most 256, which stop some 20 dB",
        ),
        (
            clock(15e3),
            "the closest is FIR 8, too slow: 8 clocks for each result at 1000 Hz, of 7; a clock of 16000 Hz would do",
        ),
    ],
)
def test_limits_that_cannot_be_met_are_refused_with_what_comes_closest(
    tree: Callable[[], dict[str, Any]], sentence: str
) -> None:
    with pytest.raises(ShortfallError) as refused:
        sosmith.design_chain(tree())
    assert str(refused.value) == HEAD + sentence


def test_hardware_that_no_decimator_has_is_refused() -> None:
    with pytest.raises(SpecificationError) as refused:
        sosmith.ChainSpecification.load(TREE | {"hardware": {"multipliers": 0}})
    assert str(refused.value) == (
        "specification: stage down: not yet available: hardware.multipliers must be 'auto' with an FIR filter that "
        "decimates, not 0"
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(24))
def test_random_requests_keep_to_their_limits(seed: int, tmp_path: Path) -> None:
    tree = draw(seed)
    chain = sosmith.design_chain(tree)
    check_losses(chain, tree)
    check_costs(chain)
    chain.generate(tmp_path)
    (tmp_path / "asked.toml").write_text(sosmith.ChainSpecification.load(tree).toml(), encoding="utf-8")
    certificate = sosmith.ChainCertificate.load(tmp_path / "rx.certificate.json")
    assert not certificate.verify(spec=tmp_path / "asked.toml", files=tmp_path).missing


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 4, 7])
def test_random_requests_are_simulated(seed: int, tmp_path: Path) -> None:
    chain = sosmith.design_chain(draw(seed))
    report = chain.simulate(folder=tmp_path, simulator="icarus", seconds=400 * chain.factor / draw(seed)["sample_rate"])
    assert report.summary["bit_exact"]
