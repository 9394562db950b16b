"""Good specifications: what is read, how exactly, and that nothing but `SpecificationError` is raised."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from sosmith.gen.specification import specification
from sosmith.gen.specification.specification import CalibrationSpec, FilterSpec, HardwareSpec, Specification, load
from sosmith.gen.specification.verilog_names import KEYWORDS, OBEYED
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port
from sosmith.verify.reader import tokens

EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*.toml"))

# The example of the contract with the user, word for word in content.
CONTRACT = {
    "name": "flange_wear",
    "sample_rate": 100.0,
    "channels": 1,
    "input": {
        "voltage": {"bits": 16, "range": [0.0, 10.0]},
        "temperature": {"bits": 16, "range": [0.0, 128.0]},
    },
    "calibration": {"coefficients": [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]},
    "filter": {
        "family": "butterworth",
        "kind": "lowpass",
        "method": "bilinear",
        "order": 7,
        "cutoff": 0.2587803,
    },
    "output": {"bits": 16, "range": [0.0, 16.0], "unit": "mm", "max_error": 0.00025},
    "hardware": {
        "realization": "auto",
        "architecture": "auto",
        "clock": 12.0e6,
        "start": "steady",
        "reload": False,
        "protect": "none",
    },
}

PLAIN = """
name = "plain"
sample_rate = 8_000
[input.x]
bits = 12
signed = true
range = [-2, 2]
[filter]
{filter}
[output]
bits = 10
range = [-4.0, 4]
"""


def read(folder: Path, text: str) -> Specification:
    """Load the specification `text` from a file in `folder`."""
    path = folder / "spec.toml"
    path.write_text(text, encoding="utf-8")
    return load(path)


def test_example_is_the_contracts_and_is_read_exactly(tmp_path: Path) -> None:
    spec = read(tmp_path, specification.example())
    assert spec == Specification(
        path=tmp_path / "spec.toml",
        source=CONTRACT,
        text=specification.example(),
        name="flange_wear",
        sample_rate=Fraction(100),
        channels=1,
        inputs=(
            Port(name="voltage", bits=16, signed=False, lsb=Fraction(10, 65536), zero=Fraction(0), unit="V"),
            Port(name="temperature", bits=16, signed=False, lsb=Fraction(1, 512), zero=Fraction(0), unit="degC"),
        ),
        calibration=CalibrationSpec(
            coefficients=(
                (Fraction(116, 100), Fraction(-36, 10000)),
                (Fraction(3672, 10000), Fraction(6618, 10**7)),
                (Fraction(5812, 10**5),),
            ),
            data=None,
        ),
        filter=FilterSpec(
            family="butterworth",
            kind="lowpass",
            method="bilinear",
            order=7,
            cutoff=(Fraction(2587803, 10**7),),
            passband_edge=None,
            stopband_edge=None,
            passband_loss=None,
            stopband_loss=None,
            sos=None,
        ),
        output=Port(name="clearance", bits=16, signed=False, lsb=Fraction(1, 4096), zero=Fraction(0), unit="mm"),
        max_error=Fraction(25, 10**5),
        wear=None,
        hardware=HardwareSpec(
            realization="auto",
            architecture="auto",
            clock=Fraction(12_000_000),
            reload=False,
            protect="none",
            start="steady",
        ),
    )


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_good_and_named_like_their_file(path: Path) -> None:
    assert load(path).name == path.stem


def test_there_are_examples() -> None:
    assert {path.stem for path in EXAMPLES} >= {
        "audio_lowpass",
        "flange_wear_bench",
        "flange_wear_locomotive",
    }


@pytest.mark.parametrize(
    ("name", "prewarped"),
    [
        pytest.param("flange_wear_bench", 3.727, id="bench, equations 16 and 18"),
        pytest.param("flange_wear_locomotive", 1.626, id="locomotive, Table 9"),
    ],
)
def test_cutoffs_of_the_examples_are_the_papers(name: str, prewarped: float) -> None:
    spec = load(next(path for path in EXAMPLES if path.stem == name))
    assert spec.filter.cutoff is not None
    # rad/s on the axis of the analogue prototype: 2 fs tan(pi fc / fs), printed with four digits
    fs = float(spec.sample_rate)
    assert 2 * fs * math.tan(math.pi * float(spec.filter.cutoff[0]) / fs) == pytest.approx(prewarped, rel=1e-6)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_source_is_what_was_written_in_the_types_of_json(path: Path) -> None:
    source = load(path).source
    assert source == tomllib.loads(path.read_text(encoding="utf-8"))
    assert json.loads(json.dumps(source, allow_nan=False)) == source


def test_plain_filter_has_one_input_in_the_unit_of_the_output_and_defaults(tmp_path: Path) -> None:
    spec = read(tmp_path, PLAIN.format(filter='family = "bessel"\nkind = "highpass"\norder = 3\ncutoff = 1e3'))
    assert spec.inputs == (Port(name="x", bits=12, signed=True, lsb=Fraction(4, 4096), zero=Fraction(0), unit=""),)
    assert spec.output == Port(name="y", bits=10, signed=False, lsb=Fraction(1, 128), zero=Fraction(-4))
    assert spec.max_error == spec.output.lsb
    assert spec.channels == 1
    assert spec.calibration is None
    assert spec.filter.method == "bilinear"
    assert spec.hardware == HardwareSpec(
        realization="auto",
        architecture="auto",
        clock=Fraction(12_000_000),
        reload=False,
        protect="none",
        start="steady",
    )


def test_inputs_come_in_the_order_of_the_polynomials_indices(tmp_path: Path) -> None:
    text = specification.example().replace("[input.voltage]", "[input.other]")
    text = text.replace("[input.temperature]", "[input.voltage]").replace("[input.other]", "[input.temperature]")
    assert [port.name for port in read(tmp_path, text).inputs] == ["voltage", "temperature"]


def test_measurements_are_found_from_the_folder_of_the_specification(tmp_path: Path) -> None:
    text = specification.example()
    start, end = text.index("coefficients"), text.index("# data")
    spec = read(tmp_path, f'{text[:start]}data = "runs/m.csv"\n{text[end:]}')
    assert spec.calibration == CalibrationSpec(coefficients=None, data=tmp_path / "runs" / "m.csv")


def test_sections_are_exact_and_need_no_family(tmp_path: Path) -> None:
    spec = read(tmp_path, PLAIN.format(filter="sos = [[0.1, 0e-99, -0.1, 1.0, -1.7, 0.8], [1, 0, 0, 1, 0.5, 0]]"))
    assert spec.filter.sos == (
        (Fraction(1, 10), 0, Fraction(-1, 10), 1, Fraction(-17, 10), Fraction(8, 10)),
        (1, 0, 0, 1, Fraction(1, 2), 0),
    )
    assert (spec.filter.family, spec.filter.kind, spec.filter.method) == ("sections",) * 3


@pytest.mark.parametrize(
    ("kind", "passband", "stopband"),
    [
        ("lowpass", "1000", "1500.5"),
        ("highpass", "1500.5", "1000"),
        ("bandpass", "[1000, 2000]", "[500, 3000]"),
        ("bandstop", "[500, 3000]", "[1000, 2000]"),
    ],
)
@pytest.mark.parametrize("family", ["butterworth", "chebyshev1", "chebyshev2", "elliptic"])
def test_edges_and_losses_do_for_every_kind(
    tmp_path: Path, family: str, kind: str, passband: str, stopband: str
) -> None:
    lines = [
        f'family = "{family}"',
        f'kind = "{kind}"',
        f"passband_edge = {passband}",
        f"stopband_edge = {stopband}",
        "passband_loss = 0.1",
        "stopband_loss = 40",
    ]
    spec = read(tmp_path, PLAIN.format(filter="\n".join(lines)))
    assert spec.filter.kind == kind
    assert spec.filter.passband_edge is not None
    assert list(spec.filter.passband_edge) == list(json.loads(f"[{passband.strip('[]')}]"))
    assert (spec.filter.passband_loss, spec.filter.stopband_loss) == (Fraction(1, 10), Fraction(40))


@pytest.mark.parametrize(
    ("family", "losses"),
    [
        ("butterworth", ""),
        ("chebyshev1", "passband_loss = 0.5"),
        ("chebyshev2", "stopband_loss = 50"),
        ("elliptic", "passband_loss = 0.5\nstopband_loss = 50"),
        ("bessel", ""),
    ],
)
def test_order_and_cutoff_do_with_the_losses_of_the_family(tmp_path: Path, family: str, losses: str) -> None:
    lines = [f'family = "{family}"', 'kind = "bandpass"', "order = 10", "cutoff = [1000, 2000]", losses]
    spec = read(tmp_path, PLAIN.format(filter="\n".join(lines)))
    assert spec.filter.cutoff == (1000, 2000)


@pytest.mark.parametrize("cutoff", ["0.008", "3999.992"])
def test_limits_themselves_are_good(tmp_path: Path, cutoff: str) -> None:
    text = PLAIN.format(filter=f'family = "butterworth"\nkind = "lowpass"\norder = 20\ncutoff = {cutoff}')
    text += "max_error = 0.003906251\n[hardware]\nclock = 8e3\n"  # just over half of 8 / 1024; the sample rate
    spec = read(tmp_path, text.ljust(specification.MAX_BYTES, "#"))
    assert 0 < spec.max_error - spec.output.lsb / 2 < 1e-8
    assert spec.hardware.clock == spec.sample_rate


def test_limits_of_texts_and_numbers_are_good(tmp_path: Path) -> None:
    digits = "1." + "3" * 49
    losses = "passband_loss = 1e-6\nstopband_loss = 200"
    text = PLAIN.format(filter=f'family = "elliptic"\nkind = "lowpass"\norder = 4\ncutoff = {digits}\n{losses}')
    text = text.replace('"plain"', f'"{"n" * 64}"').replace("-4.0, 4", "-1e-30, 9e29") + f'unit = "{"u" * 16}"\n'
    spec = read(tmp_path, text)
    assert spec.name == "n" * 64
    assert spec.output.unit == "u" * 16
    assert spec.output.zero == Fraction(-1, 10**30)
    assert spec.filter.cutoff == (Fraction(digits),)
    assert (spec.filter.passband_loss, spec.filter.stopband_loss) == (Fraction(1, 10**6), 200)


def test_byte_order_mark_of_some_editors_is_no_syntax_error(tmp_path: Path) -> None:
    assert read(tmp_path, "\ufeff" + specification.example()).name == "flange_wear"


def test_keywords_are_all_of_systemverilog() -> None:
    # IEEE 1800-2017, Annex B lists 248.
    assert len(KEYWORDS) == 248


def test_what_the_verifier_takes_for_an_order_is_no_name() -> None:
    assert tokens._OBEYED.pattern == rf"\b(?:{OBEYED.pattern})\b|/\*|\*/"


# Whatever is written, a specification is either good or refused by a SpecificationError of one line.

scalars = st.one_of(
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(["bilinear", "butterworth", "bandpass", "elliptic", "delta", "faithful", "voltage", "\0"]),
    st.sampled_from([0, 1, -1, 2, 1.0, 0.5, 6, 20, 1e300, 5e-324, 2**70]),
)
values = st.recursive(
    scalars,
    lambda inner: st.one_of(st.lists(inner, max_size=7), st.dictionaries(st.text(max_size=4), inner, max_size=3)),
    max_leaves=8,
)
keys = st.one_of(
    st.text(max_size=6),
    st.sampled_from(["sos", "order", "cutoff", "data", "signed", "passband_edge", "stopband_loss", "x"]),
)


def to_toml(value: object) -> str:
    """Return `value` as a TOML value on one line."""
    match value:
        case dict():
            return f"{{ {', '.join(f'{to_toml(key)} = {to_toml(item)}' for key, item in value.items())} }}"
        case list():
            return f"[{', '.join(map(to_toml, value))}]"
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case bool():
            return "true" if value else "false"
        case _:
            return repr(value)


def containers(tree: Any) -> Iterator[Any]:
    """Yield every dict and list in `tree` that holds something."""
    if isinstance(tree, dict | list) and tree:
        yield tree
        for item in tree.values() if isinstance(tree, dict) else tree:
            yield from containers(item)


@st.composite
def mutated_trees(draw: st.DrawFn) -> dict[str, Any]:
    """Draw a good specification with one to three keys or items deleted, replaced, renamed or added."""
    path = draw(st.sampled_from(EXAMPLES))
    tree = tomllib.loads(path.read_text(encoding="utf-8"))
    for _ in range(draw(st.integers(1, 3))):
        holders = list(containers(tree))
        if not holders:
            break
        holder = draw(st.sampled_from(holders))
        place = draw(st.sampled_from(list(holder) if isinstance(holder, dict) else range(len(holder))))
        match draw(st.sampled_from(["delete", "replace", "rename", "add"])):
            case "delete":
                del holder[place]
            case "rename" if isinstance(holder, dict):
                holder[draw(keys)] = holder.pop(place)
            case "add" if isinstance(holder, dict):
                holder[draw(keys)] = draw(values)
            case "add":
                holder.append(draw(values))
            case _:
                holder[place] = draw(values)
    return tree


def assert_loads_or_is_refused(path: Path) -> None:
    """Load `path`; if it is good, all in it must be usable, else it must be refused, on a line for each error."""
    try:
        spec = load(path)
    except SpecificationError as error:
        message = str(error)
        assert message.startswith(f"{path}: ")
        for line in message.split("\n"):
            assert line.isprintable()
            assert len(line) < len(str(path)) + 500
    else:
        assert json.loads(json.dumps(spec.source, allow_nan=False)) == spec.source
        assert spec.max_error >= spec.output.lsb / 2
        assert spec.hardware.clock >= spec.sample_rate > 0


hypothesis_settings = settings(
    max_examples=120,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


@hypothesis_settings
@given(tree=mutated_trees())
def test_mutated_trees_are_good_or_refused(tmp_path: Path, tree: dict[str, Any]) -> None:
    path = tmp_path / "spec.toml"
    path.write_text("".join(f"{to_toml(key)} = {to_toml(value)}\n" for key, value in tree.items()), "utf-8")
    assert_loads_or_is_refused(path)


@hypothesis_settings
@given(
    start=st.integers(0, 2500),
    length=st.integers(0, 40),
    inserted=st.one_of(st.text(max_size=12), st.text("0123456789eE+-._xinfa[]{}\"'=#,\n", max_size=12)),
)
@example(start=0, length=10_000, inserted="")
def test_mutated_texts_are_good_or_refused(tmp_path: Path, start: int, length: int, inserted: str) -> None:
    text = specification.example()
    path = tmp_path / "spec.toml"
    path.write_text(text[:start] + inserted + text[start + length :], "utf-8")
    assert_loads_or_is_refused(path)


@hypothesis_settings
@given(content=st.binary(max_size=200))
def test_random_bytes_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "spec.toml"
    path.write_bytes(content)
    with pytest.raises(SpecificationError):
        load(path)
