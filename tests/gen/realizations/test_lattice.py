"""Lattice wave digital filters: taken apart, exactly allpass, at rest without input, and proven like the others."""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy import signal
from tests.gen.designs import EXAMPLES, with_rows
from tests.gen.proof.cycle_search import search_cycles
from tests.gen.proven_stages import run
from tests.gen.word_lengths.filters import OUT, SIGNED, butterworth, errors, plain, stimulus
from tests.gen.word_lengths.sweep_designs import REFUSED
from tests.verify.certificate_edits import all_edits, proven, wrongly_accepted

from sosmith.gen.core import design_core
from sosmith.gen.filter.design import Filter
from sosmith.gen.output.certificate import certificate
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.manifest import manifest
from sosmith.gen.proof.limit_cycles import limit_cycles, recursions
from sosmith.gen.proof.linear_model import LinearModel, linear_models
from sosmith.gen.realizations.lattice import LatticePair, LatticeSigns, Row, lattice_parts
from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.gen.specification.specification import load
from sosmith.gen.stimuli.error_paths import error_paths
from sosmith.model.dataflow.graph import Graph, Op, Range
from sosmith.model.dataflow.structure import Stage
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.lattice import Adaptor, Allpass, LatticeStage
from sosmith.model.sections.state_space import Coefficient
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.verification import RejectedError, verify

KINDS = ("lowpass", "highpass", "bandpass", "bandstop")
ODD = [(kind, order, cutoff) for kind in KINDS for order in (1, 3, 5) for cutoff in (0.002, 0.05, 0.25, 0.35)]


def stages_of(ideal: Filter, bits: int = 5) -> list[Stage]:
    """Stages with coefficients of few bits and every quantizer at whole numbers."""
    realization = REALIZATIONS["lattice_wdf"]
    stages: list[Stage] = []
    beside: tuple[Range, ...] = ()
    for k, part in enumerate(realization.parts(ideal.rows)):
        form = SectionFormat(coefficient_bits=bits, beside=beside)
        stages.append(realization.build(part, form, f"section{k}"))
        beside = (form.x,)
    return stages


def branches(ideal: Filter) -> tuple[list[list[tuple[Fraction, ...]]], tuple[int, int]]:
    """Denominators in the upper and in the lower branch, and the signs."""
    *pairs, last = lattice_parts(ideal.rows)
    assert isinstance(last, LatticeSigns)
    lanes = [[pair.lanes[k] for pair in pairs if isinstance(pair, LatticePair)] for k in (0, 1)]
    return [[denominator for denominator in lane if denominator is not None] for lane in lanes], last.signs


def numbers(polynomial: Sequence[Fraction]) -> list[float]:
    return [float(value) for value in polynomial]


def response(ideal: Filter, w: np.ndarray) -> np.ndarray:
    return np.asarray(np.prod([np.polyval(r[2::-1], w) / np.polyval(r[:2:-1], w) for r in ideal.rows], axis=0))


# Taking a filter apart.


@pytest.mark.parametrize(("kind", "order", "cutoff"), ODD)
def test_branches_give_the_filter_back(kind: str, order: int, cutoff: float) -> None:
    """At frequencies other than those that the branches were found at, to what double precision leaves."""
    ideal = butterworth(order, cutoff, kind)
    lanes, signs = branches(ideal)
    w = np.exp(-1j * np.geomspace(1e-4, math.pi, 2000))
    total = np.zeros(len(w), dtype=np.complex128)
    for lane, sign in zip(lanes, signs, strict=True):
        total += sign * np.prod(
            [np.ones(len(w)), *(np.polyval(numbers(a), w) / np.polyval(numbers(a)[::-1], w) for a in lane)], axis=0
        )
    assert np.abs(total / 2 - response(ideal, w)).max() < 1e-9


@pytest.mark.parametrize("order", [3, 5, 7, 9, 19])
@pytest.mark.parametrize("kind", ["lowpass", "highpass"])
def test_poles_alternate_by_angle(order: int, kind: str) -> None:
    """Gazsi 1985: the real pole in one branch, its neighbours in the other, and so on."""
    lanes, _ = branches(butterworth(order, 0.1, kind))
    angles = sorted(
        (0.0 if len(a) == 2 else math.acos(-float(a[1]) / 2 / math.sqrt(a[2])), k)
        for k, lane in enumerate(lanes)
        for a in lane
    )
    assert [k for _, k in angles] in ([k % 2 for k in range(len(angles))], [1 - k % 2 for k in range(len(angles))])


