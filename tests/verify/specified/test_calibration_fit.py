"""A calibration fitted again: the same bits as the house's fit, and no other polynomial."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.gen.designs import EXAMPLES

from sosmith.gen.calibration.fit import fit, read_measurements
from sosmith.model.errors import SpecificationError
from sosmith.model.polynomial import EQUATION_5A
from sosmith.verify.certificate_file import PortEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.specified.calibration_fit import check_fit, fitted

MARCH = EXAMPLES / "measurements" / "march.csv"


def written(folder: Path, seed: int, order: int, count: int, noise: float = 0.01) -> Path:
    """Write measurements of a polynomial with noise, in columns of another order."""
    rng = np.random.default_rng(seed)
    voltage, temperature = np.round(rng.uniform(0, 10, count), 3), np.round(rng.uniform(15, 95, count), 2)
    weights = rng.uniform(0.5, 1, (order + 1, order + 1))
    clearance = sum(
        weights[i, j] * (voltage / 10) ** i * (temperature / 95) ** j
        for i in range(order + 1)
        for j in range(order + 1)
    )
    clearance = np.round(clearance + rng.normal(0, noise, count) + 1, 4)
    path = folder / "measured.csv"
    rows = zip(voltage.tolist(), clearance.tolist(), temperature.tolist(), strict=True)
    path.write_text("voltage_V,clearance_mm,temperature_C\n" + "".join(f"{a},{b},{c}\n" for a, b, c in rows))
    return path


@pytest.mark.parametrize(("seed", "order", "count"), [(1, 1, 12), (2, 2, 60), (3, 3, 200), (4, 3, 40), (5, 4, 100)])
def test_the_fit_is_the_one_of_the_house_to_the_last_bit(seed: int, order: int, count: int, tmp_path: Path) -> None:
    path = written(tmp_path, seed, order, count)
    house = fit(read_measurements(path))
    found = check_fit(path.read_bytes(), house.polynomial.coefficients)
    assert found.polynomial == house.polynomial.coefficients
    assert found.rows == count
    assert tuple((float(a), float(b)) for a, b in found.covered) == house.covered


def test_the_order_is_raised_until_the_fit_is_good_enough(tmp_path: Path) -> None:
    orders = {fit(read_measurements(written(tmp_path, seed, 4, 100, 0.0))).orders for seed in range(4)}
    assert orders != {(1, 1)}
    path = written(tmp_path, 2, 4, 60, 0.0)
    assert fitted(path.read_bytes()).polynomial == fit(read_measurements(path)).polynomial.coefficients


@pytest.mark.parametrize("place", [(0, 0), (1, 0)])
@pytest.mark.parametrize("change", [Fraction(2, 5), Fraction(1, 2**52)])
def test_another_polynomial_is_refused(place: tuple[int, int], change: Fraction) -> None:
    right = fitted(MARCH.read_bytes()).polynomial
    i, j = place
    rows = [list(row) for row in right]
    rows[i][j] += change * (1 if change > Fraction(1, 9) else abs(rows[i][j]))
    sentence = rf"^coefficient \[{i}\]\[{j}\] of the calibration must be \S+, as fitted to the measurements, not \S+$"
    with pytest.raises(RejectedError, match=sentence):
        check_fit(MARCH.read_bytes(), rows)


def test_another_order_is_refused() -> None:
    right = fitted(MARCH.read_bytes()).polynomial
    for rows in ([*right, (Fraction(0),)], [(*right[0], Fraction(0)), *right[1:]], right[:1], EQUATION_5A.coefficients):
        with pytest.raises(RejectedError, match=r"^coefficient .* of the calibration must be .*$"):
            check_fit(MARCH.read_bytes(), rows)


def test_other_weights_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path, 6, 1, 40)
    with path.open("a") as file:
        file.write("5.0,2.1,30.0\n")
    robust = fit(read_measurements(path), robust=True).polynomial.coefficients
    with pytest.raises(RejectedError, match=r"^coefficient \[0\]\[0\] of the calibration must be .*$"):
        check_fit(path.read_bytes(), robust)


def test_the_same_reading_of_another_day_counts_again(tmp_path: Path) -> None:
    path = written(tmp_path, 6, 1, 40)
    header, *rows = path.read_text().splitlines()
    dated = [f"2024-03-01,{row}" for row in rows] + [f"2024-03-02,{row}" for row in rows[:5]]
    path.write_text("\n".join([f"date,{header}", *dated, ""]))
    house = fit(read_measurements(path))
    assert check_fit(path.read_bytes(), house.polynomial.coefficients).rows == 45
    path.write_text(path.read_text() + dated[-1])
    with pytest.raises(RejectedError, match=r"^each measurement must be there once$"):
        fitted(path.read_bytes())
    path.write_text(path.read_text().replace("2024-03-02", "2.3.2024"))
    with pytest.raises(RejectedError, match=r"^a measurement must be 3 numbers and a date, not '2\.3\.2024,.*'$"):
        fitted(path.read_bytes())


def with_uncertainties(path: Path, columns: str, seed: int) -> Path:
    """State uncertainties in every row; the first column is of the clearance."""
    rng = np.random.default_rng(seed)
    header, *rows = path.read_text().splitlines()
    count = columns.count(",") + 1
    cells = [",".join(map(str, np.round(10 ** rng.uniform(-3, -0.5, count), 5).tolist())) for _ in rows]
    path.write_text("\n".join([f"{header},{columns}", *map("{},{}".format, rows, cells), ""]))
    return path


@pytest.mark.parametrize(
    "columns", ["uncertainty_mm", "uncertainty_mm,uncertainty_V,uncertainty_C", "uncertainty_C,uncertainty_V"]
)
@pytest.mark.parametrize(("seed", "order"), [(1, 1), (2, 2)])
def test_the_weighted_fit_is_the_one_of_the_house_to_the_last_bit(
    seed: int, order: int, columns: str, tmp_path: Path
) -> None:
    path = written(tmp_path, seed, order, 60, 0.05)
    plain = fit(read_measurements(path))
    house = fit(read_measurements(with_uncertainties(path, columns, seed)))
    assert house.polynomial != plain.polynomial
    assert max(house.weights) == 1
    assert check_fit(path.read_bytes(), house.polynomial.coefficients).polynomial == house.polynomial.coefficients
    with pytest.raises(RejectedError, match=r"^coefficient \[0\]\[0\] of the calibration must be .*$"):
        check_fit(path.read_bytes(), plain.polynomial.coefficients)


@pytest.mark.parametrize(
    ("cells", "sentence", "house"),
    [
        (
            ("0.02", ""),
            "uncertainties must be stated in every row or in none",
            "uncertainties must be stated in every row or in none for the paper's rule, not in 39 of 40",
        ),
        (
            ("0.02", "1e-9"),
            "uncertainties must be within a factor of 1e9 of each other",
            "uncertainties must be within a factor of 1e9 of each other, not 2e\\+10",
        ),
        (
            ("0.02", "0"),
            "an uncertainty must be more than 0, and finite",
            "uncertainty_mm must be more than 0, or empty where it is not known, not '0'",
        ),
    ],
)
def test_uncertainties_that_weigh_nothing(cells: tuple[str, str], sentence: str, house: str, tmp_path: Path) -> None:
    path = written(tmp_path, 6, 1, 40)
    header, *rows = path.read_text().splitlines()
    stated = [f"{row},{cells[k == 7]}" for k, row in enumerate(rows)]
    stated[0] = f"{rows[0]},{20 if '1e-9' in cells else cells[0]}"
    path.write_text("\n".join([f"{header},uncertainty_mm", *stated, ""]))
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        fitted(path.read_bytes())
    with pytest.raises(SpecificationError, match=f": {house}$|, line 9: {house}$"):
        fit(read_measurements(path))


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"\xff", "the measurements must be a CSV file in UTF-8"),
        (b'"', "the measurements must be a CSV file in UTF-8"),
        (b"", "the measurements must be clearance_mm, voltage_V, temperature_C"),
        (b"clearance_mm,voltage_V\n1,2\n", "the measurements must be clearance_mm, voltage_V, temperature_C"),
        (b"1,1,1\n" * 3, "there must be at least 4 measurements, not 3"),
        (b"1,1,1\n2,2,x\n3,3,3\n4,4,4\n", "a measurement must be 3 numbers, not '2,2,x'"),
        (b"1,1,1\n2,2\n3,3,3\n4,4,4\n", "a measurement must be 3 numbers, not '2,2'"),
        (b"1,1,1\n2,2,1e999\n3,3,3\n4,4,4\n", "a measurement must be finite"),
        (b"1,1,1\n2,2,1e300\n3,3,3\n4,4,4\n", "the measurements must be of a size that was measured"),
        (b"1,1,1\n" * 4, "each measurement must be there once"),
        (b"1,1,1\n1,2,1\n1,1,3\n1,2,4\n1,5,5\n", "the clearance of the measurements must vary"),
        (b"1,1,1\n2,2,2\n3,3,3\n4,4,4\n5,5,5\n", "the measurements must determine a linear polynomial"),
    ],
)
def test_files_that_determine_nothing(content: bytes, sentence: str) -> None:
    header = b"clearance_mm,voltage_V,temperature_C\n" if content[:1].isdigit() else b""
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        fitted(header + content)


def test_codes_hold_what_was_measured() -> None:
    found = fitted(b"clearance_mm,voltage_V,temperature_C\n1.1,1.1,1\n2,2,7\n3.9,3.9,2\n4.1,4.1,9\n5,5,100\n")
    voltage = PortEntry(name="v", bits=4, signed=False, lsb=Fraction(1, 2), zero=Fraction(0), unit="V")
    temperature = PortEntry(name="t", bits=4, signed=True, lsb=Fraction(2), zero=Fraction(3), unit="degC")
    assert found.codes((voltage, temperature)) == ((2, 10), (-1, 7))
