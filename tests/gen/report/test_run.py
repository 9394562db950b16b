"""What hardware computed beside integer model and exact chain: results and flags, one channel or several."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from tests.interface.small import filter_design

from sosmith.gen.report.input_ranges import InputRange, input_ranges, inputs_at_an_end, limited_inputs
from sosmith.gen.report.run import run_of
from sosmith.model.traces.trace import Tone, Trace

COUNT = 40


def trace(noise: int = 1, **changes: Any) -> Trace:
    datapath = filter_design().core.datapath
    (port,) = datapath.inputs
    codes = np.random.default_rng(noise).integers(port.lowest, port.highest + 1, (COUNT, 1))
    return replace(
        Trace(name="noise", ports=datapath.inputs, sample_rate=filter_design().core.spec.sample_rate, codes=codes),
        **changes,
    )


def test_without_hardware_results_are_those_of_the_integer_model() -> None:
    core = filter_design().core
    run = run_of(core, [trace()])
    assert run.received.tolist() == core.datapath.compute(trace().codes).tolist()
    assert (run.mismatches, run.first_mismatch, run.channels, run.error.shape) == (0, None, 1, (COUNT,))
    both = run_of(core, [trace(1), trace(2)])
    assert (both.mismatches, both.channels, both.error.shape) == (0, 2, (COUNT, 2))
    assert both.received[:, 0].tolist() == run.received.tolist()


def test_each_result_and_each_flag_that_differs_is_a_mismatch() -> None:
    """What comes beyond the trace is left out, and nothing is taken from the model if hardware gave it."""
    core, traces = filter_design().core, [trace(1), trace(2)]
    codes, flags = core.datapath.compute_with_status(np.stack([one.codes for one in traces], axis=1))
    more = [np.concatenate([array, array[:3]]) for array in (codes, flags)]
    assert run_of(core, traces, *more).mismatches == 0
    wrong, flagged = codes.copy(), flags.copy()
    wrong[7, 1] ^= 1
    flagged[5, 0] ^= 1
    run = run_of(core, traces, wrong, flagged)
    assert (run.mismatches, run.first_mismatch) == (2, 5)
    assert run.received[7, 1] == wrong[7, 1]
    for half in ((wrong, None), (None, flagged)):  # of which nothing can be said
        assert run_of(core, traces, *half).mismatches == 0


def test_the_tone_that_has_settled_last_is_told() -> None:
    early, late = (Tone(Fraction(10), settled) for settled in (3, 20))
    for tones, told in (((None, None), None), ((early, None), early), ((early, late), late), ((late, early), late)):
        assert run_of(filter_design().core, [trace(tone=tone) for tone in tones]).tone == told


def test_a_generated_signal_without_a_true_value_may_go_to_the_ends() -> None:
    truth = np.ones(COUNT)
    for seed, known, synthetic in ((None, None, False), (1, None, True), (1, truth, False), (None, truth, False)):
        (found,) = input_ranges([trace(seed=seed, truth=known)])
        assert found.synthetic == synthetic


@pytest.mark.parametrize(
    ("at_end", "limited", "synthetic", "told"),
    [(0, 0, False, 0), (8, 0, False, 1), (8, 0, True, 0), (8, 8, False, 0), (8, 7, False, 1)],
)
def test_codes_at_the_ends_are_told_unless_they_were_cut_or_are_meant(
    at_end: int, limited: int, synthetic: bool, told: int
) -> None:
    found = InputRange(
        name="x", unit="V", low=-1.0, high=1.0, samples=400, at_end=at_end, limited=limited, synthetic=synthetic
    )
    sentence = (
        "2 % of the codes of x are at an end of its range: if the trace was measured, the converter was overdriven "
        "there, and the accuracy is that of a clipped signal."
    )
    assert list(inputs_at_an_end([found])) == [sentence] * told
    assert len(list(limited_inputs([found]))) == (limited > 0)
