"""Status flags in simulation, of a core whose calibration comes from measurements."""

from contextlib import nullcontext
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.gen.designs import EXAMPLES

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.specification import load
from sosmith.model.errors import ShortfallError
from sosmith.model.status import Flag
from sosmith.sim.simulation import simulate, traces_for


def measurements() -> str:
    """Measurements from 2 to 8 V and 20 to 90 degC, as a CSV file."""
    rows = ["clearance_mm,voltage_V,temperature_C"]
    for voltage in np.linspace(2.0, 8.0, 13):
        for temperature in (20.0, 50.0, 90.0):
            rows.append(f"{1.2 + 0.3 * voltage + 0.06 * voltage**2},{voltage},{temperature + voltage / 10}")
    return "\n".join(rows) + "\n"


def made_in(folder: Path, architecture: str) -> CoreDesign:
    """Design the bench's instrument with a narrower output, so that it saturates."""
    (folder / "measurements.csv").write_text(measurements())
    text = (EXAMPLES / "flange_wear_bench.toml").read_text(encoding="utf-8")
    start = text.index("coefficients = [")
    text = text[:start] + 'data = "measurements.csv"\n' + text[text.index("[filter]") :]
    (folder / "spec.toml").write_text(text, encoding="utf-8")
    spec = load(folder / "spec.toml")
    hardware = replace(spec.hardware, architecture=architecture, realization="df1_ef2", clock=Fraction(10**8))
    return design_core(replace(spec, output=replace(spec.output, lsb=spec.output.lsb / 4), hardware=hardware))


def test_the_range_is_that_of_the_measurements(tmp_path: Path) -> None:
    made = made_in(tmp_path, "parallel")
    assert made.fit is not None
    for port, (low, high), (least, most) in zip(
        made.datapath.inputs, made.datapath.calibrated, made.fit.covered, strict=True
    ):
        first, last = (float(port.zero + port.lsb * code) for code in (low, high))
        assert first <= least < first + float(port.lsb)
        assert last - float(port.lsb) < most <= last


def test_judging_the_range_takes_clocks_that_count(tmp_path: Path) -> None:
    made = made_in(tmp_path, "folded")
    needed = made.architecture.cycles_per_sample
    for cycles, refused in ((needed, False), (needed - 1, True)):
        hardware = replace(made.spec.hardware, clock=cycles * made.spec.sample_rate)
        expected = (
            pytest.raises(ShortfallError, match=f"takes {needed:,} clocks a sample") if refused else nullcontext()
        )
        with expected:
            design_core(replace(made.spec, hardware=hardware))


@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
def test_every_flag_is_seen_and_right(architecture: str, tmp_path: Path) -> None:
    made = made_in(tmp_path, architecture)
    (trace,) = traces_for(made, "worst_case", seed=1)
    rng = np.random.default_rng(4)
    codes = np.stack([rng.integers(p.lowest, p.highest + 1, 64) for p in made.datapath.inputs], axis=1)
    # Every flag at once and none: long at the ends of both ranges, and within what was measured.
    for k, fraction in enumerate((0.0, 1.0, 0.5)):
        codes[16 * k : 16 * k + 16] = [
            port.lowest + round(fraction * (port.highest - port.lowest)) for port in made.datapath.inputs
        ]
    trace = replace(trace, codes=codes, truth=None, reading=None)
    flags = made.datapath.compute_status(codes)
    for flag in Flag:
        assert {int(value) >> flag & 1 for value in flags} == {0, 1}
    assert simulate(made, [trace], tmp_path, simulator="icarus").mismatches == 0


def test_a_wrong_flag_is_noticed(tmp_path: Path) -> None:
    made = made_in(tmp_path, "parallel")
    datapath = made.datapath
    (low, high), *rest = datapath.calibrated
    wider = replace(datapath, calibrated=((low, high + 4000), *rest))
    broken = replace(made, architecture=replace(made.architecture, datapath=wider))
    (trace,) = traces_for(made, "worst_case", seed=1)
    codes = np.full((32, 2), 1 << 14)
    codes[:, 0] = high + np.arange(32) - 16
    trace = replace(trace, codes=codes, truth=None, reading=None)
    assert simulate(broken, [trace], tmp_path, simulator="icarus").mismatches == 15
