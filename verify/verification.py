"""Proves a certificate again by a different method, using only the certificate itself.

1. Every graph must be well formed, and every range must follow from earlier ranges (`sosmith.verify.graph`).
2. The polynomial and the output rounding are followed symbolically (`sosmith.verify.bounds.polynomial`).
3. The sections' transfer functions are computed as determinants, and the Schur-Cohn recursion decides stability. A
   section may have several inputs and outputs; the cascade has one of each. A stage that starts a filter from its
   first sample is followed symbolically (`sosmith.verify.start`).
4. Sums over impulse responses are enclosed by their exact residuals: sums of magnitudes by responses in pieces
   (`sosmith.verify.bounds.piecewise`), short ones and running sums by approximate inverses
   (`sosmith.verify.bounds.l1_response`). Every range that a BOUND states must contain the proven range, and every
   claimed figure must equal the proven one, to the last unit of the certificate's grid.

5. Where sections work in on-line arithmetic, the sets of their residuals are followed (`sosmith.verify.online`).
6. Where a filter starts from zero, samples may be flagged until it has settled: the counter is run, and what any other
   past could change is followed until it has faded (`sosmith.verify.bounds.settling`).

7. A decimator before the stages is exact but for one rounding (`sosmith.verify.multirate.decimation`), and what comes
   through it from above half the lower rate is bounded (`sosmith.verify.bounds.largest_gain`). All else is proven of
   what is behind it, and, with a calibration before it, of that.

The ranges hold by induction. Unbounded integers obey the linear model exactly, with the quantizers' errors as further
inputs. The limits from the linear model therefore hold at every sample, and signals with these ranges never overflow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import prod

from flint import fmpq_poly

from sosmith.verify.bounds.driven_responses import Denominator, Driven, deviation, extremes, magnitude, rational
from sosmith.verify.bounds.l1_response import UndecidedError, fraction, is_stable
from sosmith.verify.bounds.largest_gain import check_bands
from sosmith.verify.bounds.polynomial import output_error, polynomial_error
from sosmith.verify.bounds.settling import check_fading, without_counter
from sosmith.verify.certificate_file import Certificate, Operation, StageEntry, on_grid
from sosmith.verify.graph import RejectedError, Transfer, check_graph, inputs_of, label, require
from sosmith.verify.multirate.decimation import at_lower_rate, calibration_alone, remembered, rounding
from sosmith.verify.online import check_online
from sosmith.verify.start import Start, check_start, section_alone

Progress = Callable[[str, int, int], None]
"""Callback for progress, called with the name of the step, the number of units done, and their total."""

_ROLES = ("polynomial", "start", "section", "output")


@dataclass(frozen=True)
class Verdict:
    """Result of verifying a certificate.

    Attributes
    ----------
    budget : dict of str to Fraction
        Parts of the error bound, in output LSBs.
    nodes, ranges : int
        Number of nodes with a checked range, and of those whose range needed a peak gain.
    margin : Fraction
        Worst-case peak gain by which the certificate's ideal filter may differ from another one while every claim holds
        against that one too; 0 without sections.
    """

    budget: dict[str, Fraction]
    nodes: int
    ranges: int
    margin: Fraction

    @property
    def bound(self) -> Fraction:
        """Bound on ``|hardware - exact|`` in output LSBs, the exact value limited to the output's range."""
        return sum(self.budget.values(), Fraction(0))


def verify(certificate: Certificate, progress: Progress = lambda step, done, total: None) -> Verdict:
    """Prove a certificate.

    Parameters
    ----------
    certificate : Certificate
        As read from its file.
    progress : callable
        Called at every step.

    Returns
    -------
    Verdict
        The proven figures, which equal the claims.

    Raises
    ------
    RejectedError
        If a claim does not hold, differs from the proven figure, or cannot be decided.
    """
    try:
        return _verified(certificate, progress)
    except UndecidedError as error:
        raise RejectedError(f"the certificate could not be decided: {error}") from None


