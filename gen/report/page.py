"""The report as one HTML page that stands alone: no script, no font, no picture from elsewhere.

Every text that comes from outside (names, units, descriptions) passes through `text` before it enters the page.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any

from sosmith.gen.filter.response import FilterFacts
from sosmith.gen.fpga.synthesis import Netlist
from sosmith.gen.output.core_facts import NodeFormat
from sosmith.gen.quantity import count, decibels, duration, plain_number, quantity, scale, unit_symbol
from sosmith.gen.report import plots
from sosmith.gen.report.evidence import Evidence

Summary = Mapping[str, Any]

_PASS_MARK = '<path d="M9 17.5l5.5 5.5L26 11.5"/>'
_FAIL_MARK = '<path d="M11.5 11.5l12 12M23.5 11.5l-12 12"/>'


def text(value: object) -> str:
    """Escape `value` for the page."""
    return escape(str(value))


def amount(value: float | None, unit: str) -> str:
    """Quantity for the page, its unit kept on the number's line."""
    return escape(quantity(value, unit)).replace(" ", "\u00a0")


def page(title: str, body: str) -> str:
    """Whole HTML document in the look of the reports.

    Parameters
    ----------
    title : str
        Plain text.
    body : str
        Markup, what comes from outside already escaped.
    """
    style = files("sosmith.gen.report").joinpath("report.css").read_text(encoding="utf-8")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{text(title)}</title>\n<style>\n{style}</style>\n</head>\n"
        f"<body>\n<main>\n{body}</main>\n</body>\n</html>\n"
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]], *, numbers: Sequence[int] = ()) -> str:
    """Table of cells that are markup already.

    Parameters
    ----------
    head : sequence of str
        Titles of the columns.
    rows : iterable of sequence of str
        Cells of the rows; the first is the row's title, empty where it is that of the row above.
    numbers : sequence of int
        Columns to set flush right.
    """

    def tag(name: str, column: int) -> str:
        return f'{name} class="number"' if column in numbers else name

    titles = "".join(f"<{tag('th', column)}>{cell}</th>" for column, cell in enumerate(head))
    lines = []
    for row in rows:
        cells = [f"<th>{row[0]}</th>"]
        cells += [f"<{tag('td', column)}>{cell}</td>" for column, cell in enumerate(row[1:], start=1)]
        start = "<tr>" if row[0] else '<tr class="same">'
        lines.append(f"{start}{''.join(cells)}</tr>\n")
    return (
        f'<div class="scroll"><table>\n<thead><tr>{titles}</tr></thead>\n'
        f"<tbody>\n{''.join(lines)}</tbody>\n</table></div>\n"
    )


def verdict_box(passed: bool, title: str, sentences: Sequence[str], notes: Sequence[str]) -> str:
    """Coloured box with the verdict, its reasons, and what to keep in mind; plain texts."""
    kind, mark = ("pass", _PASS_MARK) if passed else ("fail", _FAIL_MARK)
    if len(sentences) == 1:
        reasons = f"<p>{text(sentences[0])}</p>"
    else:
        reasons = "<ul>" + "".join(f"<li>{text(sentence)}</li>" for sentence in sentences) + "</ul>"
    remarks = f'<p class="note">{text(" ".join(notes))}</p>' if notes else ""
    return (
        f'<div class="verdict {kind}">\n<svg class="mark" viewBox="0 0 35 35" fill="none" stroke="currentColor" '
        f'stroke-width="3" stroke-linecap="round" stroke-linejoin="round" aria-hidden="true">'
        f'<circle cx="17.5" cy="17.5" r="15.5"/>{mark}</svg>\n'
        f"<div><strong>{text(title)}</strong>\n{reasons}\n{remarks}</div>\n</div>\n"
    )


def facts_list(facts: Iterable[tuple[str, str]]) -> str:
    """Pairs of name and value, plain texts, in as many columns as fit."""
    items = "".join(f"<div><dt>{text(name)}</dt><dd>{text(value)}</dd></div>\n" for name, value in facts)
    return f'<dl class="facts">\n{items}</dl>\n'


def _figure(title: str, drawing: str, caption: str, legend: Sequence[tuple[str, str, str]] = ()) -> str:
    """Figure of a drawing with a caption (markup); legend entries are role, shape and plain text."""
    keys = "".join(
        f'<li><i class="{shape}" style="color: var(--{role})"></i>{text(words)}</li>' for role, shape, words in legend
    )
    listing = f'<ul class="legend">{keys}</ul>\n' if keys else ""
    heading = f"<h3>{text(title)}</h3>\n" if title else ""
    return f"<figure>\n{heading}{listing}{drawing}<figcaption>{caption}</figcaption>\n</figure>\n"


