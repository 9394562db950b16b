"""Format of a scenario file: its tables, their keys and permitted values. To add a key, add it to its table."""

from __future__ import annotations

import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from sosmith.model.tables.toml_tables import Table, UnfitKeyError, shown

MIN_CLEARANCE = 0.01
"""Smallest clearance in mm: above 0, where accuracy in per cent is undefined."""

MAX_CLEARANCE = 25.0
"""Largest clearance in mm; the paper's sensor ends at 10.5."""

TEMPERATURES = (-40.0, 400.0)
"""Lowest and highest temperature in degC: a winter night, and twice the 200 degC of tread braking."""

MAX_DAY = 36_500.0
"""Largest number of a day: a hundred years."""

MAX_SECONDS = 1e6
"""Longest excerpt in s."""

MOVING = ("tangent", "curve", "braking")
"""Operations during which the vehicle moves."""

Operation = Literal["bench", "depot", "tangent", "curve", "braking"]


def quantity(unit: str, low: float, high: float, default: Any = ...) -> Any:
    """Return a field for a number of `unit` from `low` to `high`."""
    what = f"a number of {unit}" if unit else "a number"
    return Field(default, ge=low, le=high, description=f"{what} from {low:g} to {high:g}")


def numbers(unit: str, low: float, high: float, default: Any = ..., least: int = 1, most: int = 1000) -> Any:
    """Return a field for a list of `least` to `most` numbers of `unit` from `low` to `high`."""
    what = f"a list of {least} to {most} numbers of {unit} from {low:g} to {high:g}"
    return Field(default, min_length=least, max_length=most, strict=False, description=what)


def table(default: Any, what: str) -> Any:
    """Return a field for a table with defaults."""
    return Field(default_factory=default, description=f"a table {what}")


def one_of(*names: str) -> str:
    """Return `names` as a phrase."""
    return f"one of {', '.join(names)}"


Clearance = Annotated[float, Field(ge=MIN_CLEARANCE, le=MAX_CLEARANCE)]
Wear = Annotated[float, Field(ge=0.0, le=MAX_CLEARANCE)]
Temperature = Annotated[float, Field(ge=TEMPERATURES[0], le=TEMPERATURES[1])]
Day = Annotated[float, Field(ge=0.0, le=MAX_DAY)]


class MainsTable(Table):
    """``[sensors.inductive.mains]``."""

    frequency: float = quantity("Hz", 1.0, 1000.0, 50.0)
    amplitudes: tuple[Annotated[float, Field(ge=0.0, le=10.0)], ...] = numbers("V", 0.0, 10.0, (), least=0, most=40)


class AgeingTable(Table):
    """``[sensors.inductive.ageing]``."""

    offset_per_day: float = quantity("V per day", -1.0, 1.0, 0.0)
    gain_per_day: float = quantity("1 per day", -0.1, 0.1, 0.0)
    offset_walk: float = quantity("V", 0.0, 1.0, 0.0)
    gain_walk: float = quantity("", 0.0, 0.1, 0.0)


class SystematicErrorTable(Table):
    """``[sensors.inductive.systematic_error]``."""

    rms: float = quantity("mm", 0.0, 5.0, 0.0)
    correlation: float = quantity("mm", 0.01, 100.0, 2.0)


class DigitizerTable(Table):
    """``[sensors.inductive.digitizer]``: errors of the converter that feeds the core's voltage input."""

    offset: float = quantity("LSB", -1e6, 1e6, 0.0)
    gain_error: float = quantity("", -0.5, 0.5, 0.0)
    inl: float = quantity("LSB", 0.0, 1e6, 0.0)


class EmfDigitizerTable(DigitizerTable):
    """``[sensors.thermocouple.digitizer]``: the thermocouple's own converter."""

    bits: int = Field(19, ge=2, le=32, description="a whole number from 2 to 32")
    range: float = quantity("mV", 1.0, 10_000.0, 78.125)