def _verified(certificate: Certificate, progress: Progress) -> Verdict:
    budget, nodes = _before_decimator(certificate, progress)
    progress("graphs", 0, 0)
    _check_downsampling(certificate)
    rounded = rounding(certificate)
    decimation, certificate = certificate.decimation, at_lower_rate(certificate)
    stages = certificate.stages
    for stage in stages:
        check_graph(stage)
    _check_seams(certificate)
    fore, starts, sections, last = ([stage for stage in stages if stage.role == role] for role in _ROLES)
    progress("calibration", 0, 0)
    if rounded:
        budget["decimation"] = rounded
    if fore:
        budget["input scaling" if certificate.ideal.polynomial is None else "calibration"] = polynomial_error(
            certificate, fore
        )
    else:
        _check_plain_input(certificate)
    require(
        bool(sections) == bool(certificate.ideal.sections),
        f"the hardware's sections must stand for ideal ones, not {len(sections)} for {len(certificate.ideal.sections)}",
    )
    start = _start(certificate, starts)
    settling = certificate.claims.settling
    last_rounding, added = output_error(certificate, without_counter(last[0], settling))
    require(start is not None or not added, "the output stage must add nothing where no first sample is passed to it")
    ranges, margin = 0, Fraction(0)
    if sections:
        alone = [section_alone(stage) for stage in sections] if start is not None and start.passes else sections
        cascade = _Cascade(certificate, alone, start, progress)
        if certificate.claims.online is not None:
            progress("units", 0, 0)
            check_online(certificate, alone)
        for part in budget:
            budget[part] *= cascade.peak_gain
        budget["filter coefficients"], budget["filter rounding"] = cascade.coefficients, cascade.rounding
        ranges, margin = cascade.ranges, cascade.margin
        if settling is not None:
            require(start is None, "settling must not be claimed of a filter that starts from its first sample")
            progress("settling", 0, 0)
            check_fading(sections, settling - remembered(decimation))
        if decimation is not None:
            progress("aliasing", 0, 0)
            check_bands(decimation, certificate.ideal.sections)
        if start is not None:
            error = abs(added - cascade.gain_at_zero) * start.size
            budget["start"] = on_grid(error)
            margin = min(margin, (budget["start"] - error) / max(Fraction(1), start.size))
        _compare("peak_gain of the filter", certificate.claims.peak_gain, cascade.peak_gain)
    else:
        _compare("peak_gain of the filter", certificate.claims.peak_gain, None)
        require(settling is None, "settling must not be claimed where there are no sections")
        require(certificate.claims.online is None, "units must not be claimed where there are no sections")
        require(not certificate.claims.sections, "the gains of sections must not be given where there are none")
    budget["output rounding"] = last_rounding
    _compare_budget(certificate, budget)
    return Verdict(budget, nodes + sum(len(stage.nodes) for stage in stages), ranges, margin)


def _check_downsampling(certificate: Certificate) -> None:
    """Check that what leaves out results has a filter before it that remembers no more than what fills it.

    Each result that leaves is one of the filter, for samples before it that are in range: so the bound holds of it.
    """
    entry = certificate.downsampling
    if entry is None:
        return
    require(certificate.decimation is None, "a filter that decimates must have no decimator before it")
    poles = any(len(section.denominator) > 1 for section in certificate.ideal.sections)
    fir = bool(certificate.ideal.sections) and not poles and certificate.ideal.polynomial is None
    require(fir, "a filter that decimates must be an FIR filter alone")
    require(certificate.ideal.start is None, "a filter that decimates must be filled, not started beside its sections")
    delays = [node for stage in certificate.stages for node in stage.nodes if node.op is Operation.DELAY]
    require(
        entry.filled == 0 or entry.filled >= len(delays),
        f"a filter that decimates must be filled {len(delays)} times, not {entry.filled}",
    )


def _before_decimator(certificate: Certificate, progress: Progress) -> tuple[dict[str, Fraction], int]:
    """Prove the calibration before a decimator, if there is one; return its error in output LSBs and its nodes."""
    calibration = calibration_alone(certificate)
    if calibration is None:
        return {}, 0
    proven = _verified(calibration, progress)
    return {"calibration": proven.bound * calibration.output.lsb / certificate.output.lsb}, proven.nodes


def _compare(what: str, claimed: Fraction | None, proven: Fraction | None) -> None:
    require(claimed == proven, f"the {what} must be {_short(proven)}, not {_short(claimed)}")


def _short(value: Fraction | None) -> str:
    return "absent" if value is None else f"{value} = {float(value):.6g}"


def _compare_budget(certificate: Certificate, proven: dict[str, Fraction]) -> None:
    claims = certificate.claims
    require(
        [*claims.budget] == [*proven],
        f"the parts of the budget must be {', '.join(proven)}, not {', '.join(claims.budget)}",
    )
    for part, value in proven.items():
        _compare(f"part {part} of the budget", claims.budget[part], value)
    _compare("bound", claims.bound, sum(proven.values(), Fraction(0)))
    error = claims.bound * certificate.output.lsb
    unit = f" {certificate.output.unit}".rstrip()
    require(
        error <= certificate.max_error,
        f"the error must be at most {float(certificate.max_error):.6g}{unit}, not {float(error):.6g}{unit}",
    )


# Where stages meet.


