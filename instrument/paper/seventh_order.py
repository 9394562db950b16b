"""The paper's 7th-order filter: table 9 and equations 21 and 22."""

from __future__ import annotations

import math
from fractions import Fraction

from sosmith.instrument.paper.arithmetic import (
    Coefficients,
    bilinear,
    butterworth_polynomial,
    cutoff_for,
    cutoffs_of,
    loss_db,
    order_needed,
    prewarped,
    ripple,
    scaled,
)
from sosmith.instrument.paper.comparison import Comparison, Part, compare, plain, table
from sosmith.instrument.paper.fifth_order import exact, normalised_part
from sosmith.instrument.paper.figures import PaperFigures

ORDER = 7

_SLOW = (0.1, 0.25)  # Hz, slow changes of the clearance

HUNTING = 1.2
"""Hz: least damped mode of Cooperrider's bogie at 20 m/s, close to the kinematic frequency from Klingel's formula."""

_CONICITY, _ROLLING_RADIUS, _HALF_GAUGE = 0.05, 0.4572, 0.716
"""Wheel data of Cooperrider's bogie; radius and half the distance between the contact points in m."""


def seventh_order_parts(figures: PaperFigures) -> list[Part]:
    """Table 9 and equations 21 and 22, in the order of the paper."""
    return [_table_9(figures), normalised_part(figures, "equation_21", ORDER), _equation_22(figures)]


def period(figures: PaperFigures) -> Fraction:
    """Return the sampling period in s."""
    return 1 / Fraction(figures.number("table_9", "sample_rate"))


def stated_cutoff(figures: PaperFigures) -> Fraction:
    """Cutoff of table 9 in rad/s."""
    return Fraction(figures.number("table_9", "prewarped_cutoff"))


def proper_cutoff(figures: PaperFigures) -> float:
    """Cutoff in rad/s of the filter described in the text on table 9: its pass-band edge pre-warped by equation 10."""
    edge = prewarped(float(figures.number("table_9", "passband_edge")), float(period(figures)))
    return cutoff_for(edge, float(figures.number("table_9", "passband_loss")), ORDER)


def table_9_filter(figures: PaperFigures) -> tuple[Coefficients, Coefficients]:
    """Exact digital filter with the cutoff of table 9."""
    return bilinear(scaled(butterworth_polynomial(ORDER), stated_cutoff(figures)), period(figures))


def equation_22_filter(figures: PaperFigures) -> tuple[Coefficients, Coefficients]:
    """Exact digital filter from equation 22 as printed."""
    return bilinear(exact(figures, "equation_22", "denominator"), period(figures))


def proper_filter(figures: PaperFigures) -> tuple[Coefficients, Coefficients]:
    """Exact digital filter with the cutoff of `proper_cutoff`."""
    return bilinear(scaled(butterworth_polynomial(ORDER), Fraction(proper_cutoff(figures))), period(figures))


def irregularity_frequency(figures: PaperFigures) -> float:
    """Frequency in Hz at which the track's irregularity excites the vehicle."""
    return float(figures.number("track", "speed") / figures.number("track", "irregularity_length"))


def klingel_frequency(speed: float) -> float:
    """Frequency in Hz of the kinematic motion of a wheelset at a speed in m/s, from Klingel's formula."""
    return speed / (2 * math.pi) * math.sqrt(_CONICITY / (_ROLLING_RADIUS * _HALF_GAUGE))


def delay(cutoff: float) -> float:
    """Group delay at 0 Hz in s of a 7th-order Butterworth low-pass, digital or analog, with a cutoff in rad/s."""
    return float(butterworth_polynomial(ORDER)[-2]) / cutoff


def digital_frequency(cutoff: float, sampling: float) -> float:
    """Frequency in Hz to which the bilinear transformation maps an analog angular frequency in rad/s."""
    return math.atan(cutoff * sampling / 2) / (math.pi * sampling)


def degrees_taken(edge: float, sampling: float) -> float:
    """Equation 10 in rad/s for an edge in Hz, if the angle in radians is mistaken for degrees in the tangent."""
    return 2 / sampling * math.tan(math.radians(math.pi * edge * sampling))