def given(*rows: Row) -> Filter:
    return with_rows(butterworth(1, 0.1), rows)


NOTCH = (0.9, -1.2, 0.9, 1.0, -1.2, 0.8)
FITTING = {
    "notch": given(NOTCH),
    "average of neighbours": given((0.5, 0.5, 0.0, 1.0, 0.0, 0.0)),
    "average over two": given((0.5, 0.0, 0.5, 1.0, 0.0, 0.0)),
    "difference of neighbours": given((0.5, -0.5, 0.0, 1.0, 0.0, 0.0)),
    "elliptic": given(*signal.ellip(5, 0.2, 60, 0.05, output="sos", fs=1.0)),
}
UNFIT = {
    "even order": butterworth(4, 0.05),
    "even prototype": butterworth(2, 0.05, "bandpass"),
    "bessel": given(*signal.bessel(3, 0.05, output="sos", fs=1.0)),
    "another gain": given([0.9 * b for b in NOTCH[:3]] + list(NOTCH[3:])),
    "other zeros": given((0.9, -1.1, 0.9, 1.0, -1.2, 0.8)),
    "only poles": given((0.1, 0.0, 0.0, 1.0, -0.9, 0.0)),
    "too many poles": given(*[(0.05, 0.05, 0.0, 1.0, -0.9 + k / 40, 0.0) for k in range(17)]),
}


@pytest.mark.sweep(2)
@pytest.mark.parametrize("name", FITTING)
def test_given_sections_that_fit(name: str) -> None:
    quantized = plain(FITTING[name], "lattice_wdf")
    codes = stimulus(quantized.datapath.inputs, 5)
    assert np.abs(errors(quantized, codes)).max() <= quantized.bound <= 1
    some = codes[6000:9000]
    assert quantized.datapath.compute_exact(some) == quantized.datapath.compute(some).tolist()


@pytest.mark.parametrize("name", UNFIT)
def test_what_does_not_fit_is_refused(name: str) -> None:
    with pytest.raises(ShortfallError, match=f"^{re.escape(REFUSED)}$"):
        plain(UNFIT[name], "lattice_wdf")


@pytest.mark.slow
def test_auto_goes_on_without_it(tmp_path: Path) -> None:
    text = (EXAMPLES / "audio_lowpass.toml").read_text(encoding="utf-8").replace("order = 5", "order = 4")
    path = tmp_path / "even.toml"
    path.write_text(text, encoding="utf-8")
    assert design_core(load(path)).quantized.realization != "lattice_wdf"
    advice = 'hardware.realization = "df1_ef2" meets the specification as it is'
    with pytest.raises(ShortfallError, match=f"^{re.escape(f'{REFUSED}; {advice}')}$"):
        design_core(load(path), realization="lattice_wdf")


# Structure.


def at(model: LinearModel, w: int) -> Fraction:
    """Gain of a model at w = 1 or -1, exactly."""
    above, below = (sum(c * w**k for k, c in enumerate(p)) for p in (model.transfer, model.denominator))
    return Fraction(above) / Fraction(below)


@pytest.mark.sweep(20)
@pytest.mark.parametrize("bits", [2, 5, 16])
@pytest.mark.parametrize(("kind", "order", "cutoff"), ODD)
def test_sections_are_exactly_allpass(kind: str, order: int, cutoff: float, bits: int) -> None:
    """Numerator and denominator hold the same numbers, whatever the rounding made of them."""
    seen = 0
    for stage in stages_of(butterworth(order, cutoff, kind), bits)[:-1]:
        assert isinstance(stage, LatticeStage)
        for model, section in zip(linear_models(stage.graph), stage.lanes, strict=True):
            expected = (Fraction(1),) if section is None else section.denominator
            made = [*model.denominator, *[Fraction(0)] * (len(expected) - len(model.denominator))]
            assert made == list(expected)
            assert [*model.transfer, *[Fraction(0)] * (len(made) - len(model.transfer))] == made[::-1]
            seen += section is not None
    assert seen == (order + 1) // 2 if kind in {"lowpass", "highpass"} else seen >= order


