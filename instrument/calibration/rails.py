"""A sensor at a rail inside the range of its port: told from readings of one extreme voltage at different clearances.

At the ends of the port's range, hardware and fit know a rail. A sensor whose amplifier saturates earlier gives one and
the same voltage for all clearances from there on, which looks like a reading and is none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sosmith.gen.calibration.fit import NORMAL_CONSISTENCY, Measurements, residuals
from sosmith.gen.calibration.least_squares import Sums
from sosmith.instrument.calibration.acceptance import Range
from sosmith.instrument.calibration.sensor_type import TERMS
from sosmith.model.arrays import Values

FEWEST = 3
"""Readings of the very same extreme voltage that can be a rail; two may repeat by chance."""

BEYOND = 1.0
"""Scatters beyond the curve of all others that half of these readings exceed at a rail: more than a curve misses at its
ends."""

CERTAIN = 5.0
"""The same, times the root of their number: four standard errors of a median."""


@dataclass(frozen=True)
class Rails:
    """Between which voltages a sensor measures.

    Attributes
    ----------
    ends : tuple of float
        Voltages in V at and beyond which it does not; those of the port where it has no rail inside.
    found : tuple of str
        A sentence for each rail inside the port's range.
    """

    ends: Range
    found: tuple[str, ...] = ()

    def hold(self, voltage: Values) -> Values:
        """For each voltage, whether the sensor measures there."""
        return np.asarray((self.ends[0] < voltage) & (voltage < self.ends[1]))


def rails_of(measurements: Measurements, voltages: Range) -> Rails:
    """Find the rails of a sensor inside the range of its port.

    The highest voltage inside the range is a rail if at least `FEWEST` readings have that very voltage, and half of
    them belong to clearances beyond the curve of all other readings, by more than their scatter (`BEYOND`, `CERTAIN`);
    likewise the lowest voltage, at clearances below the curve. The curve has the type curve's orders, by least squares;
    the scatter is estimated from the median magnitude of its residuals, which outliers do not move.

    Parameters
    ----------
    measurements : Measurements
        All that is known of the sensor.
    voltages : tuple of float
        Range of the port in V.

    Examples
    --------
    >>> V = np.array([1.0, 2, 3, 4, 5, 6, 6, 6, 6, 1.5, 2.5, 3.5, 4.5, 5.5])
    >>> T = np.resize([20.0, 40.0, 60.0], len(V))
    >>> d = V + 0.001 * T + 0.01 * (-1.0) ** np.arange(len(V))
    >>> d[5:9] += [0.0, 1.0, 2.0, 3.0]
    >>> rails_of(Measurements(d, V, T), (0.0, 10.0)).ends
    (0.0, 6.0)
    """
    V, d = measurements.voltage, measurements.clearance
    inside = (voltages[0] < V) & (voltages[1] > V)
    ends, found = list(voltages), []
    for side, extreme in enumerate((np.min, np.max)):
        at = inside & (extreme(V[inside], initial=voltages[1 - side]) == V)
        beyond = _beyond(measurements, at, inside & ~at)
        least = max(BEYOND, CERTAIN / math.sqrt(max(int(np.count_nonzero(at)), 1)))
        if beyond is not None and (beyond if side else -beyond) > least:
            ends[side] = float(V[at][0])
            found.append(
                f"{np.count_nonzero(at)} readings of {ends[side]:g} V belong to clearances from {d[at].min():.3g} to "
                f"{d[at].max():.3g} mm: the sensor is at a rail there, and measures nothing "
                f"{('below', 'above')[side]} it"
            )
    return Rails((ends[0], ends[1]), tuple(found))


def _beyond(measurements: Measurements, at: Values, others: Values) -> float | None:
    """Return the median distance of readings from the curve of the others, in scatters; None if it cannot be told."""
    if np.count_nonzero(at) < FEWEST or np.count_nonzero(others) <= len(TERMS):
        return None
    sums = Sums(measurements.clearance, measurements.voltage, measurements.temperature, others.astype(np.float64))
    T = measurements.temperature[others]
    solution = sums.solve(TERMS if T.min() < T.max() else tuple(term for term in TERMS if not term[1]))
    if solution is None:
        return None
    off = residuals(measurements, solution.polynomial)
    scatter = NORMAL_CONSISTENCY * float(np.median(np.abs(off[others])))
    return float(np.median(off[at])) / scatter if scatter > 0 else None
