"""Ten thousand channels that start, each at a constant clearance of its own, in simulated hardware."""

import tomllib
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.verify.small_specifications import STEADY_INSTRUMENT

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.proof.settling import SETTLED
from sosmith.gen.specification.specification import from_tree
from sosmith.model.dataflow.status import Flag
from sosmith.model.reference.golden import calibrated
from sosmith.model.traces.trace import Trace
from sosmith.sim.simulation import simulate

CHANNELS, SAMPLES = 10_000, 4
WARNING, LIMIT = 4.4, 4.6
TEXT = STEADY_INSTRUMENT + f"wear = {{ initial = 4.0, warning = {WARNING - 4:.1f}, limit = {LIMIT - 4:.1f} }}\n"


def made_in(architecture: str, start: str) -> CoreDesign:
    spec = from_tree(tomllib.loads(TEXT, parse_float=Decimal), Path("small.toml"))
    hardware = replace(spec.hardware, architecture=architecture, clock=Fraction(10**10), start=start)
    return design_core(replace(spec, channels=CHANNELS, hardware=hardware))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("architecture", "start"),
    [(architecture, start) for start in ("steady", "zero") for architecture in ("parallel", "folded", "serial")],
)
def test_flags_of_wear_are_right_once_settled(architecture: str, start: str, tmp_path: Path) -> None:
    """At once behind a steady start; from zero, once the length has passed that the manifest states."""
    made = made_in(architecture, start)
    datapath, settled = made.datapath, made.quantized.settling
    assert (settled == 0) == (start == "steady")
    samples = settled + SAMPLES
    rng = np.random.default_rng(1)
    constant = np.stack([rng.integers(p.lowest, p.highest + 1, 2 * CHANNELS) for p in datapath.inputs], axis=1)
    values = calibrated(constant, datapath.inputs, made.quantized.polynomial)
    bound = float((made.quantized.bound + SETTLED * bool(settled)) * datapath.output.lsb)
    clear = np.abs(values - WARNING) > bound  # neither just below the limit nor just above
    constant, values = constant[clear][:CHANNELS], values[clear][:CHANNELS]
    assert len(constant) == CHANNELS
    ports, rate = datapath.inputs, made.spec.sample_rate
    traces = [
        Trace(name="start", ports=ports, sample_rate=rate, codes=np.tile(codes, (samples, 1))) for codes in constant
    ]
    evidence = simulate(made, traces, tmp_path, seed=1)
    assert evidence.run.mismatches == 0  # codes and flags are those of the integer model
    assert evidence.run.samples == CHANNELS * samples
    status = datapath.compute_status(np.broadcast_to(constant, (samples, *constant.shape)))
    warned = (status >> Flag.WEAR_WARNING & 1).astype(bool)
    assert not warned[:settled].any()
    unsettled = np.tile(np.arange(samples)[:, None] < settled, (1, CHANNELS))
    assert np.array_equal(status >> Flag.SETTLING & 1, unsettled)
    assert np.array_equal(evidence.run.unsettled, unsettled) if settled else evidence.run.unsettled is None
    right = warned == (values > WARNING)
    assert right[settled:].all()
    assert right[:settled].all() == (start == "steady")
    assert 1000 < np.count_nonzero(values < WARNING) < CHANNELS - 1000
