"""Regenerates the tables of docs/rates.md, and its picture from benchmarks/cost.json: `python -m benchmarks.rates`.

With `--picture` it draws the picture alone. With `--check` nothing is written; the exit status tells whether the
document is up to date.
"""

from __future__ import annotations

import io
import json
import re
import sys
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import matplotlib
from benchmarks.cost_cores import CORES, RECORD, Core, Figures, logic_of, rate, targets_in
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.decimation import choose
from sosmith.gen.output.decimation_facts import decimation_facts, rate_costs
from sosmith.gen.picture import settled
from sosmith.gen.quantity import quantity
from sosmith.gen.specification.combinations import MULTIPLEXED, PARALLEL
from sosmith.gen.specification.specification import FilterSpec, load
from sosmith.gen.word_lengths.cost import LUTS_OF_A_BLOCK

ROOT = Path(__file__).resolve().parent.parent
DOCUMENT = ROOT / "docs" / "rates.md"
PICTURE = ROOT / "docs" / "images" / "rates.svg"
LOCOMOTIVE = ROOT / "examples" / "flange_wear_locomotive.toml"
FACTORS = (None, 2, 4, 8, 16, 32, 64, "auto")

ORDERS = (1, 2, 3, 5, 7, 10)
RATIOS = tuple(Fraction(1, count) for count in (30, 50, 100, 200, 400, 1000))

_CHOICES = re.compile(r"(?<=<!-- choices -->\n).*?(?=<!-- end of choices -->)", re.DOTALL)
_TABLES = re.compile(r"(?<=<!-- factors -->\n).*?(?=<!-- end of factors -->)", re.DOTALL)
_INSTRUMENT = re.compile(r"(?<=<!-- instrument -->\n).*?(?=<!-- end of instrument -->)", re.DOTALL)
_BANDS = re.compile(r"(?<=<!-- bands -->\n).*?(?=<!-- end of bands -->)", re.DOTALL)


def locomotive(decimate: int | str | None, core: str = "filter") -> CoreDesign:
    """Design the locomotive's filter alone, or its whole instrument, with a decimator before the filter."""
    spec = load(LOCOMOTIVE)
    return design_core(replace(spec, filter=replace(spec.filter, decimate=decimate)), core=core)


def factor_table() -> str:
    """Return what each factor costs."""
    head = (
        "decimate",
        "clocks a sample",
        "memory, bits",
        "registers of the decimator, bits",
        "error bound",
        "delay",
        "into the pass band",
        "anything that folds",
        "without a decimator",
        "gain",
    )
    rows = [head, tuple("---" for _ in head)]
    direct = rate_costs(locomotive(None))
    for factor in FACTORS:
        made = locomotive(factor)
        costs, found = rate_costs(made), decimation_facts(made)
        longer = 100 * (costs.delay / direct.delay - 1)
        folds, gain = ("-", "-", "-"), "-"
        if found is not None:
            most = max(band.passing_db for band in found.aliasing)
            levels = (found.largest_db, found.direct_largest_db)
            folds = (f"{most:.0f} dB, {found.stages} stages", *(f"{level:.0f} dB" for level in levels))
            gain = f"within {found.deviation_db:.2g} dB"
        chosen = f'"auto", {"none" if found is None else found.factor}' if factor == "auto" else str(factor or "-")
        rows.append(
            (
                chosen,
                f"{costs.clocks_per_sample:.4g}",
                f"{costs.memory_bits:,}",
                f"{costs.decimator_bits:,}",
                quantity(costs.bound, made.datapath.output.unit),
                f"{quantity(costs.delay, 's')}, {longer:+.1f} %",
                *folds,
                gain,
            )
        )
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def instrument_table() -> str:
    """Return what the filter alone and the whole instrument cost, with and without the factor of "auto"."""
    head = (
        "core",
        "decimate",
        "clocks a sample",
        "calibration, clocks",
        "memory, bits",
        "registers of the decimator, bits",
        "error bound",
        "delay",
    )
    rows = [head, tuple("---" for _ in head)]
    for core in ("filter", "instrument"):
        for decimate in (None, "auto"):
            made = locomotive(decimate, core)
            costs, ahead = rate_costs(made), made.architecture.calibration
            factor = "-" if made.datapath.decimator is None else f'"auto", {made.datapath.decimator.factor}'
            rows.append(
                (
                    core,
                    factor,
                    f"{costs.clocks_per_sample:.4g}",
                    "-" if ahead is None else str(ahead.cycles_per_sample),
                    f"{costs.memory_bits:,}",
                    f"{costs.decimator_bits:,}",
                    quantity(costs.bound, made.datapath.output.unit),
                    quantity(costs.delay, "s"),
                )
            )
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def band_table() -> str:
    """Return what folds from each band, into the pass band and anywhere, with the factor of "auto"."""
    found = decimation_facts(locomotive("auto"))
    assert found is not None
    rows = ["| from | gain at most | at the output | into the pass band from | gain into it at most |\n"]
    rows.append("| --- | --- | --- | --- | --- |\n")
    rows += [
        f"| {band.whole_low:.6g} to {band.whole_high:.6g} Hz | {band.largest_db:.2f} dB | {band.largest_at:.3g} Hz "
        f"| {band.low:.6g} to {band.high:.6g} Hz | {band.passing_db:.2f} dB |\n"
        for band in found.aliasing
    ]
    return "".join(rows)


