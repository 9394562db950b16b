"""The paper's 5th-order filter, equations 8 to 19 and table 3."""

from __future__ import annotations

import math
from fractions import Fraction

from sosmith.instrument.paper.arithmetic import (
    Coefficients,
    bilinear,
    butterworth_polynomial,
    cutoff_for,
    cutoffs_of,
    dc_gain,
    gain_db,
    order_needed,
    pole_radii,
    prewarped,
    scaled,
)
from sosmith.instrument.paper.comparison import Comparison, Part, compare, plain, table
from sosmith.instrument.paper.figures import PaperFigures

ORDER = 5


def fifth_order_parts(figures: PaperFigures) -> list[Part]:
    """Equations 8 to 19 and table 3, in the order of the paper."""
    return [
        _general(figures),
        _prewarping(figures),
        _order_and_cutoff(figures),
        _table_3(figures),
        _equation_14(),
        normalised_part(figures, "equation_15", ORDER),
        _equation_16(figures),
        _equation_18(figures),
        _equation_19(figures),
    ]


def exact(figures: PaperFigures, table_name: str, name: str) -> Coefficients:
    """Return printed coefficients as fractions."""
    return tuple(map(Fraction, figures.numbers(table_name, name)))


def normalised_part(figures: PaperFigures, equation: str, order: int) -> Part:
    """Equation 15 or 21: the normalised Butterworth polynomial."""
    comparisons = [
        compare(f"coefficient of $s^{order - k}$", printed, ours)
        for k, (printed, ours) in enumerate(
            zip(figures.numbers(equation, "denominator"), butterworth_polynomial(order), strict=True)
        )
    ]
    return Part(
        title=equation.replace("_", " ").capitalize(),
        where=figures.where(equation),
        finding="right: the poles on the left half of the unit circle, multiplied out",
        comparisons=tuple(comparisons),
    )


def mean_cutoff(figures: PaperFigures) -> float:
    """Mean of the pre-warped edges printed in the text, in rad/s: the cutoff in equation 16."""
    edges = [float(figures.number("equation_10", f"prewarped_{band}_edge")) for band in ("passband", "stopband")]
    return 2 * math.pi * sum(edges) / 2


def table_3_filter(figures: PaperFigures) -> tuple[Coefficients, Coefficients]:
    """Digital filter with the cutoff of table 3 and the sample rate of the text."""
    cutoff = Fraction(figures.number("table_3", "prewarped_cutoff"))
    return bilinear(scaled(butterworth_polynomial(ORDER), cutoff), 1 / Fraction(_rate(figures)))


def equation_16_filter(figures: PaperFigures) -> tuple[Coefficients, Coefficients]:
    """Digital filter from equation 16 as printed, with the sampling period printed with equation 17."""
    return bilinear(exact(figures, "equation_16", "denominator"), Fraction(figures.number("equation_17", "period")))


def _rate(figures: PaperFigures) -> int:
    return int(figures.number("equation_10", "sample_rate"))


def _edges(figures: PaperFigures) -> tuple[float, float]:
    return (
        float(figures.number("equation_10", "passband_edge")),
        float(figures.number("equation_10", "stopband_edge")),
    )


def _general(figures: PaperFigures) -> Part:
    return Part(
        title="Equations 8 and 9",
        where="section 4",
        finding="general forms without figures",
        before=(
            "Equation 8 is the general recursive filter, equation 9 the squared magnitude of a Butterworth low-pass, "
            r"$|H_N(j\omega)|^2 = 1 / (1 + (\omega/\omega_c)^{2N})$. Both hold as printed, and neither has a figure. "
            '(Section 3.3 says "Equation (8)" where it means equation 7.)',
        ),
    )


