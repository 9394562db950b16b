"""The block diagram of a section: for each equation its terms, their gains and coefficients, the sum, the rounding.

Signals that bear the same name are connected, as on a sheet of circuits; a box with z⁻¹ delays by one sample.
"""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sosmith.gen.quantity import MINUS
from sosmith.gen.report.figures.painting import COLOUR, NARROW, draw
from sosmith.gen.report.recursion import Coefficient, Equation, Recursion, Term, gain_words

_ROW, _GAP, _TOP = 32.0, 17.0, 12.0
_SIGNAL, _GAIN, _SUM, _ROUNDING, _NAME = 118.0, 200.0, 285.0, 345.0, 384.0
"""Places across the picture in pixels: ends of the signals' names, gains, sums, roundings, results."""


def diagram(recursion: Recursion) -> str:
    """Draw the equations of a section, one below the other in the order of computation."""
    rows = sum(max(len(equation.terms), 1) for equation in recursion.equations)
    height = round(rows * _ROW + len(recursion.equations) * _GAP + _TOP)
    known = {each.name: each for each in recursion.coefficients}

    def paint(figure: Figure) -> None:
        figure.set_layout_engine("none")
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        axes.set_xlim(0, NARROW)
        axes.set_ylim(height, 0)
        top = _TOP
        for equation in recursion.equations:
            tall = max(len(equation.terms), 1) * _ROW
            _paint_equation(axes, equation, top, tall, known)
            top += tall + _GAP

    return draw(f"diagram-{recursion.section}", f"Block diagram of {recursion.section}", NARROW, height, paint)


def _paint_equation(axes: Axes, equation: Equation, top: float, tall: float, known: dict[str, Coefficient]) -> None:
    middle = top + tall / 2
    alone = len(equation.terms) == 1 and equation.terms[0].gain > 0
    for k, term in enumerate(equation.terms):
        y = top + (k + 0.5) * _ROW
        _paint_term(axes, term, y, known)
        _line(axes, [(_GAIN + 22, y), (_SUM - 30, y), (_SUM - (0 if alone else 11), middle)])
        if not alone:
            sign = MINUS if term.gain < 0 else "+"
            axes.text(_SUM - 34, y - 3, sign, ha="right", va="bottom", fontsize=12, color=COLOUR["limit"])
    if not alone:
        axes.plot([_SUM], [middle], marker="o", ms=21, mfc="none", mec=COLOUR["ink"], mew=1.4)
        axes.text(_SUM, middle, "+", ha="center", va="center", fontsize=15)
    _line(axes, [(_SUM + (0 if alone else 11), middle), (_NAME - 8, middle)], arrow=True)
    if equation.rounding:
        words = equation.rounding.format("").replace("⌊⌋", "⌊ ⌋").replace("()", " ")
        _box(axes, _ROUNDING, middle, words, 46)
    axes.text(_NAME, middle, equation.name, va="center", fontsize=12.5, fontweight="bold")


def _paint_term(axes: Axes, term: Term, y: float, known: dict[str, Coefficient]) -> None:
    name, _, delay = term.signal.partition(f"(n{MINUS}")
    start = _SIGNAL + 4
    if not term.signal:
        axes.text(_GAIN + 18, y, gain_words(term.gain), ha="right", va="center", fontsize=12)
        return
    delays, after = int(delay.partition(")")[0] or 0), delay.partition(")")[2]
    wrapped = after and name[0] in "⌊tf"
    if delays and not wrapped:
        _box(axes, _SIGNAL - 14, y, "z⁻¹" if delays == 1 else "z⁻²", 30)
        axes.text(_SIGNAL - 34, y, name, ha="right", va="center", fontsize=12)
        start = _SIGNAL + 1
    else:
        axes.text(_SIGNAL, y, term.signal, ha="right", va="center", fontsize=12)
    _line(axes, [(start, y), (_GAIN + 22, y)])
    words = "" if abs(term.gain) == 1 else gain_words(term.gain)
    if term.coefficient:
        words = f"{words}·{term.coefficient}" if words else term.coefficient
        value = known[term.coefficient]
        number = f"{value.integer / 2**value.frac:.4g}".replace("-", MINUS)
        axes.text(_GAIN - 18, y + 2, number, ha="right", va="top", fontsize=12, color=COLOUR["muted"])
    if words:
        corners = [(_GAIN - 14, y - 13), (_GAIN - 14, y + 13), (_GAIN + 20, y)]
        axes.fill(*zip(*corners, strict=True), facecolor=COLOUR["hardware"], alpha=0.18, lw=0)
        axes.plot(*zip(*corners, corners[0], strict=True), color=COLOUR["hardware"], lw=1.3)
        axes.text(_GAIN - 18, y - 2, words, ha="right", va="bottom", fontsize=12, color=COLOUR["hardware"])


def _box(axes: Axes, x: float, y: float, words: str, width: float) -> None:
    corners = [(x - width / 2, y - 11), (x + width / 2, y - 11), (x + width / 2, y + 11), (x - width / 2, y + 11)]
    axes.fill(*zip(*corners, strict=True), facecolor=COLOUR["grid"], lw=0, zorder=3)
    axes.plot(*zip(*corners, corners[0], strict=True), color=COLOUR["muted"], lw=1.0, zorder=4)
    axes.text(x, y, words, ha="center", va="center", fontsize=12, zorder=5)


def _line(axes: Axes, points: list[tuple[float, float]], *, arrow: bool = False) -> None:
    axes.plot(*zip(*points, strict=True), color=COLOUR["muted"], lw=1.2, zorder=1, solid_joinstyle="round")
    if arrow:
        axes.plot(*points[-1], marker=">", ms=6, color=COLOUR["muted"], zorder=1)
