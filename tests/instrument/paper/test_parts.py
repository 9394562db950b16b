"""What the document says of each equation and table: key figures by other routes, and labels that notice changes."""

from __future__ import annotations

import copy
import math
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import optimize, signal

from sosmith.gen.filter.design import design, minimum_order
from sosmith.gen.filter.response import group_delay
from sosmith.gen.specification.specification import example, load
from sosmith.instrument.paper.comparison import (
    DIFFERS,
    NEAR,
    NOT_COMPARABLE,
    NOT_PRINTED,
    REPRODUCED,
    UNEXPLAINED,
    Comparison,
    Part,
)
from sosmith.instrument.paper.difference_equation import section_filters, step_response
from sosmith.instrument.paper.document import markdown, paper_parts
from sosmith.instrument.paper.figures import PaperFigures, read_paper_figures
from sosmith.instrument.paper.regression import polynomial_of, scatter, voltage_for
from sosmith.instrument.paper.seventh_order import proper_cutoff
from sosmith.instrument.paper.vehicle import run_of_ours
from sosmith.instrument.paper.vehicle_comparison import run_comparison
from sosmith.model.polynomial import EQUATION_5A
from sosmith.model.reference.accuracy import accuracy_percent

pytestmark = pytest.mark.slow  # everything of the paper is computed anew

FIGURES = read_paper_figures()


@pytest.fixture(scope="module")
def parts() -> dict[str, Part]:
    return by_title(FIGURES)


def by_title(figures: PaperFigures) -> dict[str, Part]:
    every = [part for group in paper_parts(figures).values() for part in group]
    titles = {part.title: part for part in every}
    assert len(titles) == len(every)
    return titles


def one(part: Part, quantity: str) -> Comparison:
    (found,) = [comparison for comparison in part.comparisons if comparison.quantity == quantity]
    return found


def labels(part: Part) -> set[str]:
    return {comparison.label for comparison in part.comparisons} - {NOT_PRINTED}


def ours(part: Part, quantity: str) -> float:
    value = one(part, quantity).ours
    assert value is not None
    return float(value)


def test_everything_that_differs_is_explained(parts: dict[str, Part]) -> None:
    assert [part.title for part in parts.values() for c in part.comparisons if c.explanation == UNEXPLAINED] == []


def test_every_table_and_equation_is_there(parts: dict[str, Part]) -> None:
    text = " ".join(parts).lower()
    assert [number for number in range(1, 11) if f"table {number}" not in text] == []
    expected = ("1 to 3", "4", "5a", "5b", "6", "7", "8 and 9", "10 and 11", "12 and 13", *map(str, range(14, 17)))
    expected = (*expected, "17 and 18", *map(str, range(19, 25)))
    assert [number for number in expected if f"quations {number}" not in text and f"quation {number}" not in text] == []


@pytest.mark.parametrize("title", ["Table 1", "Table 2", "Equation 15", "Equation 21"])
def test_what_is_reproduced_throughout(parts: dict[str, Part], title: str) -> None:
    assert labels(parts[title]) == {REPRODUCED}


def test_table_10_follows_from_equation_22(parts: dict[str, Part]) -> None:
    part = parts["Equation 23 and table 10"]
    assert [c.label for c in part.comparisons[:16]] == [REPRODUCED] * 16
    assert one(part, r"$a_0$ by table 9's $\Omega_c$").label == NEAR


def test_equation_18_follows_from_equation_16(parts: dict[str, Part]) -> None:
    part = parts["Equations 17 and 18"]
    assert [c.label for c in part.comparisons[:12]] == [REPRODUCED] * 12
    printed = [float(v) for v in FIGURES.numbers("equation_16", "denominator")]
    expected = signal.cont2discrete(([1.0], printed), 0.167, method="bilinear")
    np.testing.assert_allclose([ours(part, f"numerator of $z^{{{-k}}}$") for k in range(6)], expected[0][0], rtol=1e-9)
    np.testing.assert_allclose([ours(part, f"denominator of $z^{{{-k}}}$") for k in range(6)], expected[1], rtol=1e-9)


def test_gain_and_poles_of_the_5th_order_filter(parts: dict[str, Part]) -> None:
    part = parts["Equations 17 and 18"]
    a = [float(v) for v in FIGURES.numbers("equation_18", "denominator")]
    radii = sorted({round(abs(pole), 6) for pole in np.roots(a)}, reverse=True)
    assert [round(radius, 3) for radius in radii] == [0.839, 0.612, 0.522]
    shown = [float(c.ours or 0) for c in part.comparisons if c.quantity.startswith("pole radius")]
    assert shown == pytest.approx(radii, abs=1e-6)
    assert round(ours(part, "gain at 0 Hz, as printed"), 4) == 0.9951
    assert round(ours(parts["Equation 19"], "gain at 0 Hz, as printed"), 4) == 0.9935
    assert ours(part, r"numerator of $z^0$ by table 3's $\Omega_c$") == pytest.approx(5.57e-5, rel=1e-3)


