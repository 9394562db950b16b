"""What a certificate says of its core in the words of a manifest: formats, sections, operators, errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf, log10
from typing import Any

from sosmith.verify.bounds.l1_response import fraction
from sosmith.verify.certificate_file import (
    Certificate,
    DecimationEntry,
    DownsamplingEntry,
    ItemEntry,
    NodeEntry,
    Operation,
    PortEntry,
    StageEntry,
)
from sosmith.verify.graph import inputs_of
from sosmith.verify.multirate.decimation import samples_of_filter
from sosmith.verify.verdict.coefficients import coefficients
from sosmith.verify.verdict.figures import Figure
from sosmith.verify.verdict.operators import bits
from sosmith.verify.verdict.recursions import Recursion

_HALF = Fraction(1, 2)
_GRID = Fraction(1, 2**40)
"""Part of an LSB that the grid of the certificate's claims may have added to them."""

_CLAIM_GRID = Fraction(1, 2**64)
"""What rounding up to the grid may have added to a gain."""

_DECIBELS = 1e-6
"""Distance from a gain in dB that the arithmetic of doubles may have brought."""


@dataclass(frozen=True)
class Decibels(Figure):
    """A gain, whose double is in dB."""

    def holds(self, stated: object) -> bool:
        """Whether a number in a manifest is this gain in dB."""
        if not isinstance(stated, float) or not -inf < stated < inf:
            return False
        least = self.value - _CLAIM_GRID
        lowest = 20 * log10(least) if least > 0 else -inf
        return lowest - _DECIBELS <= stated <= 20 * log10(self.value) + _DECIBELS

    def __str__(self) -> str:
        return f"{20 * log10(self.value):.9g}"


def bound_of(certificate: Certificate) -> Figure:
    """Return the bound on the error: no less than the proven one, and no more than allowed."""
    lsb = certificate.output.lsb
    proven = certificate.claims.bound * lsb
    return Figure(proven, _GRID * lsb, max(certificate.max_error - proven, Fraction(0)))


def parts_of(certificate: Certificate) -> dict[str, Figure]:
    """Return the parts of the bound: each no less than the proven one."""
    lsb, bound = certificate.output.lsb, bound_of(certificate)
    return {
        part: Figure(value * lsb, _GRID * lsb, bound.above + _GRID * lsb)
        for part, value in certificate.claims.budget.items()
    }


def settling_of(certificate: Certificate, rate: Fraction) -> dict[str, Any] | None:
    """Return how long a filter settles that starts from zero; None if it does not."""
    samples = certificate.claims.settling
    if samples is None or not rate:
        return None
    return {
        "samples": samples,
        "seconds": Figure(samples * samples_of_filter(certificate) / rate),
        "limit": Figure(certificate.output.lsb * _HALF),
    }


def format_of(node: NodeEntry) -> str:
    """Return the Q format of a node: ``Qi.f`` for two's complement, i without the sign bit, or ``UQi.f``."""
    whole = bits(node) - (node.low < 0) - node.frac
    return f"{'Q' if node.low < 0 else 'UQ'}{whole}.{node.frac}"


def formats_of(certificate: Certificate) -> list[dict[str, Any]]:
    """Return the formats of all nodes that have a name, in the order of the datapath."""
    calibration = None if certificate.decimation is None else certificate.decimation.calibration
    parts = [] if calibration is None else [(calibration.stages, calibration.output)]
    parts.append((certificate.stages, certificate.output))
    variables = {port.name for port in certificate.inputs}
    return [
        _format(stage, node, output, plain=stage.role == "polynomial" and node.name in variables)
        for stages, output in parts
        for stage in stages
        for node in stage.nodes
        if node.name
    ]


def _format(stage: StageEntry, node: NodeEntry, output: PortEntry, *, plain: bool) -> dict[str, Any]:
    scale = (Fraction(1) if plain else output.lsb) / Fraction(2) ** node.frac
    return {
        "stage": stage.name,
        "node": node.name,
        "format": format_of(node),
        "low": Figure(node.low * scale),
        "high": Figure(node.high * scale),
        "unit": "" if plain else output.unit,
    }


