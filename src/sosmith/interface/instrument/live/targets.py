"""Reference targets read live: what a board with converters measures while a target is before its sensor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from sosmith.gen.facts.table import Table
from sosmith.host.board import BAUD, Board
from sosmith.host.clock import Clock
from sosmith.host.identity_check import check_files, folder_of
from sosmith.host.loading import check_active, read_set
from sosmith.instrument.calibration.store.read_back import ReadBack
from sosmith.interface.certificate import Progress
from sosmith.interface.files import default_folder
from sosmith.interface.instrument.live.steady import SteadyReader
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.link.identity import Identity
from sosmith.model.polynomial import Polynomial
from sosmith.verify.certificate_file import read_certificate

SECONDS = 5.0
"""Time in s over which a target is read, unless another is asked for."""

STEADY = 0.1
"""A reading stands still if its halves differ by no more than this share of the target's uncertainty."""

LEAST = 0.5
"""V per mm of the paper's sensors where they have least, for a core whose results are in V."""


@dataclass(frozen=True)
class LiveReading:
    """What a board reads at a target.

    Attributes
    ----------
    clearance : float
        Clearance of the target in mm.
    result : float
        Mean result of the board, in mm, or in V for a core without calibration.
    voltage, temperature : float
        Mean voltage in V that this result is of, and temperature in degC.
    scatter, uncertainty : float
        Standard deviation of a single result and standard uncertainty of the mean, in V; the core's proven bound of the
        error counts as half the width of a rectangular distribution.
    count : int
        Number of results.
    """

    clearance: float
    result: float
    voltage: float
    temperature: float
    scatter: float
    uncertainty: float
    count: int

    def row(self, uncertainty: float) -> tuple[float, ...]:
        """Return the measurement of a target whose standard uncertainty in mm is given."""
        return self.clearance, self.voltage, self.temperature, uncertainty, self.uncertainty, 0.0

    def as_dict(self) -> dict[str, Any]:
        """Return it in JSON types."""
        return {
            "clearance_mm": self.clearance,
            "result": self.result,
            "voltage_V": self.voltage,
            "temperature_C": self.temperature,
            "scatter_V": self.scatter,
            "uncertainty_V": self.uncertainty,
            "results": self.count,
        }


