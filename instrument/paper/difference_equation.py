"""The paper's 7th-order filter as a difference equation: table 10, equations 23 and 24, stability; and as sections."""

from __future__ import annotations

import math

import numpy as np
from scipy import signal

from sosmith.instrument.paper.arithmetic import (
    Coefficients,
    bilinear,
    butterworth_factors,
    dc_gain,
    digits_for_stability,
    pole_radii,
    rounded,
    scaled,
)
from sosmith.instrument.paper.comparison import Comparison, Part, compare, decimal_of, plain, table
from sosmith.instrument.paper.fifth_order import exact
from sosmith.instrument.paper.figures import PaperFigures
from sosmith.instrument.paper.seventh_order import (
    ORDER,
    delay,
    equation_22_filter,
    period,
    stated_cutoff,
    table_9_filter,
)

_SETTLED = 0.01  # of a step: settling tolerance


def difference_equation_parts(figures: PaperFigures) -> list[Part]:
    """Table 10, equation 24 and the delay, in the order of the paper."""
    return [_table_10(figures), _sections(figures), _equation_24(figures), _delay(figures)]


def printed_filter(figures: PaperFigures) -> tuple[Coefficients, Coefficients]:
    """Return the filter of table 10, as printed."""
    return exact(figures, "table_10", "numerator"), exact(figures, "table_10", "denominator")


def section_filters(figures: PaperFigures) -> list[tuple[Coefficients, Coefficients]]:
    """Exact sections of the filter with table 9's cutoff, highest Q first; each has a gain of 1 at 0 Hz."""
    cutoff = stated_cutoff(figures)
    return [bilinear(scaled(factor, cutoff), period(figures)) for factor in butterworth_factors(ORDER)]


def _table_10(figures: PaperFigures) -> Part:
    ours, stated = equation_22_filter(figures), table_9_filter(figures)
    printed = printed_filter(figures)
    comparisons = [
        compare(f"${letter}_{k}$", value, ours[i][k], note="equation 22 as printed, transformed exactly")
        for i, (letter, name) in enumerate((("a", "numerator"), ("b", "denominator")))
        for k, value in enumerate(figures.numbers("table_10", name))
    ]
    comparisons.append(
        compare(
            r"$a_0$ by table 9's $\Omega_c$", figures.numbers("table_10", "numerator")[0], stated[0][0],
            note="table 9 rounds the cutoff, see equation 22",
        )
    )  # fmt: skip
    radii = pole_radii(printed[1])
    digits = digits_for_stability(stated[1])
    comparisons += _stability(figures, radii, digits)
    tenfold = math.log(10) / math.log(radii[0])
    head = ["i", "$a_i$", "$b_i$"]
    rows = [
        [str(k), f"{decimal_of(a):.18e}", f"{decimal_of(b):.18f}"] for k, (a, b) in enumerate(zip(*stated, strict=True))
    ]
    return Part(
        title="Equation 23 and table 10",
        where=figures.where("table_10"),
        finding=(
            f"every coefficient is right to its last digit, and the filter is unstable: the largest pole radius is "
            f"{radii[0]:.3f}, and {digits} digits are the fewest that keep it stable"
        ),
        comparisons=tuple(comparisons),
        after=(
            f"As printed, the output grows tenfold every {tenfold:.1f} samples. The poles lie so close to $z = 1$ that "
            f"the denominator there is the {float(sum(stated[1])):.2g} left over from terms of up to "
            f"{max(abs(float(b)) for b in stated[1]):.0f}, so each of its digits counts. The filter by table 9's "
            "cutoff, exactly:",
            table(head, rows),
            _digit_table(stated),
            "![Poles of table 10](images/paper_poles.svg)",
        ),
    )


def _stability(figures: PaperFigures, radii: list[float], digits: int) -> list[Comparison]:
    printed, stated = printed_filter(figures), table_9_filter(figures)
    return [
        *(
            compare("pole radius, as printed", None, radius, note="unstable" if radius >= 1 else "")
            for radius in _different(radii)
        ),
        *(compare("pole radius, exact", None, radius) for radius in _different(pole_radii(stated[1]))),
        compare("sum of the denominator, as printed", None, sum(printed[1])),
        compare("sum of the denominator, exact", None, sum(stated[1])),
        compare("gain at 0 Hz, as printed", None, dc_gain(*printed), note="and of the wrong sign"),
        compare("gain at 0 Hz, exact", None, dc_gain(*stated)),
        compare(
            "digits of the denominator for stability",
            None,
            digits,
            note="significant digits of each coefficient; with any more, up to 40, it stays stable",
        ),
    ]


def _different(radii: list[float]) -> list[float]:
    """Radii without duplicates: conjugate poles have the same one."""
    return sorted({round(radius, 9) for radius in radii}, reverse=True)