def _table_9(figures: PaperFigures) -> Part:
    def of(name: str) -> float:
        return float(figures.number("table_9", name))

    sampling = float(period(figures))
    passband, stopband, loss, stop = (
        of(name) for name in ("passband_edge", "stopband_edge", "passband_loss", "stopband_loss")
    )
    swapped = "in the table it stands at the other's name"
    comparisons = [
        _one(figures, "angular_stopband_edge", r"$\omega_a$", 2 * math.pi * stopband, "rad/s"),
        _one(figures, "angular_passband_edge", r"$\omega_p$", 2 * math.pi * passband, "rad/s"),
        _one(
            figures, "angular_cutoff", r"$\omega_c$", math.pi * (passband + stopband), "rad/s",
            "the mean of the two edges",
        ),
        _one(figures, "loss_a", "$A_a$", stop, "dB", f"ours is the text's; {swapped}"),
        _one(figures, "loss_p", "$A_p$", loss, "dB", f"ours is the text's; {swapped}"),
        _one(
            figures, "prewarped_a", r"$\Omega_p$", prewarped(passband, sampling), "rad/s",
            f"equation 10 with {passband:g} Hz; {swapped}",
        ),
        compare(
            r"$\Omega_a$", figures.number("table_9", "prewarped_p"), None, "rad/s",
            note=f"{stopband:g} Hz is half the sample rate, where the tangent of equation 11 is infinite; {swapped}",
        ),
        *(
            _one(
                figures, name, rf"$\Omega_{letter}$, tangent of degrees", degrees_taken(edge, sampling), "rad/s",
                "the angle in radians taken as degrees gives the printed figure",
            )
            for name, letter, edge in (("prewarped_a", "p", passband), ("prewarped_p", "a", stopband))
        ),
        *_order_and_cutoff(figures),
    ]  # fmt: skip
    return Part(
        title="Table 9",
        where=figures.where("table_9"),
        finding=(
            f"two pairs of labels swapped; the pre-warped edges are those of a tangent of degrees, {passband:g} Hz "
            f"becoming {of('prewarped_a') / (2 * math.pi):.3f} Hz; the order by its own figures is {_order(figures)}"
        ),
        comparisons=tuple(comparisons),
        after=(
            f"The bilinear transformation puts the zeros of a low-pass at half the sample rate: at {stopband:g} Hz the "
            "loss is infinite whatever the order, so that edge asks for none.",
            *_what_the_cutoff_does(figures),
        ),
    )


def _one(
    figures: PaperFigures, name: str, quantity: str, ours: float | None, unit: str = "", note: str = ""
) -> Comparison:
    return compare(quantity, figures.number("table_9", name), ours, unit, note=note)


def _order(figures: PaperFigures) -> int:
    """Order from equation 12 and the figures of table 9."""
    names = ("prewarped_a", "prewarped_p", "passband_loss", "stopband_loss")
    edge, other, loss, stop = (float(figures.number("table_9", name)) for name in names)
    return math.ceil(order_needed(edge, other, loss, stop))