def _prewarping(figures: PaperFigures) -> Part:
    period = 1 / _rate(figures)
    passband, stopband = _edges(figures)
    named = {band: figures.number("equation_10", f"prewarped_{band}_edge") for band in ("passband", "stopband")}
    used = math.atan(math.pi * float(named["passband"]) * period) / (math.pi * period)
    return Part(
        title="Equations 10 and 11",
        where=figures.where("equation_10"),
        finding=f"the pre-warped pass-band edge belongs to {used:.2f} Hz, not to the {passband:g} Hz stated",
        before=(
            r"$$\Omega = \frac{2}{\tau_s} \tan \frac{\omega \tau_s}{2}$$",
            'The text gives two frequencies in Hz that "show the warping effect".',
        ),
        comparisons=(
            compare("sampling period", figures.number("equation_10", "period"), Fraction(1, _rate(figures)), "s"),
            compare(
                f"{passband:g} Hz, pre-warped", named["passband"], prewarped(passband, period) / (2 * math.pi), "Hz",
                note=f"so low there is hardly any warping; the printed figure belongs to an edge of {used:.4f} Hz",
            ),
            compare(
                f"{stopband:g} Hz, pre-warped", named["stopband"], prewarped(stopband, period) / (2 * math.pi), "Hz",
            ),
            *(
                compare(
                    rf"$\Omega_{letter} / 2\pi$ by table 3", named[band],
                    float(figures.number("table_3", f"prewarped_{band}_edge")) / (2 * math.pi), "Hz",
                    note="which is how the printed figures can be meant",
                )
                for letter, band in (("p", "passband"), ("a", "stopband"))
            ),
        ),
    )  # fmt: skip


def _order_and_cutoff(figures: PaperFigures) -> Part:
    edge, other = (float(figures.number("table_3", f"prewarped_{band}_edge")) for band in ("passband", "stopband"))
    stop = float(figures.number("equation_12", "stopband_loss"))
    losses = {where: float(figures.number(where, "passband_loss")) for where in ("equation_12", "table_3")}
    orders = {where: order_needed(edge, other, loss, stop) for where, loss in losses.items()}
    stated = _edges(figures)
    proper = [prewarped(edge, 1 / _rate(figures)) for edge in stated]
    low = order_needed(proper[0], proper[1], losses["equation_12"], stop)
    rows = [
        compare(
            f"order before rounding up, pass-band loss {loss:g} dB", None, orders[where],
            note="edges of table 3",
        )
        for where, loss in losses.items()
    ]  # fmt: skip
    rows.append(
        compare(
            f"order for the edges stated, {stated[0]:g} and {stated[1]:g} Hz",
            None,
            low,
            note=f"so {math.ceil(low)} would be enough",
        )
    )
    rows += [
        compare(
            f"$\\Omega_c$ by equation 13, loss {loss:g} dB, $N = {ORDER}$", None,
            cutoff_for(edge, loss, ORDER), "rad/s",
        )
        for loss in losses.values()
    ]  # fmt: skip
    return Part(
        title="Equations 12 and 13",
        where=figures.where("equation_12"),
        finding=f"{orders['equation_12']:.2f} poles are needed, rounded up to {math.ceil(orders['equation_12'])}",
        before=(
            r"$$N = \frac{\log \sqrt{(10^{0.1 A_a} - 1) / (10^{0.1 A_p} - 1)}}{\log (\Omega_a / \Omega_p)}, \qquad "
            r"\Omega_c = \frac{\Omega_p}{(10^{0.1 A_p} - 1)^{1/2N}}$$",
        ),
        comparisons=tuple(rows),
    )


