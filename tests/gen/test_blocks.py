"""Look-ahead and several samples a clock: what is chosen, proven, built, and equal to the model."""

import json
import re
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from benchmarks.random_designs import random_specification
from tests.formal.prover import broken
from tests.gen.block_specifications import AUDIO, designed, text
from tests.gen.designs import EXAMPLES
from tests.hdl.core_bench import Pace, run_core

from sosmith.gen.architectures import search
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.identity import identity
from sosmith.gen.output.manifest import manifest
from sosmith.gen.output.pins import pins
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.realizations import look_ahead as realization
from sosmith.gen.realizations import registry
from sosmith.gen.realizations.registry import LOOK_AHEAD, realization_of
from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.gen.report.provenance import provenance_of
from sosmith.gen.specification.specification import from_text
from sosmith.gen.word_lengths import quantize
from sosmith.instrument.scenarios.traces import traces_for
from sosmith.model.dataflow.graph import Range
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.reference.golden import calibrated, filtered
from sosmith.verify.bounds import driven_responses
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.parallel.check import check_hardware
from sosmith.verify.verification import verify

DESIGNS = 40
MOST_POLES = 10
"""Of random filters with look-ahead: the design of more can take minutes."""
SAMPLES = 240


ROWS = [[0.25, 0.5, 0.25, 1.0, -1.5, 0.625], [1.0, 1.0, 0.0, 1.0, -0.75, 0.0], [2.0, 0.0, -1.0, 1.0, 0.5, 0.875]]
"""Sections of two poles and of one."""


@pytest.mark.parametrize("distance", LOOK_AHEAD)
def test_stages_with_look_ahead_have_the_response_of_the_sections_together(distance: int) -> None:
    made = realization_of(f"look_ahead_{distance}")
    fine = dict.fromkeys(("v", *(f"u{k}" for k in range(5))), 80)
    front, *recursions = (
        made.build(part, SectionFormat(coefficient_bits=60, fracs=fine), f"section{k}")
        for k, part in enumerate(made.parts(ROWS))
    )
    assert len(recursions) == 3
    assert {tap.delay for stage in recursions for tap in stage.recursion} == {distance, 2 * distance}
    found = [Fraction(int(n == 0)) for n in range(60)]
    for stage in (front, *recursions):
        section = replace(stage, x=Range(80, -(1 << 90), 1 << 90))
        (output,) = section.graph.output_ranges
        rows = section.graph.run([[int(value * 2**80)] for value in found])
        found = [Fraction(row[0], 1 << output.frac) for row in rows]
    wanted = [Fraction(int(n == 0)) for n in range(60)]
    for row in ROWS:
        wanted = filtered_exactly([Fraction(value) for value in row], wanted)
    assert max(abs(float(a - b)) for a, b in zip(found, wanted, strict=True)) < 1e-14


def filtered_exactly(row: list[Fraction], x: list[Fraction]) -> list[Fraction]:
    """Filter by the section b0, b1, b2, 1, a1, a2."""
    y: list[Fraction] = []
    for n in range(len(x)):
        fed = sum(row[k] * x[n - k] for k in range(min(n, 2) + 1))
        y.append(fed - sum(row[3 + k] * y[n - k] for k in range(1, min(n, 2) + 1)))
    return y


def test_what_cannot_look_ahead_is_refused() -> None:
    made, form = realization_of("look_ahead_2"), SectionFormat(coefficient_bits=12)
    zeros, poles = made.parts([[0.0, 0.0, 0.0, 1.0, -2.0, 1.0]])
    message = r"section0 must be stable with coefficients of 12 bits: poles must lie inside the unit circle, not at .*"
    with pytest.raises(ShortfallError, match=f"^{message}$"):
        made.build(poles, form, "section0")
    with pytest.raises(ShortfallError, match=r"^numerator of section0 must not be zero$"):
        made.build(zeros, form, "section0")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("clock", "order", "distance"), [("48.0e6", 5, 2), ("100.0e6", 5, 3), ("150.0e6", 5, 4), ("400.0e6", 2, 4)]
)
def test_the_shortest_look_ahead_that_reaches_the_clock_is_chosen(clock: str, order: int, distance: int) -> None:
    made = designed(clock=clock, order=order)
    assert made.quantized.realization == f"look_ahead_{distance}"
    reached = made.architecture.clock_estimate >= made.spec.hardware.clock
    assert reached == (clock != "400.0e6")
    verb = "the shortest look-ahead that reaches" if reached else "comes closest to"
    assert made.reasons["realization"].startswith(f"look_ahead_{distance}: {verb} a clock of ")
    assert re.fullmatch(
        r"parallel: the smallest that keeps up"
        r"(; \d+ products? by constants made of adders, with registers between them)?",
        made.reasons["architecture"],
    )
    assert made.architecture.multiplier_blocks > 0


