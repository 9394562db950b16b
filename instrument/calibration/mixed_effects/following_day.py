"""The posterior of a later day from that of the days before and the measurements of its morning alone.

It is what a fit of all measurements anew gives, but for the scatters, whose probabilities stay as they are: after ten
days or so, a few targets tell next to nothing of them. It takes a hundredth of the time, and goes on from day to day.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from sosmith.gen.calibration.fit import Measurements
from sosmith.instrument.calibration.mixed_effects.day_filter import moved, updated
from sosmith.instrument.calibration.mixed_effects.model import Model, Posterior, rows_of
from sosmith.model.arrays import Values


@dataclass(frozen=True, eq=False)
class Following:
    """Where a sensor's deviations stood on a day.

    Attributes
    ----------
    posterior : Posterior
        That of the day, with or without measurements of its own.
    day : int
        Ordinal of the day.
    """

    posterior: Posterior
    day: int

    def without(self, day: int) -> Following:
        """Return what is known of a later day that has no measurements."""
        known = self.posterior
        later = moved(known.factor, day - self.day, known.sensor_type.drifts)
        return Following(replace(known, factor=later, offset=None, slope=None, curve_factor=None), day)

    def on(self, morning: Measurements, weights: Values, day: int) -> Following:
        """Return what is known of a later day by the measurements of its morning.

        Parameters
        ----------
        morning : Measurements
            Of that day only, shape (n,).
        weights : ndarray, shape (n,)
            0 for what does not count, else 1.
        day : int
            Ordinal of the day, after `Following.day`.
        """
        before = self.without(day).posterior
        rows, order = rows_of(morning, before.sensor_type, day)
        V, T = morning.voltage[order], morning.temperature[order]
        curve = before.sensor_type.polynomial(before.deviations)
        rows = replace(rows, h=before.curves.columns(curve(V, T)))
        at = before.scatters
        model = Model.of(before.sensor_type, rows, weights[order])
        information = model.information(at)
        told = (information.j[..., 0, :], information.h[..., 0, :], information.q[..., 0, :])
        mean, factor, _, _ = updated(before.mean, before.factor, told)
        offset, slope, own = (values[..., 0, :] for values in model.sums.day_curves(at.ratio**2, at.scatter**2))
        made = replace(before, mean=mean, factor=factor, offset=offset, slope=slope, curve_factor=own)
        return Following(made, day)