def _table_3(figures: PaperFigures) -> Part:
    def printed(name: str, quantity: str, ours: float | Fraction | None, unit: str = "", note: str = "") -> Comparison:
        return compare(quantity, figures.number("table_3", name), ours, unit, note=note)

    period = 1 / _rate(figures)
    passband, stopband = _edges(figures)
    edge, other = (float(figures.number("table_3", f"prewarped_{band}_edge")) for band in ("passband", "stopband"))
    loss, stop = (float(figures.number("table_3", f"{band}_loss")) for band in ("passband", "stopband"))
    cutoff = float(figures.number("table_3", "prewarped_cutoff"))
    fitting = 10 * math.log10(1 + (edge / cutoff) ** (2 * ORDER))
    middle = math.pi * (passband + stopband)
    return Part(
        title="Table 3",
        where=figures.where("table_3"),
        finding=(
            r"$\omega_c$ is the mean of the edges; $\Omega_p$ and $\Omega_c$ do not follow from the stated edges "
            r"and losses"
        ),
        comparisons=(
            printed("stopband_edge_over_pi", r"$\omega_a / \pi$", 2 * stopband, "rad/s"),
            printed("passband_edge_over_pi", r"$\omega_p / \pi$", 2 * passband, "rad/s"),
            printed(
                "cutoff", r"$\omega_c$", 2 * math.pi * stopband, "rad/s",
                f'by the text, "$f_c = f_a$". What is printed is the mean of the two edges, {middle:.4f} rad/s',
            ),
            printed("stopband_loss", "$A_a$", Fraction(figures.number("equation_12", "stopband_loss")), "dB"),
            printed(
                "passband_loss", "$A_p$", Fraction(figures.number("equation_12", "passband_loss")), "dB",
                "ours is that of the text",
            ),
            printed(
                "prewarped_passband_edge", r"$\Omega_p$", prewarped(passband, period), "rad/s",
                f"equation 10 with {passband:g} Hz; see there",
            ),
            printed(
                "prewarped_stopband_edge", r"$\Omega_a$", prewarped(stopband, period), "rad/s",
                f"equation 11 with {stopband:g} Hz",
            ),
            printed("order", "$N$", math.ceil(order_needed(edge, other, loss, stop)), "", r"by the printed $\Omega$"),
            printed(
                "prewarped_cutoff", r"$\Omega_c$", cutoff_for(edge, loss, ORDER), "rad/s",
                f"equation 13 with the table's $\\Omega_p$ and $A_p$. With the text's "
                f"{figures.number('equation_12', 'passband_loss')} dB it is "
                f"{cutoff_for(edge, float(figures.number('equation_12', 'passband_loss')), ORDER):.3f} rad/s; "
                f"the printed figure needs {fitting:.3f} dB",
            ),
        ),
    )  # fmt: skip


def _equation_14() -> Part:
    right = [k for k in range(ORDER) if math.cos(math.pi * (2 * k + 1) / ORDER) > 0]
    return Part(
        title="Equation 14",
        where="section 4.1",
        finding="as printed it is not a Butterworth filter: the square is missing",
        before=(
            f"$H(jP) = 1 / (1 + (jP)^N)$ has its $N$ poles all around the unit circle; for $N = {ORDER}$, {len(right)} "
            "of them lie in the right half, so it would be unstable. Equation 9 asks for "
            r"$|H|^2 = 1 / (1 + P^{2N})$: with $s = jP$ that is $H(s) H(-s) = 1 / (1 + (s/j)^{2N})$, of whose $2N$ "
            "poles $H(s)$ takes the $N$ in the left half. Equations 15 and 21 are made that way.",
        ),
    )


def _equation_16(figures: PaperFigures) -> Part:
    printed = figures.numbers("equation_16", "denominator")
    polynomial = butterworth_polynomial(ORDER)
    stated, mean = float(figures.number("table_3", "prewarped_cutoff")), mean_cutoff(figures)
    edges = [figures.number("equation_10", f"prewarped_{band}_edge") for band in ("passband", "stopband")]
    comparisons = []
    for cutoff, note in ((stated, "the cutoff of table 3"), (mean, "the mean of the pre-warped edges")):
        ours = scaled(polynomial, Fraction(cutoff))
        comparisons += [
            compare(
                f"$s^{ORDER - k}$, $\\Omega_c$ = {cutoff:.4g}", printed[k], ours[k], f"$\\text{{s}}^{ORDER - k}$",
                note=note,
            )
            for k in range(ORDER)
        ]  # fmt: skip
    return Part(
        title="Equation 16",
        where=figures.where("equation_16"),
        finding=(
            f"its $\\Omega_c$ is the mean of both pre-warped edges, {mean:.4g} rad/s, not table 3's {stated:g} rad/s"
        ),
        before=(
            r"Each coefficient gives the cutoff it was made with, $\Omega_c = (c_k / \text{printed})^{1/k}$: "
            + ", ".join(f"{cutoff:.4f}" for cutoff in cutoffs_of(polynomial, printed))
            + f" rad/s. The mean of {edges[0]} and {edges[1]} Hz is {mean:.4f} rad/s. "
            r"In table 3 the mean stands for $\omega_c$ too.",
        ),
        comparisons=tuple(comparisons),
        after=(_losses(figures),),
    )


