"""The table of a wear report."""

from __future__ import annotations

from rich.markup import escape

from sosmith.commands.tables.console import TableConsole, new_table
from sosmith.instrument.wear.assessment import WearLimits, WearReport
from sosmith.instrument.wear.record_file import WearRecord, moment_text


def print_wear(record: WearRecord, report: WearReport, channel: int) -> None:
    """Print wear, rate and remaining life, with their intervals."""
    rate, limits = report.rate, report.limits
    table = new_table(f"Wear by {escape(record.path.name)}: {report.state}", ["", ""])
    of_channel = f" of channel {channel}" if record.channels else ""
    table.add_row("record", f"{report.samples:,} readings{of_channel} over {report.duration:.4g} days")
    table.add_row(
        "clearance",
        f"{report.clearance:.4g} mm, the median of the last {_length(rate.block)} ({limits.initial:g} mm new)",
    )
    by = "the scatter alone" if report.uncertainty is None else f"±{report.uncertainty.standard:.2g} mm standard"
    table.add_row("wear", f"{report.wear:.4g} mm ({report.wear_low:.4g} to {report.wear_high:.4g}, by {by})")
    table.add_row("remaining", f"{report.remaining:.4g} mm {_end(limits)}")
    interval = f"{rate.low:.3g} to {rate.high:.3g} at {100 * rate.confidence:g} %"
    table.add_row("rate", f"{rate.rate:.3g} mm a day ({interval}), {_yearly(rate.rate)} mm a year")
    table.add_row(
        "taken from",
        f"{rate.blocks} blocks, scatter {rate.scatter:.2g} mm, neighbours correlated by {rate.correlation:.2f}",
    )
    if (fall := report.fall) is not None:
        table.add_row(
            "fall",
            f"{fall.size:.3g} mm, {fall.window:.4g} days ago, as after turning a wheel or remounting a sensor: use "
            f"--window {fall.window:.6g} to take the rate from there on",
        )
    table.add_row("remaining life", _life(report))
    table.add_row("state", f"{report.state}: the last reading is {report.last:.4g} mm")
    for name, first, count in (
        ("warning", report.first_warning, report.warnings),
        ("critical", report.first_critical, report.criticals),
    ):
        if first is not None:
            when = moment_text(first) if record.dated else f"day {first:.4g}"
            table.add_row(f"first {name}", f"{when}; {count} of the {report.last_block} readings of the last block")
    TableConsole().print(table)


def _end(limits: WearLimits) -> str:
    if limits.critical_clearance < limits.initial + limits.limit:
        return f"to the end of the sensor's range, {limits.critical_clearance:g} mm, which comes before the limit"
    return f"to the limit of {limits.limit:g} mm"


def _length(block: float) -> str:
    return "day" if block == 1 else f"{block:.3g} days"


def _yearly(rate: float) -> str:
    return f"{rate * 365.25:.3g}"


def _life(report: WearReport) -> str:
    if report.life is None:
        least = f"; at least {report.life_low:.4g} days" if report.life_low is not None else ""
        return f"no end in sight{least}"
    low = "0" if report.life_low is None else f"{report.life_low:.4g}"
    high = "no end in sight" if report.life_high is None else f"{report.life_high:.4g}"
    return f"{report.life:.4g} days ({low} to {high}), if wear continues at this rate"
