"""Mistakes in specifications of FIR filters, and taps from other tools' files."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from tests.gen.specification.bad_specifications import BASE, FILTER, with_fault

import sosmith
from sosmith.gen.filter.design import design
from sosmith.gen.specification.specification import load
from sosmith.model.errors import SpecificationError
from sosmith.verify.graph import RejectedError
from sosmith.verify.specified.sections_file import taps_in

EDGES = "passband_edge = {}\nstopband_edge = {}\npassband_loss = 0.1\nstopband_loss = 40.0\n"
HALFBAND = 'family = "halfband"\nkind = "lowpass"\n'


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ("taps = []", "filter.taps must be a list of 1 to 512 numbers, not []"),
        (f"taps = {[1] * 513}", "filter.taps must be a list of 1 to 512 numbers, not a list of 513 values"),
        ("taps = [0, 0.0]", "filter.taps must be a list of numbers that are not all 0, not zeros only"),
        ('taps = [1, "2"]', "filter.taps[1] must be a number, not '2': write 2, without quotes and unit"),
        ("taps = [1]\norder = 3", "filter must be given by order and cutoff, .*, not by order and taps"),
        ("taps = [1]\nsos = [[1, 2, 1, 1, 0, 0]]", "filter must be given by .*, not by sos and taps"),
        ('taps = [1]\ntaps_file = "a.npy"', "filter.taps_file must be left out with taps, not 'a.npy'"),
        ('taps = [1]\nfamily = "butterworth"', "filter.family must be left out with taps, not 'butterworth'"),
        ("taps = [1]\npassband_loss = 1", "filter.passband_loss must be left out with taps, not 1"),
        (
            "taps = [1]\ndecimate = 4",
            "not yet available: filter.decimate must be left out with an FIR filter, not 4",
        ),
        (
            'family = "equiripple"\nkind = "lowpass"\norder = 3\ncutoff = 10.0',
            "filter must be given by passband_edge, stopband_edge, passband_loss and stopband_loss for equiripple, not "
            "by order and cutoff",
        ),
        (
            'family = "equiripple"\nkind = "lowpass"\norder = 63\ncutoff = 10.0',
            "filter must be given by passband_edge, stopband_edge, passband_loss and stopband_loss for equiripple, not "
            "by order and cutoff",
        ),
        (
            'family = "kaiser"\nkind = "lowpass"\nmethod = "bilinear"\n' + EDGES.format(10.0, 20.0),
            "filter.method must be left out for kaiser, not 'bilinear'",
        ),
        (
            'family = "halfband"\nkind = "highpass"\n' + EDGES.format(30.0, 20.0),
            "filter.kind must be lowpass for halfband: the taps of a high-pass are the same with alternating signs, "
            "not 'highpass'",
        ),
        (
            HALFBAND + EDGES.format(20.0, 31.0),
            "filter.stopband_edge must be 30 Hz for halfband, half the sample_rate less passband_edge, not 31",
        ),
    ],
)
def test_mistakes_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, table: str, sentence: str) -> None:
    monkeypatch.chdir(tmp_path)
    Path("spec.toml").write_text(with_fault(FILTER, f"[filter]\n{table}\n\n"), encoding="utf-8")
    pattern = sentence.replace("[", r"\[").replace("]", r"\]")
    with pytest.raises(SpecificationError, match=rf"^spec\.toml: {pattern}$"):
        load(Path("spec.toml"))


def test_the_taps_of_a_specification_are_exact(tmp_path: Path) -> None:
    path = tmp_path / "spec.toml"
    path.write_text(BASE.replace(FILTER, "[filter]\ntaps = [0.1, -2, 3e-1]\n\n"), encoding="utf-8")
    assert load(path).filter.taps == (Fraction(1, 10), Fraction(-2), Fraction(3, 10))
    assert load(path).filter.is_fir


FILES = {
    "column.txt": "0.1\n0.5 # middle\n0.1\n",
    "row.csv": "0.1,0.5,0.1\n",
    "designer.fcf": "% Discrete-Time FIR Filter (real)\nNumerator:\n 0.1\n 0.5\n 0.1\n",
}


@pytest.mark.parametrize("name", [*FILES, "taps.npy", "taps.mat", "b_and_a.mat"])
def test_taps_of_other_tools_are_read(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    if name in FILES:
        path.write_text(FILES[name], encoding="utf-8")
    elif name == "taps.npy":
        np.save(path, np.array([0.1, 0.5, 0.1]))
    else:
        scipy.io.savemat(path, {"Num": [0.1, 0.5, 0.1]} if name == "taps.mat" else {"b": [0.2, 1.0, 0.2], "a": [2.0]})
    read = sosmith.Coefficients.load(path, sample_rate=1000.0)
    assert [float(tap) for tap in read.taps] == [0.1, 0.5, 0.1]
    assert read.gains == pytest.approx((0.7, -0.3))
    assert read.specification(name="f").as_dict()["filter"]["taps"] == [0.1, 0.5, 0.1]
    tree = sosmith.Specification.from_taps([1.0], 1000.0).as_dict() | {"filter": {"taps_file": name}}
    spec = tmp_path / "spec.toml"
    spec.write_text(
        sosmith.Specification.from_taps([1.0], 1000.0).toml().replace("taps = [1.0]", f'taps_file = "{name}"')
    )
    assert tree["filter"] == sosmith.Specification.load(spec).as_dict()["filter"]
    assert load(spec).filter.taps == read.taps
    assert load(spec).filter.origin.startswith("3 taps from ")
    if name in {"column.txt", "row.csv", "taps.npy"}:
        assert taps_in(path) == read.taps


def test_files_without_taps_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "sections.csv"
    path.write_text("1,2,1,1,0,0\n", encoding="utf-8")
    spec = tmp_path / "spec.toml"
    spec.write_text(BASE.replace(FILTER, '[filter]\ntaps_file = "sections.csv"\n\n'), encoding="utf-8")
    with pytest.raises(
        SpecificationError,
        match=r"csv: filter\.taps_file must hold the taps of an FIR filter, not a table of b0, b1, b2, a0, a1, a2$",
    ):
        load(spec)
    path.write_text("1,2\n3,4\n", encoding="utf-8")
    with pytest.raises(
        RejectedError, match=r"^filter\.taps_file must have one row or one column of numbers to be compared"
    ):
        taps_in(path)


@pytest.mark.parametrize(("taps", "words"), [([0.5], "1 tap"), ([1.0, 0.0, 0.0, 1.0], "4 taps")])
def test_given_taps_are_not_called_after_a_pass_band(tmp_path: Path, taps: list[float], words: str) -> None:
    """A pure gain and a comb have none."""
    spec = tmp_path / "given.toml"
    spec.write_text(sosmith.Specification.from_taps(taps, sample_rate=48000.0).toml())
    assert design(load(spec).filter, 48000.0).describe == f"FIR of {words} given at 48000 Hz"
