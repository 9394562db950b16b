"""Estimated errors of the formats of a cascade, from those of formats that differ in a few places.

A search asks for the errors of thousands of formats that differ from the ones it stands at in one quantizer or one
coefficient. What has not changed is not computed again: the errors of a section's quantizers, and the deviation of the
impulse response that all coefficients cause together, which is updated by the slope of the one that has changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sosmith.gen.realizations.section_format import SectionFormat
from sosmith.gen.word_lengths.estimates import Array, Estimate, Window, largest_magnitude


@dataclass(frozen=True, eq=False)
class _Base:
    """Reference formats, which others differ from in a few places, and their deviation and errors.

    `roundings` holds the errors of each section's quantizers, `error` that of all coefficients. `errors` holds those of
    the others that are known, by the sections and coefficients in which they differ.
    """

    formats: tuple[SectionFormat, ...]
    roundings: tuple[float, ...]
    deviation: Array
    error: float
    errors: dict[tuple[object, ...], float]


class FormatErrors:
    """Errors of the formats of a cascade, in output LSBs.

    Parameters
    ----------
    estimates : sequence of Estimate
        Estimates of each section.
    windows : sequence of Window
        What the cascade's input keeps to; of several, one at a time.
    """

    def __init__(self, estimates: Sequence[Estimate], windows: Sequence[Window]) -> None:
        self._estimates = estimates
        self._windows = windows
        self._base: _Base | None = None

    def refer_to(self, formats: tuple[SectionFormat, ...]) -> None:
        """Take formats as the reference; what is known of others stays so if only quantizers have changed."""
        base = self._base
        if base is not None and all(
            form.coefficients is before.coefficients for form, before in zip(formats, base.formats, strict=True)
        ):
            self._base = replace(base, formats=formats, roundings=self._roundings(formats))
            return
        deviation = self._deviation(formats, None)
        error = largest_magnitude(deviation, self._windows)
        self._base = _Base(formats, self._roundings(formats), deviation, error, {})

    def of_rounding(self, formats: tuple[SectionFormat, ...]) -> float:
        """Return the error of all quantizers."""
        return sum(self._roundings(formats))

    def of_coefficients(self, formats: tuple[SectionFormat, ...]) -> float:
        """Return the error of all coefficients."""
        base = self._base
        if base is None:
            return largest_magnitude(self._deviation(formats, None), self._windows)
        changed = tuple(
            (k, *form.coefficients.items())
            for k, (form, before) in enumerate(zip(formats, base.formats, strict=True))
            if form.coefficients is not before.coefficients
        )
        if not changed:
            return base.error
        if changed not in base.errors:
            base.errors[changed] = largest_magnitude(self._deviation(formats, base), self._windows)
        return base.errors[changed]

    def _roundings(self, formats: tuple[SectionFormat, ...]) -> tuple[float, ...]:
        """Return the error of the quantizers of each section."""
        base = self._base
        return tuple(
            base.roundings[k]
            if base is not None and form.fracs is base.formats[k].fracs
            else self._estimates[k].rounding(form.fracs)
            for k, form in enumerate(formats)
        )

    def _deviation(self, formats: Sequence[SectionFormat], base: _Base | None) -> Array:
        """Deviation of the impulse response due to the coefficients, updated from that of `base`."""
        response = np.zeros(1, dtype=np.float32) if base is None else base.deviation
        for k, (estimate, form) in enumerate(zip(self._estimates, formats, strict=True)):
            before = None if base is None else base.formats[k].coefficients
            for name, (integer, frac) in form.coefficients.items():
                start = estimate.ideal[name]
                if before is not None:
                    if before[name] == (integer, frac):
                        continue
                    start = before[name][0] * 2.0 ** -before[name][1]
                response = response + (integer * 2.0**-frac - start) * estimate.slopes[name]
        return response