def both_widths(wide: str, narrow: str) -> str:
    """Two drawings of the same, of which the page shows the one that fits."""
    return f'<div class="wide">{wide}</div>\n<div class="narrow">{narrow}</div>\n'


def _tile(name: str, value: str, aside: str, meter: str = "") -> str:
    return f'<div><dt>{name}</dt>\n<dd class="value">{value}</dd>{meter}<dd class="aside">{aside}</dd></div>\n'


def _meter(share: float) -> str:
    over = " over" if share > 1 else ""
    return f'<dd class="meter{over}"><i style="width: {100 * min(share, 1):.1f}%"></i></dd>'


def _percent(value: float) -> str:
    return f"{value:.3f}\u00a0%".replace("-", "−")


def _lsb(steps: float) -> str:
    return f"{plain_number(steps)} LSB"


def _error_tile(evidence: Evidence, summary: Summary) -> str:
    error = summary["error"]
    share = error["max_abs"] / evidence.bound
    return _tile(
        "Largest error",
        amount(error["max_abs"], evidence.unit),
        f"{_lsb(error['max_lsb'])} · {100 * share:.0f} % of the limit {amount(evidence.bound, evidence.unit)}",
        _meter(share),
    )


def _accuracy_tile(summary: Summary) -> str:
    """Tile of the paper's accuracy; where no truth is known, of the filter's; else an empty text."""
    accuracy = summary["accuracy_percent"]
    if accuracy["hardware"] is not None:
        apart = amount(abs(accuracy["hardware"] - accuracy["golden"]), "")
        aside = f"exact calculation {_percent(accuracy['golden'])}, {apart} points apart"
        if accuracy["unfiltered"] is not None:
            aside += f"<br>without the filter {_percent(accuracy['unfiltered'])}"
        return _tile("Accuracy against the true value", _percent(accuracy["hardware"]), aside)
    deviation = summary["frequency_response"]["max_deviation_db_passband"]
    if deviation is None:
        return ""
    return _tile("Change of the gain in the passband", text(decibels(deviation)), "by rounding the coefficients")


def _tiles(evidence: Evidence, summary: Summary) -> str:
    mean = summary["error"]["mean"]
    tiles = [
        _error_tile(evidence, summary),
        _tile(
            "Typical error (RMS)",
            amount(summary["error"]["rms"], evidence.unit),
            f"{_lsb(summary['error']['rms'] / evidence.lsb)} · mean {amount(mean, evidence.unit)}",
        ),
        _accuracy_tile(summary),
        _tile(
            "Samples equal to the integer model",
            f"all {evidence.samples:,}" if summary["bit_exact"] else f"all but {evidence.mismatches:,}",
            ("bit for bit" if summary["bit_exact"] else f"of {count(evidence.samples, 'sample')}")
            + (f", {count(evidence.channels, 'channel')}" if evidence.channels > 1 else ""),
        ),
        _tile(
            "Signal to error",
            decibels(summary["sqnr_db"]) if summary["error"]["rms"] else "no error at all",
            f"one LSB is {amount(evidence.lsb, evidence.unit)}",
        ),
        _tile(
            "Simulation",
            f"{amount(evidence.cycles_per_second, '')} cycles/s",
            f"{count(evidence.cycles, 'clock cycle')} in {text(duration(evidence.wall_seconds))} "
            f"with {text(evidence.simulator)}{'' if evidence.gates is None else ', gate by gate'}",
        ),
    ]
    return f'<dl class="tiles">\n{"".join(tiles)}</dl>\n'


def _header(evidence: Evidence, summary: Summary) -> str:
    lede = f'<p class="lede">{text(evidence.description)}</p>\n' if evidence.description else ""
    error, bound = (quantity(value, evidence.unit) for value in (summary["error"]["max_abs"], evidence.bound))
    if summary["passed"]:
        title = "Passed"
        sentences = [
            f"The simulated {_what_ran(evidence)} agrees with its integer model bit for bit, and stays within {error} "
            f"of the exact calculation; the limit is {bound}."
        ]
    else:
        title, sentences = "Falls short", list(summary["shortfalls"])
    return (
        f'<header>\n<p class="eyebrow">Accuracy report · {text(evidence.core)} core · '
        f"trace {text(evidence.scenario)}</p>\n<h1>{text(evidence.name)}</h1>\n{lede}</header>\n"
        + verdict_box(summary["passed"], title, sentences, summary["notes"])
    )


