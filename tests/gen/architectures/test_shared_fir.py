"""One multiplier for all results of a stage that interpolates: where it can be, its clocks, and what it refuses."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sosmith
from sosmith.gen.architectures.folded_fir import FoldedFir
from sosmith.gen.architectures.shared_fir import SharedFir, shared
from sosmith.gen.fpga.boards import find_board
from sosmith.model.errors import ShortfallError, SpecificationError

TAPS = [0.25, 0.5, 1.0, 0.75, 0.25, 0.125, 0.5]


def chain(clock: float = 1e6, bits: int = 8, **hardware: Any) -> sosmith.Chain:
    """Design a filter that makes three results of each sample, of 3, 2 and 2 taps."""
    tree = {
        "name": "rx",
        "sample_rate": 8000.0,
        "input": {"x": {"bits": bits, "range": [-1.0, 1.0], "signed": True}},
        "stage": [{"name": "up", "kind": "fir", "interpolate": 3, "taps": TAPS}],
        "output": {"bits": bits, "range": [-4.0, 4.0], "signed": True},
        "hardware": {"clock": clock, **hardware},
    }
    return sosmith.design_chain(sosmith.ChainSpecification.load(tree))


def test_all_results_have_one_multiplier() -> None:
    made = chain()
    (stage,) = made.core.stages
    assert stage.modules == ("rx_up",)
    architectures = [core.architecture for core in stage.cores]
    assert all(isinstance(each, SharedFir) for each in architectures)
    assert [each.multiplier_blocks for each in architectures] == [1, 0, 0]
    assert [each.memory_bits for each in architectures] == [4 * 8, 0, 0]
    assert [each.cycles_per_sample for each in architectures] == [1 + (3 + 5) + (2 + 5) + (2 + 5)] * 3
    assert [each.latency_cycles for each in architectures] == [9, 16, 23]
    board = find_board("ulx3s_25f")
    assert [design.estimates[0].luts > 0 for design in made.stages] == [True, False, False]
    assert board.device.multipliers > 1
    assert "one multiplier for all 3 results; takes 23 of 125 clocks a sample" in made.stages[0].reasons["architecture"]


@pytest.mark.parametrize(
    ("clock", "hardware"),
    [
        (22 * 8000.0, {}),
        (1e6, {"architecture": "serial"}),
        (1e6, {"reload": True}),
        (1e6, {"protect": "detect"}),
        (1e6, {"keep": True}),
    ],
)
def test_each_result_has_its_own_hardware_otherwise(clock: float, hardware: dict[str, Any]) -> None:
    (stage,) = chain(clock, **hardware).core.stages
    assert stage.shared is None
    assert stage.modules == ("rx_up_p0", "rx_up_p1", "rx_up_p2")


@pytest.mark.parametrize(
    ("given", "architecture"),
    [({"signed": False, "range": [0.0, 5.0]}, "folded"), ({"signed": False, "range": [-1.0, 3.0]}, "auto")],
    ids=["other steps", "an offset"],
)
def test_samples_that_are_scaled_have_programs(given: dict[str, Any], architecture: str) -> None:
    tree = {
        "name": "rx",
        "sample_rate": 8000.0,
        "input": {"x": {"bits": 8, **given}},
        "stage": [{"name": "up", "kind": "fir", "interpolate": 3, "taps": TAPS}],
        "output": {"bits": 8, "range": [-16.0, 16.0], "signed": True},
        "hardware": {"clock": 1e6, "architecture": architecture},
    }
    (stage,) = sosmith.design_chain(sosmith.ChainSpecification.load(tree)).core.stages
    assert stage.modules == ("rx_up_p0", "rx_up_p1", "rx_up_p2")


def test_results_are_those_of_the_filter() -> None:
    made = chain(bits=12)
    codes = np.random.default_rng(1).integers(-2048, 2048, (40, 1))
    spread = np.zeros(3 * (len(codes) + 3))
    spread[::3] = np.concatenate([np.repeat(codes[:1, 0], 3), codes[:, 0]])
    wanted = np.convolve(spread, TAPS)[9 : 9 + 3 * len(codes)] / 4
    assert np.abs(made.core.compute(codes[:, :, None])[:, 0] - wanted).max() <= 0.5


def test_all_results_settle_at_once() -> None:
    made = chain(start="zero")
    (stage,) = made.core.stages
    assert stage.modules == ("rx_up",)
    assert [core.quantized.settling for core in stage.cores] == [3, 3, 3]
    assert made.core.settling == 9


@pytest.mark.parametrize("hardware", [{"architecture": "parallel"}, {"reload": True}], ids=["parallel", "reload"])
def test_results_of_cores_side_by_side_settle_each_by_itself(hardware: dict[str, Any], tmp_path: Path) -> None:
    made = chain(start="zero", **hardware)
    (stage,) = made.core.stages
    own = [core.quantized.settling for core in stage.cores]
    assert own[0] > own[1]
    _, status = made.core.compute_with_status(np.zeros((10, 1, 1), dtype=np.int64))
    wanted = [32 * (n < each) for n in range(10) for each in own]
    assert [int(flags) & 32 for flags in status[:, 0]] == wanted
    assert made.core.settling == sum(own) == wanted.count(32)
    made.generate(tmp_path)
    certificate = sosmith.ChainCertificate.load(tmp_path / "rx.certificate.json")
    certificate.verify(files=tmp_path)
    assert certificate.entries.settling == wanted.count(32)


def test_what_cannot_share_is_told() -> None:
    sentence = "results that share a multiplier must have fixed taps and no check bits"
    steady = [core.architecture for core in chain().core.stages[0].cores]
    with pytest.raises(ShortfallError, match=f"^{sentence}$"):
        shared([replace(each, protect="detect") for each in steady], 100)
    with pytest.raises(ShortfallError, match=r"^one multiplier must have 23 clocks a sample for all results, not 22$"):
        shared(steady, 22)
    few = [replace(each, blocks=each.blocks._replace(bits=3)) for each in steady]
    assert [each.block for each in shared(few, 200)] == [3, 3, 3]
    sentence = "results that share a multiplier must take no more multiplier blocks than there are results"
    with pytest.raises(ShortfallError, match=f"^{re.escape(sentence)}$"):
        shared(few, 30)


@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize(
    ("clock", "multipliers", "blocks", "clocks"),
    [
        (10e6, None, 1, 2 * 2 * 3 + 6),  # a product of 25 by 25 bits is one of two digits by two
        (0.1e6, None, 4, 3 + 6),
        (10e6, 4, 4, 3 + 6),
        (10e6, 3, 1, 2 * 2 * 3 + 6),
    ],
)
def test_wide_products_have_digits_where_there_is_time(
    clock: float, multipliers: int | None, blocks: int, clocks: int, *, signed: bool
) -> None:
    tree = {
        "name": "wide",
        "sample_rate": 8000.0,
        "input": {"x": {"bits": 24, "range": [-1.0 * signed, 1.0], "signed": signed}},
        "filter": {"taps": [0.1, 0.2345678, 0.3456789, 0.2345678, 0.1]},
        "output": {"bits": 24, "range": [-2.0, 2.0], "signed": True},
        "hardware": {"clock": clock, "architecture": "folded"}
        | ({} if multipliers is None else {"multipliers": multipliers}),
    }
    architecture = sosmith.design(sosmith.Specification.load(tree)).core.architecture
    assert isinstance(architecture, FoldedFir)
    assert architecture.multiplier_blocks == blocks
    assert architecture.cycles_per_sample == clocks


def test_a_result_is_packed_with_its_chain(tmp_path: Path) -> None:
    (first, *_) = chain().stages
    sentence = "a result that shares its hardware with others must be packed with its chain, not by itself"
    with pytest.raises(SpecificationError, match=rf": {sentence}$"):
        first.package(tmp_path)
    assert sorted(path.name for path in first.generate(tmp_path)) == [
        f"rx_up_p0.{end}" for end in ("c", "certificate.json", "h", "json")
    ]
    (overview, *_) = first.tables()
    rows = {row.name if hasattr(row, "name") else row[0]: str(row) for row in overview.rows}
    assert "3 steps for a result, for all 3 results of a sample" in rows["multipliers"]
