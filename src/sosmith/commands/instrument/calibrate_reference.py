"""`sosmith calibrate reference`: the morning's targets, from a file, by hand, or live from a board."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sosmith.commands.instrument.calibrate_options import DATE, ORDER, SENSOR, STORE, lengths, millimetres
from sosmith.commands.options import BAUD, PORT, print_tables
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.terminal import JSON_OPTION, note, print_json, show_progress

if TYPE_CHECKING:
    from sosmith.interface.instrument.live.targets import LiveReading, LiveTargets

_SKIP = "s"
"""Answer that leaves a target out."""


@click.command("reference")
@click.argument("targets", type=click.Path(path_type=Path), required=False)
@click.option(
    "--reading",
    "readings",
    type=(float, float, float),
    multiple=True,
    metavar="MM V DEGC",
    help="A reading by hand, in place of TARGETS: clearance of the target in mm, voltage in V, temperature in degC; "
    "may be given several times.",
)
@PORT
@click.option(
    "--target",
    "clearances",
    multiple=True,
    callback=lengths,
    metavar="LENGTH",
    help="With --port: clearance of a target, such as 2mm; given once for each, in the order in which they are read.",
)
@click.option(
    "--temperature",
    type=click.FloatRange(-273.15, 2000.0),
    metavar="DEGC",
    help="With --port: temperature of the sensor in degC.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(0.1, 3600.0),
    default=5.0,
    show_default=True,
    help="With --port: time over which a target is averaged, once the reading stands still.",
)
@click.option(
    "--channel", type=click.IntRange(min=0), help="With --port: channel of the sensor.  [default: the only one]"
)
@click.option(
    "--files",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="With --port: folder with manifest and certificate of the core.  [default: build/<name> or a folder in it]",
)
@click.option(
    "--active",
    type=click.Path(path_type=Path),
    metavar="SET.json",
    help="With --port: the set that `sosmith reload` has loaded into the board, if it has loaded one.",
)
@BAUD
@click.option(
    "--uncertainty",
    default="0.02mm",
    show_default=True,
    callback=millimetres,
    help="Standard uncertainty of a target's clearance, where TARGETS has no column uncertainty_mm.",
)
@click.option("--surprising", is_flag=True, help="Store readings that look like a slip.")
@ORDER
@STORE
@SENSOR
@DATE
@JSON_OPTION
def reference_command(
    targets: Path | None,
    readings: tuple[tuple[float, float, float], ...],
    port: str | None,
    clearances: tuple[float, ...],
    temperature: float | None,
    seconds: float,
    channel: int | None,
    files: Path | None,
    active: Path | None,
    baud: int,
    uncertainty: float,
    surprising: bool,
    order: int | None,
    store: Path,
    sensor: str,
    date: str,
    as_json: bool,
) -> None:
    """Read reference targets in the morning: the curve of the day, and what a reading is worth today.

    TARGETS is a CSV or XLSX file as for `sosmith calibrate add`, with what the sensor reads at targets of known
    clearance, such as gauge blocks. They count by their own uncertainty, not by the scatter of other measurements.
    Three to five of them, spread over the clearances that matter, remove most of the error of the day. Prints how far
    the sensor is off at each target by the calibration before and now, and the intervals of readings on this day.

    With --port, a board with converters reads them: for each --target, the command asks for it, waits until the reading
    stands still, and averages it. The voltage follows from the calibration that is active in the core. Nothing is
    stored before the last target has been read: Ctrl-C leaves the store as it was.

    \b
        sosmith calibrate reference gauges.csv --sensor left
        sosmith calibrate reference --sensor left --reading 2 1.52 21 --reading 5 5.31 21 --reading 8 7.95 21
        sosmith calibrate reference --sensor left --port /dev/ttyUSB1 --target 2mm --target 5mm --temperature 21
    """
    from sosmith.interface.instrument.calibration_store import CalibrationStore

    if [targets is None, not readings, port is None].count(False) != 1:
        raise SpecificationError("targets must be given by a file, by --reading, or live by --port, one of them")
    kept, source, live = CalibrationStore(store), "by hand", []
    given: Path | Sequence[Sequence[float]] = readings if targets is None else targets
    if port is not None:
        if not clearances or temperature is None:
            raise SpecificationError("--port must come with --target, once for each target, and with --temperature")
        from sosmith.interface.instrument.live.targets import LiveTargets

        kept.files(sensor)  # before anybody moves a target: an unknown sensor is refused
        with LiveTargets(port, files=files, active=active, channel=channel, baud=baud) as board:
            live = [
                reading
                for clearance in clearances
                if (reading := _read(board, clearance, temperature, seconds, uncertainty)) is not None
            ]
        if not live:
            raise SpecificationError("at least one target must be read, not all of them left out")
        given, source = [one.row(uncertainty) for one in live], "read live"
    elif clearances or temperature is not None or channel is not None or files or active:
        raise SpecificationError("--target, --temperature, --channel, --files and --active must come with --port")
    with show_progress() as step:
        read = kept.reference(
            sensor,
            given,
            date,
            uncertainty=uncertainty,
            source=source,
            surprising=surprising,
            order=order,
            progress=step,
        )
    if as_json:
        print_json(read.as_dict() | ({"live": [one.as_dict() for one in live]} if live else {}))
    for warning in read.warnings:
        note(f"warning: {warning}")
    for warning in read.added.fitted.warnings:
        note(f"warning: {warning}")
    if not as_json:
        from sosmith.interface.instrument.live.targets import readings_table

        print_tables([*([readings_table(live)] if live else []), *read.tables()])


def _read(
    board: LiveTargets, clearance: float, temperature: float, seconds: float, uncertainty: float
) -> LiveReading | None:
    """Ask for a target, and read it; None if it is left out."""
    while True:
        question = f"target of {clearance:g} mm: put it before the sensor, then Enter, or {_SKIP} and Enter without it"
        if click.prompt(question, default="", show_default=False, prompt_suffix=": ", err=True).strip() == _SKIP:
            return None
        try:
            with show_progress() as step:
                reading = board.read(clearance, temperature, seconds=seconds, uncertainty=uncertainty, progress=step)
        except ShortfallError as error:
            note(f"not read: {error}")
            continue
        note(
            f"{clearance:g} mm: {reading.voltage:.4f} V at {temperature:g} degC, the mean of {reading.count:,} results "
            f"that scatter by {1e3 * reading.scatter:.2f} mV; known to {1e3 * reading.uncertainty:.2f} mV"
        )
        return reading
