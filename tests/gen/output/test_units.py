"""Units with letters that ASCII lacks: files that must be ASCII spell them, and are proven as any other."""

from pathlib import Path

import pytest

import sosmith
from sosmith.model.templates import in_ascii


@pytest.mark.parametrize(
    ("unit", "spelled"),
    [("µm", "um"), ("\u03bcm", "um"), ("°C", "degC"), ("Ω", "Ohm"), ("m·s⁻²", "m*s^-2"), ("米", "?")],
)
def test_a_unit_is_spelled(unit: str, spelled: str) -> None:
    assert in_ascii(unit) == spelled


@pytest.mark.slow
def test_a_core_with_such_a_unit_is_proven_with_its_files(tmp_path: Path) -> None:
    sos = [[0.5, 0.5, 0.0, 1.0, -0.5, 0.0]]
    spec = sosmith.Specification.from_sos(sos, 1000, input_bits=6, architecture="serial", unit="µm*/°")
    design = sosmith.design(spec, realization="df1")
    design.generate(tmp_path)
    for suffix in (".sv", ".h"):
        text = (tmp_path / f"sos_filter{suffix}").read_text(encoding="ascii")
        assert "* code um" in text
    certificate = sosmith.Certificate.load(tmp_path / "sos_filter.certificate.json")
    assert certificate.verify(files=tmp_path)
