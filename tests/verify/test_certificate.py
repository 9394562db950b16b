"""Certificates: proven again by another method, and rejected when any number in them that matters is not right."""

import json
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flint import fmpq, fmpq_poly, fmpz_poly
from tests.gen.designs import ALL, example_design, with_rows, zero_design
from tests.gen.word_lengths.filters import OUT, SIGNED, butterworth, plain
from tests.verify.certificate_edits import PLACE, all_edits, edited, is_rejected, proven, rejected, wrongly_accepted

import sosmith
from sosmith.cli import main
from sosmith.gen.filter.design import design
from sosmith.gen.output.certificate import about, certificate
from sosmith.gen.realizations.registry import CASCADES, SECTIONS
from sosmith.gen.specification.schema import MAX_CHANNELS
from sosmith.gen.specification.specification import FilterSpec
from sosmith.gen.word_lengths.quantize import quantize
from sosmith.model.dataflow.graph import Op
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.verify import certificate_file, verification
from sosmith.verify.bounds.l1_response import Inverse, UndecidedError, inverse, is_stable, response
from sosmith.verify.certificate_file import Certificate, Operation, certificate_text, on_grid, read_certificate
from sosmith.verify.verification import verify

BENCH, LOCOMOTIVE = "flange_wear_bench.toml", "flange_wear_locomotive.toml"


@lru_cache
def text_of(name: str, realization: str | None = "df1_ef2", core: str | None = None) -> str:
    design = example_design(name, realization=realization, core=core)
    return certificate_text(certificate(design.quantized, design.spec.max_error))


def tree_of(name: str = BENCH, realization: str = "df1_ef2") -> Any:
    """Return the certificate of a filter that starts from zero: its stages are polynomial, sections and output."""
    design = zero_design(name, realization=realization)
    return json.loads(certificate_text(certificate(design.quantized, design.spec.max_error)))


# What is right is proven.


def test_the_file_has_a_name_for_every_operation() -> None:
    assert {operation.value for operation in Operation} == {op.value for op in Op}


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", SECTIONS)
@pytest.mark.parametrize(
    "name", [name if name != LOCOMOTIVE else pytest.param(name, marks=pytest.mark.slow) for name in ALL]
)
def test_examples_in_every_realization(name: str, realization: str) -> None:
    design = example_design(name, realization=realization)
    proven(design.quantized, design.spec.max_error)


@pytest.mark.slow
def test_the_locomotive() -> None:
    steps = []
    read = Certificate.model_validate(tree_of(LOCOMOTIVE))
    verdict = verify(read, lambda step, done, total: steps.append((step, done, total)))
    assert verdict.bound == read.claims.bound <= read.max_error / read.output.lsb
    assert verdict.ranges >= 4
    assert verdict.nodes == sum(len(stage.nodes) for stage in read.stages)
    assert steps == [
        ("graphs", 0, 0),
        ("calibration", 0, 0),
        *(("sections", k, 4) for k in range(5)),
        ("settling", 0, 0),
    ]


@pytest.mark.parametrize("core", ["filter", "calibration"])
def test_parts_of_the_instrument(core: str) -> None:
    proven(example_design(BENCH, core=core).quantized)


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("inputs", "output"),
    [
        (Port.from_range("x", 12, Fraction(-5), Fraction(5), signed=True), OUT),
        (Port.from_range("x", 14, Fraction(0), Fraction(33, 10)), Port.from_range("y", 18, Fraction(-1), Fraction(4))),
        (Port.from_range("x", 10, Fraction(4), Fraction(20)), Port.from_range("y", 16, Fraction(4), Fraction(20))),
        (SIGNED, Port.from_range("y", 8, Fraction(-1, 2), Fraction(1, 2), signed=True)),
    ],
)
def test_any_input_and_output_range(inputs: Port, output: Port) -> None:
    proven(plain(butterworth(3, 0.05), inputs=inputs, output=output))