def test_order_and_cutoff_of_table_3(parts: dict[str, Part]) -> None:
    assert signal.buttord(1.328, 6.1287, 0.1, 40, analog=True)[0] == 5
    part = parts["Equations 12 and 13"]
    assert round(ours(part, "order before rounding up, pass-band loss 0.1 dB"), 2) == 4.24
    assert round(ours(part, "order before rounding up, pass-band loss 0.17 dB"), 2) == 4.06
    assert minimum_order(0.1, 0.9, 0.1, 40, 6)[0] == math.ceil(ours(part, "order for the edges stated, 0.1 and 0.9 Hz"))
    loss = 10 * math.log10(1 + (1.328 / ours(part, r"$\Omega_c$ by equation 13, loss 0.1 dB, $N = 5$")) ** 10)
    assert loss == pytest.approx(0.1)
    table = parts["Table 3"]
    assert [one(table, name).label for name in ("$N$", r"$\Omega_c$", r"$\omega_c$", "$A_p$")] == [
        REPRODUCED, DIFFERS, DIFFERS, DIFFERS,
    ]  # fmt: skip


def test_the_cutoff_of_equation_16_is_not_table_3s(parts: dict[str, Part]) -> None:
    assert [c.label for c in parts["Equation 16"].comparisons] == [DIFFERS] * 5 + [REPRODUCED] * 5


def test_the_prewarping_of_table_9(parts: dict[str, Part]) -> None:
    part = parts["Table 9"]
    assert ours(part, r"$\Omega_p$") == pytest.approx(64.98, abs=0.005)
    assert ours(part, r"$\Omega_p$, tangent of degrees") == pytest.approx(200 * math.tan(0.1 * math.pi * math.pi / 180))
    assert one(part, r"$\Omega_a$").label == NOT_COMPARABLE
    assert one(part, "$A_a$").label == one(part, "$A_p$").label == one(part, "$N$").label == DIFFERS
    assert signal.buttord(1.1, 5.48, 0.02, 60, analog=True)[0] == ours(part, "$N$") == 6
    # 0.02 dB at the edge of the pre-warped filter, by scipy's own design
    cutoff = 100 / math.pi * math.atan(proper_cutoff(FIGURES) / 200)
    response = signal.sosfreqz(signal.butter(7, cutoff, fs=100, output="sos"), [10.0], fs=100)[1]
    assert -20 * math.log10(abs(response[0])) == pytest.approx(0.02, rel=1e-9)
    assert (round(cutoff, 2), round(proper_cutoff(FIGURES), 2)) == (14.17, 95.42)


def test_delay_overshoot_and_sections_are_those_of_the_example(tmp_path: Path) -> None:
    path = tmp_path / "example.toml"
    path.write_text(example(), encoding="utf-8")
    spec = load(path)
    assert spec.filter is not None
    sos = design(spec.filter, float(spec.sample_rate)).sos
    np.testing.assert_allclose(
        [[float(value) for value in denominator[1:]] for _, denominator in section_filters(FIGURES)[:3]],
        [row[4:] for row in sos[:0:-1]],
        rtol=1e-8,
    )
    assert group_delay(sos, np.array([0.0]), 100.0)[0] == pytest.approx(2.7638, abs=5e-5)
    assert step_response(FIGURES)[1].max() == pytest.approx(1.1541, abs=5e-5)


def test_delay_is_not_10_ms(parts: dict[str, Part]) -> None:
    delay = one(parts["Delay and accuracy of the 7th-order filter"], "delay")
    assert (delay.label, round(float(delay.ours or 0), 2)) == (DIFFERS, 2.76)


def test_unstable_gain_of_table_10(parts: dict[str, Part]) -> None:
    part = parts["Equation 23 and table 10"]
    assert ours(part, "gain at 0 Hz, as printed") == pytest.approx(-2.33e-11, rel=2e-3)
    assert ours(part, "sum of the denominator, as printed") == -0.0125


def test_accuracies_by_the_measure_of_the_reports(parts: dict[str, Part]) -> None:
    for name, expected in (("table_1", 96.1826), ("table_2", 96.5335), ("table_4", 96.8810)):
        truth = np.array([float(v) for v in FIGURES.numbers(name, "clearance")])
        error = np.array([float(v) for v in FIGURES.numbers(name, "error")])
        part = parts[name.replace("_", " ").capitalize()]
        assert accuracy_percent(truth * (1 + error), truth) == pytest.approx(ours(part, "accuracy stated"), abs=1e-9)
        assert round(ours(part, "accuracy stated"), 4) == expected
        assert accuracy_percent(truth + error, truth) == pytest.approx(
            ours(part, "accuracy if the errors are in mm"), abs=1e-9
        )
    assert one(parts["Table 4"], "accuracy stated").label == DIFFERS
    assert one(parts["Accuracies of the abstract"], "filtered in real time").label == NOT_COMPARABLE