ONES = {"lowpass": (1,), "highpass": (-1,), "bandstop": (1, -1), "bandpass": ()}
NULLS = {"lowpass": (-1,), "highpass": (1,), "bandstop": (), "bandpass": (1, -1)}


@pytest.mark.sweep(20)
@pytest.mark.parametrize("bits", [2, 5, 16])
@pytest.mark.parametrize(("kind", "order", "cutoff"), ODD)
def test_gain_is_exactly_one_or_zero(kind: str, order: int, cutoff: float, bits: int) -> None:
    """At zero frequency and at half the sample rate, whatever the rounding of the coefficients."""
    *stages, last = (linear_models(stage.graph) for stage in stages_of(butterworth(order, cutoff, kind), bits))
    ((*signs,),) = (model.transfers for model in last)
    for ends, size in ((ONES, 1), (NULLS, 0)):
        for w in ends[kind]:
            gains = [math.prod(at(stage[k], w) for stage in stages) for k in (0, 1)]
            assert abs(sum(sign[0] * gain for sign, gain in zip(signs, gains, strict=True))) == size


@pytest.mark.parametrize(
    ("integer", "states", "message"),
    [
        (8, 1, r"coefficients of adaptors must lie between -1 and 1, not at 1\.0"),
        (-9, 1, r"coefficients of adaptors must lie between -1 and 1, not at -1\.125"),
        (1, 2, "adaptors must be one or two, with as many states, not 1 and 2"),
    ],
)
def test_sections_that_cannot_be(integer: int, states: int, message: str) -> None:
    words = Range(0, -100, 100)
    with pytest.raises(ValueError, match=f"^{message}$"):
        Allpass(adaptors=(Adaptor(0, Coefficient(integer, 3)),), states=(words,) * states, inner=words, output=words)


def test_a_section_unstable_by_quantization() -> None:
    """Rounded up to 2 bits, 1 - g = 1/2 - 2**-30 leaves g = 1/2; a rest beyond takes a pole to the unit circle."""
    part = LatticePair(((Fraction(1), Fraction(-1, 2) - Fraction(1, 1 << 30)), None))
    realization = REALIZATIONS["lattice_wdf"]
    (model, _) = linear_models(realization.build(part, SectionFormat(coefficient_bits=2), "s").graph)
    assert model.denominator == (1, Fraction(-1, 2))
    message = (
        "section4 must be stable with its coefficients rounded: coefficients of adaptors must lie between -1 and 1, "
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(message)}not at 1\\.0$"):
        realization.build(
            LatticePair(((Fraction(1), Fraction(-1)), None)), SectionFormat(coefficient_bits=4), "section4"
        )


# The same transfer function as sections.


LARGEST = {("bandpass", 5, 0.002), ("bandstop", 5, 0.002), ("bandstop", 3, 0.002)}
"""Up to a minute each: rationals of the most digits."""


@pytest.mark.sweep(8)
@pytest.mark.parametrize(
    ("kind", "order", "cutoff"),
    [
        pytest.param(*wanted, marks=[pytest.mark.slow] if wanted in LARGEST else [])
        for wanted in [*ODD, ("lowpass", 9, 0.01), ("bandpass", 7, 0.1)]
    ],
)
def test_effective_sections_are_exact_in_the_stop_band(kind: str, order: int, cutoff: float) -> None:
    """Against the branches in rationals, at frequencies whose sine and cosine are rational."""
    quantized = plain(butterworth(order, cutoff, kind), "lattice_wdf")
    *stages, (last,) = (linear_models(section.graph) for section in quantized.sections)
    for t in (Fraction(1, 9999), Fraction(1, 97), Fraction(2, 3), Fraction(7, 4), Fraction(101, 2), Fraction(9001)):
        re_w, im_w = (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)
        total = (Fraction(0), Fraction(0))
        for k, sign in enumerate(last.transfers):
            value = (sign[0], Fraction(0))
            for stage in stages:
                value = times(value, evaluated(stage[k].transfer, (re_w, im_w)))
                a, b = evaluated(stage[k].denominator, (re_w, im_w))
                size = a * a + b * b
                value = times(value, (a / size, -b / size))
            total = total[0] + value[0], total[1] + value[1]
        exact = complex(*map(float, total))
        w = complex(float(re_w), float(im_w))
        made = np.prod([np.polyval(r[2::-1], w) / np.polyval(r[:2:-1], w) for r in quantized.quantized_sos])
        # What w is rounded by moves a response far down a slope by more than its own rounding.
        assert abs(made - exact) <= 1e-7 * abs(exact) + 1e-15


