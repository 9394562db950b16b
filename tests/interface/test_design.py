"""A design from Python: figures with units, arrays in and out, files, certificate, co-simulation."""

import copy
import json
import pickle
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.signal
from tests.gen.report.pictures import unpainted
from tests.interface.small import FILTER, filter_design, instrument_design

import sosmith
from sosmith import SpecificationError
from sosmith.gen.output import generate as writing
from sosmith.gen.report.comparison.report_file import load_report

NOISE = np.random.default_rng(1)


def test_figures_are_those_of_the_proof() -> None:
    design = instrument_design()
    assert str(design.bound).endswith(" mm")
    assert design.bound.unit == "mm"
    assert sum(design.budget.values()) == pytest.approx(design.bound, rel=1e-12)
    assert design.bound <= design.specification.max_error
    parts = ["calibration", "filter coefficients", "filter rounding", "start", "output rounding"]
    assert list(design.budget) == parts
    assert (design.kind, design.realization, design.architecture) == ("instrument", "df1_ef1", "parallel")
    assert design.manifest["error_bound"] == design.bound
    assert design.cost.luts > 0


def test_sections_are_the_quantized_ones() -> None:
    design = filter_design()
    (section,) = design.sections
    assert np.allclose([*section.b, *section.a], design.quantized_sos[0], rtol=0, atol=1e-15)
    assert not np.array_equal(design.sos, design.quantized_sos)
    assert all(c.value == c.integer / 2**c.fraction_bits for c in section.coefficients.values())
    assert {"input", "output", "x1"} <= section.formats.keys()


def test_frequency_response_is_that_of_the_sections() -> None:
    design = filter_design()
    f = np.array([[0.0, 1.0], [100.0, 499.0]])
    for ideal, sos in ((True, design.sos), (False, design.quantized_sos)):
        _, expected = scipy.signal.sosfreqz(sos, worN=f.ravel(), fs=1000)
        assert np.allclose(design.frequency_response(f, ideal=ideal).ravel(), expected, rtol=1e-9)


def test_runs_in_physical_units_one_channel_or_several() -> None:
    design = instrument_design()
    voltage, temperature = NOISE.uniform(0, 10, (300, 2)), NOISE.uniform(0, 128, (300, 1))
    result, exact = (
        design.run(voltage=voltage, temperature=temperature),
        design.run_exact(voltage=voltage, temperature=temperature),
    )
    assert result.shape == exact.shape == (300, 2)
    assert abs(result - exact).max() <= design.bound
    single = design.run(temperature=temperature[:, 0], voltage=voltage[:, 1])
    assert np.array_equal(single, result[:, 1])
    assert design.run(voltage=[5.0] * 40, temperature=20.0)[-1] == pytest.approx(1.16 - 0.072 + 1.836, abs=0.01)


def test_runs_on_codes() -> None:
    design = filter_design()
    codes = NOISE.integers(-512, 512, 200)
    values = design.core.datapath.inputs[0].decode(codes)
    results = design.run_codes(x=codes)
    assert results.dtype == np.int64
    assert np.array_equal(design.core.datapath.output.decode(results), design.run(x=values))
    assert results.tolist() == design.core.datapath.compute_exact(codes[:, np.newaxis])


REFUSED = {
    "missing": ({"voltage": [1.0]}, "the inputs must be voltage and temperature, not without temperature"),
    "unknown": (
        {"voltage": [1.0], "temprature": [1.0]},
        r"the inputs must be voltage and temperature, not temprature \(did you mean temperature\?\)",
    ),
    "not finite": ({"voltage": [np.inf], "temperature": [1.0]}, "values of voltage must be finite, not .*inf.*"),
    "text": ({"voltage": ["high"], "temperature": [1.0]}, "values of voltage must be real numbers, not text"),
    "complex": ({"voltage": [1 + 2j], "temperature": 1.0}, "values of voltage must be real numbers, not complex ones"),
    "masked": (
        {"voltage": np.ma.array([1.0, 2.0], mask=[False, True]), "temperature": 1.0},
        r"values of voltage must all be known, not masked \(1 of 2\): fill the gaps",
    ),
    "ragged": (
        {"voltage": [[1.0], [1.0, 2.0]], "temperature": 1.0},
        "values of voltage must be in rows of one length, not in rows of different ones",
    ),
    "too large": (
        {"voltage": [10**400], "temperature": 1.0},
        "values of voltage must be real numbers in the range of a double, not other objects",
    ),
    "no samples": ({"voltage": [], "temperature": []}, "the inputs must have at least one sample, not none"),
    "channels": (
        {"voltage": np.ones((4, 3)), "temperature": 20.0},
        r"the inputs must have the shape \(samples,\) or \(samples, 2\), not \(4, 3\) and \(\)",
    ),
    "lengths": (
        {"voltage": np.ones(3), "temperature": np.ones(4)},
        r"the inputs must have shapes that broadcast, not \(3,\) and \(4,\)",
    ),
}


