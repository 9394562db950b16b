"""The ideal filter of a specification: what can be said about it before anything is rounded."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter import response
from sosmith.gen.filter.design import Filter as Designed
from sosmith.gen.filter.step_response import SETTLED, StepResponse, step_response
from sosmith.interface.quantity import Quantity

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Filter:
    """The ideal filter of a specification, from `Specification.filter`: no coefficient is rounded to integers yet.

    Examples
    --------
    >>> import sosmith
    >>> ideal = sosmith.Specification.example().filter
    >>> ideal
    <sosmith.Filter: Butterworth lowpass, order 7, 0.25878 Hz at 100 Hz>
    >>> abs(ideal.frequency_response([0.0, ideal.cutoff[0]])).round(3).tolist()
    [1.0, 0.707]
    >>> print(ideal.settling_time, f"{ideal.overshoot:.3f}")
    11.31 s 0.154
    """

    designed: Designed = field(repr=False)
    """The filter in the form of the inner packages, with exact sections."""

    @property
    def sample_rate(self) -> float:
        """Samples per second, in Hz."""
        return self.designed.sample_rate

    @property
    def kind(self) -> str:
        """Such as "lowpass"; "sections" if the sections were given."""
        return self.designed.kind

    @property
    def order(self) -> int:
        """Number of poles."""
        return self.designed.order

    @property
    def cutoff(self) -> tuple[float, ...] | None:
        """Cutoff in Hz as the family defines it, one or two; None if the sections were given."""
        return self.designed.cutoff

    @property
    def sos(self) -> Floats:
        """Second-order sections, shape (sections, 6) as in scipy."""
        return self.designed.sos

    @property
    def zeros(self) -> npt.NDArray[np.complex128]:
        """Zeros in the z-plane, without those at the origin and at infinity."""
        return response.zeros(self.sos)

    @property
    def poles(self) -> npt.NDArray[np.complex128]:
        """Poles in the z-plane, without those at the origin."""
        return response.poles(self.sos)

    @property
    def passbands(self) -> list[tuple[float, float]]:
        """Passbands in Hz, by the edges of the mask or else the cutoff; empty if sections or taps were given."""
        return [] if self._facts is None else response.passbands(self._facts)

    @property
    def stopbands(self) -> list[tuple[float, float]]:
        """Stopbands in Hz, by the edges of the mask or else from an octave beyond the cutoff."""
        return [] if self._facts is None else response.stopbands(self._facts)

    def frequencies(self, points: int = 400) -> Floats:
        """Return frequencies in Hz for a picture, rising: from 1/100 of the lowest edge to half the sample rate.

        They are spaced evenly on a logarithmic axis, and have the edges among them.
        """
        return response.frequency_grid(self._plain, points)

    def frequency_response(self, f: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """Return the complex gain at the frequencies `f` in Hz, an array of the same shape."""
        return response.complex_response(self.sos, np.asarray(f, dtype=np.float64), self.sample_rate)

    def group_delay(self, f: npt.ArrayLike) -> Floats:
        """Return the group delay in s at the frequencies `f` in Hz, of the same shape; NaN where the gain is zero."""
        return response.group_delay(self.sos, np.asarray(f, dtype=np.float64), self.sample_rate)

    def step_response(self) -> tuple[Floats, Floats]:
        """Return time in s and output of the response to a unit step from rest, until it has settled.

        Both are empty for a filter that is unstable or takes more than a million samples.
        """
        values = np.zeros(0) if self._step is None else self._step.values
        return np.arange(len(values)) / self.sample_rate, values

    @property
    def overshoot(self) -> float | None:
        """How far the step response exceeds its final value, as a fraction of that; None if constants do not pass."""
        return None if self._step is None else self._step.overshoot

    @property
    def settling_time(self) -> Quantity | None:
        """Time from which on the step response stays within 1 % of its final value; None for a filter without one."""
        if self._step is None or not self._step.passes_constants:
            return None
        return Quantity(self._step.samples_to(SETTLED) / self.sample_rate, "s")

    @cached_property
    def _step(self) -> StepResponse | None:
        return step_response(self.sos, self.sample_rate, SETTLED)

    @property
    def _facts(self) -> response.FilterFacts | None:
        """Facts for the bands; None where the kind is not known."""
        return self._plain if self._has_edges else None

    @property
    def _has_edges(self) -> bool:
        return self.designed.cutoff is not None or self.designed.passband_edge is not None

    @cached_property
    def _plain(self) -> response.FilterFacts:
        designed = self.designed
        return response.FilterFacts(
            sample_rate=designed.sample_rate,
            ideal_sos=designed.sos,
            quantized_sos=designed.sos,
            kind=designed.kind if self._has_edges else "lowpass",
            passband_edge=designed.passband_edge,
            stopband_edge=designed.stopband_edge,
            passband_loss=designed.passband_loss,
            stopband_loss=designed.stopband_loss,
            cutoff=designed.cutoff,
            cutoff_of_stopband=designed.cutoff_of_stopband,
        )

    def __repr__(self) -> str:
        return f"<sosmith.Filter: {self.designed.describe}>"
