"""Status flags of a sample: each of them alone, and all together."""

from dataclasses import replace

import numpy as np
from tests.gen.designs import example_design

from sosmith.gen.core import design_core
from sosmith.model.datapath import Datapath
from sosmith.model.status import Flag

RAIL, OUTSIDE, SATURATED = (1 << flag for flag in (Flag.INPUT_AT_RAIL, Flag.OUTSIDE_CALIBRATION, Flag.OUTPUT_SATURATED))


def calibration(calibrated: tuple[tuple[int, int], ...]) -> Datapath:
    """Make the calibration of the bench alone: no state, so that each sample stands for itself."""
    spec = example_design("flange_wear_bench.toml").spec
    narrow = replace(spec, output=replace(spec.output, lsb=spec.output.lsb / 4))
    return replace(design_core(narrow, core="calibration").datapath, calibrated=calibrated)


def status(datapath: Datapath, *codes: tuple[int, int]) -> list[int]:
    return datapath.compute_status(np.array(codes)).tolist()


def test_rails_of_either_input() -> None:
    datapath = calibration(())
    (low, high), (least, most) = ((port.lowest, port.highest) for port in datapath.inputs)
    middle = (low + high) // 8, (least + most) // 2
    found = status(datapath, middle, (low, middle[1]), (low + 1, middle[1]), (middle[0], least), (middle[0], most))
    assert [flags & RAIL for flags in found] == [0, RAIL, 0, RAIL, RAIL]
    assert status(datapath, (high, middle[1]), (high - 1, middle[1]))[0] & RAIL


def test_outside_the_calibrated_range() -> None:
    datapath = calibration(((1000, 9000), (2000, 8000)))
    codes = [(1000, 2000), (999, 2000), (9000, 8000), (9001, 8000), (5000, 1999), (5000, 8001)]
    assert [flags & OUTSIDE for flags in status(datapath, *codes)] == [0, OUTSIDE, 0, OUTSIDE, OUTSIDE, OUTSIDE]


def test_a_limited_output() -> None:
    datapath = calibration(())
    codes = np.stack([np.arange(0, 1 << 16, 64), np.full(1024, 1 << 14)], axis=1)
    results, flags = datapath.compute(codes), datapath.compute_status(codes)
    limited = (flags & SATURATED) != 0
    assert limited.any()
    assert set(results[limited].tolist()) <= {datapath.output.lowest, datapath.output.highest}
    inside = (results > datapath.output.lowest) & (results < datapath.output.highest)
    assert not limited[inside].any()
    assert inside.any()


def test_without_measurements_no_input_is_outside() -> None:
    datapath = calibration(())
    codes = np.stack([np.arange(0, 1 << 16, 64), np.arange(0, 1 << 16, 64)], axis=1)
    assert not (datapath.compute_status(codes) & OUTSIDE).any()
