"""Input signals of a core: made without any simulator."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.interface.small import FILTER, INSTRUMENT, filter_design, instrument_design

import sosmith
from sosmith import SpecificationError
from sosmith.gen.stimuli.core import bench_before, bench_of
from sosmith.instrument.scenarios.traces import ChosenTraces


@pytest.mark.slow
def test_no_simulator_is_imported() -> None:
    listed = "[m for m in sys.modules if m.startswith(('sosmith.sim', 'cocotb'))]"
    code = f"import sys, sosmith.instrument.scenarios.traces; print({listed})"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


@pytest.mark.parametrize("core", [None, "filter", "calibration"])
def test_what_traces_depend_on_is_known_before_the_design(core: str | None) -> None:
    spec = sosmith.Specification.load(INSTRUMENT)
    before, after = bench_before(spec.checked, core), bench_of(sosmith.design(spec, core=core).core, errors=False)
    assert (before.ports, before.output.lsb, before.sample_rate) == (after.ports, after.output.lsb, after.sample_rate)
    assert np.array_equal(before.impulse_response, after.impulse_response)


def test_so_is_what_stands_before_a_decimator() -> None:
    tables = {**FILTER, "filter": {**FILTER["filter"], "cutoff": 10.0, "decimate": 4}}
    spec = sosmith.Specification.load(tables)
    before, after = bench_before(spec.checked), bench_of(sosmith.design(spec).core, errors=False)
    assert np.array_equal(before.impulse_response, after.impulse_response)


def test_the_least_samples_are_enough_and_one_fewer_is_not() -> None:
    made = instrument_design().core
    traces, rate = ChosenTraces(), float(made.spec.sample_rate)
    least = traces.least(made.spec, None)
    assert traces(made, 1, least / rate)[0].reading.sum() == 1
    with pytest.raises(SpecificationError, match=r"^seconds must be at least \S+ for wear_ramp \("):
        traces(made, 1, (least - 1) / rate)


def test_traces_of_a_file_are_its_first_samples_and_told_by_its_content(tmp_path: Path) -> None:
    made = filter_design()
    whole, path = made.trace("noise", seconds=0.5), tmp_path / "noise.wav"
    whole.write(path)
    traces = ChosenTraces(str(path))
    traces.check(made.core.spec, None)
    (trace,) = traces(made.core, 1, 0.1)
    assert np.array_equal(trace.codes, whole.coded[0].codes[:100])
    assert traces.least(made.core.spec, None) == 1
    assert ChosenTraces().identity() == []
    assert ChosenTraces("noise").identity() == ["noise"]
    before = traces.identity()
    path.write_bytes(path.read_bytes()[:-1] + b"\x01")
    assert len({*before, *traces.identity()}) == 2
    with pytest.raises(SpecificationError, match=r"^scenario for a plain filter must be one of .*, not 'noises'"):
        ChosenTraces("noises").check(made.core.spec, None)
    with pytest.raises(
        SpecificationError, match=r"^none\.wav: the WAV file must be a readable file, not: no such file"
    ):
        ChosenTraces("none.wav").check(made.core.spec, None)