class InductiveTable(Table):
    """``[sensors.inductive]``."""

    model: Literal["equation_4", "equation_5a", "coil"] = Field(
        "equation_5a", description=one_of("equation_4", "equation_5a", "coil")
    )
    noise: float = quantity("V", 0.0, 10.0)
    output_range: tuple[float, float] = Field(
        (0.0, 10.0), strict=False, description="a list of 2 numbers of V, [low, high]"
    )
    mains: MainsTable = table(MainsTable, "of the mains' hum")
    ageing: AgeingTable = table(AgeingTable, "of the drift over days")
    systematic_error: SystematicErrorTable = table(SystematicErrorTable, "of a run's error")
    digitizer: DigitizerTable = table(DigitizerTable, "of the converter")

    @model_validator(mode="after")
    def _check(self) -> Self:
        low, high = self.output_range
        if not low < high:
            raise UnfitKeyError("output_range", "rising, [low, high]", shown(self.output_range))
        return self


class ThermocoupleTable(Table):
    """``[sensors.thermocouple]``."""

    noise: float = quantity("uV", 0.0, 10_000.0)
    cold_junction: float = quantity("degC", -40.0, 125.0, 25.0)
    cold_junction_error: float = quantity("degC", -50.0, 50.0, 0.0)
    digitizer: EmfDigitizerTable = table(EmfDigitizerTable, "of the converter")


class SensorsTable(Table):
    """``[sensors]``."""

    inductive: InductiveTable = Field(description="a table [sensors.inductive]")
    thermocouple: ThermocoupleTable = Field(description="a table [sensors.thermocouple]")


