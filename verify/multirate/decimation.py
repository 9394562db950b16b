"""Checks a decimator before a filter: that it is exact up to one rounding, and what folds into the pass band.

The decimator is a CIC filter, ``((1 - z**-R) / (1 - z**-1))**N`` at every R-th sample. Its polynomial is multiplied out
here. No coefficient is negative, so that every result lies between the least and the greatest code times their sum.
Integrators and combs add and subtract modulo ``2**width``; where all results fit that many bits, the last difference is
the result itself. The rounding behind it is to nearest, half an LSB at most, which the peak gain of the filter takes to
the output.

For a factor R that is a power of two, the magnitude of the response is the product over all j from 0 to log2(R) - 1 of
``|cos(2**j pi f)|**N``, f in units of the rate of the input, which equals ``|sin(pi R f) / (R sin(pi f))|**N``. In the
band around a multiple k of the lower rate, as far as it folds into the pass band 0..F, it is largest at its lower end
``k / R - F``: with ``F R < 1/2`` the numerator is largest at both ends, and the denominator smallest at the lower one.

A calibration before the decimator is a certificate within the certificate, for the polynomial alone. It may limit
nothing, since the exact result is limited at the end only: then its error holds for every input, and no sum of samples
whose weights are positive and add up to one makes it greater. The peak gain of the filter takes it to the output.
"""

from __future__ import annotations

from fractions import Fraction

from flint import arb, ctx, fmpq, fmpz_poly

from sosmith.verify.bounds.grid import rounded_up
from sosmith.verify.certificate_file import (
    Certificate,
    DecimationEntry,
    IdealEntry,
    Operation,
    PortEntry,
    SectionEntry,
)
from sosmith.verify.graph import require
from sosmith.verify.reader.inlined import inlined
from sosmith.verify.reader.source import read_source

_PRECISION = 256
"""Bits to which gains are computed."""

_MAX_BITS = 32
"""Widest code that enters a filter."""

_CORRECTION = 10
"""Fraction bits of the weight that corrects the droop."""


def at_lower_rate(certificate: Certificate) -> Certificate:
    """Check the decimator of a certificate, and return the certificate of what is behind it; without one, itself.

    Raises
    ------
    RejectedError
        If a result would not fit the registers, or a figure is not what follows.
    """
    entry = certificate.decimation
    if entry is None:
        return certificate
    behind = handed_on(certificate)
    require(
        entry.factor & (entry.factor - 1) == 0,
        f"the factor of the decimator must be a power of two, not {entry.factor}",
    )
    _check_widths(entry, _taken(certificate, entry), behind.inputs[0])
    _check_aliasing(entry)
    _check_correction(entry, certificate.ideal.sections[-1])
    return behind


def handed_on(certificate: Certificate) -> Certificate:
    """Return the certificate of what is behind a decimator, of which no figure is checked.

    Raises
    ------
    RejectedError
        If there is no filter behind it, or it does not take one code and hand on another.
    """
    entry = certificate.decimation
    if entry is None:
        return certificate
    require(bool(certificate.ideal.sections), "a decimator must have a filter behind it")
    code = _behind(entry, _taken(certificate, entry))
    ideal = certificate.ideal.model_copy(update={"polynomial": None})
    return certificate.model_copy(update={"inputs": (code,), "ideal": ideal, "decimation": None})


def samples_of_filter(certificate: Certificate) -> int:
    """Return how many samples of the input each sample of the filter takes: one without a decimator."""
    return 1 if certificate.decimation is None else certificate.decimation.factor