@pytest.mark.sweep(3)
@pytest.mark.parametrize("kind", ["lowpass", "highpass", "bandpass", "bandstop"])
@pytest.mark.parametrize(("order", "cutoff"), [(1, 0.25), (3, 0.2), pytest.param(4, 0.01, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "realization", [name if name == "df1_ef2" else pytest.param(name, marks=pytest.mark.slow) for name in CASCADES]
)
def test_designs(kind: str, order: int, cutoff: float, realization: str) -> None:
    proven(plain(butterworth(order, cutoff, kind), realization))


@pytest.mark.slow
def test_an_input_to_be_scaled_before_sections_in_another_order() -> None:
    """An error before the filter counts by the filter's gain, whose last digits depend on the order of the sections."""
    given = FilterSpec(
        family="elliptic",
        kind="lowpass",
        method="bilinear",
        order=5,
        cutoff=(Fraction(1, 20),),
        passband_edge=None,
        stopband_edge=None,
        passband_loss=Fraction(1),
        stopband_loss=Fraction(60),
        sos=None,
    )
    ideal = design(given, Fraction(1))
    quantized = plain(ideal, inputs=Port.from_range("x", 14, Fraction(0), Fraction(33, 10)))
    assert quantized.filter is not None
    assert quantized.filter.rows != ideal.rows
    proven(quantized)


@pytest.mark.parametrize(("cutoff", "smaller"), [(0.1, "coefficients"), (0.3, "gain")])
def test_the_margin_is_what_rounding_up_adds(cutoff: float, smaller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another ideal filter may add that much to the gain, and, times the largest input, to the error."""
    exact: dict[Fraction, Fraction] = {}

    def noted(value: Fraction) -> Fraction:
        exact[on_grid(value)] = value
        return on_grid(value)

    ports = (Port.from_range(name, 4, Fraction(-end), Fraction(end), signed=True) for name, end in (("x", 1), ("y", 2)))
    made = plain(butterworth(1, cutoff), inputs=next(ports), output=next(ports))
    read = Certificate.model_validate(json.loads(certificate_text(certificate(made, made.datapath.output.lsb))))
    monkeypatch.setattr(verification, "on_grid", noted)
    verdict = verify(read)
    claims = {"gain": read.claims.peak_gain, "coefficients": verdict.budget["filter coefficients"]}
    room = {name: value - exact[value] for name, value in claims.items() if value is not None}
    room["coefficients"] /= 4  # the largest input, in output LSBs
    assert min(room, key=lambda name: room[name]) == smaller
    assert verdict.margin == room[smaller]


def test_the_same_section_twice() -> None:
    """Poles that fall together are no special case."""
    ideal = butterworth(2, 0.1)
    proven(plain(with_rows(ideal, ideal.rows * 3)))


def test_a_pole_of_high_order_is_enclosed() -> None:
    """Each time that it occurs, its size takes further bits."""
    made = inverse(fmpq_poly([1, fmpq(-127, 128)]) ** 8)
    assert made.error <= Fraction(1, 2**136)
    exact = Fraction(128**8)
    assert abs(sum(map(int, made.samples.coeffs())) - exact * 2**made.bits) <= made.error * 2**made.bits


def test_a_polynomial_of_higher_order() -> None:
    design = example_design(BENCH, core="calibration")
    polynomial = Polynomial.from_numbers([["0.5", "-0.01", "0.0002"], ["0.3", "0.001"], ["0.02"], ["0.003", "0.00001"]])
    proven(
        quantize(
            name="p",
            inputs=design.datapath.inputs,
            output=design.datapath.output,
            max_error=design.datapath.output.lsb,
            ideal=None,
            polynomial=polynomial,
            realization="df1_ef2",
        )
    )


def test_verification_has_nothing_in_common_with_the_proof() -> None:
    """Neither the extraction nor the peak gains nor the search for word lengths are even loaded."""
    program = (
        "import sys, sosmith.verify.verification;"
        "print(*sorted(name.removeprefix('sosmith.') for name in sys.modules if name.startswith('sosmith.')))"
    )
    loaded = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True).stdout.split()
    shared = {name for name in loaded if not name.startswith("verify")}
    assert shared == {"gen", "gen.version", "model", "model.errors"}
    assert "verify.verification" in loaded


# Any number that matters.


@pytest.mark.slow
@pytest.mark.parametrize("realization", ["df1_ef2", "delta"])
def test_one_unit_off_in_any_number_is_rejected(realization: str) -> None:
    tree = tree_of(BENCH, realization)
    chosen = all_edits(tree)
    assert len(chosen) > 900
    picks = np.random.default_rng(11).permutation(len(chosen))[:200]
    assert not is_rejected(tree)
    assert wrongly_accepted(tree, [chosen[k] for k in picks]) == []


@pytest.mark.slow
def test_one_unit_off_in_a_graph_is_rejected_in_the_larger_examples() -> None:
    for name, count in (("audio_lowpass.toml", 60), (LOCOMOTIVE, 6)):
        tree = tree_of(name)
        chosen = all_edits(tree)
        picks = np.random.default_rng(12).permutation(len(chosen))[:count]
        assert wrongly_accepted(tree, [chosen[k] for k in picks]) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "realization"),
    [(BENCH, realization) for realization in SECTIONS] + [(name, "df1_ef2") for name in ALL if name != BENCH],
)
def test_one_unit_off_in_every_number(name: str, realization: str) -> None:
    tree = tree_of(name, realization)
    assert wrongly_accepted(tree, all_edits(tree)) == []


# Lies that hang together.


def change(tree: Any, name: str, stage: int, **fields: Any) -> Any:
    """Change a node, found by its name, in a stage."""
    for node in tree["stages"][stage]["nodes"]:
        if node.get("name") == name:
            node.update(fields)
    return tree


def without_calibration() -> Any:
    """Return the certificate of a filter whose one section is the first stage."""
    quantized = plain(butterworth(1, 0.1))
    return json.loads(certificate_text(certificate(quantized, OUT.lsb)))


@pytest.mark.parametrize("end", ["low", "high"])
def test_a_range_too_narrow_for_what_is_possible(end: str) -> None:
    """Everything that follows from the narrower range is consistent; only the peak gain says otherwise."""
    quantized = plain(butterworth(2, 0.05))
    (section,) = quantized.sections
    low, high = section.v_range
    if end == "low":
        low -= low // 2**12
    else:
        high -= high // 2**12
    narrow = replace(section, v_range=(low, high))
    stages = list(quantized.datapath.stages)
    stages[0] = narrow
    node = narrow.graph.nodes[narrow.graph.outputs[0]]
    stages[1] = replace(stages[1], x=node.range)
    lie = replace(quantized, datapath=replace(quantized.datapath, stages=tuple(stages)))
    number = next(index for index, node in enumerate(narrow.graph.nodes) if node.name == "v")
    message = rf"node {number} \(bound v\) of section0 must hold -[0-9.]+\.\.[0-9.]+, not {low}\.\.{high}"
    rejected(json.loads(certificate_text(certificate(lie, OUT.lsb))), message)


@pytest.mark.parametrize(
    ("lie", "message"),
    [
        pytest.param(
            lambda t: t.update(max_error="1/20000"),
            r"the error must be at most 5e-05 mm, not 0\.0002\d* mm",
            id="error not met",
        ),
        pytest.param(
            lambda t: t["claims"]["budget"].pop("filter rounding"),
            "the parts of the budget must be calibration, filter coefficients, filter rounding, output rounding, "
            "not calibration, filter coefficients, output rounding",
            id="part missing",
        ),
        pytest.param(
            lambda t: t["claims"]["budget"].update({"output rounding": "1/4"}),
            r"the part output rounding of the budget must be 1/2 = 0\.5, not 1/4 = 0\.25",
            id="part too small",
        ),
        pytest.param(
            lambda t: t["claims"]["budget"].update({"output rounding": "3/4"}),
            r"the part output rounding of the budget must be 1/2 = 0\.5, not 3/4 = 0\.75",
            id="part too large",
        ),
        pytest.param(
            lambda t: t["claims"].update(bound="1/2"),
            r"the bound must be \d+/\d+ = 0\.\d+, not 1/2 = 0\.5",
            id="bound",
        ),
        pytest.param(
            lambda t: t["claims"].update(peak_gain=None),
            r"the peak_gain of the filter must be \d+/\d+ = 1\.43\d+, not absent",
            id="gain absent",
        ),
        pytest.param(
            lambda t: t["claims"]["sections"].pop(),
            "gains must be given of section0, section1, section2, not section0, section1",
            id="gains missing",
        ),
        pytest.param(
            lambda t: t["claims"]["sections"].clear(),
            "gains must be given of section0, section1, section2, not nothing",
            id="no gains",
        ),
        pytest.param(
            lambda t: t["stages"].insert(3, t["stages"].pop(4)),
            r"input x of section1 must take the range -?\d+\.\.\d+ and the format of what feeds it, not -?\d+\.\.\d+",
            id="sections swapped",
        ),
        pytest.param(
            lambda t: t["stages"].append(t["stages"].pop(2)),
            "the stages must be polynomial, start, section and one output, in this order, "
            "not polynomial, polynomial, section, section, section, output, polynomial",
            id="stages out of order",
        ),
        pytest.param(
            lambda t: t["stages"][3].update(role="polynomial"),
            r"node 1 \(delay x1\) of section0 must not be in a polynomial stage",
            id="section as polynomial",
        ),
        pytest.param(
            lambda t: t["stages"][2].update(role="section"),
            "the polynomial must have one result, not 3",
            id="polynomial as section",
        ),
        pytest.param(
            lambda t: t["ideal"].update(sections=[]),
            "the hardware's sections must stand for ideal ones, not 3 for 0",
            id="no ideal",
        ),
        pytest.param(
            lambda t: t["ideal"]["sections"][1].update(denominator=["1", "-2", "1"]),
            "ideal section 1 must have its poles inside the unit circle",
            id="ideal unstable",
        ),
        pytest.param(
            lambda t: t["ideal"]["sections"][1].update(denominator=["1", "-3/2", "2/3"]),
            "the certificate could not be decided: a coefficient is no binary fraction",
            id="not dyadic",
        ),
        pytest.param(
            lambda t: t["ideal"]["sections"][1].update(denominator=["1", f"-{2**30 - 1}/{2**30}"]),
            "the certificate could not be decided: a response does not die away within 16777216 samples",
            id="too slow",
        ),
        pytest.param(
            lambda t: t["ideal"].update(polynomial=None),
            "the parts of the budget must be input scaling, filter coefficients, filter rounding, output rounding, "
            "not calibration, filter coefficients, filter rounding, output rounding",
            id="no polynomial",
        ),
        pytest.param(
            lambda t: change(t, "product_A1", 4, parameter=2**22, low=0, high=0),
            r"node \d+ \(scale product_A1\) of section1 must have the range -\d+\.\.\d+, not 0\.\.0",
            id="range of a product",
        ),
        pytest.param(
            lambda t: change(t, "y", 3, operands=[14]),
            r"node 14 \(floor y\) of section0 must have operands before it, not \(14,\)",
            id="operand after",
        ),
        pytest.param(
            lambda t: change(t, "y", 3, operands=[9, 10]),
            r"node 14 \(floor y\) of section0 must have 1 operands, not 2",
            id="operands too many",
        ),
        pytest.param(
            lambda t: change(t, "y", 3, parameter=1),
            r"node 14 \(floor y\) of section0 must have no parameter that it does not use, not \(1, 0\)",
            id="parameter unused",
        ),
        pytest.param(
            lambda t: change(t, "v1", 3, operands=[2]),
            r"node 2 \(delay v1\) of section0 must not be its own source",
            id="endless delay",
        ),
        pytest.param(
            lambda t: t["output"].update(lsb="-1/4096"),
            r"lsb of clearance must be positive, not -1/4096",
            id="lsb",
        ),
        pytest.param(lambda t: t["output"].update(lsb="0"), r"lsb of clearance must be positive, not 0", id="no lsb"),
        pytest.param(
            lambda t: change(t, "code", -1, high=65534),
            r"the output must be limited to 0\.\.65535, not 0\.\.65534",
            id="output limited too early",
        ),
        pytest.param(
            lambda t: change(t, "code", -1, high=65536),
            r"the output must be whole codes in 0\.\.65535, not in 0\.\.65536 with 0 fraction bits",
            id="output beyond its port",
        ),
    ],
)
def test_a_lie_is_rejected_with_its_reason(lie: Callable[[Any], Any], message: str) -> None:
    tree = tree_of()
    lie(tree)
    rejected(tree, message)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("key", ["parameter", "parameter_frac"])
def test_a_parameter_without_a_use_is_rejected_at_every_node(key: str) -> None:
    """It would change nothing, and so stand for nothing: two texts would certify one design."""
    seen = set()
    for stage in tree_of()["stages"]:
        for index, node in enumerate(stage["nodes"]):
            if key not in node and (key, node["op"]) != ("parameter_frac", "scale"):
                seen.add(node["op"])
                tree = tree_of()
                changed = next(one for one in tree["stages"] if one["name"] == stage["name"])["nodes"]
                changed[index][key] = 1
                what = re.escape(f"node {index} ({' '.join(filter(None, (node['op'], node.get('name'))))})")
                unused = r"\(1,( 0)?\)" if key == "parameter" else r"\((0, )?1,?\)"
                rejected(tree, rf"{what} of .* must have no parameter that it does not use, not {unused}")
    assert seen >= {"input", "add", "subtract", "floor", "clamp", "bound", "delay"}


def test_an_error_equal_to_what_is_allowed_is_within_it() -> None:
    tree = tree_of()
    error = Fraction(tree["claims"]["bound"]) * Fraction(tree["output"]["lsb"])
    assert not is_rejected(tree | {"max_error": str(error)})
    assert is_rejected(tree | {"max_error": str(error - Fraction(1, 2**90))})


def test_a_recursion_beyond_the_unit_circle() -> None:
    """A section of one state whose ranges are as wide as it takes for the arithmetic to be consistent."""
    nodes = [
        {"op": "input", "frac": 0, "low": 0, "high": 3, "name": "x"},
        {"op": "delay", "operands": [4], "frac": 0, "low": 0, "high": 9, "name": "s"},
        {"op": "shift", "operands": [1], "frac": 0, "low": 0, "high": 9},
        {"op": "add", "operands": [0, 2], "frac": 0, "low": 0, "high": 12},
        {"op": "bound", "operands": [3], "frac": 0, "low": 0, "high": 9, "name": "v"},
    ]
    tree = without_calibration()
    tree["inputs"][0].update(bits=2, signed=False)
    tree["stages"][0].update(nodes=nodes, outputs=[4])
    tree["stages"][1].update(nodes=[{"op": "input", "frac": 0, "low": 0, "high": 9, "name": "x"}], outputs=[0])
    rejected(tree, "section0 must have its poles inside the unit circle")


# The arithmetic underneath.


def test_stability_is_decided_exactly() -> None:
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(300):
        coefficients = [1, *(int(c) for c in rng.integers(-40, 41, rng.integers(1, 7)))]
        largest = np.abs(np.roots([16 * coefficients[0], *coefficients[1:]])).max(initial=0)
        if abs(largest - 1) > 1e-3:
            stable = is_stable(fmpq_poly([fmpq(16), *coefficients[1:]]))
            assert stable == (largest < 1)
            seen.add(stable)
    assert seen == {True, False}
    assert is_stable(fmpq_poly([1, -1 + fmpq(1, 2**400)]))
    assert not is_stable(fmpq_poly([1, -1]))
    assert not is_stable(fmpq_poly([1, 0, 1]))
    assert not is_stable(fmpq_poly([1, -1 - fmpq(1, 2**400)]))


@pytest.mark.parametrize("denominator", [[1], [1, "-1/2"], [1, "-7/4", "13/16"], [1, "-5/4", "3/8", "1/8", "-1/16"]])
def test_an_inverse_is_within_its_error(denominator: list[Any]) -> None:
    exact = [Fraction(value) for value in denominator]
    over = inverse(fmpq_poly([fmpq(*value.as_integer_ratio()) for value in exact]))
    assert 0 <= over.error < Fraction(1, 2**136)
    numerator = fmpq_poly([1, fmpq(3, 8), 5])
    made = response(numerator, over)
    memory: list[Fraction] = []
    inputs = [Fraction(1), Fraction(3, 8), Fraction(5)]
    total = Fraction(0)
    for k in range(700):
        value = (inputs[k] if k < 3 else 0) - sum(a * memory[k - i] for i, a in enumerate(exact) if 0 < i <= k)
        memory.append(value)
        sample = made.samples[k] if k < len(made.samples) else 0
        total += abs(value - Fraction(sample, 2**176))
    assert total <= made.error < Fraction(1, 2**120)
    assert total > 0 or len(denominator) == 1


def test_the_error_of_an_inverse_goes_through_the_numerator() -> None:
    """It grows by the sum of the absolute coefficients; what a real inverse is off by is too small to be seen."""
    coarse = Inverse(fmpz_poly([1 << 200]), 200, Fraction(1, 2**20))
    found = response(fmpq_poly([3, -2]), coarse)
    assert 5 * coarse.error <= found.error < 6 * coarse.error
    assert found.gain >= 5 + 5 * coarse.error


@pytest.mark.slow
def test_a_pole_on_the_circle_has_no_inverse() -> None:
    with pytest.raises(UndecidedError, match=r"^a response does not die away within 2097152 samples$"):
        inverse(fmpq_poly([1, 0, 1]))


def test_the_grid_is_above() -> None:
    unit = Fraction(1, 2**64)
    assert on_grid(Fraction(0)) == unit
    assert on_grid(Fraction(1)) == 1 + unit
    assert on_grid(1 - unit / 3) == 1
    assert on_grid(Fraction(-1, 3)) - unit <= Fraction(-1, 3) < on_grid(Fraction(-1, 3))


@pytest.mark.parametrize("operands", [[14], [1007], []])
def test_a_node_that_refers_to_a_later_one_without_operands(operands: list[int]) -> None:
    """The range of a delay is looked up at its source: all references are checked before."""
    tree = json.loads(text_of(BENCH))
    stage, index = next(
        (stage, index)
        for stage in tree["stages"]
        for index, node in enumerate(stage["nodes"])
        if node["op"] == "delay" and stage["nodes"][node["operands"][0]]["op"] == "bound"
    )
    stage["nodes"][stage["nodes"][index]["operands"][0]]["operands"] = operands
    rejected(tree, r"node \d+ \(bound .*\) of .* must have (1 operands, not 0|operands before it, not .*)")


# The file and the command.


def test_as_many_channels_as_a_specification_takes() -> None:
    keys: dict[str, Any] = {"channels": MAX_CHANNELS, "input_bits": 8, "clock": 1e9}
    spec = sosmith.Specification.from_taps(
        [0.5, 0.25], 100.0, realization="fir_direct", architecture="parallel", **keys
    )
    item = about(sosmith.design(spec).core, {}).item
    assert item is not None
    assert item.channels == MAX_CHANNELS


def test_text_and_back(tmp_path: Path) -> None:
    text = text_of(BENCH)
    (tmp_path / "c.json").write_text(text, encoding="utf-8")
    assert certificate_text(read_certificate(tmp_path / "c.json")) == text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file must be a certificate in JSON, not text that is no JSON from line 1, column 1 on"),
        ("[" * 100000, "the file must be a certificate in JSON, not one nested so deep"),
        ("9" * 5000, "the file must be a certificate in JSON, not: an integer of 5000 digits"),
        ("1.5", "the file must be a certificate in JSON, not: 1.5, which is neither an integer nor a text"),
        ("NaN", "the file must be a certificate in JSON, not: NaN, which is neither an integer nor a text"),
        ('{"a": 1, "a": 2}', "the file must be a certificate in JSON, not: an object with the same key twice"),
        ("{}", "the file must be a certificate, not one where format is wrong: the key is missing"),
        ("[]", "the file must be a certificate, not one where the whole is wrong: it must be an object"),
    ],
)
def test_what_is_no_certificate(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SpecificationError, match=f"^{re.escape(f'{path}: {message}')}"):
        read_certificate(path)


@pytest.mark.parametrize(
    ("place", "new", "message"),
    [
        (("format",), "sosmith certificate 1", "it must be 'sosmith certificate 2'"),
        (("max_error",), 1, 'it must be a rational number as a text "p/q"'),
        (("max_error",), "1/0", 'it must be a rational number as a text "p/q"'),
        *(
            (("max_error",), text, 'it must be a rational number in lowest terms as a text "p/q", or "p"')
            for text in ("2/4", "1/1", "01", "-0", "0/1", "1/04096")
        ),
        *(
            (("max_error",), text, 'it must be a rational number as a text "p/q"')
            for text in ("+1", " 1", "1\n", "1e0", "1.0", "0x1", "\uff11", "\u0661/2", "1/-2", "--1", "1//2", "1_0", "")
        ),
        (("inputs", 0, "bits"), 33, "it must be at most 32"),
        (("inputs", 0, "bits"), "16", "it must be an integer"),
        (("inputs", 0, "bits"), 1, "it must be at least 2"),
        (("inputs", 0, "signed"), 1, "it must be true or false"),
        (("inputs",), [], "it must have no fewer entries than 1"),
        (("stages",), {}, "it must be a list"),
        (("stages", 0, "name"), "x" * 1001, "it must have at most 1000 characters"),
        (("stages", 0, "name"), 1, "it must be a text"),
        (("name",), "\ud800", "it must be a text of Unicode characters, without half of a surrogate pair"),
        (("stages", 0, "outputs", 0), 10000, "it must be less than 10000"),
        (
            ("stages", 0, "nodes", 0, "op"),
            "divide",
            "it must be 'input', 'constant', 'add', 'subtract', 'shift', 'scale', 'multiply', 'floor', 'fraction', "
            "'truncate', 'clamp', 'bound' or 'delay'",
        ),
        (("stages", 0, "nodes", 0, "low"), 2**4096 + 1, "it must be at most 2**4096"),
        (("stages", 0, "nodes", 0, "low"), -(2**4096) - 1, "it must be at least -2**4096"),
        (("ideal", "sections", 0, "numerator"), ["1"] * 513, "it must have no more entries than 512"),
        (("claims", "budget"), 1, "it must be an object"),
        (("stages", 0, "nodes", 0, "frac"), 10**9, "it must be at most 4096"),
        (("stages", 0, "role"), "poem", "it must be 'polynomial', 'start', 'section' or 'output'"),
        (("claims", "extra"), 1, "there is no such key"),
    ],
)
def test_a_certificate_of_the_wrong_form(place: PLACE, new: Any, message: str, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_text(json.dumps(edited(tree_of(), place, new)), encoding="utf-8")
    where = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place)[1:]
    expected = f"{path}: the file must be a certificate, not one where {where} is wrong: {message}"
    with pytest.raises(SpecificationError, match=f"^{re.escape(expected)}$"):
        read_certificate(path)


def test_a_kind_of_mistake_without_a_sentence_of_ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(certificate_file._SENTENCES, "missing")
    path = tmp_path / "c.json"
    path.write_text("{}", encoding="utf-8")
    what = "where format is wrong: it is not what is expected (Field required)"
    expected = f"{path}: the file must be a certificate, not one {what}"
    with pytest.raises(SpecificationError, match=f"^{re.escape(expected)}$"):
        read_certificate(path)


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    for path, reason in ((tmp_path, "it is no regular file"), (tmp_path / "none", "No such file or directory")):
        message = f"{path}: the certificate must be a file that can be read, not: {reason}"
        with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
            read_certificate(path)
    (tmp_path / "bytes").write_bytes(b"\xff")
    with pytest.raises(SpecificationError, match=r"not: it is not UTF-8$"):
        read_certificate(tmp_path / "bytes")


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["sosmith", *arguments])
    with pytest.raises(SystemExit) as exit_of:
        main()
    return int(exit_of.value.code or 0)


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "c.json"
    path.write_text(text_of(BENCH), encoding="utf-8")
    assert run(monkeypatch, "verify", str(path)) == 0
    assert "proven: flange_wear_bench, 124 nodes within their ranges, 8 by peak gains" in capsys.readouterr().out
    assert run(monkeypatch, "verify", str(path), "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["proven"] is True
    assert printed["error_bound"] == pytest.approx(sum(printed["error_parts"].values()))
    tree = tree_of()
    tree["claims"]["bound"] = "1/2"
    path.write_text(json.dumps(tree), encoding="utf-8")
    assert run(monkeypatch, "verify", str(path)) == 1
    printed_last = capsys.readouterr()
    assert printed_last.out == ""
    assert re.search(rf"^sosmith: error: {re.escape(str(path))}: the bound must be ", printed_last.err, re.MULTILINE)
    path.write_text("no", encoding="utf-8")
    assert run(monkeypatch, "verify", str(path)) == 2
