"""Status flags at the very codes at which they change: of the hardware, of its program, and of the C model."""

from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest
from tests.hdl.axi_stream.adders import A, B, Ends, adder
from tests.hdl.axi_stream.stream_bench import run

from sosmith.hdl.cores.folded import FoldedCore
from sosmith.hdl.cores.parallel import Core
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.folding.fold import program
from sosmith.model.dataflow.status import Flag


def around(ends: Ends, port: Ends) -> list[int]:
    """Codes of a port: its rails, both ends of the range, and the neighbours of these."""
    codes = {end + step for end in (*ends, *port) for step in (-1, 0, 1)}
    return sorted(code for code in codes if port[0] <= code <= port[1])


def status(datapath: Datapath, channel: int, codes: Sequence[int]) -> int:
    """Return the flags of a sample, from what each of them means."""
    total = sum(codes)
    y = min(max(total, datapath.output.lowest), datapath.output.highest)
    warning, critical = datapath.wear[channel % len(datapath.wear)]
    holds = {
        Flag.INPUT_AT_RAIL: any(code in ends for code, ends in zip(codes, (A, B), strict=True)),
        Flag.OUTSIDE_CALIBRATION: any(
            code < low or code > high for code, (low, high) in zip(codes, datapath.calibrated, strict=True)
        ),
        Flag.OUTPUT_SATURATED: y != total,
        Flag.WEAR_WARNING: y >= warning,
        Flag.WEAR_CRITICAL: y >= critical,
    }
    return sum(1 << flag for flag, raised in holds.items() if raised)


RANGES = [((6, 24), (-5, 4)), ((1, 30), (-7, 6)), ((0, 24), (-5, 7)), ((6, 31), (-8, 4)), (A, B)]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("calibrated", RANGES)
def test_the_software_at_the_ends_of_every_range(calibrated: tuple[Ends, Ends]) -> None:
    datapath = adder(calibrated, ((10, 20),))
    codes = list(product(*map(around, calibrated, (A, B))))
    assert datapath.compute_status(np.array(codes)).tolist() == [status(datapath, 0, sample) for sample in codes]
    made = program(datapath, 3)
    words = made.reset()
    outside = [made.step(sample, words, (0, 0)).outside for sample in codes]
    assert outside == [bool(status(datapath, 0, sample) >> Flag.OUTSIDE_CALIBRATION & 1) for sample in codes]


@pytest.mark.sweep(2)
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
@pytest.mark.parametrize("calibrated", RANGES[:3])
def test_the_hardware_at_the_ends_of_every_range(calibrated: tuple[Ends, Ends], architecture: str) -> None:
    datapath = adder(calibrated, ((10, 20),))
    codes = [(a, 3) for a in around(calibrated[0], A)] + [(7, b) for b in around(calibrated[1], B)]
    codes += [(0, -1), (0, 0), (29, 2), (29, 3)]  # at both ends of the output
    found = run(hardware(datapath, architecture), [(0, sample) for sample in codes])
    assert [result.status for result in found] == [status(datapath, 0, sample) for sample in codes]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
@pytest.mark.parametrize("limits", [((-3, 5),), ((-3, 5), (0, 9), (-7, 15))])
def test_the_hardware_at_the_limits_of_wear(limits: tuple[Ends, ...], architecture: str) -> None:
    datapath = adder((A, B), limits, signed=True)
    sums = sorted({limit + step for pair in limits for limit in pair for step in (-1, 0, 1)})
    samples = [(channel, (max(total, 0), min(total, 0))) for total in sums for channel in range(3)]
    found = run(hardware(datapath, architecture, 3), samples)
    assert [(r.channel, r.code, r.status) for r in found] == [
        (channel, min(sum(codes), 15), status(datapath, channel, codes)) for channel, codes in samples
    ]


def hardware(datapath: Datapath, architecture: str, channels: int = 1) -> Core | FoldedCore:
    if architecture == "parallel":
        return Core(datapath, channels)
    return FoldedCore(datapath, program(datapath, 3), serial=architecture == "serial", channels=channels)
