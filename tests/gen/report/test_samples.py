"""The samples in the page: packed without loss of codes, thinned to those with the largest errors."""

from __future__ import annotations

import base64
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.gen.designs import example_design
from tests.gen.report.behaviours import told
from tests.gen.report.evidences import LSB, OUTPUT, evidence, page_of, plain

from sosmith.gen.report.recursion import recursion_of
from sosmith.gen.report.samples import MAX_POINTS, packed, viewer_data


def unpacked(entry: dict[str, Any]) -> np.ndarray[Any, np.dtype[np.float64]]:
    integers = np.frombuffer(base64.b64decode(entry["data"]), dtype=f"<u{entry['bytes']}")
    return np.asarray(entry["low"] + entry["step"] * integers, dtype=np.float64)


@pytest.mark.parametrize("values", [[3.0], [-32768.0, 32767.0], [-8388608.0, 0.0, 8388607.0], [7.0, 7.0]])
def test_whole_numbers_come_back(values: list[float]) -> None:
    entry = packed(np.array(values), exact=True)
    assert unpacked(entry).tolist() == values
    assert entry["bytes"] == (4 if max(values) > 32767 else 2)


def test_other_numbers_come_back_to_a_part_of_their_span() -> None:
    values = np.random.default_rng(1).standard_normal(1000)
    assert unpacked(packed(values)) == pytest.approx(values, abs=np.ptp(values) / 65535 / 1.999)
    assert unpacked(packed(np.full(3, 0.1))).tolist() == [0.1] * 3


def test_a_short_run_is_held_whole() -> None:
    run = evidence()
    data = viewer_data(run, 12)
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    codes = unpacked(data["code"])
    assert (data["zero"] + data["lsb"] * codes).tolist() == run.run.hardware.tolist()
    assert unpacked(data["index"]).tolist() == list(range(3000))
    assert (data["stride"], data["samples"], data["transient"]) == (1, 3000, 12)
    assert data["start"] + data["step"] * 2999 == pytest.approx(run.run.time[-1])
    assert viewer_data(plain(), 0)["truth"] is None


def test_codes_of_an_output_around_zero() -> None:
    """Code 0 is not the lowest one of a signed output."""
    values = np.array([-2.0, 0.0, 1.0]) * LSB
    run = plain(time=np.arange(3.0), golden=values, hardware=values, output=replace(OUTPUT, signed=True))
    assert unpacked(viewer_data(run, 0)["code"]).tolist() == [-2.0, 0.0, 1.0]


def test_a_long_run_keeps_the_largest_error_of_each_stretch() -> None:
    samples = 3 * MAX_POINTS - 1
    error = np.random.default_rng(2).uniform(-1, 1, samples) * LSB
    run = plain(time=np.arange(float(samples)), golden=-error, hardware=np.zeros(samples))
    data = viewer_data(run, 0)
    index = unpacked(data["index"]).astype(int)
    assert (data["stride"], len(index)) == (3, MAX_POINTS)
    for k in (0, 1, 7777, MAX_POINTS - 1):
        assert index[k] == 3 * k + int(np.argmax(np.abs(error[3 * k : 3 * k + 3])))
    assert unpacked(data["error"]) == pytest.approx(error[index], abs=2 * LSB / 65535)


@pytest.mark.slow
def test_the_page_of_the_largest_run_is_below_a_megabyte() -> None:
    """Order 12, 12 channels, 60,000 samples of each; noise everywhere, which no packing makes small."""
    samples, channels = 60_000, 12
    generator = np.random.default_rng(3)
    time = np.arange(samples) / 100
    truth = np.repeat((3 + 0.01 * time)[:, np.newaxis], channels, axis=1)
    golden = truth + 0.1 * generator.standard_normal((samples, channels))
    section = example_design("flange_wear_bench.toml", core="filter", realization="lattice_wdf").quantized.sections[0]
    one = evidence()
    run = evidence(
        time=time,
        truth=truth,
        reading=np.full((samples, channels), fill_value=True),
        golden=golden,
        hardware=np.round(golden / LSB) * LSB,
        unfiltered=golden + generator.standard_normal((samples, channels)),
        provenance=told(),
        formats=one.facts.formats * 80,
        sections=one.facts.sections * 6,
        limit_cycles=one.facts.limit_cycles[:1] * 6,
        recursions=(recursion_of(section.name, section.graph),) * 6,
    )
    size = len(page_of(run).encode())
    assert 500_000 < size < 1_000_000