def _order_and_cutoff(figures: PaperFigures) -> list[Comparison]:
    def of(name: str) -> float:
        return float(figures.number("table_9", name))

    edge, other, loss, stop = (of(name) for name in ("prewarped_a", "prewarped_p", "passband_loss", "stopband_loss"))
    cutoff, order = of("prewarped_cutoff"), int(of("order"))
    needed = order_needed(edge, other, loss, stop)
    meant = cutoff * math.pow(ripple(loss), 1 / order)
    sampling = float(period(figures))
    frequency = math.degrees(math.atan(meant * sampling / 2)) / (math.pi * sampling)
    return [
        _one(
            figures, "order", "$N$", _order(figures), "",
            f"equation 12 with the table's figures gives {needed:.3f}. With the edge that the printed $\\Omega_c$ "
            f"means, {meant:.4f} rad/s, which would be rounded to {edge:g}, it gives "
            f"{order_needed(meant, other, loss, stop):.4f}, just above",
        ),
        _one(
            figures, "prewarped_cutoff", r"$\Omega_c$", cutoff_for(edge, loss, order), "rad/s",
            f"equation 13 with the table's figures; an edge of {frequency:.2f} Hz, in degrees, would give the printed "
            f"one",
        ),
        compare(
            r"$\Omega_p$ for the edge stated", None, prewarped(of("passband_edge"), sampling), "rad/s",
            note="equation 10 in radians",
        ),
        compare(
            f"$\\Omega_c$ for the edge stated, $N = {ORDER}$", None, proper_cutoff(figures), "rad/s",
            note=f"{digital_frequency(proper_cutoff(figures), sampling):.2f} Hz",
        ),
        compare(
            "cutoff that the printed $\\Omega_c$ is", None, digital_frequency(cutoff, sampling), "Hz",
            note=f"1/{1 / (digital_frequency(cutoff, sampling) * sampling):.0f} of the sample rate",
        ),
    ]  # fmt: skip


def _what_the_cutoff_does(figures: PaperFigures) -> list[str]:
    """Losses and delay of the filter with the printed cutoff and with the properly pre-warped one."""
    sampling, edge = float(period(figures)), float(figures.number("table_9", "passband_edge"))
    cutoffs = (float(stated_cutoff(figures)), proper_cutoff(figures))
    head = ["", *(f"$\\Omega_c$ = {cutoff:.4g} rad/s" for cutoff in cutoffs)]
    rows = [
        [f"loss at {frequency:g} Hz, dB", *(_loss(prewarped(frequency, sampling), cutoff) for cutoff in cutoffs)]
        for frequency in (*_SLOW, HUNTING, irregularity_frequency(figures), edge)
    ]
    rows.append(["delay at 0 Hz, s", *(f"{delay(cutoff):.4f}" for cutoff in cutoffs)])
    at_edge = loss_db(prewarped(edge, sampling), cutoffs[0], ORDER)
    speed = float(figures.number("track", "speed"))
    return [
        table(head, rows),
        f"At its own stated pass-band edge the filter so made loses {at_edge:.0f} dB instead of "
        f"{figures.number('table_9', 'passband_loss')} dB. It does remove the motions of the vehicle at {speed:g} m/s: "
        f"hunting is near {HUNTING:g} Hz (Cooperrider's bogie; Klingel's formula gives {klingel_frequency(speed):.2f} "
        f"Hz), and the track's irregularity is met at {irregularity_frequency(figures):g} Hz. A filter with its edge "
        f"at {edge:g} Hz, as stated, would pass both. So the printed figures do what the stated specification would "
        "not, at the price of the delay.",
        "![Responses of the 7th-order filter](images/paper_seventh_order.svg)",
    ]


def _loss(angular: float, cutoff: float) -> str:
    return plain(loss_db(angular, cutoff, ORDER), 4)


def _equation_22(figures: PaperFigures) -> Part:
    printed = figures.numbers("equation_22", "denominator")
    polynomial = butterworth_polynomial(ORDER)
    stated, made_with = stated_cutoff(figures), cutoffs_of(polynomial, printed)
    ours = scaled(polynomial, stated)
    return Part(
        title="Equation 22",
        where=figures.where("equation_22"),
        finding=f"its cutoff is {min(made_with):.4f} to {max(made_with):.4f} rad/s, table 9's {float(stated):g} rad/s",
        before=(
            r"Each coefficient gives the cutoff it was made with, $\Omega_c = (c_k / \text{printed})^{1/k}$: "
            + ", ".join(f"{cutoff:.4f}" for cutoff in made_with)
            + " rad/s. They agree with each other; the last digit of table 9's $\\Omega_c$ does not with them.",
        ),
        comparisons=tuple(
            compare(
                f"coefficient of $s^{ORDER - k}$", printed[k], ours[k], f"$\\text{{s}}^{ORDER - k}$",
                note="with the cutoff of table 9",
            )
            for k in range(ORDER + 1)
        ),
    )  # fmt: skip