def _check_seams(certificate: Certificate) -> None:
    stages = certificate.stages
    roles = [stage.role for stage in stages]
    require(
        roles == sorted(roles, key=_ROLES.index) and roles.count("output") == 1,
        f"the stages must be polynomial, start, section and one output, in this order, not {', '.join(roles)}",
    )
    for port in (*certificate.inputs, certificate.output):
        require(port.lsb > 0, f"lsb of {port.name} must be positive, not {port.lsb}")
    wires: list[tuple[int | None, int, int]] = [(None, port.lowest, port.highest) for port in certificate.inputs]
    for stage in stages:
        entries = [stage.nodes[index] for index in inputs_of(stage)]
        require(len(entries) == len(wires), f"{stage.name} must have {len(wires)} inputs, not {len(entries)}")
        for entry, (frac, low, high) in zip(entries, wires, strict=True):
            fits = frac in {None, entry.frac} and (entry.low, entry.high) == (low, high)
            require(
                fits,
                f"input {entry.name} of {stage.name} must take the range {low}..{high} and the format of what feeds "
                f"it, not {entry.low}..{entry.high}",
            )
        wires = [(stage.nodes[i].frac, stage.nodes[i].low, stage.nodes[i].high) for i in stage.outputs]
    output, node = certificate.output, stages[-1].nodes[stages[-1].outputs[0]]
    require(
        node.frac == 0 and output.lowest <= node.low and node.high <= output.highest,
        f"the output must be whole codes in {output.lowest}..{output.highest}, not in {node.low}..{node.high} "
        f"with {node.frac} fraction bits",
    )


def _start(certificate: Certificate, stages: Sequence[StageEntry]) -> Start | None:
    """Prove the stage that starts the filter from its first sample, if there is one."""
    wanted = int(certificate.ideal.start is not None)
    require(len(stages) == wanted, f"there must be {wanted} start stages, as the ideal filter says, not {len(stages)}")
    if not stages:
        return None
    require(bool(certificate.ideal.sections), "a start must not be given where there are no sections")
    return check_start(stages[0])


def _check_plain_input(certificate: Certificate) -> None:
    """Check that without a polynomial, the input's code is a multiple of the output's LSB."""
    port, output = certificate.inputs[0], certificate.output
    entry = certificate.stages[0].nodes[inputs_of(certificate.stages[0])[0]]
    require(
        certificate.ideal.polynomial is None and len(certificate.inputs) == 1,
        "the calibration must have stages that compute it",
    )
    require(
        port.zero == 0 and port.lsb / output.lsb == Fraction(2) ** -entry.frac,
        f"lsb and zero of {port.name} must be {Fraction(2) ** -entry.frac * output.lsb} and 0, "
        f"not {port.lsb} and {port.zero}",
    )


# The sections.


@dataclass(frozen=True)
class _Drive:
    """A source within the cascade: where it entered, its numerator so far on each wire, and its range."""

    first: int
    numerators: Sequence[fmpq_poly]
    low: Fraction
    high: Fraction


