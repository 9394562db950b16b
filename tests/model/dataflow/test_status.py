"""Status flags of a sample: each of them alone, and all together."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from tests.gen.designs import example_design

from sosmith.gen.core import design_core
from sosmith.gen.specification.wear_limits import WearSpec
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.status import Flag

RAIL, OUTSIDE, SATURATED, WARNING, CRITICAL = (1 << flag for flag in Flag if flag < Flag.SETTLING)


def calibration(calibrated: tuple[tuple[int, int], ...]) -> Datapath:
    """Make the calibration of the bench alone: no state, so that each sample stands for itself."""
    spec = example_design("flange_wear_bench.toml").spec
    narrow = replace(spec, output=replace(spec.output, lsb=spec.output.lsb / 4))
    return replace(design_core(narrow, core="calibration").datapath, calibrated=calibrated)


def status(datapath: Datapath, *codes: tuple[int, int]) -> list[int]:
    return datapath.compute_status(np.array(codes)).tolist()


@pytest.mark.slow
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


def test_wear_rises_with_the_codes_that_reach_it() -> None:
    datapath = replace(calibration(()), wear=((20_000, 50_000),))
    codes = np.stack([np.arange(0, 1 << 16, 16), np.full(4096, 1 << 14)], axis=1)
    results, flags = datapath.compute(codes), datapath.compute_status(codes)
    assert ((flags & WARNING != 0) == (results >= 20_000)).all()
    assert ((flags & CRITICAL != 0) == (results >= 50_000)).all()
    assert 0 < np.count_nonzero(flags & CRITICAL) < np.count_nonzero(flags & WARNING) < len(flags)


def test_each_channel_has_its_own_wear() -> None:
    limits = ((20_000, 50_000), (30_000, 40_000))
    datapath = replace(calibration(()), wear=limits)
    column = np.stack([np.arange(0, 1 << 16, 64), np.full(1024, 1 << 14)], axis=1)
    codes = np.stack([column, column], axis=1)
    results, flags = datapath.compute(codes), datapath.compute_status(codes)
    for channel, (warning, critical) in enumerate(limits):
        assert ((flags[:, channel] & WARNING != 0) == (results[:, channel] >= warning)).all()
        assert ((flags[:, channel] & CRITICAL != 0) == (results[:, channel] >= critical)).all()
    sentence = "codes must be of 2 channels, for each of which wear is judged, not 1"
    with pytest.raises(ValueError, match=f"^{sentence}$"):
        datapath.compute_status(column)


def test_a_wear_that_no_code_tells_is_refused() -> None:
    for limits in ((5, 5), (0, 9), (9, 1 << 16)):
        with pytest.raises(
            ValueError, match=f"^wear must be codes that rise within 1..65535, not {limits[0]}, {limits[1]}$"
        ):
            replace(calibration(()), wear=(limits,))


def test_codes_of_clearances() -> None:
    output = replace(calibration(()).output, lsb=Fraction(1, 4096), zero=Fraction(0))
    wear = WearSpec(initial=(Fraction(3, 2),), warning=Fraction(7), limit=Fraction(9))
    assert wear.codes(output) == ((8.5 * 4096, 10.5 * 4096),)
    between = replace(wear, warning=Fraction(7) + Fraction(1, 5000))  # the code below has not reached it yet
    assert between.codes(output) == ((8.5 * 4096 + 1, 10.5 * 4096),)
    blind = replace(wear, sensor_range=Fraction(10))
    assert blind.codes(output) == ((8.5 * 4096, 10 * 4096),)
    several = replace(wear, initial=(Fraction(3, 2), Fraction(2)))
    assert several.codes(output) == ((8.5 * 4096, 10.5 * 4096), (9 * 4096, 11 * 4096))
    assert replace(wear, initial=(Fraction(3, 2),) * 5).codes(output) == wear.codes(output)
