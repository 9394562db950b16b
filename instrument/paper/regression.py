"""The paper's regressions, equations 1 to 6: their quality, and what they imply for sensor and temperature."""

from __future__ import annotations

import math
from fractions import Fraction

from sosmith.gen.calibration.acceptance import REQUIRED_R
from sosmith.instrument.paper.comparison import Comparison, Part, compare, plain, table
from sosmith.instrument.paper.figures import PaperFigures
from sosmith.model.polynomial import Polynomial

_VOLTAGES = (0.0, 2.0, 5.0, 8.0, 10.0)  # V
_CLEARANCES = (1.0, 2.0, 3.0, 5.0, 8.0, 10.0)  # mm
_TEMPERATURES = (20.0, 60.0, 98.0)  # degC
_WARMER = (60.0, 73.0, 98.0)
_HOTTEST = _WARMER[-1]

_NO_DATA = "the measurements behind it are not printed"


def regression_parts(figures: PaperFigures) -> list[Part]:
    """Equations 1 to 6."""
    return [_method(figures), *(_equation(figures, name) for name in ("4", "5a", "5b")), _drift(figures)]


def polynomial_of(figures: PaperFigures, equation: str) -> Polynomial:
    """Polynomial of equation "4", "5a" or "5b" as printed: clearance in mm of V and degC."""
    rows = figures.rows(f"equation_{equation}", "coefficients")
    return Polynomial(tuple(tuple(Fraction(value) for value in row) for row in rows))


def voltage_for(polynomial: Polynomial, clearance: float, temperature: float) -> float | None:
    """Voltage in V at which `polynomial`, at most quadratic in V, gives `clearance` in mm; None if below 0 V."""
    rows = [sum(float(a) * temperature**j for j, a in enumerate(row)) for row in polynomial.coefficients]
    c, b, a = (*rows, 0.0)[:3]
    if clearance < c:  # the clearance rises with the voltage, so the voltage would be negative
        return None
    c -= clearance
    return -c / b if a == 0 else (math.sqrt(b * b - 4 * a * c) - b) / (2 * a)


def scatter(figures: PaperFigures, determination: float) -> float:
    """Return the standard deviation in mm implied by an adjusted r^2, for the clearances of table 1."""
    clearances = [float(value) for value in figures.numbers("table_1", "clearance")]
    mean = sum(clearances) / len(clearances)
    spread = math.sqrt(sum((value - mean) ** 2 for value in clearances) / len(clearances))
    return spread * math.sqrt(1 - determination)


def _method(figures: PaperFigures) -> Part:
    required, confidence = figures.number("calibration", "required_r"), figures.number("calibration", "confidence")
    return Part(
        title="Equations 1 to 3",
        where=figures.where("calibration"),
        finding=(
            f"the method of `sosmith calibrate`; to demand $r$ = {required} is to demand $r^2$ = "
            f"{float(required**2):.4f}"
        ),
        before=(
            "Least squares of a polynomial in voltage and temperature, with orders that rise until the adjusted $r$ "
            f"reaches {REQUIRED_R}. [calibration.md](calibration.md) has ours, which solves equation 3 without loss.",
        ),
        comparisons=(
            compare(
                f"confidence that $r$ = {required} stands for", confidence, 100 * Fraction(required) ** 2, "%",
                note="$100 r^2$: the paper's confidence is the share of the variance explained, not a probability",
            ),
        ),
    )  # fmt: skip


def _equation(figures: PaperFigures, equation: str) -> Part:
    name = f"equation_{equation}"
    polynomial = polynomial_of(figures, equation)
    rows = figures.rows(name, "coefficients")
    comparisons: list[Comparison] = [
        compare(f"coefficient of {_powers(i, j)}", value, None, _unit(i, j), note=_NO_DATA)
        for i, row in enumerate(rows)
        for j, value in enumerate(row)
    ]
    r = figures.number(name, "adjusted_r")
    if "adjusted_r_squared" in figures.tables[name]:
        determination = float(figures.number(name, "adjusted_r_squared"))
        comparisons.append(compare("adjusted $r$", r, math.sqrt(determination), note="root of the printed $r^2$"))
    else:
        determination = float(r) ** 2
    comparisons += [
        compare("confidence", figures.number(name, "confidence"), 100 * determination, "%", note="$100 r^2$"),
        compare(
            "scatter of the measurements about it", None, scatter(figures, determination), "mm",
            note="standard deviation that this $r$ means for clearances spread like those of table 1",
        ),
    ]  # fmt: skip
    required = figures.number("calibration", "required_r")
    finding = (
        f"$r$ and confidence are one figure, and mean a scatter of {plain(scatter(figures, determination), 2)} mm; "
        f"{'accepted' if r >= required else 'refused, as the paper says,'} by the rule $r \\ge {required}$"
    )
    return Part(
        title=f"Equation {equation}",
        where=figures.where(name),
        finding=finding,
        before=(f"$${formula(figures, equation)}$$",),
        comparisons=tuple(comparisons),
        after=(_values(polynomial), *_shape(figures, equation, polynomial)),
    )


def formula(figures: PaperFigures, equation: str) -> str:
    """Return the equation as LaTeX, digits as printed."""
    text = "d ="
    for i, row in enumerate(figures.rows(f"equation_{equation}", "coefficients")):
        for j, value in enumerate(row):
            sign = "-" if value < 0 else "" if text == "d =" else "+"
            text += f" {sign} {abs(value)} {_powers(i, j, constant='').strip('$')}"
    return " ".join(text.split())