def _losses(figures: PaperFigures) -> str:
    """Loss at the edges for each filter that the paper may mean."""
    rate = float(_rate(figures))
    passband, stopband = _edges(figures)
    printed = exact(figures, "equation_18", "numerator"), exact(figures, "equation_18", "denominator")
    filters = {
        r"table 3, $\Omega_c$ = " + f"{figures.number('table_3', 'prewarped_cutoff')}": (table_3_filter(figures), rate),
        "equation 16": (equation_16_filter(figures), 1 / float(figures.number("equation_17", "period"))),
        "equation 18 as printed": (printed, 1 / float(figures.number("equation_17", "period"))),
    }
    rows = [
        [name, *(f"{-gain_db(*filter_, edge, fs):.3f}" for edge in (passband, stopband))]
        for name, (filter_, fs) in filters.items()
    ]
    demand = [f"{figures.number('equation_12', f'{band}_loss')}" for band in ("passband", "stopband")]
    rows.append(["asked for", f"at most {demand[0]}", f"at least {demand[1]}"])
    return table(["loss in dB at", f"{passband:g} Hz", f"{stopband:g} Hz"], rows)


def _equation_18(figures: PaperFigures) -> Part:
    printed = [figures.numbers("equation_18", name) for name in ("numerator", "denominator")]
    ours, stated = equation_16_filter(figures), table_3_filter(figures)
    note = f"equation 16 as printed, $\\tau_s$ = {figures.number('equation_17', 'period')} s"
    comparisons = [
        compare(f"{part} of $z^{{{-k}}}$", value, ours[i][k], note=note if not k else "")
        for i, part in enumerate(("numerator", "denominator"))
        for k, value in enumerate(printed[i])
    ]
    comparisons.append(
        compare(
            r"numerator of $z^0$ by table 3's $\Omega_c$", printed[0][0], stated[0][0],
            note="equation 16 has another cutoff, see there",
        )
    )  # fmt: skip
    as_printed = exact(figures, "equation_18", "numerator"), exact(figures, "equation_18", "denominator")
    gain = float(dc_gain(*as_printed))
    comparisons += [
        compare(
            "gain at 0 Hz, as printed", None, gain, note="1 before rounding: a steady clearance comes out too small"
        ),
        *(
            compare("pole radius, as printed", None, radius, note="below 1: stable")
            for radius in sorted({round(r, 9) for r in pole_radii(as_printed[1])}, reverse=True)
        ),
    ]
    head = ["power of $z^{-1}$", "numerator", "denominator"]
    rows = [[str(k), plain(b, 6), plain(a, 6)] for k, (b, a) in enumerate(zip(*stated, strict=True))]
    delay = float(exact(figures, "equation_16", "denominator")[-2])
    return Part(
        title="Equations 17 and 18",
        where=figures.where("equation_18"),
        finding=(
            f"every coefficient follows from equation 16 as printed; rounded, they lose {100 * (1 - gain):.1f} % of "
            f"a steady value"
        ),
        before=("$H(z) = H(s)$ at " + r"$s = \frac{2}{\tau_s} \frac{1 - z^{-1}}{1 + z^{-1}}$, computed in fractions.",),
        comparisons=tuple(comparisons),
        after=(
            f"The delay at 0 Hz is the coefficient of $s$ in equation 16, {delay:.4f} s, or "
            f"{delay * _rate(figures):.1f} samples. What the cutoff of table 3 gives instead, at {_rate(figures)} Hz:",
            table(head, rows),
            "![Responses of the 5th-order filter](images/paper_fifth_order.svg)",
        ),
    )


def _equation_19(figures: PaperFigures) -> Part:
    inputs, outputs = (figures.numbers("equation_19", name) for name in ("input", "output"))
    numerator, denominator = (exact(figures, "equation_18", name) for name in ("numerator", "denominator"))
    comparisons = [
        compare(
            f"coefficient of $x(n-{k})$",
            printed,
            numerator[k],
            note="equation 18 has it without the second 0: a slip of writing"
            if abs(Fraction(printed) - numerator[k])
            else "",
        )
        for k, printed in enumerate(inputs)
    ]
    comparisons += [
        compare(f"coefficient of $y(n-{k})$", printed, -denominator[k]) for k, printed in enumerate(outputs, start=1)
    ]  # fmt: skip
    slip = dc_gain(tuple(map(Fraction, inputs)), (Fraction(1), *(-Fraction(value) for value in outputs)))
    comparisons.append(compare("gain at 0 Hz, as printed", None, slip))
    return Part(
        title="Equation 19",
        where=figures.where("equation_19"),
        finding=f"equation 18 solved for $y(n)$, with one slip; with it the gain at 0 Hz is {float(slip):.4f}",
        comparisons=tuple(comparisons),
    )
