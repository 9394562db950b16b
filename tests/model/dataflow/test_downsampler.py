"""What hands on every N-th result: counts, flags gathered between results, and the C model for single samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sosmith
from sosmith.model.dataflow.compiled import Pushed
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.dataflow.downsampler import Downsampler, gathered
from sosmith.model.dataflow.status import Flag


def datapath(start: str, factor: int = 3) -> Datapath:
    tree = {
        "name": "every_third",
        "sample_rate": 1000.0,
        "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"taps": [0.25, 0.5, -0.125, 0.25], "decimate": factor},
        "output": {"bits": 10, "range": [-2.0, 2.0], "signed": True},
        "hardware": {"start": start, "clock": 1e6},
    }
    return sosmith.design(sosmith.Specification.load(tree)).core.datapath


@pytest.mark.parametrize("start", ["zero", "steady"])
def test_results_are_those_of_the_filter_alone(start: str) -> None:
    down = datapath(start)
    codes = np.random.default_rng(1).integers(-128, 128, (50, 1))
    first = codes[:1] if start == "steady" else codes[:1] * 0
    all_of_them = replace(down, downsampler=None).compute(np.concatenate([np.repeat(first, 9, axis=0), codes]))
    assert down.compute(codes).tolist() == all_of_them[9::3].tolist()
    assert down.compute_exact(codes) == all_of_them[9::3].tolist()
    assert down.results(50) == 17


@pytest.mark.parametrize("start", ["zero", "steady"])
def test_single_samples_have_the_same_results_and_flags(start: str) -> None:
    down = datapath(start)
    codes = np.random.default_rng(2).integers(-128, 128, (60, 1))
    codes[7], codes[20] = 127, -128
    results, status = down.compute_with_status(codes)
    push = Pushed(down)
    pushed = [push(sample) for sample in codes]
    assert [each is not None for each in pushed] == [n % 3 == 0 for n in range(60)]
    assert [each for each in pushed if each is not None] == list(zip(results.tolist(), status.tolist(), strict=True))
    rails = (status & 1 << Flag.INPUT_AT_RAIL).astype(bool)
    assert np.flatnonzero(rails).tolist() == [3, 7]
    settling = (status & 1 << Flag.SETTLING).astype(bool)
    assert settling.any() == (start == "zero")


def test_flags_are_those_since_the_result_before() -> None:
    flags = np.array([1, 2, 0, 4, 0, 0, 8, 16], dtype=np.uint8)
    assert gathered(flags, 3).tolist() == [1, 6, 8]
    assert gathered(flags[:0], 3).tolist() == []


def test_what_it_refuses() -> None:
    with pytest.raises(ValueError, match=r"^factor must be at least 1, not 0$"):
        Downsampler(factor=0, filled=0)
    with pytest.raises(ValueError, match=r"^filled must not be negative, not -1$"):
        Downsampler(factor=2, filled=-1)
    down = datapath("zero")
    decimator = Decimator(input=down.inputs[0], factor=2, stages=1, dropped=0)
    with pytest.raises(ValueError, match=r"^downsampler must be left out behind a decimator$"):
        replace(down, decimator=decimator)