def _digit_table(filter_: tuple[Coefficients, Coefficients]) -> str:
    """Tabulate the largest pole radius and the gain for denominators rounded to increasing numbers of digits."""
    rows = []
    for digits in (4, 8, 12, 14, 15, 16, 17, 20):
        denominator = rounded(filter_[1], digits)
        radius = pole_radii(denominator)[0]
        gain = plain(dc_gain(filter_[0], denominator), 6) if sum(denominator) else "infinite"
        rows.append([str(digits), f"{radius:.6f}", "stable" if radius < 1 else "unstable", gain])
    return table(["digits of the denominator", "largest pole radius", "", "gain at 0 Hz"], rows)


def _sections(figures: PaperFigures) -> Part:
    sections = section_filters(figures)
    rows = []
    for k, (numerator, denominator) in enumerate(sections):
        a = [f"{float(value):.12f}" for value in denominator[1:]]
        quality = 1 / (2 * math.sin(math.pi * (2 * k + 1) / (2 * ORDER))) if len(denominator) == 3 else None
        rows.append(
            [
                str(k),
                "first order" if quality is None else f"{quality:.5f}",
                f"{float(numerator[0]):.6e}",
                *[*a, "-"][:2],
                f"{pole_radii(denominator)[0]:.6f}",
                str(digits_for_stability(denominator)),
            ]
        )
    gain = math.prod(dc_gain(*section) for section in sections)
    return Part(
        title="The same filter in sections",
        where="not in the paper",
        finding=(
            f"in sections the same filter is stable with {max(int(row[-1]) for row in rows)} digits of each "
            f"coefficient, and its gain at 0 Hz is {gain} exactly"
        ),
        before=(
            "What `sosmith` builds for the cutoff of table 9: sections of second order, "
            r"$b_0 (1 + z^{-1})^2 / (1 + a_1 z^{-1} + a_2 z^{-2})$, and one of first. In fractions their product "
            "is the filter above, coefficient by coefficient. How many bits each needs follows from the error allowed: "
            "`sosmith design`.",
        ),
        after=(
            table(
                ["section", "Q", "$b_0$", "$a_1$", "$a_2$", "pole radius", "digits for stability"],
                rows,
            ),
        ),
    )


def _equation_24(figures: PaperFigures) -> Part:
    inputs, outputs = (figures.numbers("equation_24", name) for name in ("input", "output"))
    numerator, denominator = printed_filter(figures)
    delays = figures.numbers("equation_24", "input_delays")
    comparisons = [
        compare(f"coefficient of $x(n-{k})$", printed, numerator[k], note="table 10")
        for k, printed in enumerate(inputs)
    ]
    comparisons += [
        compare(f"coefficient of $y(n-{k})$", printed, -denominator[k], note="table 10")
        for k, printed in enumerate(outputs, start=1)
    ]
    comparisons.append(
        compare(
            "delay of the last input term", delays[-1], len(delays) - 1, "samples",
            note="a slip of writing: there is a term of that delay already",
        )
    )  # fmt: skip
    return Part(
        title="Equation 24",
        where=figures.where("equation_24"),
        finding=(
            f"table 10 solved for $y(n)$; its last input term must be $x(n-{len(delays) - 1})$, not $x(n-{delays[-1]})$"
        ),
        comparisons=tuple(comparisons),
    )


def step_response(figures: PaperFigures) -> tuple[np.ndarray, np.ndarray]:
    """Time in s and output of the filter with table 9's cutoff for a step of height 1."""
    rows = []
    for numerator, denominator in section_filters(figures):
        padded = [[*map(float, values), 0.0][:3] for values in (numerator, denominator)]
        rows.append([*padded[0], *padded[1]])
    sampling = float(period(figures))
    time = np.arange(round(20 / sampling)) * sampling
    return time, np.asarray(signal.sosfilt(np.array(rows), np.ones(len(time))), dtype=np.float64)


def _delay(figures: PaperFigures) -> Part:
    stated = figures.number("equation_24", "delay")
    ours = delay(float(stated_cutoff(figures)))
    time, output = step_response(figures)
    half = float(time[np.argmax(output >= 0.5)])
    settled = float(time[len(output) - np.argmax(np.abs(output[::-1] - 1) > _SETTLED)])
    samples = float(stated) / float(period(figures))
    return Part(
        title="Delay and accuracy of the 7th-order filter",
        where="section 5.5",
        finding=f"the filter delays slow changes by {ours:.2f} s, not by {1000 * stated:.0f} ms",
        comparisons=(
            compare(
                "delay", stated, ours, "s",
                note="ours is the group delay at 0 Hz, the coefficient of $s$ in equation 22. The stated one, "
                f"{samples:.0f} sample, is laid to computing time; the filter's own is not mentioned",
            ),
            compare("half of a step is reached after", None, half, "s"),
            compare("overshoot of a step", None, 100 * (float(output.max()) - 1), "%"),
            compare(f"within {100 * _SETTLED:g} % of a step for good after", None, settled, "s"),
            compare(
                "accuracy of the filtered readings", figures.number("equation_24", "accuracy"), None, "%",
                note="figure 19 is a picture; neither its readings nor the true clearances are printed",
            ),
        ),
        after=(
            f"Wear is slow, and does not mind the delay. A clearance that changes by 1 mm in a minute is read "
            f"{ours / 60:.3f} mm off.",
        ),
    )  # fmt: skip