def _powers(i: int, j: int, constant: str = "1") -> str:
    powers = [letter + (f"^{power}" if power > 1 else "") for letter, power in (("V", i), ("T", j)) if power]
    return f"${' '.join(powers)}$" if powers else constant


def _unit(i: int, j: int) -> str:
    return {(0, 0): "mm", (0, 1): "mm/°C", (1, 0): "mm/V", (1, 1): "mm/(V °C)", (2, 0): "mm/V²"}[i, j]


def _values(polynomial: Polynomial) -> str:
    head = ["clearance in mm at", *(f"{temperature:g} °C" for temperature in _TEMPERATURES)]
    rows = [
        [f"{voltage:g} V", *(f"{float(polynomial(voltage, temperature)):.3f}" for temperature in _TEMPERATURES)]
        for voltage in _VOLTAGES
    ]
    return table(head, rows)


def _shape(figures: PaperFigures, equation: str, polynomial: Polynomial) -> list[str]:
    """Describe where the clearance rises and falls, and which clearances no voltage gives."""
    if polynomial.orders[0] < 2:
        return ["A plane: it rises with voltage and temperature everywhere."]
    name = f"equation_{equation}"
    slopes = [float(row[1]) for row in polynomial.coefficients[:2]]
    turn = -slopes[0] / slopes[1]
    at_turn = float(polynomial(turn, 0.0))
    lowest, highest = (float(value) for value in figures.numbers(name, "temperature"))
    cold, hot = (float(polynomial(0.0, temperature)) for temperature in (lowest, highest))
    text = [
        "The clearance rises with the voltage at every voltage and temperature above zero. With the temperature it "
        f"falls below {turn:.3f} V and rises above; there, at {at_turn:.2f} mm, the temperature has no effect. At 0 V "
        f"it is {cold:.3f} mm at {lowest:g} °C and {hot:.3f} mm at {highest:g} °C: no voltage stands for anything "
        "below."
    ]
    text.append(_unreachable(figures, polynomial) if equation == "4" else _reachable(figures, polynomial))
    return text


def _unreachable(figures: PaperFigures, polynomial: Polynomial) -> str:
    """Explain that the first row of table 1 is below the range of equation 4."""
    warm = float(figures.numbers("table_1", "temperature")[1])
    first = float(figures.numbers("table_1", "clearance")[0])
    least = float(polynomial(0.0, warm))
    return (
        f"Table 1 was measured at up to {warm:g} °C, before equation 5a was there. At that temperature equation 4 "
        f"gives {least:.3f} mm or more from 0 V on, so at the table's first clearance, {first:g} mm, its error would "
        f"be at least {100 * (least - first) / first:.0f} %, and not the "
        f"{plain(figures.numbers('table_1', 'percent')[0])} % printed. So the table comes from another regression, or "
        "from voltages below zero."
    )


def _reachable(figures: PaperFigures, polynomial: Polynomial) -> str:
    """Explain that the first row of table 2 is within the range of equation 5a."""
    cool, warm = (float(value) for value in figures.numbers("table_2", "temperature"))
    least = float(polynomial(0.0, cool))
    return (
        f"At the {cool:g} to {warm:g} °C of table 2 it gives {least:.3f} mm and more, so the table's first clearance, "
        f"{figures.numbers('table_2', 'clearance')[0]} mm, can be read."
    )


def _drift(figures: PaperFigures) -> Part:
    reference = float(figures.number("equation_6", "reference"))
    blocks = []
    for equation in ("4", "5a"):
        polynomial = polynomial_of(figures, equation)
        head = [f"$V - V_R$ in V by equation {equation}, at", *(f"{temperature:g} °C" for temperature in _WARMER)]
        rows = []
        for clearance in _CLEARANCES:
            base = voltage_for(polynomial, clearance, reference)
            cells = []
            for temperature in _WARMER:
                voltage = voltage_for(polynomial, clearance, temperature)
                cells.append("below 0 V" if voltage is None or base is None else f"{voltage - base:+.3f}")
            rows.append([f"{clearance:g} mm", *cells])
        blocks.append(table(head, rows))
    changes = [
        f"{_change(figures, equation, 2.0):+.3f} V at 2 mm and {_change(figures, equation, 10.0):+.3f} V at 10 mm"
        for equation in ("4", "5a")
    ]
    return Part(
        title="Equation 6",
        where=figures.where("equation_6"),
        finding=(
            "figures 4 to 7 have no numbers to compare with; the regressions inverted give the drift of the voltage"
        ),
        before=(
            "Figures 4 to 7 of the paper are pictures without numbers, so there is nothing to set ours beside. What "
            f"the sensor's voltage does from {reference:g} °C on follows from the regressions, solved for the voltage; "
            "equation 6 is its magnitude.",
        ),
        after=(
            *blocks,
            "The paper says that the voltage falls as it gets warmer, little from 0 to 5 mm and much from 5 to 10 mm. "
            f"So does equation 4: from {reference:g} to {_HOTTEST:g} °C the voltage changes by {changes[0]}. Equation "
            f"5a, which took its place, says so only above its turning point: {changes[1]}, so most at small "
            "clearances, and upwards.",
        ),
    )


def _change(figures: PaperFigures, equation: str, clearance: float) -> float:
    """Change of the voltage in V from the reference to the highest temperature."""
    polynomial = polynomial_of(figures, equation)
    reference = float(figures.number("equation_6", "reference"))
    voltages = [voltage_for(polynomial, clearance, temperature) for temperature in (reference, _HOTTEST)]
    assert voltages[0] is not None
    assert voltages[1] is not None
    return voltages[1] - voltages[0]