def test_regressions() -> None:
    polynomial = polynomial_of(FIGURES, "5a")
    assert polynomial == EQUATION_5A
    for clearance, temperature in ((2.0, 20.0), (5.0, 98.0), (10.0, 60.0)):
        found = optimize.brentq(lambda v, d=clearance, t=temperature: float(polynomial(v, t)) - d, 0, 20)
        assert voltage_for(polynomial, clearance, temperature) == pytest.approx(found, rel=1e-9)
    # the theory's figures for 2, 5 and 10 mm
    assert [round(voltage_for(polynomial, d, 20.0) or 0, 4) for d in (2, 5, 10)] == [1.8656, 5.5601, 9.5353]
    assert voltage_for(polynomial, 1.0, 20.0) is None
    assert scatter(FIGURES, 0.9709) == pytest.approx(math.sqrt(0.0291 * 8.25))


def test_wear(parts: dict[str, Part]) -> None:
    part = parts["Wear depth $s_w$"]
    assert (one(part, "$s_{w,max}$").label, ours(part, "$s_{w,max}$")) == (DIFFERS, 11)


CHANGES = [
    ("table_1", "accuracy", None, "Table 1"),
    ("table_1", "error", 3, "Table 1"),
    ("table_2", "percent", 17, "Table 2"),
    ("table_3", "order", None, "Table 3"),
    ("table_4", "percent", 0, "Table 4"),
    ("table_9", "angular_cutoff", None, "Table 9"),
    ("table_9", "prewarped_p", None, "Table 9"),
    ("table_10", "denominator", 7, "Equation 23 and table 10"),
    ("table_10", "numerator", 4, "Equation 23 and table 10"),
    ("equation_4", "adjusted_r", None, "Equation 4"),
    ("equation_5b", "confidence", None, "Equation 5b"),
    ("equation_15", "denominator", 2, "Equation 15"),
    ("equation_16", "denominator", 1, "Equation 16"),
    ("equation_18", "numerator", 2, "Equations 17 and 18"),
    ("equation_19", "output", 1, "Equation 19"),
    ("equation_21", "denominator", 6, "Equation 21"),
    ("equation_24", "output", 6, "Equation 24"),
    ("table_8", "vertical_frame", None, "Table 8"),
    ("wear", "largest_wear", None, "Wear depth $s_w$"),
]


@pytest.mark.sweep(6)
@pytest.mark.parametrize(("table", "name", "index", "title"), CHANGES)
def test_a_wrong_figure_in_the_data_changes_a_label(
    parts: dict[str, Part], table: str, name: str, index: int | None, title: str
) -> None:
    tables = copy.deepcopy(dict(FIGURES.tables))
    factor = Decimal("1.04")
    if index is None:
        tables[table][name] = Decimal(tables[table][name]) * factor  # type: ignore[index]
    else:
        tables[table][name][index] = Decimal(tables[table][name][index]) * factor
    changed = by_title(PaperFigures(tables))[title]
    assert changed.count(REPRODUCED) < parts[title].count(REPRODUCED)


def test_no_figure_of_the_data_is_left_out() -> None:
    """Each printed figure has a part in the document: with another one, it reads otherwise."""
    text = markdown(FIGURES)
    unused = []
    for table, names in FIGURES.tables.items():
        for name in names:
            if name == "where":
                continue
            tables = copy.deepcopy(dict(FIGURES.tables))
            tables[table] = {**tables[table], name: _changed(tables[table][name])}
            if markdown(PaperFigures(tables)) == text:
                unused.append(f"{table}.{name}")
    assert unused == []


def _changed(value: Any) -> Any:
    if isinstance(value, list):
        return [*value[:-1], _changed(value[-1])]
    return value + 1 if isinstance(value, int) else value * Decimal("1.01")


def test_the_vehicle_has_a_figure_for_each_printed_one(parts: dict[str, Part]) -> None:
    for number, motions in ((5, ("vertical",)), (6, ("lateral",)), (7, ("yaw",)), (8, ("vertical", "lateral", "yaw"))):
        part, name = parts[f"Table {number}"], f"table_{number}"
        if number == 8:
            printed = [value for motion in motions for value in FIGURES.numbers(name, motion)]
        else:
            printed = [value for motion in motions for row in FIGURES.rows(name, motion) for value in row]
        printed += [FIGURES.number(name, "frame")] if number == 5 else []
        simulated = part.comparisons[-len(printed) :]
        assert sorted(one.printed for one in simulated if one.printed is not None) == sorted(printed)
        assert all(one.ours is not None for one in simulated)


def test_the_command_and_the_document_label_the_vehicle_alike(parts: dict[str, Part]) -> None:
    """One rule and one place: `sosmith vehicle` shows the rows of the document."""
    rows = run_comparison(run_of_ours(), FIGURES)
    for number, comparisons in rows.items():
        assert parts[f"Table {number}"].comparisons[-len(comparisons) :] == comparisons
    assert {one.label for one in (*rows[5], *rows[7])} == {DIFFERS}
    assert {one.label for one in (*rows[6], *rows[8])} == {NOT_COMPARABLE}