def test_numbers_are_one_sample_and_a_column_is_the_same_for_every_channel() -> None:
    design = instrument_design()
    assert np.array_equal(
        design.run(voltage=5.0, temperature=20.0), design.run(voltage=[5.0] * 3, temperature=20.0)[:1]
    )
    voltage, temperature = NOISE.uniform(0, 10, (2, 2)), NOISE.uniform(0, 100, 2)
    assert np.array_equal(
        design.run(voltage=voltage, temperature=temperature),
        design.run(voltage=voltage, temperature=np.stack([temperature, temperature], axis=1)),
    )


@pytest.mark.parametrize(("inputs", "message"), REFUSED.values(), ids=REFUSED)
def test_inputs_that_do_not_fit(inputs: dict[str, object], message: str) -> None:
    for call in (instrument_design().run, instrument_design().run_exact):
        with pytest.raises(SpecificationError, match=f"^{message}$"):
            call(**inputs)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("codes", "message"),
    [
        ([0.5], "codes of x must be integers, not float64"),
        ([0, 512], r"codes of x must be in -512..511, not 0..512"),
        ([2**70], f"codes of x must be in -512..511, not {2**70}..{2**70}"),
    ],
    ids=["float", "above", "far above"],
)
def test_codes_that_do_not_fit(codes: list[float], message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{message}$"):
        filter_design().run_codes(x=codes)


@pytest.mark.parametrize(
    ("frequencies", "message"),
    [
        ("ten", "frequencies must be real numbers, not text"),
        ([1j], "frequencies must be real numbers, not complex ones"),
        ([1.0, float("nan")], "frequencies must be finite, not nan"),
    ],
)
def test_frequencies_that_are_none(frequencies: object, message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{message}$"):
        filter_design().frequency_response(frequencies)  # type: ignore[arg-type]


EDGES = {"passband_edge": 100.0, "stopband_edge": 101.0, "passband_loss": 0.01, "stopband_loss": 90.0}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        pytest.param(
            {"output": FILTER["output"] | {"max_error": 0.00097656250001}},
            "the filter's coefficients must keep their error below 2.56e-12 output LSB with 40 significant bits each, "
            "and do not: raise output.max_error or raise output.bits",
            id="an error too small",
        ),
        pytest.param(
            {"filter": {"family": "butterworth", "kind": "lowpass"} | EDGES},
            "filter's edges and losses must be met by an order of at most 20, not 1259: widen the transition band or "
            "lower stopband_loss",
            id="edges too close",
        ),
        pytest.param(
            {"hardware": {"architecture": "serial", "clock": 1000}},
            "none of the 8 realizations meets the specification: with df1_ef2, the serial architecture takes 114 "
            "clocks a sample: at a clock of 1,000 Hz the sample rate must be at most 8.77192 Hz, not 1,000 Hz",
            id="a clock too slow",
        ),
    ],
)
def test_what_refuses_a_specification_as_a_whole_names_its_file(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(
        (sosmith.ShortfallError, SpecificationError), match=f"^{re.escape(f'specification: {message}')}$"
    ):
        sosmith.design(FILTER | changes)


def test_names_that_do_not_exist_are_refused_before_the_design() -> None:
    for options, message in (
        ({"board": "icebraker"}, r"the board must be one of .*, not icebraker \(did you mean icebreaker\?\)"),
        ({"core": "filtr"}, r"the core must be one of .*, not filtr \(did you mean filter\?\)"),
        ({"realization": "dleta"}, r"the realization must be auto, .*, not dleta \(did you mean delta\?\)"),
    ):
        with pytest.raises(SpecificationError, match=message):
            sosmith.design(FILTER, **options)  # type: ignore[arg-type]


def test_files_and_certificate(tmp_path: Path) -> None:
    design = filter_design()
    paths = {path.suffix: path for path in design.generate(tmp_path)}
    assert json.loads(paths[".json"].read_text(encoding="utf-8"))["name"] == "plain"
    read = sosmith.Certificate.load(tmp_path / "plain.certificate.json")
    of_files, of_design = (each.entries.model_copy(update={"about": None}) for each in (read, design.certificate))
    assert of_files == of_design
    assert read.entries.about is not None
    assert {entry.name for entry in read.entries.about.files} == {
        path.name for path in paths.values() if not path.name.endswith("certificate.json")
    } | {"plain.json"}
    proof = read.verify()
    assert proof.bound == read.bound == pytest.approx(design.bound, rel=1e-9)
    assert proof.budget.keys() == design.budget.keys()
    forged = read.entries.model_copy(update={"max_error": Fraction(1, 10**6)})
    with pytest.raises(sosmith.ShortfallError, match="the error must be at most"):
        sosmith.Certificate(forged).verify()
    assert read.save(tmp_path / "copy.json").read_bytes() == (tmp_path / "plain.certificate.json").read_bytes()
    saved = sosmith.Certificate.load(design.certificate.save(tmp_path / "own.json"))
    assert saved.text() == design.certificate.text()


@pytest.mark.slow
@unpainted
def test_co_simulation(tmp_path: Path) -> None:
    design = instrument_design()
    voltage = NOISE.uniform(0, 10, (60, 2))
    vectors = tmp_path / "vectors" / "run.npz"
    report = design.simulate(
        {"voltage": voltage, "temperature": 25.0}, folder=tmp_path, simulator="icarus", vectors=vectors
    )
    with np.load(vectors) as run:
        assert np.array_equal(run["stimuli"][..., 0], report.input_codes["voltage"])
        assert np.array_equal(run["responses"], report.hardware_codes)
        assert np.array_equal(run["status"], design.core.datapath.compute_status(run["stimuli"]))
    assert (report.passed, report.bit_exact, report.shortfalls) == (True, True, ())
    assert np.array_equal(report.hardware, design.run(voltage=voltage, temperature=25.0))
    assert np.array_equal(report.exact, design.run_exact(voltage=voltage, temperature=25.0))
    assert np.array_equal(report.hardware_codes, design.run_codes(**report.input_codes))
    assert report.largest_error == abs(report.error).max() <= report.bound == design.bound
    assert report.time.tolist() == [k / 100 for k in range(60)]
    assert load_report(tmp_path) == report.summary
    both = sosmith.compare([report, tmp_path])
    assert both.names == ["gauge, df1_ef1 (1)", "gauge, df1_ef1 (2)"]
    assert (both.choice.taken, both.differences, both.passed) == (None, [], True)
    beside = sosmith.compare([report], baseline=tmp_path, tolerance="error=0,bound=0,lut=0")
    assert (beside.passed, beside.names) == (True, ["baseline", "gauge"])
    for shown in (report, both, design):
        html = shown._repr_html_()
        assert html.startswith("<table><caption>")
        assert "script" not in html
    assert "<th scope" in both._repr_html_()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"trace": "nois"}, r"scenario for a plain filter must be one of .*, not 'nois' \(did you mean noise\?\)"),
        (
            {"simulator": "icarsu"},
            r"simulator must be verilator, icarus or cxxrtl, not icarsu \(did you mean icarus\?\)",
        ),
        ({"gates": "nexys"}, "the board must be one of .*, not nexys"),
        ({"vectors": "run.fst"}, r"run\.fst: a file of vectors must end in .*, not '\.fst'"),
        ({"idle": float("nan")}, "idle must be from 0 to 0.99, not nan"),
        (
            {"trace": {"x": [0.0]}, "seconds": 1.0},
            "seconds must come with the name of a built-in trace, not with arrays",
        ),
    ],
)
def test_co_simulation_is_refused(options: dict[str, object], message: str, tmp_path: Path) -> None:
    with pytest.raises(SpecificationError, match=f"^{message}$"):
        filter_design().simulate(folder=tmp_path / "out", **options)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_notebooks_get_escaped_text() -> None:
    spec = sosmith.Specification.load(FILTER | {"output": FILTER["output"] | {"unit": "<b>&"}})
    html = sosmith.design(spec)._repr_html_()
    assert "&lt;b&gt;&amp;" in html
    assert "<b>" not in html
    html = spec._repr_html_()
    assert '<tr><th scope="row">output.unit</th><td>&lt;b&gt;&amp;</td></tr>' in html
    assert html.startswith("<table><caption>Specification ")