def remembered(entry: DecimationEntry | None) -> int:
    """Return how many results after a start depend on what was before it: those whose samples reach that far.

    Result n has the ``N (R - 1)`` samples before sample ``n R`` in it.
    """
    return 0 if entry is None else -(-entry.stages * (entry.factor - 1) // entry.factor)


def calibration_alone(certificate: Certificate) -> Certificate | None:
    """Return the certificate of the calibration before the decimator of a certificate; None if there is none.

    Its error is allowed to be what it claims. Its output is in the unit and steps of its own.

    Raises
    ------
    RejectedError
        If it has no polynomial to compute, or limits its result.
    """
    entry = None if certificate.decimation is None else certificate.decimation.calibration
    if entry is None:
        return None
    require(certificate.ideal.polynomial is not None, "a calibration before the decimator must have a polynomial")
    limits = any(node.op is Operation.CLAMP for stage in entry.stages for node in stage.nodes)
    require(not limits, "the calibration before the decimator must pass on all that it can give, not limit it")
    return Certificate(
        format=certificate.format,
        name=f"{certificate.name}_ahead",
        inputs=certificate.inputs,
        output=entry.output,
        max_error=entry.claims.bound * entry.output.lsb,
        ideal=IdealEntry(polynomial=certificate.ideal.polynomial, sections=()),
        stages=entry.stages,
        claims=entry.claims,
    )


def _taken(certificate: Certificate, entry: DecimationEntry) -> PortEntry:
    """Return the port that the decimator takes."""
    if entry.calibration is not None:
        port, output = entry.calibration.output, certificate.output
        require(port.unit == output.unit, f"the calibration must give {output.unit}, not {port.unit}")
        return port
    require(len(certificate.inputs) == 1, f"a decimator must have one input, not {len(certificate.inputs)}")
    require(certificate.ideal.polynomial is None, "the calibration must stand before the decimator")
    return certificate.inputs[0]


def behind_decimator(text: str, certificate: Certificate) -> str:
    """Return the SystemVerilog of what is behind a decimator: its module alone; without one, all of the text.

    Raises
    ------
    RejectedError
        If the text has no such module.
    """
    return text if certificate.decimation is None else module_in(text, certificate.name, f"{certificate.name}_behind")


def module_in(text: str, top: str, name: str) -> str:
    """Return the SystemVerilog of one module of a core.

    Raises
    ------
    RejectedError
        If the text has no such module, or anything that cannot be read.
    """
    source = read_source(text, top)
    require(name in source.modules, f"the core must have one module {name}, not 0")
    return inlined(source, name).text


def rounding(certificate: Certificate) -> Fraction:
    """Bound on the rounding behind the decimator of a certificate, at the filter's input, in output LSBs."""
    entry = certificate.decimation
    if entry is None or entry.dropped == 0:
        return Fraction(0)
    return _step(entry, _taken(certificate, entry)) / certificate.output.lsb / 2


def _step(entry: DecimationEntry, port: PortEntry) -> Fraction:
    """Value of one LSB behind the decimator: the rounding drops bits of a sum with the weight R**N."""
    return Fraction(port.lsb * 2**entry.dropped / entry.factor**entry.stages)


def _behind(entry: DecimationEntry, port: PortEntry) -> PortEntry:
    """Return the port of what leaves a decimator."""
    bits = entry.width - entry.dropped
    require(2 <= bits <= _MAX_BITS, f"what leaves the decimator must have 2 to {_MAX_BITS} bits, not {bits}")
    lsb = _step(entry, port)
    return PortEntry(name=port.name, bits=bits, signed=port.signed, lsb=lsb, zero=port.zero, unit=port.unit)


def _check_widths(entry: DecimationEntry, port: PortEntry, output: PortEntry) -> None:
    """Check that the words of a decimator and what leaves it hold all results."""
    ones = fmpz_poly([1] * entry.factor) ** entry.stages
    taps = [int(tap) for tap in ones.coeffs()]
    require(min(taps) > 0 and sum(taps) == entry.factor**entry.stages, "the taps of the decimator must be positive")
    least, most = port.lowest * sum(taps), port.highest * sum(taps)
    low, high = (-(1 << entry.width - 1), (1 << entry.width - 1) - 1) if port.signed else (0, (1 << entry.width) - 1)
    require(
        low <= least and most <= high,
        f"the registers of the decimator must hold {least}..{most}, which {entry.width} bits do not",
    )
    half = 1 << entry.dropped >> 1
    for result in (least, most):
        rounded = (result + half) >> entry.dropped
        require(
            output.lowest <= rounded <= output.highest,
            f"what leaves the decimator must be in {output.lowest}..{output.highest}, not {rounded}",
        )


def _check_aliasing(entry: DecimationEntry) -> None:
    bands = entry.factor // 2
    require(0 < entry.edge * entry.factor * 2 < 1, "the pass band must end below half the rate behind the decimator")
    require(
        len(entry.aliasing) == bands,
        f"aliasing must be given of {bands} bands, not {len(entry.aliasing)}",
    )
    for band, claimed in enumerate(entry.aliasing, start=1):
        gain = folding_gain(entry.factor, entry.stages, Fraction(band, entry.factor) - entry.edge)
        require(
            claimed == gain,
            f"aliasing from band {band} must be at most {float(gain):.6g}, not {float(claimed):.6g}",
        )


def folding_gain(factor: int, stages: int, frequency: Fraction) -> Fraction:
    """Gain of a CIC filter at a frequency in units of the rate of its input, rounded up to the grid."""
    with ctx.workprec(_PRECISION):
        gain = arb(1)
        for doubling in range(factor.bit_length() - 1):
            angle = frequency * 2**doubling
            gain *= abs(arb.cos_pi_fmpq(fmpq(angle.numerator, angle.denominator)))
        return rounded_up(gain**stages, f"the gain of the decimator at {frequency}")


def _check_correction(entry: DecimationEntry, section: SectionEntry) -> None:
    """Check that the last ideal section makes up for the droop: ``1 + g - g w``, with the g next to the best one.

    Of the best, ``(2 g + 1)**2 = 1 + N (1 - R**-2) / 3``.
    """
    g, unit = entry.correction, Fraction(1, 2**_CORRECTION)
    square = 1 + entry.stages * (1 - Fraction(1, entry.factor**2)) / 3
    low, high = ((2 * (g + side * unit / 2) + 1) ** 2 for side in (-1, 1))
    require(
        g > 0 and g % unit == 0 and low <= square <= high,
        f"the correction of the droop must be the multiple of {unit} next to the best one, not {g}",
    )
    corrects = list(section.numerator) == [1 + g, -g] and list(section.denominator) == [1]
    require(
        corrects,
        f"the last ideal section must be {1 + g} - {g} / z, which corrects the droop",
    )