class LiveTargets:
    """A board with converters that reads targets; use it in a ``with`` statement, which closes the port.

    A board hands out results, not voltages. The voltage of a steady result follows from the calibration that is active
    in the core, which stands in its certificate, or in the set that was loaded, and from the temperature.

    Parameters
    ----------
    port : str or Board
        Name of the serial port, or a board that is open.
    files : path or None
        Folder with manifest and certificate of its core; None for ``build/<name>`` or a folder in it.
    active : path or None
        The set that was loaded into it, as `sosmith reload` has written it; None if none was.
    channel : int or None
        Channel of the sensor; None for a board that has one only.
    baud : int
        Bits per second.
    clock : Clock or None
        Time; None for that of this computer.

    Raises
    ------
    SpecificationError
        If the board has no converters or no such channel, or its files are missing or are not those of a core.
    ShortfallError
        If they are those of another core, or another set is active.
    ToolError, LinkError
        If the board is missing or makes no sense.
    """

    def __init__(
        self,
        port: str | Board,
        *,
        files: Path | None = None,
        active: str | PathLike[str] | None = None,
        channel: int | None = None,
        baud: int = BAUD,
        clock: Clock | None = None,
    ) -> None:
        loaded = None if active is None else read_set(active)
        self._board = Board(port, baud=baud) if isinstance(port, str) else port
        try:
            about = self._board.identity
            if channel is None and about.channels > 1:
                raise SpecificationError(f"the channel must be given, 0 to {about.channels - 1}: the board has several")
            self._reader = SteadyReader(self._board, channel or 0, clock)
            if about.reload is not None:
                check_active(self._board, loaded)
            elif loaded is not None:
                raise ShortfallError("the board must have registers for a set to be active, not be without reload")
            if about.output_port.unit not in {"mm", "V"}:
                raise SpecificationError(
                    f"the board must give mm or V, not {about.output_port.unit or 'plain numbers'}"
                )
            self._back = None if about.output_port.unit == "V" else _read_back(about, files, loaded)
        except BaseException:
            self._board.close()
            raise

    def __enter__(self) -> LiveTargets:
        """Return it."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the port."""
        self._board.close()

    def read(
        self,
        clearance: float,
        temperature: float,
        *,
        seconds: float = SECONDS,
        uncertainty: float = 0.02,
        progress: Progress = lambda step, done, total: None,
    ) -> LiveReading:
        """Read a target that is before the sensor now.

        Parameters
        ----------
        clearance : float
            Its clearance in mm.
        temperature : float
            Temperature of the sensor in degC.
        seconds : float
            Time over which results are averaged, once they stand still.
        uncertainty : float
            Standard uncertainty of the clearance in mm; what moves by less than a tenth of it stands still.

        Raises
        ------
        ShortfallError
            If the result does not stand still, or has no voltage.
        LinkError
            If the link fails.
        """
        step, least = f"reading {clearance:g} mm", 1.0 if self._back is not None else LEAST
        mean = self._reader.read(seconds, STEADY * uncertainty * least, lambda done, total: progress(step, done, total))
        voltage, slope = mean.value, 1.0
        # Of a result that stands still, anything within the proven bound may be the error, the same in all results.
        error = float(self._board.identity.output_port.lsb) / 2 / math.sqrt(3)
        if self._back is not None:
            voltage, slope = self._back.voltage(mean.value, temperature)
            error = self._back.bound / math.sqrt(3)
        return LiveReading(
            clearance,
            mean.value,
            voltage,
            temperature,
            slope * mean.scatter,
            slope * math.hypot(mean.uncertainty, error),
            mean.count,
        )


def _read_back(about: Identity, files: Path | None, loaded: Mapping[str, Any] | None) -> ReadBack:
    """Return the calibration of a core, or that of a set."""
    usual = default_folder(about.name)
    folder = files or folder_of(about, usual)
    if folder is None:
        raise SpecificationError(
            f"the files of the board's core, {about.name}, must be in {usual}, or named by --files"
        )
    check_files(about, folder)
    voltage = about.input_ports[0]
    rows: Any
    if loaded is not None:
        if not {"calibration", "zero_frequency_gain", "error_bound"} <= loaded.keys():
            raise SpecificationError("the set must say its calibration, as `sosmith reload` writes it, not only words")
        rows, gain = loaded["calibration"], float(loaded["zero_frequency_gain"])
        bound = float(loaded["error_bound"])
    else:
        certificate = read_certificate(folder / f"{about.name}.certificate.json")
        ideal = certificate.ideal
        rows, gain = ideal.polynomial, 1.0
        bound = float(Fraction(certificate.claims.bound)) * float(about.output_port.lsb)
        for section in ideal.sections:
            gain *= float(sum(map(Fraction, section.numerator)) / sum(map(Fraction, section.denominator)))
    if not rows or not gain:
        raise SpecificationError(
            f"the core {about.name} must have a calibration, and pass what stands still, for its targets to be read"
        )
    low, high = voltage.decode(np.array([voltage.lowest, voltage.highest])).tolist()
    return ReadBack(Polynomial.from_numbers(rows), gain, (low, high), bound)


def readings_table(readings: list[LiveReading]) -> Table:
    """Return what was read, a row for each target."""
    heads = ("target, mm", "result", "V", "°C", "scatter, mV", "mean known to, mV", "results")
    rows = [
        (
            f"{one.clearance:g}",
            f"{one.result:.4f}",
            f"{one.voltage:.5f}",
            f"{one.temperature:g}",
            f"{1e3 * one.scatter:.2f}",
            f"{1e3 * one.uncertainty:.2f}",
            f"{one.count:,}",
        )
        for one in readings
    ]
    return Table("Read at the targets", rows, heads)
