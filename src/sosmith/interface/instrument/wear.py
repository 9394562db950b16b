"""The wear of a wheel flange, its rate and its remaining life, from a record of clearances."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from sosmith.gen.facts.table import Table, View
from sosmith.instrument.uncertainty.instrument_budget import instrument_of
from sosmith.instrument.wear.assessment import WearLimits, WearReport, judge
from sosmith.instrument.wear.over_days import TOTAL_ERROR, OverDays, over_days
from sosmith.instrument.wear.record_file import WearRecord, moment_text, read_wear_record
from sosmith.instrument.wear.state_space import Happening, Told, WearModel
from sosmith.interface.certificate import Progress
from sosmith.interface.specification import Specification
from sosmith.model.errors import SpecificationError

__all__ = ["Wear", "WearLimits"]


@dataclass(frozen=True, eq=False)
class Wear(View):
    """The wear by a record of clearances.

    Attributes
    ----------
    record : WearRecord
        The clearances.
    report : WearReport
        What they say.
    channel : int
        The channel that was read.
    over_days : OverDays or None
        Level and rate as a state over days, if it was asked for.
    """

    record: WearRecord = field(repr=False)
    report: WearReport
    channel: int
    over_days: OverDays | None = None

    @classmethod
    def of(
        cls,
        trace: str | PathLike[str],
        limits: WearLimits | Specification,
        *,
        channel: int = 0,
        column: str | None = None,
        block: float | None = None,
        window: float | None = None,
        confidence: float = 0.95,
        risk: float | None = None,
        day_error: float | None = None,
        other_wheel: str | None = None,
        total: str | None = None,
        total_error: float | None = None,
        progress: Progress = lambda step, done, total: None,
    ) -> Wear:
        """Judge the record in a CSV file.

        Parameters
        ----------
        trace : path
            The file, with a column of time and one of clearance in mm.
        limits : WearLimits or Specification
            The clearances that count; a specification has them in its table ``[wear]``, and what a reading is worth.
        channel : int
            Channel of the specification, and of the file if it has that column.
        column : str
            Name of the column of clearances, if it is not a usual one.
        block, window : float
            Days of a block of readings, and of the record's end that the rate is taken from.
        confidence : float
            Probability of the intervals, between 0 and 1.
        risk : float
            Probability of being past the limit from which wear is critical: follows level and rate over the days, and
            tells jumps and changes of the rate. Without, they are not followed.
        day_error : float
            With `risk`: standard uncertainty in mm of what is new each day in a reading. By default that of a
            specification that states it, else the scatter of the days.
        other_wheel, total : str
            With `risk`: names of the columns of the other wheel's clearance in mm, and of the known sum of both.
        total_error : float
            Standard uncertainty in mm of that sum; 0.03 if not given.
        progress : callable
            Called with the name of each step, 0 and 0.

        Raises
        ------
        SpecificationError
            If the file cannot be read, or the limits do not fit.
        """
        of_days = {"--day-error": day_error, "--other-wheel": other_wheel, "--sum": total, "--sum-error": total_error}
        for name, given in of_days.items():
            if given is not None and risk is None:
                raise SpecificationError(f"{name} must go with --risk, not without it")
        worth, known, instrument = None, limits, None
        if isinstance(known, Specification):
            asked, known = known, _limits_of(known, channel)
            instrument = instrument_of(asked.checked)
            worth = None if instrument is None else instrument.of_wear
        path = Path(fspath(trace))
        progress(f"reading {path}", 0, 0)
        record = read_wear_record(path, column, channel)
        if channel and known is limits and not record.channels:
            raise SpecificationError("--channel must come with --spec or with a column channel, not without both")
        progress("rate of wear", 0, 0)
        report = judge(
            record.time,
            record.clearance,
            known,
            block=block,
            window=window,
            confidence=confidence,
            uncertainty=worth,
        )
        followed = None
        if risk is not None:
            progress("wear over days", 0, 0)
            model = WearModel()
            if instrument is not None:
                model = WearModel(shared=instrument.shared(report.clearance))
                day_error = day_error or instrument.known.systematic or None
            followed = over_days(
                record.time,
                record.clearance,
                known,
                block=block,
                day_error=day_error,
                model=model,
                risk=risk,
                confidence=confidence,
                other=None if other_wheel is None else read_wear_record(path, other_wheel, channel).clearance,
                total=None if total is None else read_wear_record(path, total, channel).clearance,
                total_error=TOTAL_ERROR if total_error is None else total_error,
            )
        return cls(record, report, channel, followed)

    def picture(self, file_format: str) -> bytes:
        """Draw the record with its rate, as "svg" or "png"."""
        from sosmith.instrument.wear.wear_plot import wear_plot

        return wear_plot(self.record.time, self.record.clearance, self.report, file_format, dated=self.record.dated)

    def tables(self) -> list[Table]:
        """Return wear, rate and remaining life, with their intervals."""
        rows = list(_rows(self.record, self.report, self.channel))
        tables = [Table(f"Wear by {self.record.path.name}: {self.report.state}", rows)]
        if self.over_days is not None:
            tables.append(Table("Over days", list(_rows_over_days(self.record, self.over_days))))
        return tables

    def as_dict(self) -> dict[str, Any]:
        """Return all results in JSON types, with the unit in each key."""
        record, report, rate = self.record, self.report, self.report.rate
        return {
            "file": str(record.path),
            "column": record.column,
            "samples": report.samples,
            "duration_days": report.duration,
            "limits_mm": asdict(report.limits) | {"critical_clearance": report.limits.critical_clearance},
            "clearance_mm": report.clearance,
            "wear_mm": report.wear,
            "wear_interval_mm": {"low": report.wear_low, "high": report.wear_high, "confidence": rate.confidence},
            "uncertainty": None
            if report.uncertainty is None
            else {"standard_mm": report.uncertainty.standard, "rise_mm": report.uncertainty.rise},
            "remaining_mm": report.remaining,
            "rate_mm_per_day": {"value": rate.rate, "low": rate.low, "high": rate.high, "confidence": rate.confidence},
            "fall": None if report.fall is None else {"mm": report.fall.size, "window_days": report.fall.window},
            "blocks": {
                "count": rate.blocks,
                "days": rate.block,
                "scatter_mm": rate.scatter,
                "correlation": rate.correlation,
            },
            "life_days": {"value": report.life, "low": report.life_low, "high": report.life_high},
            "last_reading_mm": report.last,
            "state": str(report.state),
            "first_warning_days": report.first_warning,
            "first_critical_days": report.first_critical,
            "last_block": {
                "samples": report.last_block,
                "at_warning_or_beyond": report.warnings,
                "critical": report.criticals,
            },
            "over_days": None if self.over_days is None else _over_days_json(self.over_days),
        }


def _limits_of(asked: Specification, channel: int) -> WearLimits:
    spec = asked.checked
    path = spec.path
    wear = spec.wear
    if wear is None:
        raise SpecificationError(f"{path}: the specification must have a table [wear] for --spec, not none")
    if spec.output.unit != "mm":
        raise SpecificationError(f"{path}: output.unit must be 'mm' for --spec, not {spec.output.unit!r}")
    if channel >= spec.channels:
        raise SpecificationError(f"{path}: channel must be below {spec.channels}, the count of channels, not {channel}")
    return WearLimits(
        initial=float(wear.initial[channel if len(wear.initial) > 1 else 0]),
        limit=float(wear.limit),
        warning=float(wear.warning),
        sensor_range=None if wear.sensor_range is None else float(wear.sensor_range),
    )


def _rows(record: WearRecord, report: WearReport, channel: int) -> Iterator[tuple[str, str]]:
    """Wear, rate and remaining life, with their intervals."""
    rate, limits = report.rate, report.limits
    of_channel = f" of channel {channel}" if record.channels else ""
    yield ("record", f"{report.samples:,} readings{of_channel} over {report.duration:.4g} days")
    yield (
        "clearance",
        f"{report.clearance:.4g} mm, the median of the last {_length(rate.block)} ({limits.initial:g} mm new)",
    )
    by = "the scatter alone" if report.uncertainty is None else f"±{report.uncertainty.standard:.2g} mm standard"
    yield ("wear", f"{report.wear:.4g} mm ({report.wear_low:.4g} to {report.wear_high:.4g}, by {by})")
    yield ("remaining", f"{report.remaining:.4g} mm {_end(limits)}")
    interval = f"{rate.low:.3g} to {rate.high:.3g} at {100 * rate.confidence:g} %"
    yield ("rate", f"{rate.rate:.3g} mm a day ({interval}), {_yearly(rate.rate)} mm a year")
    yield (
        "taken from",
        f"{rate.blocks} blocks, scatter {rate.scatter:.2g} mm, neighbours correlated by {rate.correlation:.2f}",
    )
    if (fall := report.fall) is not None:
        yield (
            "fall",
            f"{fall.size:.3g} mm, {fall.window:.4g} days ago, as after turning a wheel or remounting a sensor: use "
            f"--window {fall.window:.6g} to take the rate from there on",
        )
    yield ("remaining life", _life(report))
    yield ("state", f"{report.state}: the last reading is {report.last:.4g} mm")
    for name, first, count in (
        ("warning", report.first_warning, report.warnings),
        ("critical", report.first_critical, report.criticals),
    ):
        if first is not None:
            when = moment_text(first) if record.dated else f"day {first:.4g}"
            yield (f"first {name}", f"{when}; {count} of the {report.last_block} readings of the last block")


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


def _rows_over_days(record: WearRecord, found: OverDays) -> Iterator[tuple[str, str]]:
    """Level, rate, risk and what was told, by the state over days."""
    share, (low, high) = f"at {100 * found.confidence:g} %", found.interval
    yield "clearance", f"{found.now.level()[0]:.4g} mm ({low:.4g} to {high:.4g} {share})"
    if found.other is not None:
        level, low, high = found.other
        yield "other wheel", f"{level:.4g} mm ({low:.4g} to {high:.4g})"
    rate, slow, fast = found.rate
    yield "rate", f"{rate:.3g} mm a day ({slow:.3g} to {fast:.3g})"
    by = "as stated" if found.stated else "by the scatter of the days"
    yield "error of a day", f"{found.day_error:.2g} mm, {by}"
    half, soon, late = ("no end in sight" if days is None else f"{days:.4g}" for days in found.life)
    yield "remaining life", f"{half} days ({soon} to {late})" if found.life[0] is not None else half
    what = "critical" if found.critical else "not critical"
    yield "past the limit", f"with a probability of {found.past:.2g}: {what} at a risk of {found.risk:g}"
    for one in found.told:
        yield "told", _told(record, one)


def _told(record: WearRecord, one: Told) -> str:
    def when(days: float) -> str:
        return moment_text(days) if record.dated else f"day {days:.4g}"

    text = (
        f"a {one.event.what} to {one.size:.2g} mm a day at about {when(one.event.time)}"
        if one.event.what is Happening.RATE
        else f"a {one.event.what} of about {one.size:+.2g} mm at {when(one.event.time)}"
    )
    other = " of the other wheel" * one.event.wheel
    return f"{text}{other}, seen at {when(one.at)} with a probability of {one.probability:.2g}"


def _over_days_json(found: OverDays) -> dict[str, Any]:
    (level, spread), (low, high), (rate, slow, fast) = found.now.level(), found.interval, found.rate
    half, soon, late = found.life
    return {
        "clearance_mm": {"value": level, "standard": spread, "low": low, "high": high},
        "rate_mm_per_day": {"value": rate, "low": slow, "high": fast},
        "other_wheel_mm": None
        if found.other is None
        else dict(zip(("value", "low", "high"), found.other, strict=True)),
        "day_error_mm": found.day_error,
        "life_days": {"value": half, "low": soon, "high": late},
        "probability_past_the_limit": found.past,
        "risk": found.risk,
        "critical": found.critical,
        "told": [
            {
                "what": str(one.event.what),
                "wheel": one.event.wheel,
                "days": one.event.time,
                "seen_days": one.at,
                "probability": one.probability,
                "size": one.size,
            }
            for one in found.told
        ],
    }
