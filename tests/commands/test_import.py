"""The command `import`, and a specification whose sections are in another tool's file."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.signal
from tests.commands.invocation import Invocation
from tests.interface.small import FILTER

import sosmith
from sosmith.gen.specification.toml_text import toml_text
from sosmith.model.errors import SpecificationError

SOS = scipy.signal.butter(2, 100, fs=1000, output="sos")
BIQUAD = "biquad1,\nb0={},\nb1={},\nb2={},\na1={},\na2={}\n".format(*SOS[0, :3], *(-SOS[0, 4:]))

command = Invocation("import")


def test_a_list_of_biquads_becomes_a_specification(tmp_path: Path) -> None:
    (tmp_path / "8 bands.txt").write_text(BIQUAD)
    output = tmp_path / "spec.toml"
    result = command.good(str(tmp_path / "8 bands.txt"), "--sample-rate", "1000", "--unit", "V", "-o", str(output))
    assert result.stdout == f"{output}\n"
    assert result.stderr == (
        "sosmith: 1 second-order section from a list of biquads as from Room EQ Wizard and miniDSP, read with the "
        "signs of a1 and a2 negated: with scipy's signs of a1 and a2 it would be unstable\n"
        "sosmith: gain 1 at 0 Hz, 0 at 500 Hz\n"
    )
    spec = sosmith.Specification.load(output)
    assert (spec.name, spec.sample_rate) == ("filter_8_bands", 1000)
    np.testing.assert_array_equal(spec.as_dict()["filter"]["sos"], SOS)


def test_coefficients_are_written_to_the_last_digit(tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_text("0.1234567890123456789012345,0,0,1,-0.5,0\n")
    text = command.good(str(tmp_path / "f.csv"), "--sample-rate", "10", "--name", "long").stdout
    assert "sos = [[0.1234567890123456789012345, 0.0, 0.0, 1.0, -0.5, 0.0]]\n" in text


def test_a_file_without_a_filter_is_refused_with_its_name(tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_text("1,0,0,1,2,1.21\n")
    command.refused(
        f"{tmp_path / 'f.csv'}: sections must be stable, not a pole of radius 1.1 in section 0 with scipy's signs of "
        "a1 and a2, and a pole of radius 2.48661 in section 0 with the signs of a1 and a2 negated",
        str(tmp_path / "f.csv"),
        "--sample-rate",
        "10",
    )


def in_file(folder: Path, name: str, content: bytes) -> Path:
    """Write a specification whose sections are in the file `name`."""
    (folder / name).write_bytes(content)
    path = folder / "spec.toml"
    path.write_text(toml_text(FILTER | {"filter": {"sos_file": name}}))
    return path


def matlab() -> bytes:
    """Make a MAT file with leading coefficients 1 and the gain apart."""
    file = io.BytesIO()
    rows = SOS.copy()
    rows[:, :3] /= rows[0, 0]
    scipy.io.savemat(file, {"SOS": rows, "G": [SOS[0, 0], 1.0]})
    return file.getvalue()


def array() -> bytes:
    file = io.BytesIO()
    np.save(file, SOS)
    return file.getvalue()


TEXT = ",".join(map(repr, map(float, SOS[0]))).encode()


@pytest.mark.parametrize(
    ("name", "content"), [("f.npy", array()), ("f.csv", b"b0,b1,b2,a0,a1,a2\n" + TEXT), ("f.mat", matlab())]
)
def test_a_certificate_is_held_against_the_file_of_sections(name: str, content: bytes, tmp_path: Path) -> None:
    path = in_file(tmp_path, name, content)
    certificate = sosmith.design(sosmith.Specification.load(path)).certificate
    agreement = certificate.verify(spec=path).agreement
    assert agreement is not None
    assert agreement.distance is not None
    assert agreement.distance < 1e-50
    sections = SOS.copy()
    sections[0, 1] *= 1 + 1e-6
    path.write_text(path.read_text().replace(name, "other.npy"))
    np.save(tmp_path / "other.npy", sections)
    with pytest.raises(sosmith.ShortfallError, match=r"^the filter must be the specified one within a peak gain of "):
        certificate.verify(spec=path)


def test_sections_that_the_verifier_cannot_read_itself_are_not_taken_on_trust(tmp_path: Path) -> None:
    path = in_file(tmp_path, "f.txt", BIQUAD.encode())
    certificate = sosmith.design(sosmith.Specification.load(path)).certificate
    with pytest.raises(
        sosmith.ShortfallError, match=r"^filter\.sos_file must be a file of sections that can be read, "
    ):
        certificate.verify(spec=path)


def test_a_file_of_sections_says_how_it_was_read(tmp_path: Path) -> None:
    path = in_file(tmp_path, "f.npy", array())
    spec = sosmith.Specification.load(path).checked
    assert spec.filter.origin == (
        "1 second-order section from a NumPy file .npy of b0, b1, b2, a0, a1, a2, read with scipy's signs of a1 and "
        "a2: with the signs of a1 and a2 negated it would be unstable"
    )


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            b"0.5,0.5\n1,-0.2\n",
            "filter.sos_file must hold second-order sections, not a table of b and a; "
            "`sosmith import` makes a specification of it",
        ),
        ((TEXT + b"\n") * 11, "sections must be at most 10, not 11"),
    ],
)
def test_a_file_that_is_no_list_of_sections_is_refused(content: bytes, message: str, tmp_path: Path) -> None:
    path = in_file(tmp_path, "f.csv", content)
    with pytest.raises(SpecificationError) as refused:
        sosmith.Specification.load(path)
    assert str(refused.value) == f"{tmp_path / 'f.csv'}: {message}"
