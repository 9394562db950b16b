"""State-space sections: least roundoff noise, truncation that comes to rest, and both through the quantizer."""

import math
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from benchmarks.published import (
    BUTTERWORTH_GAINS,
    DELTA,
    JENSSEN,
    SECTION_GAINS,
    butterworth_gain,
    jenssen_estimate,
    jenssen_gain,
    jenssen_simulated,
    lowpass,
    qualities,
)
from benchmarks.published import butterworth as whole_butterworth
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal
from tests.gen.designs import with_rows
from tests.gen.word_lengths.filters import butterworth, errors, plain, stimulus
from tests.hdl.stages.stage_bench import run

from sosmith.gen.proof.linear_model import linear_model
from sosmith.gen.realizations.noise import (
    StateSystem,
    companion,
    minimum_gain,
    second_order_modes,
)
from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.gen.realizations.state_space import StateDesign, minimum_noise, normal
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Range
from sosmith.model.dataflow.structure import Stage
from sosmith.model.errors import ShortfallError
from sosmith.model.port import Port
from sosmith.model.sections.state_space import Coefficient, StateSpace

CUTOFFS = (0.0026, 0.01, 0.03, 0.1, 0.25)
Row = tuple[float, ...]


ROWS: dict[str, Row] = {
    "low-pass": lowpass(0.0026, 2.2),
    "low-pass, Q 0.51": lowpass(0.05, 0.51),
    "low-pass, poles at 90 degrees": lowpass(0.25, 3.0),
    "low-pass, poles near -1": lowpass(0.45, 1.5),
    "high-pass": tuple(signal.butter(2, 0.01, "highpass", fs=1.0, output="sos")[0]),
    "notch": tuple(signal.ellip(2, 0.5, 40, 0.03, fs=1.0, output="sos")[0]),
    "two real poles": (0.01, 0.02, 0.005, 1.0, -(0.97 + 0.6), 0.97 * 0.6),
    "two real poles on both sides": (0.3, 0.1, 0.2, 1.0, -(0.9 - 0.8), -0.9 * 0.8),
    "equal real poles": (0.01, 0.02, 0.01, 1.0, -1.75, 0.765625),
    "equal real poles but for rounding": (0.01, 0.0, 0.0, 1.0, -2 * 0.9, 0.9 * 0.9 * (1 + 2.0**-52)),
    "one zero": (0.5, 0.25, 0.0, 1.0, -1.2, 0.5),
    "delays only": (0.25, 0.5, 0.25, 1.0, 0.0, 0.0),
}
FLAT: dict[str, Row] = {
    "a band of an equalizer at 0 dB": (1.0, -1.8, 0.9, 1.0, -1.8, 0.9),
    "zeros at equal real poles": (0.5, -0.9, 0.405, 1.0, -1.8, 0.81),
}


@pytest.mark.parametrize("cutoff", CUTOFFS)
@pytest.mark.parametrize("q", [0.51, 1 / math.sqrt(2), 2.25, 20.0])
def test_noise_of_a_low_pass_section_has_a_closed_form(cutoff: float, q: float) -> None:
    """mu1 - mu2 = 1/2 and mu1 mu2 = Q**2/4, so that the gain is Q**2/2 + 1/8 at every cutoff."""
    system = minimum_noise(lowpass(cutoff, q)).system
    mu1, mu2 = second_order_modes(system)
    assert (mu1 - mu2, mu1 * mu2) == pytest.approx((0.5, q * q / 4), rel=1e-6)
    assert system.noise.sum() == pytest.approx(q * q / 2 + 1 / 8, rel=1e-6)
    assert system.noise[0] == pytest.approx(system.noise[1], rel=1e-6)


@pytest.mark.parametrize(("order", "gains"), [*SECTION_GAINS.items(), (2, (0.375,))])
def test_noise_of_butterworth_sections(order: int, gains: tuple[float, ...]) -> None:
    """Figures of the project's theory notes, section 3.6."""
    made = [minimum_noise(lowpass(0.02, q)).system.noise.sum() for q in qualities(order)]
    assert made == pytest.approx(list(gains), abs=1e-6)