def _trace_section(evidence: Evidence) -> str:
    legend = [("golden", "broad", "exact calculation"), ("hardware", "dashed", "hardware")]
    if evidence.truth is not None:
        legend.append(("truth", "broad", "true value"))
    if evidence.unfiltered is not None:
        legend.append(("unfiltered", "", "without the filter"))
    caption = (
        "The hardware, in blue, should lie on the orange line of the exact calculation "
        "(double precision, unrounded coefficients, the same input codes)."
    )
    if evidence.truth is not None and evidence.filter is not None:
        caption += " Their distance from the true value is the noise the filter lets through, and its delay."
    if evidence.shown_channel is not None:
        caption += (
            f" All pictures show channel {evidence.shown_channel:,}, the one of {evidence.channels:,} "
            "with the largest error; the figures above are of all channels."
        )
    drawing = both_widths(plots.trace_figure(evidence, plots.WIDE), plots.trace_figure(evidence, plots.NARROW))
    return "<h2>The measured signal</h2>\n" + _figure("", drawing, caption, legend) + _close_up_figure(evidence)


def _close_up_figure(evidence: Evidence) -> str:
    near = plots.close_up(evidence)
    caption = (
        f"{count(near.stop - near.start, 'sample')} of the same curves; the dotted line marks the largest error. "
        f"The output moves in steps of {amount(evidence.lsb, evidence.unit)}."
    )
    legend = [("golden", "broad", "exact calculation"), ("hardware", "dot", "hardware")]
    drawing = both_widths(plots.close_up_figure(evidence, plots.WIDE), plots.close_up_figure(evidence, plots.NARROW))
    return _figure("Around the largest error", drawing, caption, legend)


def _error_figure(evidence: Evidence) -> str:
    inside, outside = plots.error_limits(evidence)
    legend = [("hardware", "", "hardware minus exact calculation")]
    legend += [
        (
            limit.role,
            "dashed" if limit.dashes == "--" else "dotted",
            f"{limit.words} ±{quantity(limit.value, evidence.unit)}",
        )
        for limit in inside
    ]
    caption = "The curve must stay between the limits."
    if outside:
        names = " and ".join(f"{limit.words} ±{amount(limit.value, evidence.unit)}" for limit in outside)
        caption += f" Too far out to draw: {names}."
    if evidence.first_mismatch is not None:
        caption += (
            f" The upright line marks sample {evidence.first_mismatch:,}, "
            "the first at which hardware and integer model differ."
        )
    drawing = both_widths(plots.error_figure(evidence, plots.WIDE), plots.error_figure(evidence, plots.NARROW))
    return _figure("Over time", drawing, caption, legend)


def _histogram_figure(evidence: Evidence) -> str:
    caption = (
        f"One LSB is {amount(evidence.lsb, evidence.unit)}. Rounding the output spreads the error evenly between "
        "the dotted lines at ±½\u00a0LSB; what lies beyond them comes from inside."
    )
    return _figure("How often each error occurs", plots.histogram_figure(evidence), caption)


def _alternatives_pair(evidence: Evidence, summary: Summary) -> str:
    """How the other realizations fare: a picture, and its numbers beside it."""
    rows = [(f"{evidence.realization} (this design)", summary["error"]["max_abs"], summary["error"]["rms"])]
    rows += [(other.name, other.max_abs, other.rms) for other in evidence.rivals]
    listing = table(
        ("realization", "largest error", "in LSB", "RMS"),
        [
            (
                text(name),
                amount(largest, evidence.unit),
                plain_number(largest / evidence.lsb),
                amount(rms, evidence.unit),
            )
            for name, largest, rms in rows
        ],
        numbers=(1, 2, 3),
    )
    caption = (
        "Same word lengths, same inputs; only what becomes of the rounding errors inside the sections differs. "
        "Mind the scale: each grid line is a step by the same factor."
    )
    legend = [("muted", "dotted", "one LSB"), ("asked", "dotted", "allowed by the specification")]
    return (
        _figure("What the realization is worth", plots.alternatives_figure(evidence), caption, legend)
        + f"<figure><h3>In numbers</h3>\n{listing}</figure>\n"
    )