class WearTable(Table):
    """``[wear]`` or ``[[channel]]``: initial clearance, and wear by a rate or by breakpoints."""

    initial_clearance: float = quantity("mm", MIN_CLEARANCE, MAX_CLEARANCE)
    rate: float | None = quantity("mm per day", 0.0, 10.0, None)
    rate_per_1000_km: float | None = quantity("mm per 1000 km", 0.0, 10.0, None)
    km_per_day: float | None = quantity("km per day", 0.0, 10_000.0, None)
    history: tuple[Annotated[tuple[Day, Wear], Field(strict=False)], ...] | None = Field(
        None, min_length=2, strict=False, description="a list of pairs [day, wear in mm]"
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        ways = [key for key in ("rate", "rate_per_1000_km", "history") if getattr(self, key) is not None]
        if len(ways) != 1:
            found = ", ".join(ways) or "none of them"
            raise UnfitKeyError("", "given by one of rate, rate_per_1000_km and history", found)
        if (self.rate_per_1000_km is None) != (self.km_per_day is None):
            raise UnfitKeyError("km_per_day", "given if and only if rate_per_1000_km is given", shown(self.km_per_day))
        days = [day for day, _ in self.history or ()]
        if sorted(set(days)) != days:
            raise UnfitKeyError("history", "a list of pairs with rising days", shown(days))
        return self


class CalibrationTable(Table):
    """``[calibration]``: the measurements taken by hand in the depot."""

    days: tuple[Day, ...] = numbers("days", 0.0, MAX_DAY)
    clearances: tuple[Clearance, ...] = numbers("mm", MIN_CLEARANCE, MAX_CLEARANCE)
    temperatures: tuple[Temperature, ...] = numbers("degC", *TEMPERATURES)
    repeats: int = Field(1, ge=1, le=1000, description="a whole number from 1 to 1000")
    scatter: float = quantity("mm", 0.0, 5.0)
    scatter_in: Literal["clearance", "voltage"] = Field("clearance", description=one_of("clearance", "voltage"))

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.repeats > 1 and not self.scatter:
            # The store rejects equal measurements as duplicates.
            raise UnfitKeyError("repeats", "1 where scatter is 0", shown(self.repeats))
        for name in ("days", "clearances", "temperatures"):
            values = getattr(self, name)
            if len(set(values)) != len(values):
                raise UnfitKeyError(name, "a list without repetition", shown(values))
        return self


class FaultTable(Table):
    """``[[excerpt.fault]]``."""

    sensor: Literal["inductive", "thermocouple"] = Field(description=one_of("inductive", "thermocouple"))
    kind: Literal["missing", "stuck", "open"] = Field(description=one_of("missing", "stuck", "open"))
    start: float = quantity("s", 0.0, MAX_SECONDS)
    seconds: float = quantity("s", 1e-6, MAX_SECONDS)
    share: float | None = quantity("", 0.0, 1.0, None)
    code: int | None = Field(None, ge=-(1 << 31), lt=1 << 32, description="a whole number, a code of the input")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.kind == "open" and self.sensor != "thermocouple":
            raise UnfitKeyError("kind", "missing or stuck for the inductive sensor", "'open'")
        if (self.kind == "missing") != (self.share is not None):
            raise UnfitKeyError("share", 'given if and only if kind is "missing"', shown(self.share))
        if self.code is not None and self.kind != "stuck":
            raise UnfitKeyError("code", 'given only if kind is "stuck"', shown(self.code))
        return self


class ExcerptTable(Table):
    """``[[excerpt]]``: a period of time on one day."""

    day: float = quantity("days", 0.0, MAX_DAY, 0.0)
    operation: Operation = Field(description=one_of("bench", "depot", *MOVING))
    seconds: float | None = quantity("s", 1e-3, MAX_SECONDS, None)
    temperature: float = quantity("degC", *TEMPERATURES)
    temperature_to: float | None = quantity("degC", *TEMPERATURES, None)
    time_constant: float | None = quantity("s", 1e-3, MAX_SECONDS, None)
    clearances: tuple[Clearance, ...] | None = numbers("mm", MIN_CLEARANCE, MAX_CLEARANCE, None)
    motion: tuple[
        Annotated[
            tuple[Annotated[float, Field(gt=0.0, le=1000.0)], Annotated[float, Field(ge=0.0, le=MAX_CLEARANCE)]],
            Field(strict=False),
        ],
        ...,
    ] = Field((), strict=False, max_length=1000, description="a list of pairs [frequency in Hz, amplitude in mm]")
    motion_from: str | None = Field(
        None, min_length=1, description='"vehicle", or the name of a CSV file with the columns time_s and clearance_mm'
    )
    vibration: float = quantity("mm", 0.0, MAX_CLEARANCE, 0.0)
    fault: tuple[FaultTable, ...] = Field((), strict=False, description="tables [[excerpt.fault]]")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.time_constant is not None and self.temperature_to is None:
            raise UnfitKeyError("time_constant", "given only together with temperature_to", shown(self.time_constant))
        if self.motion and self.motion_from is not None:
            raise UnfitKeyError("motion_from", "left out where motion is given", shown(self.motion_from))
        moved = [key for key in ("motion", "motion_from", "vibration") if getattr(self, key)]
        if moved and self.operation not in MOVING:
            raise UnfitKeyError(
                moved[0], f"left out where operation is {self.operation}", shown(getattr(self, moved[0]))
            )
        if self.clearances is not None and self.operation in MOVING:
            raise UnfitKeyError("clearances", f"left out where operation is {self.operation}", shown(self.clearances))
        return self


class ScenarioDocument(Table):
    """The whole file."""

    description: str = Field(min_length=1, max_length=200, description="a text of 1 to 200 characters")
    start: datetime.date = Field(datetime.date(2024, 1, 1), description="a date such as 2024-03-01, that of day 0")
    sensors: SensorsTable = Field(description="a table [sensors]")
    wear: WearTable | None = Field(None, description="a table [wear]")
    channel: tuple[WearTable, ...] = Field((), strict=False, description="tables [[channel]], one for each channel")
    calibration: CalibrationTable | None = Field(None, description="a table [calibration]")
    excerpt: tuple[ExcerptTable, ...] = Field(
        min_length=1, max_length=10_000, strict=False, description="at least one table [[excerpt]]"
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.wear is not None and self.channel:
            raise UnfitKeyError("channel", "left out where [wear] is given", shown(self.channel))
        if self.start.toordinal() + MAX_DAY > datetime.date.max.toordinal():
            latest = datetime.date.fromordinal(datetime.date.max.toordinal() - int(MAX_DAY))
            raise UnfitKeyError("start", f"a date up to {latest}, so that every day has a date", shown(self.start))
        wearing = [k for k, excerpt in enumerate(self.excerpt) if excerpt.clearances is None]
        if wearing and self.wear is None and not self.channel:
            raise UnfitKeyError(f"excerpt[{wearing[0]}].clearances", "given where there is no [wear]", "missing")
        return self
