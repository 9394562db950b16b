"""Filters that start from the steady state of their first sample: error, ranges, constant inputs, wear."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy import signal
from tests.gen.designs import EXAMPLES
from tests.gen.word_lengths.filters import OUT, SIGNED, butterworth, plain
from tests.gen.word_lengths.steady import CURRENT, ripple, steady_design

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.realizations.registry import SECTIONS
from sosmith.gen.specification.specification import load
from sosmith.gen.word_lengths.other_realization import with_realization
from sosmith.gen.word_lengths.quantized import START, Quantized
from sosmith.model.dataflow.status import Flag
from sosmith.model.port import Port
from sosmith.model.reference.golden import calibrated, filtered
from sosmith.model.sections.start import PassingStage, StartStage

WEAR = Flag.WEAR_WARNING, Flag.WEAR_CRITICAL


def error(made: Quantized, codes: np.ndarray) -> float:
    """Largest error of the integer model, in output LSBs."""
    datapath = made.datapath
    assert made.filter is not None
    values = calibrated(codes, datapath.inputs, made.polynomial)
    exact = filtered(values, made.filter.sos, datapath.output, steady=True)
    return float(np.abs(datapath.output.decode(datapath.compute(codes)) - exact).max() / float(datapath.output.lsb))


@pytest.mark.slow
@pytest.mark.parametrize("realization", SECTIONS)
@pytest.mark.parametrize("kind", ["lowpass", "highpass", "bandpass", "bandstop"])
def test_error_and_ranges_of_every_realization(kind: str, realization: str) -> None:
    made = plain(butterworth(3, 0.05, kind), realization, steady=True)
    passes = kind in {"lowpass", "bandstop"}
    assert made.steady
    assert isinstance(made.datapath.stages[0], StartStage)
    assert [isinstance(stage, PassingStage) for stage in made.datapath.stages[1:-1]] == [passes] * len(made.sections)
    rng = np.random.default_rng(3)
    for first in (SIGNED.lowest, SIGNED.highest, 12345):
        codes = rng.integers(SIGNED.lowest, SIGNED.highest + 1, (400, 1))
        codes[:200] = np.where(rng.random((200, 1)) < 0.5, SIGNED.lowest, SIGNED.highest)
        codes[0] = first
        assert error(made, codes) <= float(made.bound)
        assert made.datapath.compute_exact(codes) == made.datapath.compute(codes).tolist()


@pytest.mark.slow
@pytest.mark.parametrize("inputs", [SIGNED, CURRENT], ids=["signed", "offset"])
def test_the_worst_inputs_reach_the_ranges_of_all_states(inputs: Port) -> None:
    """After a first sample at one end of the range, the sign pattern of a state's response: no state has spare bits."""
    output = OUT if inputs is SIGNED else Port.from_range("y", 12, Fraction(4), Fraction(20))
    made = plain(butterworth(3, 0.05), inputs=inputs, output=output, steady=True)
    used: dict[str, float] = {}
    for section in range(len(made.sections)):
        sos = made.quantized_sos[: section + 1]
        response = signal.sosfilt(sos, np.eye(1, 400)[0])
        pattern = (response >= 0)[::-1]
        for first, towards in ((inputs.lowest, pattern), (inputs.highest, ~pattern)):
            codes = [first, *np.where(towards, inputs.highest, inputs.lowest).tolist()]
            wires = [[code] for code in codes]
            for stage in made.datapath.stages:
                wires = stage.graph.run(wires)  # raises where a range is left
                if stage.name == f"section{section}":
                    node = stage.graph.nodes[stage.graph.outputs[0]]
                    assert node.low == -node.high or abs(node.low + node.high) <= 2
                    most = max(abs(wire[0]) for wire in wires) / node.high
                    used[stage.name] = max(used.get(stage.name, 0.0), most)
    assert min(used.values()) > 0.98