def _budget_table(evidence: Evidence) -> str:
    def row(name: str, value: float) -> tuple[str, str, str]:
        return text(name), amount(value, evidence.unit), _lsb(value / evidence.lsb)

    rows = [row(name.replace("_", " "), value) for name, value in evidence.bound_parts.items()]
    rows.append(row("limit", evidence.bound))
    rows.append(row("allowed by the specification", evidence.max_error))
    status = "proven" if evidence.proven else "estimated in double precision, not yet proven"
    return (
        "<figure><h3>What the limit is made of</h3>\n"
        + table(("contribution", "at most", ""), rows, numbers=(1, 2))
        + f"<figcaption>Limit of the error over all inputs in range, {status}.</figcaption></figure>\n"
    )


def _limit_cycles_table(evidence: Evidence) -> str:
    """Tell what each section's rounding can keep up by itself, at the section's own output."""
    rows = []
    for found in evidence.limit_cycles:
        weights = [f"{float(weight):.4g}" for weight in found.lyapunov or ()]
        rows.append(
            (
                text(found.section),
                "none, proven" if found.none else amount(found.largest, evidence.unit),
                "" if found.none else _lsb(found.largest / evidence.lsb),
                amount(found.dead_band, evidence.unit) if found.dead_band else "none",
                _lsb(found.dead_band / evidence.lsb) if found.dead_band else "",
                text(", ".join(weights)) or "none exist",
            )
        )
    caption = (
        "Largest limit cycle without input, and the farthest that a constant output can stay from where it should be: "
        "bounds, proven for each section at its own output. Where Lyapunov weights exist, the section cannot go on "
        "oscillating after an overflow either."
    )
    head = ("section", "without input, at most", "", "dead band", "", "Lyapunov weights")
    return (
        "<figure><h3>What rounding can keep up by itself</h3>\n"
        f"{table(head, rows, numbers=range(1, 6))}<figcaption>{caption}</figcaption></figure>\n"
    )


def _error_section(evidence: Evidence, summary: Summary) -> str:
    pairs = _histogram_figure(evidence) + _budget_table(evidence)
    if evidence.rivals:
        pairs += _alternatives_pair(evidence, summary)
    own = _limit_cycles_table(evidence) if evidence.limit_cycles else ""
    return f'<h2>The error</h2>\n{_error_figure(evidence)}<div class="pair">\n{pairs}</div>\n{own}'


def _hertz(edges: Sequence[float]) -> str:
    """Frequencies as they were asked for, to seven digits, without idle zeros."""
    scaled = [(edge, *scale(edge, "Hz")) for edge in edges]
    return " and ".join(f"{edge * factor:.7g} {unit}" for edge, factor, unit in scaled)


def _response_rows(facts: FilterFacts, measures: Mapping[str, float | None]) -> list[tuple[str, str]]:
    rows = [
        ("largest deviation in the passband", decibels(measures["max_deviation_db_passband"])),
        ("largest loss in the passband", decibels(measures["passband_loss_db"])),
    ]
    if facts.passband_edge and facts.passband_loss is not None:
        rows.append((f"allowed up to {_hertz(facts.passband_edge)}", f"{facts.passband_loss:g} dB"))
    rows.append(("smallest loss in the stopband", decibels(measures["stopband_attenuation_db"])))
    if facts.stopband_edge and facts.stopband_loss is not None:
        rows.append((f"asked for from {_hertz(facts.stopband_edge)}", f"{facts.stopband_loss:g} dB"))
    if facts.cutoff:
        rows.append(("cut-off", _hertz(facts.cutoff)))
    radius = measures["largest_pole_radius"]
    rows.append(("sampling frequency", _hertz((facts.sample_rate,))))
    rows.append(("largest pole radius", "—" if radius is None else f"{radius:.7f}"))
    return rows


def _filter_section(facts: FilterFacts, measures: Mapping[str, float | None]) -> str:
    legend = [("golden", "broad", "ideal filter"), ("hardware", "dashed", "integer coefficients")]
    masked = (facts.passband_edge and facts.passband_loss) or (facts.stopband_edge and facts.stopband_loss)
    mask = [("limit", "area", "forbidden by the specification")] if masked else []
    gain = _figure(
        "Gain",
        plots.magnitude_figure(facts),
        "Rounding the coefficients bends the ideal curve by the difference drawn below it.",
        legend + mask,
    )
    delay = _figure(
        "Group delay",
        plots.delay_figure(facts),
        "How much later a slow change of each frequency appears at the output.",
        legend,
    )
    plane = _figure(
        "Poles and zeros",
        plots.pole_zero_figure(facts),
        "Crosses are poles, rings are zeros; inside the unit circle a pole is stable. "
        "Where blue covers orange, rounding has not moved it.",
        [("golden", "", "ideal filter"), ("hardware", "", "integer coefficients")],
    )
    numbers = table(
        ("with the integer coefficients", ""),
        [(text(name), text(value)) for name, value in _response_rows(facts, measures)],
        numbers=(1,),
    )
    return (
        f'<h2>The filter</h2>\n<div class="pair">\n{gain}{delay}{plane}'
        f"<figure><h3>In numbers</h3>\n{numbers}</figure>\n</div>\n"
    )