@pytest.mark.parametrize(("order", "gain"), list(enumerate(BUTTERWORTH_GAINS, start=1)))
def test_least_noise_of_a_whole_butterworth_filter(order: int, gain: float) -> None:
    """Figures of the project's theory notes, section 3.6; the modes' squares sum to N/4."""
    assert butterworth_gain(order) == pytest.approx(gain, abs=1e-6)
    assert np.sum(second_order_modes(whole_butterworth(order)) ** 2) == pytest.approx(order / 4, abs=1e-9)


def bomar(row: Row) -> StateSystem:
    """Minimum-noise section by Bomar's equations (1985) as Jenssen states them, an independent way there."""
    b0, b1, b2, _, p1, p2 = row
    q1, q2 = b1 - b0 * p1, b2 - b0 * p2
    v1 = q2 / q1
    v2 = math.sqrt(v1 * v1 - p1 * v1 + p2)
    v5, v6, v8 = p2 - 1, p2 + 1, p1 * p1 / 4 - p2
    g1, g2 = (math.sqrt(v5 * (v6**2 - p1**2) / (2 * p1 * v - v6 * (1 + v * v))) for v in (v1 - v2, v1 + v2))
    a21 = math.sqrt(v8 * (v5 + g2 * g2) / (v5 + g1 * g1))
    A = np.array([[-p1 / 2, v8 / a21], [a21, -p1 / 2]])
    return StateSystem(A, np.array([g1, g2]), np.array([q1 / (2 * g1), q1 / (2 * g2)]), b0)


@pytest.mark.parametrize("q", [0.51, 2.25])
@pytest.mark.parametrize("cutoff", CUTOFFS)
def test_minimum_noise_agrees_with_bomar(cutoff: float, q: float) -> None:
    made, known = minimum_noise(lowpass(cutoff, q)), bomar(lowpass(cutoff, q))
    assert made.system.noise == pytest.approx(known.noise, rel=1e-6)
    # The same up to the scale of the states and their order.
    A, other = made.system.A, known.A
    assert (A[0, 0], A[1, 1]) == pytest.approx((other[0, 0], other[1, 1]), abs=1e-9)
    assert A[0, 1] * A[1, 0] == pytest.approx(other[0, 1] * other[1, 0], rel=1e-6)


@given(
    st.sampled_from(sorted(set(ROWS) - {"delays only"})),
    st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda v: abs(v[0] * v[3] - v[1] * v[2]) > 1e-2),
)
def test_no_coordinates_make_less_noise(name: str, entries: list[float]) -> None:
    system = minimum_noise(ROWS[name]).system
    other = system.transformed(np.array(entries).reshape(2, 2))
    assert system.noise.sum() == pytest.approx(minimum_gain(second_order_modes(system)), rel=1e-5)
    assert other.noise.sum() >= system.noise.sum() * (1 - 1e-5)


@pytest.mark.parametrize("make", [minimum_noise, normal])
@pytest.mark.parametrize("name", ROWS)
def test_designs_are_scaled_by_powers_of_two(name: str, make: object) -> None:
    made: StateDesign = make(ROWS[name])  # type of `minimum_noise`
    deviations = np.sqrt(np.diag(made.system.controllability))
    assert np.all(deviations < 1 + 1e-9)
    assert deviations.max() > 0.5
    assert all(value == 0 or math.frexp(value)[0] == 0.5 for value in made.B)


@pytest.mark.parametrize("row", FLAT.values(), ids=FLAT)
def test_zeros_at_the_poles_leave_a_factor(row: Row) -> None:
    made = minimum_noise(row)
    assert (made.C.tolist(), made.D) == ([0.0, 0.0], row[0])
    assert np.linalg.eigvals(made.system.A) == pytest.approx(np.roots(row[3:]), abs=1e-6)


@pytest.mark.parametrize("name", ROWS)
def test_normal_form_is_near_the_minimum(name: str) -> None:
    """Two thirds above it, at most; and no coefficient is out of all proportion."""
    made, best = normal(ROWS[name]), minimum_noise(ROWS[name])
    assert best.system.noise.sum() <= made.system.noise.sum() * (1 + 1e-6)
    assert made.system.noise.sum() < 1.7 * best.system.noise.sum()
    assert max(np.abs(made.C)) < 3


