"""Files that are withdrawn: their measurements stay in the store and count no more."""

from __future__ import annotations

from dataclasses import dataclass, replace

from sosmith.gen.calibration.fit import Progress, untold
from sosmith.instrument.calibration.measurement_store import MeasurementStore, Source
from sosmith.instrument.calibration.self_updating import (
    Calibration,
    Settings,
    fit_version,
    known_sensor,
    settings_of,
)
from sosmith.model.errors import SpecificationError


@dataclass(frozen=True)
class Withdrawn:
    """Result of withdrawing a file.

    Attributes
    ----------
    source : Source
        The file, with its withdrawal.
    calibration : Calibration or None
        The version without it, fitted as the newest one was; None if there was none, or no polynomial is good enough.
    shortfall : str
        Reason why there is no version now; empty otherwise.
    """

    source: Source
    calibration: Calibration | None
    shortfall: str


def withdraw(
    store: MeasurementStore,
    sensor: str,
    name: str,
    date: str,
    author: str,
    reason: str,
    progress: Progress = untold,
) -> Withdrawn:
    """Withdraw a file: its measurements stay in the store and count no more. Fit again, in one transaction.

    Parameters
    ----------
    name : str
        Number or name of the file, as `MeasurementStore.sources` has them.
    date, author, reason : str
        Of the withdrawal; the date is that of the new version, too.

    Raises
    ------
    SpecificationError
        If the sensor is unknown; if no file of it that counts has that number or name, or several do; if author or
        reason is no printable text.
    """
    for what, text in (("author", author), ("reason", reason)):
        if not text.strip() or not text.isprintable():
            raise SpecificationError(f"the {what} must be printable text, not {text!r}")
    with store.transaction():
        known_sensor(store, sensor)
        source = _counted_source(store, sensor, name)
        store.withdraw(source.number, date, author, reason)
        source = next(one for one in store.sources(sensor) if one.number == source.number)
        versions = store.versions(sensor)
        try:
            settings = settings_of(versions[-1]) if versions else Settings("bayes", 0.0, False, None, None)
            settings = replace(settings, sensor_type=store.sensor_type(sensor))
            return Withdrawn(source, fit_version(store, sensor, date, settings, progress), "")
        except SpecificationError as error:
            return Withdrawn(source, None, str(error))


def sources_of(store: MeasurementStore, sensor: str) -> list[Source]:
    """Return the files of a sensor; raises SpecificationError if there is no such sensor."""
    known_sensor(store, sensor)
    return store.sources(sensor)


def _counted_source(store: MeasurementStore, sensor: str, name: str) -> Source:
    """Return the file of that number or name that was not withdrawn."""
    sources = store.sources(sensor)
    found = [one for one in sources if name in (str(one.number), one.name)]
    if not found:
        raise SpecificationError(
            f"{store.path}: the file must be one of {', '.join(one.name for one in sources)}, or its number, not {name}"
        )
    counted = [one for one in found if one.withdrawal is None]
    if not counted:
        gone = found[-1].withdrawal
        assert gone is not None, "it does not count"
        raise SpecificationError(
            f"{name} must be a file that counts, not one that {gone.author} withdrew on {gone.date}"
        )
    if len(counted) > 1:
        numbers = ", ".join(str(one.number) for one in counted)
        raise SpecificationError(
            f"{name} must be given by its number, one of {numbers}, not by a name that is there twice"
        )
    return counted[0]