def choice_table() -> str:
    """Return the factor and the stages that "auto" takes, by order and cutoff."""
    rows = [f"| cutoff over sample rate | {' | '.join(f'order {order}' for order in ORDERS)} |\n"]
    rows.append(f"| --- |{' --- |' * len(ORDERS)}\n")
    for ratio in RATIOS:
        found = [choose(butterworth(order, ratio), Fraction(1), Fraction(1, 2**15), 16)[0] for order in ORDERS]
        cells = ("none" if each is None else f"{each.factor}, {each.stages} stages" for each in found)
        rows.append(f"| 1/{ratio.denominator} | {' | '.join(cells)} |\n")
    return "".join(rows)


def butterworth(order: int, ratio: Fraction) -> FilterSpec:
    """Return a filter with its cutoff at `ratio` of the sample rate."""
    return FilterSpec(
        family="butterworth",
        kind="lowpass",
        method="bilinear",
        order=order,
        cutoff=(ratio,),
        passband_edge=None,
        stopband_edge=None,
        passband_loss=None,
        stopband_loss=None,
        sos=None,
        decimate="auto",
    )


def with_choices(text: str) -> str:
    """Return the document's `text` with the table of choices as it is now."""
    return _CHOICES.sub(lambda _: choice_table(), text)


CURVES = {
    "serial": "C2",
    "folded": "C1",
    "online": "C4",
    "multiplexed": "C5",
    "parallel": "C0",
    "parallel, channels in turn": "C9",
    "parallel, several a clock": "C7",
    "parallel, look-ahead": "C3",
}
"""Curves of the picture, and their colours."""

PLACES = {
    "parallel, channels in turn": ("center", (0, 8)),
    "parallel, several a clock": ("left", (6, -3)),
    "parallel, look-ahead": ("left", (6, -3)),
}
"""Where the marks of curves stand that have neighbours on their left; elsewhere on the side where there is nothing."""


@dataclass(frozen=True, order=True)
class Point:
    """A measured core in the picture: samples per second, area, and what tells it from others of its curve."""

    rate: float
    area: float
    mark: str


