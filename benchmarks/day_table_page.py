"""The page docs/day_table.md from the record of `python -m benchmarks.day_table`."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from statistics import median_low
from typing import Any

WAYS = {"polynomial": "polynomial", "linear": "table, lines", "quadratic": "table, parabolas"}

CLOCKS = 12e6 / 6
"""Clocks that the instrument has for a sample: 12 MHz at 6 Hz."""

Pick = Callable[[dict[str, Any]], float]


def page(found: dict[str, Any]) -> str:
    """Return the page."""
    return "\n".join([*_head(found), *_memory(found), *_logic(found), *_verdict(found), *_room(found)])


def middle(found: dict[str, Any], allowed: str, way: str, pick: Pick) -> float:
    """Return the (lower) median over the curves of a figure."""
    return median_low(_all(found, allowed, way, pick))


def largest(found: dict[str, Any], allowed: str, way: str, pick: Pick) -> float:
    """Return the largest over the curves of a figure."""
    return max(_all(found, allowed, way, pick))


def _all(found: dict[str, Any], allowed: str, way: str, pick: Pick) -> list[float]:
    return [pick(row) for curve in found["curves"] for row in curve if (row["allowed"], row["way"]) == (allowed, way)]


def _wrapped(text: str) -> list[str]:
    return [*textwrap.wrap(" ".join(text.split()), 120, break_long_words=False, break_on_hyphens=False), ""]


def _table(header: str, rows: list[list[str]]) -> list[str]:
    head = [f"| {header} |", f"|{'---|' * len(header.split(' | '))}"]
    return [*head, *(f"| {' | '.join(row)} |" for row in rows), ""]


def _head(found: dict[str, Any]) -> list[str]:
    count, order, first = len(found["curves"]), found["order"], found["first_seed"]
    subject = f"""
        Written by `python -m benchmarks.day_table --document`. The day's own curve goes to the hardware as a
        polynomial, of orders {order}, 1 where it needs them
        ([calibration.md](calibration.md#two-ways-of-fitting)).
        Would a table with proven interpolation be cheaper? Both are costed here for the curves of {count} sensors of
        the bench at 43 to 50 °C with five targets on the morning (seeds {first} to {first + count - 1} of
        [days.md](days.md)), with the same ports, as a calibration by itself that may be loaded.
    """
    proof = """
        The table: values of the curve at equal steps of the voltage's code, their number a power of two, one row for
        each order of the temperature; lines between neighbours, or a parabola through the ends and the middle of each
        segment. Of all numbers of segments and fraction bits that are proven to keep to the error allowed, those of
        fewest bits. Proven, in rational numbers: interpolation misses at most h²/8 max|d''|, or h³/(72√3) max|d'''|,
        with the derivative bounded on each segment by its Bernstein coefficients there; values and products are rounded
        to the fraction bits, and the result to the output. The bound is the sum.
    """
    cost = """
        Logic is estimated for ECP5 as in [cost.md](cost.md), of the table for the arithmetic behind its memory, with
        the words that it reads as inputs. Not counted against the table: what writes to its memory, the clocks of
        reading where one unit is shared, and a second bank, which a swap between two samples needs: twice the block
        RAM. *At once*: all values of a segment are read in one clock, neighbours from memories of their own. *Fixed*:
        only the table can be loaded, not the program. Figures are medians over the curves, with the largest in
        parentheses where it differs; hardware for any day needs the largest.
    """
    return ["# A table in place of the polynomial", "", *_wrapped(subject), *_wrapped(proof), *_wrapped(cost)]


def _each(found: dict[str, Any]) -> list[tuple[str, str]]:
    return [(allowed, way) for allowed in found["allowed"] for way in WAYS]


def _both(found: dict[str, Any], allowed: str, way: str, pick: Pick, form: str = ",.0f") -> str:
    usual, most = (f"{get(found, allowed, way, pick):{form}}" for get in (middle, largest))
    return usual if usual == most else f"{usual} ({most})"


def _memory(found: dict[str, Any]) -> list[str]:
    rows = []
    for allowed, way in _each(found):
        start = [f"{1000 * found['allowed'][allowed]:.3g}", WAYS[way]]
        if way == "polynomial":
            words = [
                _both(found, allowed, way, lambda row, kind=kind: row[kind]["words"]) for kind in ("parallel", "folded")
            ]
            bound = _both(found, allowed, way, lambda row: 1000 * row["parallel"]["bound"], ".3f")
            rows.append([*start, "-", "-", "-", "-", f"{words[0]} parallel, {words[1]} folded", bound])
            continue
        figures = [_both(found, allowed, way, lambda row, key=key: row[key]) for key in ("segments", "bits")]
        rams = [
            _both(found, allowed, way, lambda row, key=key: row[key]) for key in ("block_rams", "block_rams_at_once")
        ]
        words_all = _both(found, allowed, way, lambda row: row["reload_words"])
        rows.append(
            [*start, *figures, *rams, words_all, _both(found, allowed, way, lambda row: 1000 * row["bound"], ".3f")]
        )
    header = "allowed, µm | way | segments | bits | block RAM | block RAM, at once | words to load | proven bound, µm"
    return ["## Memory, loading, bound", "", *_table(header, rows)]


def _logic(found: dict[str, Any]) -> list[str]:
    rows = []
    for allowed, way in _each(found):
        figures = [
            _both(found, allowed, way, lambda row, kind=kind, key=key: row[kind][key])
            for kind, key in (
                ("parallel", "luts"),
                ("parallel", "flip_flops"),
                ("parallel", "blocks"),
                ("folded", "luts"),
                ("folded", "clocks"),
            )
        ]
        products = _both(found, allowed, way, lambda row: row["products"])
        fixed = "-" if way == "polynomial" else _both(found, allowed, way, lambda row: row["fixed_program"])
        figures.insert(4, fixed)
        rows.append([f"{1000 * found['allowed'][allowed]:.3g}", WAYS[way], products, *figures])
    header = (
        "allowed, µm | way | products | parallel: LUT4 | flip-flops | multiplier blocks | folded: LUT4 | fixed: LUT4 | "
        "clocks a sample"
    )
    return ["## Logic and time", "", *_table(header, rows)]


def _verdict(found: dict[str, Any]) -> list[str]:
    allowed = next(name for name in found["allowed"] if "bench" in name)

    def of(way: str, kind: str, key: str) -> float:
        return largest(found, allowed, way, lambda row: row[kind][key])

    def of_table(key: str) -> float:
        return largest(found, allowed, "linear", lambda row: row[key])

    step = 1000 * found["allowed"][allowed]
    pairs = {
        (way, kind, key): of(way, kind, key)
        for way in ("polynomial", "linear")
        for kind in ("parallel", "folded")
        for key in ("luts", "blocks", "words", "clocks")
    }
    smaller = pairs["linear", "parallel", "luts"] < pairs["polynomial", "parallel", "luts"]
    fewer = pairs["linear", "parallel", "blocks"] < pairs["polynomial", "parallel", "blocks"]
    parallel = "is cheaper" if smaller and fewer else "is not cheaper"
    less = pairs["linear", "folded", "luts"] < pairs["polynomial", "folded", "luts"]
    folded = "saves logic" if less else "saves no logic"
    shared = f"""
        For {step:.3g} µm, the largest figures of the curves. Where one unit is shared, as in the instrument, whose
        sample has {CLOCKS:,.0f} clocks, a table with lines {folded}:
        {pairs["linear", "folded", "luts"]:,.0f} LUT4 and {of_table("block_rams"):.0f} block RAM, or
        {2 * of_table("block_rams"):.0f} with a second bank, where the polynomial takes
        {pairs["polynomial", "folded", "luts"]:,.0f} LUT4 and no memory more. With a program that cannot be loaded,
        so that the
        filter cannot either, the table would take {of_table("fixed_program"):,.0f} LUT4 beside its block RAM. It takes
        {pairs["linear", "folded", "clocks"]:.0f} clocks in place of {pairs["polynomial", "folded", "clocks"]:.0f}, for
        which nothing there waits, and {of_table("reload_words"):,.0f} words to load in place of
        {pairs["polynomial", "folded", "words"]:.0f}. So the polynomial is what the instrument has.
    """
    own = f"""
        Where every product has its own multiplier, a table {parallel} in logic:
        {pairs["linear", "parallel", "blocks"]:.0f} multiplier blocks in place of
        {pairs["polynomial", "parallel", "blocks"]:.0f}, and {pairs["linear", "parallel", "luts"]:,.0f} LUT4 in place of
        {pairs["polynomial", "parallel", "luts"]:,.0f}. It costs {of_table("block_rams_at_once"):.0f} block RAM, or
        {2 * of_table("block_rams_at_once"):.0f} with a second bank, and {of_table("reload_words"):,.0f} words to load
        in place of {pairs["polynomial", "parallel", "words"]:.0f}. That is worth it for samples at every clock or
        nearly so, which no sensor of wear gives, and it is not built: `parallel` has the polynomial, too. How many
        segments a table needs depends on the curve of the day, so that hardware with a table refuses a curve that is
        bent more than what it was designed with; the polynomial of its order has no such limit, but that of its
        coefficients' widths.
    """
    return ["## Which is cheaper", "", *_wrapped(shared), *_wrapped(own)]


def _room(found: dict[str, Any]) -> list[str]:
    text = """
        In `parallel` every coefficient has as many bits as that of the curve that the hardware is designed with, and
        one more. Curves of days and sensors that are hardly apart differ much in their coefficients. `calibrate export
        --room` writes a curve to design with in whose coefficients every curve within so many mm over the ports fits,
        proven by Markov's inequality for coefficients. Here each curve's own hardware, by itself, is given the sets of
        all curves; *refused* are those that do not fit. With a
        filter behind it, the hardware is that of the first curve; the words of the filter grow, too, since ranges are
        those that the coefficients give by interval arithmetic.
    """
    rows = [
        [
            "a Butterworth filter of order 2" if row["filtered"] else "-",
            "-" if row["room"] is None else f"{row['room']:g}",
            f"{row['refused']} of {row['sets']}",
            f"{median_low(row['luts']):,} ({max(row['luts']):,})",
            f"{median_low(row['blocks'])} ({max(row['blocks'])})",
        ]
        for row in found["rooms"]
    ]
    header = "behind it | room, mm | refused | LUT4 | multiplier blocks"
    return ["## Room for the curves of other days", "", *_wrapped(text), *_table(header, rows)]