@pytest.mark.slow
@pytest.mark.parametrize("blocks", [0, 1, 9, 20])
def test_look_ahead_takes_no_more_blocks_than_it_may(blocks: int) -> None:
    made = designed(clock="100.0e6", multipliers=blocks)
    assert made.architecture.multiplier_blocks <= blocks < made.architecture.multiplier_blocks + 2
    codes = codes_of(made, SAMPLES)
    found = run_core(made.architecture, [(0, row) for row in codes.tolist()], Pace())
    assert [beat.code for beat in found] == made.datapath.compute_exact(codes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("clock", "rate", "chosen"), [("100e6", "90e6", True), ("100e6", "40e6", False), ("50e6", "50e6", False)]
)
def test_auto_looks_ahead_where_clock_and_rate_ask_for_it(clock: str, rate: str, chosen: bool) -> None:
    fast = AUDIO.replace("sample_rate = 48000.0", f"sample_rate = {rate}").replace("clock = 48.0e6", f"clock = {clock}")
    fast = fast.replace("cutoff = 1000.0", f"cutoff = {float(rate) / 48:.1f}")
    made = design_core(from_text(fast.replace('architecture = "auto"', 'architecture = "parallel"'), Path("fast.toml")))
    assert made.quantized.realization.startswith("look_ahead_") == made.architecture.look_ahead == chosen


def test_a_realization_cannot_be_asked_for_with_look_ahead() -> None:
    spec = from_text(text(), Path("audio.toml"))
    message = 'audio.toml: the realization must be auto with hardware.pipeline = "look-ahead", not df1'
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        design_core(spec, realization="df1")
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        design_core(spec, widths_of="df1")


@pytest.mark.slow
def test_auto_keeps_plain_loops_where_look_ahead_is_no_faster() -> None:
    """16 samples a clock are more than look-ahead has: what was proven without it stays."""
    wide = text(16, pipeline="auto", clock="100e6").replace("sample_rate = 48000.0", "sample_rate = 1600e6")
    made = design_core(from_text(wide.replace("cutoff = 1000.0", "cutoff = 50e6"), Path("wide.toml")))
    assert not made.architecture.look_ahead
    assert (made.architecture.samples_per_clock, made.quantized.realization) == (16, "df1_ef2")