Complex = tuple[Fraction, Fraction]


def times(a: Complex, b: Complex) -> Complex:
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def evaluated(polynomial: tuple[Fraction, ...], w: Complex) -> Complex:
    value: Complex = (Fraction(0), Fraction(0))
    for c in reversed(polynomial):
        real, imaginary = times(value, w)
        value = real + c, imaginary
    return value


# Rounding noise.


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "order", "cutoff"),
    [("lowpass", 3, 0.02), ("lowpass", 5, 0.1), ("highpass", 3, 0.05), ("bandpass", 1, 0.05), ("lowpass", 7, 0.2)],
)
def test_measured_noise_is_the_predicted_one(kind: str, order: int, cutoff: float) -> None:
    """Output minus that of exact arithmetic, within 0.2 dB of the sum of all transfer functions' powers.

    The error of a truncation is half a step in the direction of the value, and noise of a twelfth of a squared step
    about it. The first part follows from the signal; what is left is compared.
    """
    quantized = plain(butterworth(order, cutoff, kind), "lattice_wdf")
    codes = np.random.default_rng(3).integers(SIGNED.lowest, SIGNED.highest + 1, 1 << 19)
    frac = quantized.sections[-1].graph.nodes[quantized.sections[-1].graph.outputs[0]].frac
    entry = quantized.sections[0].graph.nodes[0].frac
    x = codes * 2.0**-entry
    error = run(quantized.sections, SIGNED, codes) * 2.0**-frac - signal.sosfilt(quantized.quantized_sos, x)
    # Signals between the stages, without quantizers.
    wires = [[x]]
    for section in quantized.sections[:-1]:
        arrived = wires[-1] * (3 - len(wires[-1]))
        wires.append(
            [
                signal.lfilter(numbers(m.transfer), numbers(m.denominator), arrived[k])
                for k, m in enumerate(linear_models(section.graph))
            ]
        )
    predicted = 0.0
    for number, model, source, path in error_paths(quantized):
        if source.kept is None:
            continue
        step = float(source.high)
        predicted += step**2 / 12 * float(np.sum(path**2))
        if source.low < 0:
            graph = quantized.sections[number].graph
            kept = source.name.replace("_sum", "_next" if "_x" in source.name else "")
            bound = next(i for i in model.bounds if graph.nodes[i].name == kept)
            numerator = numbers(model.sources[0].numerators[bound])
            value = signal.lfilter(numerator, numbers(model.denominator), wires[number][model.entries[0]])
            error -= step / 2 * signal.fftconvolve(np.sign(value), path)[: len(value)]
    settled = error[len(error) // 8 :]
    assert abs(10 * math.log10(np.var(settled) / predicted)) < 0.2
    assert abs(np.mean(settled)) < 0.1 * np.std(settled)


# Limit cycles.


def loops(kind: str, order: int, cutoff: float, bits: int = 6) -> list[Graph]:
    return [g for stage in stages_of(butterworth(order, cutoff, kind), bits) for g in recursions(stage).values()]


SEARCHED = [("lowpass", 3, 0.05), ("lowpass", 5, 0.2), ("highpass", 3, 0.1), ("highpass", 5, 0.4), ("bandpass", 3, 0.1)]


@pytest.mark.sweep(3)
@pytest.mark.parametrize("bits", [3, 6])
@pytest.mark.parametrize(("kind", "order", "cutoff"), SEARCHED)
def test_every_section_comes_to_rest(kind: str, order: int, cutoff: float, bits: int) -> None:
    """Proven by a Lyapunov function in rationals, and searched from every state of five-bit words."""
    graphs = loops(kind, order, cutoff, bits)
    assert graphs
    for graph in graphs:
        told = limit_cycles(graph)
        assert told.none
        assert search_cycles(graph, 15).amplitude == 0


def with_floors(graph: Graph) -> Graph:
    """Break a section: bits are dropped downward, not towards zero."""
    return replace(graph, nodes=tuple(n._replace(op=Op.FLOOR) if n.op is Op.TRUNCATE else n for n in graph.nodes))


def test_it_is_truncation_that_brings_them_to_rest() -> None:
    broken = [with_floors(graph) for graph in loops("lowpass", 3, 0.05)]
    assert not any(limit_cycles(graph).none for graph in broken)
    assert max(search_cycles(graph, 15).amplitude for graph in broken) > 0


def test_energy_is_that_of_the_port_conductances() -> None:
    """The weights of the states are as 1 - g2 to |g1| (1 + g2): what the adaptors conserve, and g1 takes a part of."""
    stage = stages_of(butterworth(3, 0.05), 12)[0]
    assert isinstance(stage, LatticeStage)
    for section, graph in zip(stage.lanes, recursions(stage).values(), strict=True):
        assert section is not None
        if len(section.adaptors) == 2:
            g1, g2 = (adaptor.value for adaptor in section.adaptors)
            assert limit_cycles(graph).lyapunov == (1, abs(g1) * (1 + g2) / (1 - g2))


# Certificates, manifest.


@pytest.mark.sweep(3)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("order", "cutoff"),
    [(1, 0.25), (3, 0.2), *(pytest.param(*each, marks=pytest.mark.slow) for each in ((3, 0.01), (5, 0.1)))],
)
def test_certificates_are_proven(kind: str, order: int, cutoff: float) -> None:
    proven(plain(butterworth(order, cutoff, kind), "lattice_wdf"))