def curve_of(core: Core) -> tuple[str, str]:
    """Return the curve that a core of audio_lowpass lies on, and its mark there; empty if it is on none."""
    varied = core.protect != "none" or core.realization or core.freedom or core.order or core.start
    if core.example != "audio_lowpass" or varied:
        return "", ""
    if core.channels > 1:
        several = sorted(other.channels for other in CORES if replace(other, channels=core.channels) == core)[1:]
        mark = f"{several[0]} to {several[-1]} channels" if core.channels == several[-1] else ""
        return ("parallel, channels in turn", mark) if core.architecture == PARALLEL.name else ("", "")
    if core.architecture == MULTIPLEXED.name:
        return core.architecture, f"for {core.clock} MHz"
    lanes = f"{core.lanes} a clock"
    if core.clock:
        # One curve over the samples of a clock; of one sample, the core that was made for the highest clock.
        wanted = max(
            other.clock for other in CORES if (other.lanes, other.architecture) == (core.lanes, core.architecture)
        )
        return ("parallel, look-ahead", lanes) if core.clock == wanted else ("", "")
    if core.lanes > 1:
        return "parallel, several a clock", lanes
    return core.architecture, f"{core.bits or 16} bits"


def curves(record: Figures, key: str) -> dict[str, list[Point]]:
    """Return the measured points of each curve on a family of FPGAs, in the order of `CURVES`."""
    same = {"ecp5": ("ecp5", "ecp5_85")}.get(key, (key,))
    found: dict[str, list[Point]] = {name: [] for name in CURVES}
    for core in CORES:
        name, mark = curve_of(core)
        for target, figures in targets_in(record, core).items():
            if name and target in same and not figures["refusal"]:
                area = logic_of(target, figures) + LUTS_OF_A_BLOCK * figures["area"]["multipliers"]
                found[name].append(Point(rate(core, figures), area, mark))
    return {name: points for name, points in found.items() if points}


def picture(record: Figures) -> str:
    """Return an SVG of area against samples per second, one panel for each family, one curve for each architecture."""
    with matplotlib.rc_context({"svg.hashsalt": "sosmith", "svg.fonttype": "none"}):
        figure = Figure(figsize=(11, 5.5), layout="constrained")
        FigureCanvasSVG(figure)
        for axes, key in zip(figure.subplots(1, 2, sharey=True), ("hx8k", "ecp5"), strict=True):
            for name, points in curves(record, key).items():
                x, y = [point.rate for point in points], [point.area for point in points]
                axes.loglog(x, y, "o-", color=CURVES[name], label=name)
                for point in points:
                    side, offset = ("right", (-6, -3)) if point.rate == min(x) else ("left", (6, -3))
                    side, offset = PLACES.get(name, (side, offset))
                    axes.annotate(
                        point.mark,
                        (point.rate, point.area),
                        offset,
                        ha=side,
                        textcoords="offset points",
                        fontsize="x-small",
                        color=CURVES[name],
                    )
            axes.margins(x=0.2)
            axes.set_title("iCE40 HX8K" if key == "hx8k" else "ECP5 LFE5U-25F and -85F, speed 6")
            axes.set_xlabel("samples per second at fmax, all channels together")
            axes.grid(visible=True, which="both", alpha=0.3)
            axes.legend(fontsize="small", loc="upper left")
            axes.set_ylabel(f"LUT4, a multiplier block as {LUTS_OF_A_BLOCK}" if key == "ecp5" else "logic cells")
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    return settled(text.getvalue())


def document() -> str:
    """Return the document with the tables as they are now."""
    text = DOCUMENT.read_text(encoding="utf-8")
    for place, table in ((_TABLES, factor_table), (_BANDS, band_table), (_INSTRUMENT, instrument_table)):
        made = table()
        text = place.sub(lambda _, made=made: made, text)
    return with_choices(text)


if __name__ == "__main__":
    drawn = picture(json.loads(RECORD.read_text(encoding="utf-8")))
    if sys.argv[1:] == ["--picture"]:
        PICTURE.write_text(drawn, encoding="utf-8")
        sys.exit()
    made = document()
    if sys.argv[1:] == ["--check"]:
        sys.exit((made, drawn) != (DOCUMENT.read_text(encoding="utf-8"), PICTURE.read_text(encoding="utf-8")))
    DOCUMENT.write_text(made, encoding="utf-8")
    PICTURE.write_text(drawn, encoding="utf-8")
