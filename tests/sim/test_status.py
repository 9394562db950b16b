"""Status flags in simulation, of a core whose calibration comes from measurements."""

import subprocess
from contextlib import nullcontext
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.gen.designs import EXAMPLES
from tests.sim.lint import icarus_check, lint

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.generate import generate
from sosmith.gen.output.manifest import manifest
from sosmith.gen.specification.specification import load
from sosmith.gen.specification.wear_limits import WearSpec
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port
from sosmith.sim.simulation import simulate


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


@pytest.mark.slow
def test_the_range_is_that_of_the_measurements(tmp_path: Path) -> None:
    made = made_in(tmp_path, "parallel")
    assert made.fit is not None
    for port, (low, high), (least, most) in zip(
        made.datapath.inputs, made.datapath.calibrated, made.fit.covered, strict=True
    ):
        # The ends have the codes of the ends measured: the next code is nearest to no value that was.
        for code, value in ((low, least), (high, most)):
            assert abs(float(port.zero + port.lsb * code) - value) <= float(port.lsb) / 2


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


@pytest.mark.slow
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
    for flag in (Flag.INPUT_AT_RAIL, Flag.OUTSIDE_CALIBRATION, Flag.OUTPUT_SATURATED):
        assert {int(value) >> flag & 1 for value in flags} == {0, 1}
    assert simulate(made, [trace], tmp_path, simulator="icarus").run.mismatches == 0


@pytest.mark.slow
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
    assert simulate(broken, [trace], tmp_path, simulator="icarus").run.mismatches == 15


def worn(architecture: str, channels: int, initial: tuple[str, ...], *, signed: bool = False) -> CoreDesign:
    """Design the bench's instrument with limits of wear."""
    spec = load(EXAMPLES / "flange_wear_bench.toml")
    output = spec.output
    if signed:
        output = Port.from_range("clearance", 16, Fraction(-16), Fraction(16), signed=True, unit="mm")
    hardware = replace(spec.hardware, architecture=architecture, realization="df1_ef2", clock=Fraction(10**8))
    wear = WearSpec(initial=tuple(map(Fraction, initial)), warning=Fraction(2), limit=Fraction(4))
    return design_core(
        replace(spec, output=output, max_error=output.lsb, channels=channels, hardware=hardware, wear=wear)
    )


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["parallel", "folded", pytest.param("serial", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("channels", "initial"), [(1, ("1.5",)), (3, ("1.5",)), (3, ("1.5", "2", "0.5"))], ids=["1", "3", "3-different"]
)
def test_wear(architecture: str, channels: int, initial: tuple[str, ...], tmp_path: Path) -> None:
    made = worn(architecture, channels, initial, signed=architecture == "folded")
    traces = traces_for(made, "wear_ramp", seed=1)
    keep = np.linspace(0, len(traces[0]) - 1, 200).astype(int)
    traces = [replace(trace, codes=trace.codes[keep], truth=None, reading=None) for trace in traces]
    flags = made.datapath.compute_status(np.stack([trace.codes for trace in traces], axis=1))
    for column in flags.T:
        assert {int(value) >> Flag.WEAR_WARNING for value in column} == {0, 1, 3}
    assert simulate(made, traces, tmp_path, simulator="icarus").run.mismatches == 0


@pytest.mark.slow
def test_limits_of_another_channel_are_noticed(tmp_path: Path) -> None:
    made = worn("parallel", 3, ("1.5", "2", "0.5"))
    datapath = made.datapath
    broken = replace(
        made,
        architecture=replace(made.architecture, datapath=replace(datapath, wear=datapath.wear[1:] + datapath.wear[:1])),
    )
    traces = traces_for(made, "wear_ramp", seed=1)
    keep = np.linspace(0, len(traces[0]) - 1, 200).astype(int)
    traces = [replace(trace, codes=trace.codes[keep], truth=None, reading=None) for trace in traces]
    assert simulate(broken, traces, tmp_path, simulator="icarus").run.mismatches > 0


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
@pytest.mark.parametrize(("channels", "initial"), [(1, ("1.5",)), (3, ("1.5", "2", "0.5"))], ids=["1", "3-different"])
def test_wear_leaves_nothing_for_a_linter_or_a_compiler(
    architecture: str, channels: int, initial: tuple[str, ...], tmp_path: Path
) -> None:
    made = worn(architecture, channels, initial, signed=True)
    generate(made, tmp_path)
    name = made.spec.name
    assert lint(tmp_path / f"{name}.sv", name, tmp_path) == []
    assert icarus_check(tmp_path / f"{name}.sv", name) == []
    flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-c"]
    subprocess.run(["cc", *flags, f"{name}.c"], cwd=tmp_path, check=True)
    (first, *_) = made.spec.wear.clearances() if made.spec.wear is not None else ()
    entries = manifest(core_facts(made))["wear"]
    assert len(entries) == len(made.datapath.wear) == len(initial)
    assert (entries[0]["warning"], entries[0]["critical"]) == first == (3.5, 5.5)
    for entry, codes in zip(entries, made.datapath.wear, strict=True):
        assert tuple(entry["codes"]) == codes