class _Cascade:
    """The proof of a cascade of sections; its attributes are the claimed figures, rounded up to the grid."""

    def __init__(
        self, certificate: Certificate, sections: Sequence[StageEntry], start: Start | None, progress: Progress
    ) -> None:
        self._models = [Transfer(section) for section in sections]
        self._over: dict[str, Denominator] = {}
        shape = (len(inputs_of(sections[0])), len(sections[-1].outputs))
        require(shape == (1, 1), f"the sections must have one input and one output in all, not {shape}")
        for section, model in zip(sections, self._models, strict=True):
            require(is_stable(model.denominator), f"{section.name} must have its poles inside the unit circle")
        self._compare_gains(certificate)
        self._windows = [self._models[0].sources[self._models[0].inputs[0]]] if start is None else start.windows
        exact = self._ideal(certificate)
        self.gain_at_zero = fraction(exact[0](1) / exact[1](1))
        ideal = self._ideal_over = self._over_all(exact[1])
        gain = ideal.norm(exact[0])
        self.peak_gain = on_grid(gain)
        self.ranges = 0
        drives = [_Drive(0, [fmpq_poly([1])], *self._windows[0])]
        for index, model in enumerate(self._models):
            progress("sections", index, len(self._models))
            arrived = drives
            for node, entry_of in enumerate(model.stage.nodes):
                if entry_of.op is Operation.BOUND:
                    self._check_bound(index, node, arrived)
                    self.ranges += 1
            drives = self._at(index, model.stage.outputs, arrived)
        progress("sections", len(self._models), len(self._models))
        last = len(self._models) - 1
        signal, *errors = (self._driven(drive, last) for drive in drives)
        over = self._up_to(last)
        self.rounding = on_grid(magnitude(over, errors))
        exceeded = deviation(over, signal[0], ideal, exact[0], self._windows)
        self.coefficients = on_grid(exceeded)
        # Both figures are rounded up: what that adds is room for another ideal filter.
        largest = max(Fraction(1), *(abs(end) for window in self._windows for end in window))
        self.margin = min(self.peak_gain - gain, (self.coefficients - exceeded) / largest)

    def _compare_gains(self, certificate: Certificate) -> None:
        claims = certificate.claims.sections
        names = [model.stage.name for model in self._models]
        require(
            [claim.section for claim in claims] == names,
            f"gains must be given of {', '.join(names) or 'nothing'}, "
            f"not {', '.join(claim.section for claim in claims) or 'nothing'}",
        )
        for claim, model in zip(claims, self._models, strict=True):
            over = self._over_all(model.denominator)
            gains = [
                sum((over.norm(model.numerator(entry, output)) for entry in model.inputs), Fraction(0))
                for output in model.stage.outputs
            ]
            _compare(f"peak_gain of {claim.section}", claim.peak_gain, on_grid(max(gains)))
            recursion = over.norm(fmpq_poly([1]))
            _compare(f"recursion_gain of {claim.section}", claim.recursion_gain, on_grid(recursion))

    def _ideal(self, certificate: Certificate) -> tuple[fmpq_poly, fmpq_poly]:
        """Numerator and denominator of the ideal filter."""
        numerator = denominator = fmpq_poly([1])
        for index, section in enumerate(certificate.ideal.sections):
            b, a = (fmpq_poly(list(map(rational, p))) for p in (section.numerator, section.denominator))
            require(section.denominator[0] == 1, f"the denominator of ideal section {index} must begin with 1")
            require(is_stable(a), f"ideal section {index} must have its poles inside the unit circle")
            numerator, denominator = numerator * b, denominator * a
        return numerator, denominator

    def _over_all(self, denominator: fmpq_poly, like: Denominator | None = None) -> Denominator:
        """Return what is known over a denominator; the same for the same one."""
        return self._over.setdefault(str(denominator.coeffs()), Denominator(denominator, like))

    def _up_to(self, last: int) -> Denominator:
        """Return what is known over the denominators of all sections up to `last`."""
        under = prod((m.denominator for m in self._models[: last + 1]), start=fmpq_poly([1]))
        return self._over_all(under, self._ideal_over if last == len(self._models) - 1 else None)

    def _at(self, index: int, nodes: Sequence[int], arrived: Sequence[_Drive]) -> list[_Drive]:
        """Everything that drives the given nodes: drives from earlier sections, then the section's own sources."""
        model = self._models[index]
        ways = [[model.numerator(entry, node) for entry in model.inputs] for node in nodes]
        return [
            *(_Drive(d.first, [_combined(d.numerators, way) for way in ways], d.low, d.high) for d in arrived),
            *(
                _Drive(index, [model.numerator(source, node) for node in nodes], *ends)
                for source, ends in model.sources.items()
                if source not in model.inputs
            ),
        ]

    def _driven(self, drive: _Drive, last: int) -> Driven:
        """Response to a drive over the denominators of all sections up to `last`."""
        (numerator,) = drive.numerators
        before = prod((model.denominator for model in self._models[: drive.first]), start=fmpq_poly([1]))
        return numerator * before, drive.low, drive.high

    def _check_bound(self, index: int, node: int, arrived: Sequence[_Drive]) -> None:
        stage = self._models[index].stage
        bound = stage.nodes[node]
        of = stage.nodes[bound.operands[0]]
        (through, *_), *others = (self._driven(drive, index) for drive in self._at(index, [node], arrived))
        low = high = Fraction(0)
        for rough in (True, False):  # a rough range mostly fits
            ranges = [
                extremes(self._up_to(index), [(through, *window), *others], rough=rough) for window in self._windows
            ]
            low, high = min(low for low, _ in ranges) * 2**bound.frac, max(high for _, high in ranges) * 2**bound.frac
            if bound.low <= max(low, of.low) and min(high, of.high) <= bound.high:
                return
        raise RejectedError(
            f"{label(stage, node)} must hold {float(low):.17g}..{float(high):.17g}, not {bound.low}..{bound.high}"
        )


def _combined(numerators: Sequence[fmpq_poly], way: Sequence[fmpq_poly]) -> fmpq_poly:
    total = fmpq_poly([0])
    for numerator, through in zip(numerators, way, strict=True):
        total += numerator * through
    return total


__all__ = ["Progress", "RejectedError", "Verdict", "verify"]
