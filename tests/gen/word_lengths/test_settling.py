"""How long the start from zero shows: proven, so never shorter than what any past could change."""

from fractions import Fraction

import numpy as np
import pytest
from scipy import signal
from tests.gen.designs import example_design, zero_design
from tests.gen.word_lengths.filters import butterworth, plain
from tests.gen.word_lengths.steady import steady_design

from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.manifest import manifest
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.gen.word_lengths.settling import samples_to_settle
from sosmith.model.reference.golden import calibrated


def remains(made: Quantized, samples: int) -> float:
    """Largest change that the inputs before a start can make to the output from sample number `samples` on, in LSBs."""
    (port,) = made.datapath.inputs
    response = signal.sosfilt(made.quantized_sos, np.eye(1, 4 * samples)[0])
    reach = float(max(-port.lowest, port.highest) * port.lsb / made.datapath.output.lsb)
    return reach * float(np.abs(response[samples:]).sum())


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", ["df1_ef2", "df2t", "state_space", "lattice_wdf"])
@pytest.mark.parametrize(("order", "cutoff"), [(1, 0.1), (3, 0.02)])
def test_covers_what_any_past_could_change(order: int, cutoff: float, realization: str) -> None:
    made = plain(butterworth(order, cutoff), realization)
    samples = samples_to_settle(made.datapath)
    assert remains(made, samples) <= 0.5
    assert remains(made, samples // 2) > 0.5


@pytest.mark.slow
def test_a_constant_input_has_settled_by_then() -> None:
    """From 2,000 random starts: afterwards the result is that of a filter which has run for ever."""
    design = zero_design("flange_wear_bench.toml")
    made, datapath = design.quantized, design.datapath
    samples = made.settling
    rng = np.random.default_rng(1)
    constant = np.stack([rng.integers(port.lowest, port.highest + 1, 2000) for port in datapath.inputs], axis=1)
    results = datapath.output.decode(datapath.compute(np.broadcast_to(constant, (samples + 20, *constant.shape))))
    exact = calibrated(constant, datapath.inputs, made.polynomial)
    ends = datapath.output.decode(np.array([datapath.output.lowest, datapath.output.highest]))
    error = np.abs(results - np.clip(exact, *ends)) / float(datapath.output.lsb)
    assert error[samples:].max() <= float(made.bound + Fraction(1, 2))
    assert error[samples // 2 : samples].max() > float(made.bound + Fraction(1, 2))


@pytest.mark.slow
def test_the_manifest_has_it_in_samples_and_seconds() -> None:
    design = zero_design("flange_wear_bench.toml")
    tree = manifest(core_facts(design))
    samples = design.quantized.settling
    assert tree["start"] == "zero"
    assert tree["settling"] == {
        "samples": samples,
        "seconds": samples / 6,
        "limit": float(design.datapath.output.lsb) / 2,
    }
    calibration = manifest(core_facts(example_design("flange_wear_bench.toml", core="calibration")))
    steady = manifest(core_facts(steady_design("flange_wear_bench.toml")))
    assert (calibration["start"], calibration["settling"]) == (None, None)
    assert (steady["start"], steady["settling"]) == ("steady", None)
