"""Specifications from files, dicts and sections; their text as TOML."""

import tomllib
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from tests.interface.small import FILTER, INSTRUMENT

import sosmith
from sosmith import Specification, SpecificationError

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_file_dict_and_text_are_the_same_specification(path: Path, tmp_path: Path) -> None:
    from_file = Specification.load(path)
    from_dict = Specification.load(from_file.as_dict())
    written = tmp_path / "spec.toml"
    written.write_text(from_file.toml(), encoding="utf-8")
    from_text = Specification.load(str(written))
    for other in (from_dict, from_text):
        assert other.as_dict() == from_file.as_dict()
        assert other.checked.filter == from_file.checked.filter
        assert other.checked.output == from_file.checked.output
        assert other.max_error == from_file.max_error


def test_floats_of_a_dict_are_the_numbers_written() -> None:
    spec = Specification.load(FILTER | {"sample_rate": np.float64(0.1), "filter": FILTER["filter"] | {"cutoff": 0.01}})
    assert spec.checked.sample_rate == Fraction(1, 10)


def test_sections_of_scipy_reach_the_design_bit_for_bit() -> None:
    sos = scipy.signal.cheby1(4, 0.1, 300.0, fs=8000.0, output="sos")
    spec = Specification.from_sos(sos, 8000.0, output_bits=12, input_range=(0, 5), unit="V", channels=3)
    assert np.array_equal([[float(v) for v in row] for row in spec.checked.filter.sos or ()], sos)
    assert (spec.channels, spec.inputs, spec.max_error.unit) == (3, {"x": "V"}, "V")
    assert spec.max_error == 5 / 2**12
    assert tomllib.loads(spec.toml())["input"]["x"] == {"bits": 16, "range": [0.0, 5.0], "signed": False}


BAD = {
    "one row of five": ([[1.0, 0.0, 0.0, 1.0, 0.0]], {}, r"filter\.sos\[0\] must be a list of 6 numbers, not"),
    "not in rows": (np.zeros(6), {}, r"filter\.sos\[0\] must be a list of 6 numbers, not 0\.0"),
    "unstable": ([[1.0, 0.0, 0.0, 1.0, -3.0, 1.0]], {}, r"filter\.sos"),
    "not a number": (
        [[np.nan, 0.0, 0.0, 1.0, 0.0, 0.0]],
        {},
        r"filter\.sos\[0\]\[0\] must be a finite number, not",
    ),
    "range of one": ([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]], {"input_range": (1.0,)}, r"a range must be two numbers"),
    "range of text": ([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]], {"input_range": ("a", 1)}, r"a range must be two numbers.*'a'"),
    "range of a number": ([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]], {"input_range": 5}, r"a range must be two numbers.*not 5$"),
    "masked": (
        np.ma.masked_array([[1.0, 0, 0, 1, 0, 0]], [[0, 0, 0, 0, 1, 0]]),
        {},
        r"sos must all be known, not mask",
    ),
    "complex": ([[1.0, 0.0, 0.0, 1.0, 1j, 0.0]], {}, r"sos must be real numbers, not complex ones"),
    "realization": (
        [[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]],
        {"realization": "df1_ef3"},
        r"hardware\.realization must be one of .*, not 'df1_ef3' \(did you mean df1_ef\d\?\)",
    ),
    "architecture": (
        [[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]],
        {"architecture": "foldet"},
        r"hardware\.architecture must be one of .*, not 'foldet' \(did you mean folded\?\)",
    ),
}


@pytest.mark.parametrize(("sos", "options", "message"), BAD.values(), ids=BAD)
def test_bad_sections_are_refused(sos: object, options: dict[str, object], message: str) -> None:
    with pytest.raises(SpecificationError, match=f"^(specification: )?{message}"):
        Specification.from_sos(sos, 1000.0, **options)  # type: ignore[arg-type]


def test_frequencies_that_are_no_numbers_are_refused() -> None:
    sos = scipy.signal.butter(2, 100.0, fs=1000.0, output="sos")
    with pytest.raises(SpecificationError, match=r"^sample_rate must be a number of Hz, not '1 kHz'$"):
        Specification.from_sos(sos, "1 kHz")  # type: ignore[arg-type]
    with pytest.raises(SpecificationError, match=r"^clock must be a number of Hz, not None$"):
        Specification.from_sos(sos, 1000.0, clock=None)  # type: ignore[arg-type]


def test_a_changed_dict_changes_no_specification() -> None:
    spec = Specification.load(INSTRUMENT)
    spec.as_dict()["output"]["bits"] = 3
    assert spec.as_dict()["output"]["bits"] == 12


def test_replaced_keys() -> None:
    spec = Specification.load(INSTRUMENT).replaced(channels=1, hardware=None)
    assert spec.channels == 1
    assert "hardware" not in spec.as_dict()
    assert sosmith.Specification.load(INSTRUMENT).channels == 2


@pytest.mark.parametrize(("source", "found"), [(None, "None"), (5, "5"), ([1], "something of type list")])
def test_what_is_no_specification(source: object, found: str) -> None:
    message = f"^the specification must be a path, a dict or a Specification, not {found}$"
    with pytest.raises(SpecificationError, match=message):
        Specification.load(source)  # type: ignore[arg-type]