@pytest.mark.slow
@pytest.mark.parametrize("searches_anew", [True])
def test_formats_of_long_responses_are_not_trimmed(searches_anew: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are proven as they are found first, and take a little more."""
    trimmed = designed()
    monkeypatch.setattr(quantize, "_MOST_WORK", 0)
    long = design_core(from_text(text(), Path("audio.toml")))
    assert long.quantized.realization == trimmed.quantized.realization
    assert long.quantized.bound * long.datapath.output.lsb <= long.spec.max_error
    assert long.architecture.cost.adder_bits > trimmed.architecture.cost.adder_bits


def test_a_rate_beyond_the_samples_a_clock_is_refused() -> None:
    slow = text(2, pipeline="plain").replace("sample_rate = 48000.0", "sample_rate = 97e6").replace("1000.0", "2e6")
    message = (
        "slow.toml: hardware.clock must be at least the sample_rate (97000000 Hz) divided by "
        "hardware.samples_per_clock = 2, not 48000000"
    )
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        from_text(slow, Path("slow.toml"))


@pytest.mark.slow
def test_several_samples_are_refused_on_a_board() -> None:
    message = (
        "audio.toml: hardware.samples_per_clock must be 1 on a board, whose serial line never brings several samples a "
        "clock, not 2"
    )
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        identity(designed(2, pipeline="plain"), "", baud=1_000_000, clock=48e6)
    assert identity(designed(), "", baud=1_000_000, clock=48e6).architecture == "parallel"


@pytest.mark.slow
def test_manifest_and_pins_tell_how_samples_lie_in_a_beat() -> None:
    made = designed(2, pipeline="plain")
    facts = core_facts(made)
    streams = manifest(facts)["streams"]
    assert (streams["s_axis"]["width"], streams["s_axis"]["samples"], streams["s_axis"]["sample_width"]) == (32, 2, 16)
    assert streams["m_axis"]["tuser"]["width"] == 16
    named = {pin.name: pin for pin in pins(made, facts.interface)}
    assert (named["s_axis_tdata"].width, named["m_axis_tdata"].width, named["m_axis_tuser"].width) == (32, 32, 16)
    assert named["s_axis_tdata"].meaning.startswith("2 samples of 16 bits, the first one lowest, each with the bits; ")
    assert "pipeline" not in manifest(facts)
    (trace,) = traces_for(made, "noise", seed=1)
    assert provenance_of(made, [trace]).cycles_per_sample == 0.5
    plain = manifest(core_facts(designed()))
    assert plain["pipeline"] == "look-ahead"
    assert "samples" not in plain["streams"]["s_axis"]


def codes_of(made: CoreDesign, count: int) -> np.ndarray:
    """Return codes that jump between the rails, rest at one of them, and wander."""
    rng = np.random.default_rng(5)
    (port,) = made.datapath.inputs
    codes = rng.integers(port.lowest, port.highest, (count, 1), endpoint=True)
    codes[: count // 4] = port.highest
    codes[count // 4 : count // 2 : 3] = port.lowest
    return codes


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    "pace",
    [
        Pace(),
        pytest.param(Pace(idle=0.0, stall=0.0), marks=pytest.mark.slow),
        pytest.param(Pace(idle=0.6, stall=0.6, withdraw=0.3), marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize(
    ("lanes", "pipeline", "clock"),
    [(1, "look-ahead", "48.0e6"), (1, "look-ahead", "150.0e6"), (2, "plain", "48.0e6"), (2, "look-ahead", "100.0e6")],
)
def test_a_core_gives_the_codes_and_flags_of_the_model(lanes: int, pipeline: str, clock: str, pace: Pace) -> None:
    made = designed(lanes, pipeline=pipeline, clock=clock)
    codes = codes_of(made, SAMPLES)
    found = run_core(made.architecture, [(0, row) for row in codes.tolist()], pace)
    assert [beat.code for beat in found] == made.datapath.compute_exact(codes)
    assert [beat.status for beat in found] == made.datapath.compute_status(codes).tolist()
    assert {beat.status & 1 for beat in found} == {0, 1}


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [2, 4])
def test_an_instrument_takes_several_samples_a_clock(lanes: int) -> None:
    bench = (EXAMPLES / "flange_wear_bench.toml").read_text(encoding="utf-8")
    wide = re.sub(r"\[hardware\]", f"[hardware]\nsamples_per_clock = {lanes}", bench)
    made = design_core(from_text(re.sub(r"reload = true", "reload = false", wide), EXAMPLES / "wide.toml"))
    assert made.architecture.name == "parallel"
    (trace,) = traces_for(made, "worst_case", seed=1)
    codes = trace.codes[: 50 * lanes]
    found = run_core(made.architecture, [(0, row) for row in codes.tolist()], Pace())
    assert [beat.code for beat in found] == made.datapath.compute_exact(codes)
    assert [beat.status for beat in found] == made.datapath.compute_status(codes).tolist()


def proven(made: CoreDesign) -> Certificate:
    return Certificate.model_validate(json.loads(certificate_text(certificate(made.quantized, made.spec.max_error))))


@pytest.mark.slow
def test_the_verifier_proves_look_ahead_by_its_own_method() -> None:
    proof = proven(designed())
    verify(proof)
    changed = json.loads(certificate_text(certificate(designed().quantized, designed().spec.max_error)))
    changed["claims"]["budget"]["filter coefficients"] = "1/100000"
    with pytest.raises(ShortfallError):
        verify(Certificate.model_validate(changed))


def test_responses_that_take_turns_have_the_norm_of_all_of_them() -> None:
    poly = driven_responses.fmpq_poly
    scattered = poly([1, 0, 0, 0, driven_responses.fmpq(1, 2)])
    plain = poly([1, driven_responses.fmpq(1, 2)])
    numerator = poly([1, 2, 3, 0, 5])
    turns = driven_responses.Denominator(scattered).norm(numerator)
    apart = sum(driven_responses.Denominator(plain).norm(part) for part in (poly([1, 5]), poly([2]), poly([3])))
    assert turns == apart
    factor, made = driven_responses._scattered(poly([1, -1, driven_responses.fmpq(1, 4)]), 8)
    assert {k for k, value in enumerate(made.coeffs()) if value} == {0, 8, 16}
    assert made == factor * poly([1, -1, driven_responses.fmpq(1, 4)])


@pytest.mark.parametrize(
    "numerators", [([1, 1], [0]), ([3, -1, 2, 5], [1, 0, -2]), ([1, 0, 0, 0, 7], [-4, 1]), ([0, 0, 0, -1], [2, 2, 2])]
)
def test_rough_limits_by_turns_enclose_those_of_every_sample(numerators: tuple[list[int], list[int]]) -> None:
    """With drives that do not contain zero, sums up to some sample may be beyond whole ones."""
    poly, quarter = driven_responses.fmpq_poly, driven_responses.fmpq(1, 4)
    over = driven_responses.Denominator(poly([1, 0, 0, 0, -4 * quarter, 0, 0, 0, quarter]))
    driven = [
        (poly(numerators[0]), Fraction(1), Fraction(2)),
        (poly(numerators[1]), Fraction(-3), Fraction(-1, 2)),
    ]
    low, high = driven_responses._running_extremes(over, driven)
    below, above = driven_responses.extremes(over, driven, rough=True)
    slack = Fraction(1, 2**64)  # limits of every sample are rounded
    assert below - slack <= low < high <= above + slack
    assert above - below <= 2 * (high - low)


@pytest.mark.slow
def test_twelve_poles_look_ahead() -> None:
    """They have nodes in each of the responses that take turns."""
    asked = text(clock="150.0e6").replace("order = 5\n", "order = 12\n").replace("cutoff = 1000.0", "cutoff = 2400.0")
    made = design_core(from_text(asked, Path("audio.toml")))
    assert made.quantized.realization.startswith("look_ahead_")
    assert made.architecture.clock_estimate >= made.spec.hardware.clock
    assert verify(proven(made)).bound * made.datapath.output.lsb <= made.spec.max_error


@pytest.mark.slow
@pytest.mark.parametrize("searches_anew", [True])
def test_a_wrong_recursion_exceeds_its_bound(searches_anew: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """With A(w) in place of A(-w), it is another filter, which no word lengths bring within the error allowed."""
    wrong = broken(realization, "value * (-1) ** k", "value")
    other = replace(LOOK_AHEAD[6], parts=partial(wrong.look_ahead_parts, distance=6), build=wrong.look_ahead)
    for module in (registry, search):
        monkeypatch.setattr(module, "LOOK_AHEAD", {6: other})
    with pytest.raises(ShortfallError, match=r"^the filter's coefficients must keep their error below "):
        design_core(from_text(text().replace("order = 5\n", "order = 2\n"), Path("audio.toml")))


def random_design(number: int, lanes: int, pipeline: str) -> CoreDesign:
    """Design the first specification that can be met of every `DESIGNS`th seed."""
    for seed in range(2000 + number, 20_000, DESIGNS):
        base = random_specification(seed)[1]
        hardware = f'pipeline = "{pipeline}"\nsamples_per_clock = {lanes}\n'
        made = base.replace('architecture = "auto"', 'architecture = "parallel"') + hardware
        spec = from_text(made, Path("random.toml"))
        assert spec.filter.order is not None
        poles = spec.filter.order * (2 if spec.filter.kind.startswith("band") else 1)
        if pipeline == "look-ahead" and poles > MOST_POLES:
            continue
        try:
            return design_core(spec)
        except ShortfallError:
            continue
    raise AssertionError


@pytest.mark.slow
@pytest.mark.parametrize("number", range(DESIGNS))
@pytest.mark.parametrize("pipeline", ["plain", "look-ahead"])
def test_a_random_design_is_proven_and_equal_to_the_model(pipeline: str, number: int) -> None:
    lanes = (2, 4, 8, 16)[number % 4] if pipeline == "plain" else (1, 2, 1, 4)[number % 4]
    made = random_design(number, lanes, pipeline)
    core, quantized, output = made.architecture, made.quantized, made.datapath.output
    assert (core.samples_per_clock, core.look_ahead) == (lanes, pipeline == "look-ahead")
    verify(proven(made))
    written = to_verilog(to_rtlil(core.component(), made.datapath.name))
    assert check_hardware(written, proven(made), lanes=lanes).latency == core.latency_cycles
    (trace,) = traces_for(made, "worst_case_errors", seed=number)
    codes = trace.codes[-len(trace.codes[: 20 * 16]) // lanes * lanes :]
    wanted = made.datapath.compute_exact(codes)
    found = [beat.code for beat in run_core(core, [(0, row) for row in codes.tolist()], Pace())]
    assert found == wanted
    assert quantized.filter is not None
    ideal, exact = np.array(quantized.filter.sos), calibrated(codes, made.datapath.inputs, None)
    golden = filtered(exact, ideal, output, steady=quantized.steady)
    error = np.abs(output.decode(np.array(found)) - golden).max() / float(output.lsb)
    assert error <= float(quantized.bound) + 1e-6