def section_of(part: Recursion) -> dict[str, Any]:
    """Return the entry of a recursion with one input and one output."""
    transfer, nodes, given = part.transfer, part.stage.nodes, part.output
    numerator = transfer.numerator(transfer.inputs[0], given)
    entry = {
        "name": part.name,
        "coefficients": [
            {"name": name, "integer": integer, "frac": frac, "value": Figure(integer / Fraction(2) ** frac)}
            for name, integer, frac in coefficients(nodes)
        ],
        "states": {node.name: format_of(node) for node in nodes if node.op is Operation.DELAY},
        "b": _padded([fraction(value) for value in numerator.coeffs()]),
        "a": _padded([fraction(value) for value in transfer.denominator.coeffs()]),
        "input": format_of(nodes[inputs_of(part.stage)[0]]),
        "output": format_of(nodes[given]),
    }
    return entry if part.error_feedback is None else entry | {"error_feedback": list(part.error_feedback)}


def _padded(values: Sequence[Fraction]) -> list[Figure]:
    return [Figure(value) for value in [*values, *[Fraction(0)] * (3 - len(values))]]


def decimation_of(certificate: Certificate, item: ItemEntry, entry: DecimationEntry, rate: Fraction) -> dict[str, Any]:
    """Return what is known of a decimator; `rate` is that of the samples, in Hz."""
    lower, edge = rate / entry.factor, entry.edge * rate
    port, codes = certificate.inputs[0], None
    if entry.calibration is not None:
        port, last = entry.calibration.output, entry.calibration.stages[-1]
        node = last.nodes[last.outputs[0]]
        codes = node.low, node.high
    low, high = codes or (port.lowest, port.highest)
    amplitude = port.lsb * (high - low) / 2
    facts: dict[str, Any] = {
        "factor": entry.factor,
        "stages": entry.stages,
        "width": entry.width,
        "dropped": entry.dropped,
        "sample_rate": Figure(lower),
        "correction": Figure(entry.correction),
        "held": item.hold,
        "calibration": _ahead(certificate, item, entry),
    }
    if entry.bands:
        largest = max(band.gain for band in entry.bands)
        facts |= {
            "aliasing": [
                {
                    "low": Figure(k * lower - edge, above=_GRID, below=_GRID),
                    "high": Figure(min(k * lower + edge, rate / 2), above=_GRID, below=_GRID),
                    "gain_db": Decibels(gain),
                    "passing_db": Decibels(into.gain),
                    "whole_low": Figure((k - _HALF) * lower),
                    "whole_high": Figure(min((k + _HALF) * lower, rate / 2)),
                    "largest_db": Decibels(band.gain),
                    "largest_at": Figure(band.at * lower),
                }
                for k, (gain, into, band) in enumerate(
                    zip(entry.aliasing, entry.passing, entry.bands, strict=True), start=1
                )
            ],
            "worst_aliasing": Figure(max(band.gain for band in entry.passing) * amplitude, _GRID * amplitude),
            "largest_db": Decibels(largest),
            "largest": Figure(largest * amplitude, _GRID * amplitude),
        }
    return facts


def downsampling_of(
    certificate: Certificate, item: ItemEntry, entry: DownsamplingEntry, rate: Fraction
) -> dict[str, Any]:
    """Return what is known of an FIR filter that decimates; `rate` is that of the samples, in Hz."""
    taps = certificate.ideal.sections[0].numerator
    symmetric = any(tuple(sign * tap for tap in reversed(taps)) == tuple(taps) for sign in (1, -1))
    total = sum(taps, Fraction(0))
    centre = Fraction(len(taps) - 1, 2)
    if not symmetric and total:
        centre = sum((k * tap for k, tap in enumerate(taps)), Fraction(0)) / total
    return {
        "factor": entry.factor,
        "filled": entry.filled,
        "sample_rate": Figure(rate / entry.factor),
        "held": item.hold,
        "delay": Figure(centre / rate, above=_GRID, below=_GRID),
    }


def _ahead(certificate: Certificate, item: ItemEntry, entry: DecimationEntry) -> dict[str, Any] | None:
    calibration = entry.calibration
    if calibration is None:
        return None
    port, last = calibration.output, calibration.stages[-1]
    node = last.nodes[last.outputs[0]]
    error = calibration.claims.bound * port.lsb
    return {
        "architecture": item.ahead,
        "bits": port.bits,
        "lsb": Figure(port.lsb),
        "low": Figure(port.zero + node.low * port.lsb),
        "high": Figure(port.zero + node.high * port.lsb),
        "error": Figure(error, _GRID * port.lsb, max(certificate.max_error - error, Fraction(0))),
    }