def test_one_unit_off_in_a_certificate_is_rejected() -> None:
    tree = json.loads(certificate_text(certificate(plain(butterworth(3, 0.1), "lattice_wdf"), OUT.lsb)))
    chosen = all_edits(tree)
    picks = np.random.default_rng(4).permutation(len(chosen))[:60]
    assert wrongly_accepted(tree, [chosen[k] for k in picks]) == []


def test_a_range_too_narrow_is_rejected() -> None:
    """Everything that follows from the narrower range is consistent; only the peak gain says otherwise."""
    quantized = plain(butterworth(3, 0.1), "lattice_wdf")
    first, join = quantized.sections
    assert isinstance(first, LatticeStage)
    upper, lower = first.lanes
    assert upper is not None
    frac, low, high = upper.output
    narrow = replace(first, lanes=(replace(upper, output=Range(frac, low, high - high // 2**12)), lower))
    wave = narrow.graph.nodes[narrow.graph.outputs[0]]
    last = replace(join, entries=(Range(frac, wave.low, wave.high), join.entries[1]))
    ends = last.graph.nodes[last.graph.outputs[0]]
    output = replace(quantized.datapath.stages[-1], x=ends.range)
    lie = replace(quantized, datapath=replace(quantized.datapath, stages=(narrow, last, output)))
    tree = json.loads(certificate_text(certificate(lie, OUT.lsb)))
    pattern = r"^node \d+ \(bound upper_y\) of section0 must hold .*, not .*$"
    with pytest.raises(RejectedError, match=pattern):
        verify(Certificate.model_validate(tree))


@pytest.mark.slow
def test_the_manifest_tells_every_recursion() -> None:
    design = design_core(load(EXAMPLES / "flange_wear_bench.toml"), realization="lattice_wdf")
    told = manifest(core_facts(design))
    assert [entry["name"] for entry in told["sections"]] == ["section0 upper_y", "section0 lower_y", "section1 lower_y"]
    assert [entry["section"] for entry in told["limit_cycles"]] == [entry["name"] for entry in told["sections"]]
    assert all(entry["none"] for entry in told["limit_cycles"])
    for entry in told["sections"]:
        order = len(entry["states"])
        assert entry["b"][: order + 1] == entry["a"][order::-1]
        assert len(entry["coefficients"]) == order