@pytest.mark.parametrize("realization", ["state_space", "normal"])
@pytest.mark.parametrize("name", ROWS)
def test_sections_are_what_was_asked_for(name: str, realization: str) -> None:
    """The exact transfer function of the integers is the row's, to the precision of 40-bit coefficients."""
    words = SectionFormat(coefficient_bits=40)
    model = linear_model(REALIZATIONS[realization].build(ROWS[name], words, "s").graph)
    made = [*map(float, model.transfer), 0.0, 0.0][:3] + [*map(float, model.denominator), 0.0, 0.0][:3]
    assert made == pytest.approx(ROWS[name], abs=1e-10)


@pytest.mark.parametrize("name", ROWS)
def test_energy_is_that_of_the_impulse_response(name: str) -> None:
    row = ROWS[name]
    impulse = np.zeros(20_000)
    impulse[0] = 1
    response = signal.lfilter(row[:3], row[3:], impulse)
    assert companion(row).energy == pytest.approx(np.sum(response**2), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("structure", JENSSEN)
def test_published_noise_of_a_cascade(structure: str) -> None:
    """The published figures again: gain and estimate to the last printed digit, simulation within a tenth.

    Not so for the global optimum, whose coordinates are not unique: those published round to other 10-bit coefficients.
    """
    gain, estimate, simulated = JENSSEN[structure]
    unique = structure != "global optimal"
    assert jenssen_gain(structure) == pytest.approx(gain, abs=0.005 if unique else 0.01)
    assert jenssen_estimate(structure) == pytest.approx(estimate, abs=0.0051 if unique else 0.015)
    assert DELTA**2 * gain / 12 + 1 / 12 == pytest.approx(estimate, abs=0.055)
    assert jenssen_simulated(structure) == pytest.approx(simulated, rel=0.1)


def coarse(row: Row, realization: str, *, bits: int = 24) -> StateSpace:
    """Section whose states and output are whole numbers, for 20-bit inputs."""
    limits = (-(1 << 30), 1 << 30)
    words = SectionFormat(
        x=Range(0, -(1 << 19), (1 << 19) - 1),
        coefficient_bits=bits,
        fracs=dict.fromkeys(("x1_sum", "x2_sum", "y_sum"), 0),
        ranges=dict.fromkeys(("x1_next", "x2_next", "y"), limits),
    )
    stage = REALIZATIONS[realization].build(row, words, "section")
    assert isinstance(stage, StateSpace)
    return stage


@pytest.mark.slow
@pytest.mark.parametrize("cutoff", [*CUTOFFS[:-1], 0.2])
def test_measured_noise_is_the_predicted_one(cutoff: float) -> None:
    """A section with whole-numbered states: its output minus that of exact arithmetic, within 0.2 dB.

    By the closed form, K_ii W_ii is half of Q**2/2 + 1/8 for each state, and W_ii is what its rounding contributes.
    Not at 0.25, where A holds a 0 and a 1: what is rounded there is no fine-grained product.
    """
    q = 1.6
    row = lowpass(cutoff, q)
    section = coarse(row, "state_space")
    ports = [Port(name=n, bits=b, signed=True, lsb=Fraction(1), zero=Fraction(0)) for n, b in (("x", 20), ("y", 32))]
    datapath = Datapath(name="section", inputs=(ports[0],), output=ports[1], stages=(section,))
    codes = np.random.default_rng(5).integers(-100_000, 100_000, (400_000, 1))
    model = linear_model(section.graph)
    exact = signal.lfilter([float(v) for v in model.transfer], [float(v) for v in model.denominator], codes[:, 0])
    error = datapath.compute(codes) - exact
    assert abs(np.mean(error)) < 0.1
    measured = np.var(error)
    states = np.diag(minimum_noise(row).system.controllability)
    predicted = (np.sum((q * q / 4 + 1 / 16) / states) + 1) / 12
    assert abs(10 * math.log10(measured / predicted)) < 0.2


POLES = {
    "high quality, low cutoff": lowpass(0.01, 5.0),
    "high quality": lowpass(0.1, 20.0),
    "90 degrees": lowpass(0.25, 10.0),
    "near -1": lowpass(0.47, 4.0),
}
REAL_POLES = {
    "one real pole": (0.05, 0.05, 0.0, 1.0, -0.9, 0.0),
    "one real pole near -1": (0.05, 0.05, 0.0, 1.0, 0.95, 0.0),
    "two real poles": ROWS["two real poles"],
    "equal real poles": ROWS["equal real poles"],
}


def cycles(graph: Graph, reach: int) -> set[tuple[int, ...]]:
    """States on limit cycles without input, from every state whose codes are within `reach`."""
    following: dict[tuple[int, ...], tuple[int, ...]] = {}
    found: set[tuple[int, ...]] = set()
    for start in np.ndindex(*[2 * reach + 1] * len(graph.delays)):
        state = tuple(code - reach for code in start)
        path: list[tuple[int, ...]] = []
        while state not in following:
            path.append(state)
            memory = list(state)
            graph.step([0], memory)
            following[state] = tuple(memory)
            state = following[state]
        if state in path:
            found.update(path[path.index(state) :])
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", [*POLES, *REAL_POLES])
@pytest.mark.parametrize("bits", [6, 12])
def test_truncated_states_come_to_rest_and_rounded_ones_do_not(name: str, bits: int) -> None:
    """Every state of five-bit words, followed until it repeats."""
    section = coarse((POLES | REAL_POLES)[name], "normal", bits=bits)
    zero = (0,) * len(section.a)
    assert cycles(section.graph, 15) == {zero}
    assert len(cycles(replace(section, truncating=False).graph, 15)) > 1


@pytest.mark.parametrize("name", [*POLES, *REAL_POLES])
def test_energy_of_a_truncated_section_falls(name: str) -> None:
    """Diagonal D > 0 with D - A' D A positive definite, in rationals: x' D x falls, and truncation lowers it more."""
    A = coarse((POLES | REAL_POLES)[name], "normal").matrix
    if len(A) == 1:
        assert abs(A[0][0]) < 1
        return
    (a, b), (c, d) = A
    # The second row's weight so small that the coupling, one way for real poles, does not matter.
    weight = Fraction(1) if b else (1 - a * a) * (1 - d * d) / (2 * c * c)
    first, second = 1 - a * a - weight * c * c, weight - b * b - weight * d * d
    mixed = a * b + weight * c * d
    assert first > 0
    assert first * second > mixed * mixed


@pytest.mark.slow
@pytest.mark.parametrize(("realization", "silent"), [("normal", True), ("df1", False), ("state_space", False)])
def test_output_is_silent_after_the_input(realization: str, silent: bool) -> None:
    section, *_ = plain(butterworth(2, 0.01), realization).sections
    node = section.graph.nodes[section.graph.inputs[0]]
    state = section.graph.reset()
    noise = np.random.default_rng(2).integers(node.low, node.high + 1, (300, 1)).tolist()
    *_, (last,) = section.graph.run([*noise, *[[0]] * 1500], state)
    assert (last == 0 and not any(state)) is silent


def test_truncation_errs_to_either_side() -> None:
    """Of two fraction bits it drops up to three quarters of an LSB, with the sign of the value."""
    g = GraphBuilder()
    graph = g.build([g.truncate(g.input("x", 2, -8, 7), 0)])
    source, error = linear_model(graph).sources
    assert (source.low, source.high, error.low, error.high) == (-2, Fraction(7, 4), -Fraction(3, 4), Fraction(3, 4))
    assert error.numerators == {1: (-1,)}
    dropped = {Fraction(code, 4) - graph.step([code], [])[0] for code in range(-8, 8)}
    assert (min(dropped), max(dropped)) == (error.low, error.high)


SLOW = {(order, 0.0026) for order in (2, 3)} | {(3, 0.03)} | {(6, cutoff) for cutoff in (0.0026, 0.03, 0.2, 0.36)}


DESIGNS = [
    (kind, order, cutoff)
    for kind in ("lowpass", "highpass", "bandpass", "bandstop")
    for order in (1, 2, 3, 6)
    for cutoff in (0.0026, 0.03, 0.2, 0.36)
]
CASES = [
    pytest.param(realization, *wanted, marks=[pytest.mark.slow] if wanted[1:] in SLOW or (i + i // 4 + k) % 4 else [])
    for i, wanted in enumerate(DESIGNS)
    for k, realization in enumerate(("state_space", "normal"))
]
"""All designs in both realizations; the fast tests take every other of the smaller ones, each realization in turn."""


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("realization", "kind", "order", "cutoff"), CASES)
def test_designs_stay_within_their_bound(realization: str, kind: str, order: int, cutoff: float) -> None:
    quantized = plain(butterworth(order, cutoff, kind), realization)
    codes = stimulus(quantized.datapath.inputs, order, 12_000)
    assert 0.4 < np.abs(errors(quantized, codes)).max() <= quantized.bound <= 1
    part = codes[2200:3400]  # noise, then a step; raises if a value leaves its range
    assert quantized.datapath.compute_exact(part) == quantized.datapath.compute(part).tolist()


@pytest.mark.sweep(1)
@pytest.mark.parametrize("realization", ["state_space", "normal"])
@pytest.mark.parametrize("name", ["low-pass", "two real poles", "two real poles on both sides", "delays only"])
def test_hardware_equals_its_graph(name: str, realization: str) -> None:
    quantized = plain(with_rows(butterworth(2, 0.1), [ROWS[name]]), realization)
    samples: list[list[int]] = stimulus(quantized.datapath.inputs, 3, 200).tolist()
    stage: Stage = quantized.sections[0]
    assert run(stage, samples, 3) == stage.graph.run(samples)


def test_powers_of_two_are_not_multiplied() -> None:
    section = coarse(lowpass(0.1, 1.5), "state_space")
    assert all(abs(b.integer) == 1 for b in section.b)
    products = {node.name for node in section.graph.nodes if node.op.value == "scale"}
    assert products == {f"product_{name}" for name in ("a11", "a12", "a21", "a22", "c1", "c2", "d")}


def test_rounding_of_the_design_makes_no_coefficients() -> None:
    """At a quarter of the sample rate the diagonal of A is zero, and it is 1e-16 in double precision."""
    section = coarse(lowpass(0.25, 1.6), "state_space")
    assert (section.a[0][0], section.a[1][1]) == (Coefficient(0, 0), Coefficient(0, 0))
    assert max(node.frac for node in section.graph.nodes) <= 26


ONE = Coefficient(1, 1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"a": ()}, "states must be one or two, not 0"),
        ({"b": (ONE, ONE)}, "everything about 1 states must come 1 times, not [1, 1, 2, 1, 1]"),
        ({"integer_part": (-2,)}, "poles must lie inside the unit circle, not at a1 = 1.5, a2 = 0.0"),
    ],
)
def test_sections_that_cannot_be(changes: dict[str, object], message: str) -> None:
    section = StateSpace(
        name="s",
        a=((ONE,),),
        integer_part=(0,),
        b=(ONE,),
        c=(ONE,),
        d=ONE,
        truncating=False,
        u=Range(0, -8, 7),
        x=(Range(0, -8, 7),),
        y=Range(0, -8, 7),
    )
    assert section.graph.run([[7], [0], [0]]) == [[4], [2], [1]]
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        replace(section, **changes)  # type of a field


@pytest.mark.parametrize(("realization", "a2"), [("state_space", 1.025634765625), ("normal", 1.041259765625)])
def test_refusals(realization: str, a2: float) -> None:
    words = SectionFormat(coefficient_bits=4)
    with pytest.raises(ShortfallError, match=r"^numerator of section7 must not be zero$"):
        REALIZATIONS[realization].build((0.0, 0.0, 0.0, 1.0, -0.5, 0.0), words, "section7")
    message = (
        "section7 must be stable with coefficients of 4 bits: "
        f"poles must lie inside the unit circle, not at a1 = -0.40625, a2 = {a2}"
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(message)}$"):
        REALIZATIONS[realization].build((1.0, 0.5, 0.25, 1.0, -0.4, 0.999), words, "section7")