@pytest.mark.slow
@pytest.mark.parametrize("inputs", [SIGNED, CURRENT], ids=["signed", "offset"])
def test_a_gain_that_is_not_1_is_rounded_within_a_share_of_the_error(inputs: Port) -> None:
    output = OUT if inputs is SIGNED else replace(CURRENT, name="y")
    made = plain(ripple(), inputs=inputs, output=output, steady=True)
    assert made.first_sample is not None
    gain = made.first_sample.gain * 2.0**-made.first_sample.gain_frac
    assert gain == pytest.approx(10 ** (-1 / 20), abs=2e-5)
    assert 0 < made.budget[START] < Fraction(1, 16)
    rng = np.random.default_rng(4)
    for first in (inputs.lowest, inputs.highest):
        codes = rng.integers(inputs.lowest, inputs.highest + 1, (300, 1))
        codes[0] = first
        assert error(made, codes) <= float(made.bound)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["audio_lowpass.toml", "flange_wear_bench.toml", "flange_wear_locomotive.toml"])
def test_examples_are_right_from_the_first_sample_on(name: str) -> None:
    """10,000 channels start at 10,000 constant inputs; no result ever leaves the bound about the exact value."""
    design = steady_design(name)
    made, datapath = design.quantized, design.datapath
    rng = np.random.default_rng(5)
    constant = np.stack([rng.integers(port.lowest, port.highest + 1, 10_000) for port in datapath.inputs], axis=1)
    results = datapath.output.decode(datapath.compute(np.broadcast_to(constant, (40, *constant.shape))))
    low, high = datapath.output.decode(np.array([datapath.output.lowest, datapath.output.highest]))
    exact = np.clip(calibrated(constant, datapath.inputs, made.polynomial), low, high)
    assert np.abs(results - exact).max() <= float(made.bound * datapath.output.lsb)


def with_wear(start: str) -> CoreDesign:
    spec = load(EXAMPLES / "flange_wear_bench.toml")
    made = design_core(replace(spec, hardware=replace(spec.hardware, start=start)))
    limits = made.datapath.output.encode(np.array([5.4, 5.6])).tolist()
    return replace(made, quantized=replace(made.quantized, datapath=replace(made.datapath, wear=(tuple(limits),))))


@pytest.mark.slow
def test_no_false_wear_flag_in_ten_thousand_starts_and_a_true_one_at_once() -> None:
    """Constant clearances up to the bound below the warning: the filter that starts from zero overshoots it.

    Its flag of settling keeps that from being told.
    """
    flags = sum(1 << flag for flag in WEAR)
    raised, above = {}, {}
    for start in ("zero", "steady"):
        made = with_wear(start)
        datapath = made.datapath
        rng = np.random.default_rng(6)
        codes = np.stack([rng.integers(port.lowest, port.highest + 1, 30_000) for port in datapath.inputs], axis=1)
        values = calibrated(codes, datapath.inputs, made.quantized.polynomial)
        bound = float(made.quantized.bound * datapath.output.lsb)
        sound, worn = codes[values < 5.4 - bound][:10_000], codes[values > 5.4 + bound]
        assert len(sound) == 10_000
        status = datapath.compute_status(np.broadcast_to(sound, (60, *sound.shape)))
        raised[start] = int(np.count_nonzero((status & flags).any(axis=0)))
        results = datapath.compute(np.broadcast_to(sound, (60, *sound.shape)))
        above[start] = int(np.count_nonzero((results >= datapath.wear[0][0]).any(axis=0)))
        if start == "steady":
            assert np.all(datapath.compute_status(worn[np.newaxis]) & (1 << Flag.WEAR_WARNING))
    assert raised == {"steady": 0, "zero": 0}
    assert above["steady"] == 0
    assert above["zero"] > 100


@pytest.mark.slow
def test_another_realization_keeps_the_start() -> None:
    made = steady_design("audio_lowpass.toml").quantized
    other = with_realization(made, "df1_ef1")
    assert [stage.name for stage in other.datapath.stages] == [stage.name for stage in made.datapath.stages]
    assert other.first_sample == made.first_sample
    codes = np.random.default_rng(7).integers(-32768, 32768, (200, 1))
    assert error(other, codes) <= float(other.bound)