def test_notebooks_show_cost_and_proof() -> None:
    made = filter_design()
    html, counted = made.cost._repr_html_(), made.facts.cost
    assert f'<th scope="row">Adder bits</th><td>{counted.adder_bits:,}</td>' in html
    assert counted.multiplier_sizes in html
    assert (made.cost.luts, made.cost.multipliers) == (counted.luts, counted.multipliers)
    assert "Error budget, proven for all inputs in range" in made.verify()._repr_html_()


def test_quantities_keep_their_unit() -> None:
    bound = sosmith.Quantity(0.25, "mm")
    for other in (copy.deepcopy(bound), pickle.loads(pickle.dumps(bound))):
        assert (other, other.unit) == (0.25, "mm")
    assert repr(bound) == "Quantity(0.25, 'mm')"
    assert str(sosmith.Quantity(3.0)) == "3"


def test_facts_and_certificate_are_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What `generate` writes is made of those of the design, and is the same as if it made them itself."""
    made = sosmith.design(FILTER)
    expected = writing.generated(made.core)
    assert (made.facts.name, made.certificate.name) == (made.name, made.name)
    monkeypatch.setattr(writing, "core_facts", None)
    monkeypatch.setattr(writing, "certificate", None)
    written = {path.name: path.read_text(encoding="utf-8") for path in made.generate(tmp_path)}
    assert written == expected


@pytest.mark.parametrize(
    ("trace", "seconds", "message"),
    [
        (
            np.zeros(3),
            None,
            "the trace must be the name of one, a path, or arrays by the names of the inputs, not something "
            "of type ndarray",
        ),
        ("noise", "x", "seconds must be a number, not 'x'"),
    ],
)
def test_traces_that_are_none(trace: Any, seconds: Any, message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^{message}$"):
        filter_design().simulate(trace, seconds=seconds)