def _coefficient_table(evidence: Evidence) -> str:
    rows = []
    for section in evidence.sections:
        for index, coefficient in enumerate(section.coefficients):
            title = text(section.name) if index == 0 else ""
            rows.append(
                (
                    title,
                    f"<code>{text(coefficient.name)}</code>",
                    f"<code>{text(format(coefficient.integer, ','))}</code>".replace("-", "−"),
                    text(coefficient.frac),
                    f"<code>{text(format(coefficient.value, '.10g'))}</code>".replace("-", "−"),
                )
            )
    head = ("section", "", "integer", "fractional bits", "value")
    return table(head, rows, numbers=(2, 3, 4))


def _format_table(formats: Sequence[NodeFormat]) -> str:
    """List the formats by stage, folded up if they are many: few readers look for more than one."""
    rows, previous = [], ""
    for row in formats:
        rows.append(
            (
                "" if row.stage == previous else text(row.stage),
                text(row.node),
                f"<code>{text(row.format)}</code>",
                amount(row.low, row.unit),
                amount(row.high, row.unit),
            )
        )
        previous = row.stage
    unfolded = " open" if len(formats) <= 24 else ""
    listing = table(("stage", "signal", "format", "from", "to"), rows, numbers=(3, 4))
    title = f"Number formats along the way: {count(len(formats), 'signal')}"
    return f"<details{unfolded}><summary>{title}</summary>\n{listing}</details>\n"


def _number_section(evidence: Evidence) -> str:
    body = ""
    if evidence.sections:
        body += (
            "<h3>Coefficients</h3>\n<p>The hardware multiplies by the integer; its value is the integer divided by "
            f"2 to the number of fractional bits.</p>\n{_coefficient_table(evidence)}"
        )
    if evidence.formats:
        body += _format_table(evidence.formats)
    return f"<h2>The numbers inside</h2>\n{body}" if body else ""


def _what_ran(evidence: Evidence) -> str:
    return "hardware" if evidence.gates is None else f"netlist for the {text(evidence.gates.board.title)}"


def _netlist_in_words(netlist: Netlist) -> str:
    cells = ", ".join(f"{number:,} {kind}" for kind, number in netlist.cells.items())
    return f"the netlist for the {netlist.board.title}, {netlist.board.device.title}: {cells}"


def _run_section(evidence: Evidence) -> str:
    span = float(evidence.time[-1] - evidence.time[0])
    facts = [
        ("trace", f"{evidence.scenario}, {duration(span)}"),
        ("samples", f"{evidence.samples:,}"),
        ("channels", f"{evidence.channels:,}"),
        ("clock cycles", f"{evidence.cycles:,}"),
        ("latency", count(evidence.latency_cycles, "cycle")),
        ("realization", evidence.realization),
        ("architecture", evidence.architecture),
        (
            "output range",
            f"{plain_number(evidence.low)} to {plain_number(evidence.high)} {unit_symbol(evidence.unit)}".rstrip(),
        ),
        ("simulator", evidence.simulator),
        *([] if evidence.gates is None else [("what ran", _netlist_in_words(evidence.gates))]),
        ("seed", str(evidence.seed)),
        *evidence.tools.items(),
    ]
    why = f"<p>{text(evidence.why)}</p>\n" if evidence.why else ""
    return f"<h2>How this was made</h2>\n{why}{facts_list(facts)}"


def render_page(evidence: Evidence, summary: Summary) -> str:
    """Whole report page; `summary` is what `sosmith.gen.report.report.summarise` makes of `evidence`."""
    body = _header(evidence, summary) + _tiles(evidence, summary)
    evidence = evidence.of_channel(evidence.worst_channel)
    body += _trace_section(evidence)
    body += _error_section(evidence, summary)
    if evidence.filter is not None:
        body += _filter_section(evidence.filter, summary["frequency_response"])
    body += _number_section(evidence) + _run_section(evidence)
    body += f"<footer>Made by sosmith {text(summary['sosmith_version'])}.</footer>\n"
    return page(f"{evidence.name}: accuracy report", body)
