"""Holds a certificate against the words of its specification, read by code of its own.

The specification's numbers are taken as they are written, as decimal fractions. Ports, allowed error and calibration
must equal the certificate's entries exactly. The filter is derived again from its words, by
`sosmith.verify.specified.ideal_filter`; the certificate's rational sections must be so close to it that every
claim holds against it as well, and have the very digits that follow from it (`sosmith.verify.specified.exact_form`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from itertools import zip_longest
from pathlib import Path
from typing import Any

from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.certificate_file import Certificate, PortEntry, SectionEntry
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.specified.balls import decided
from sosmith.verify.specified.exact_form import exact_sections
from sosmith.verify.specified.filter_distance import distance
from sosmith.verify.specified.fir_mask import keeps_to_losses
from sosmith.verify.specified.ideal_filter import StatedFilter, stated_filter
from sosmith.verify.specified.section_mask import sections_keep_to_losses
from sosmith.verify.specified.sections_file import sections_in, taps_in
from sosmith.verify.specified.words import words_of

CALIBRATED = {"voltage": "V", "temperature": "degC"}
"""Inputs of a calibration, in the order of the ports, and their units."""

_START = "steady"
"""How a filter starts if the specification does not say."""


@dataclass(frozen=True)
class Agreement:
    """What of a specification a certificate was held against.

    Attributes
    ----------
    core : str
        "instrument", "filter" or "calibration": the part of the specification that the certificate is about.
    distance : Fraction or None
        Bound on the worst-case peak gain of the difference between the specified filter and the certificate's rational
        one, without unit; None without a filter.
    fitted : bool
        Whether the calibration is fitted to measurements: its coefficients are then not in the specification.
    measurements : int
        Number of measurements that it was fitted to again; 0 if it was not.
    by_losses : bool
        Whether the filter was shown to keep to its edges and losses, which state no digits of it: those of FIR filters,
        and of others with `freedom`.
    not_compared : tuple of str
        Keys of the specification that nothing was held against, in its order.
    """

    core: str
    distance: Fraction | None
    fitted: bool
    measurements: int = 0
    by_losses: bool = False
    not_compared: tuple[str, ...] = ()


def check_specification(certificate: Certificate, text: str, margin: Fraction, folder: Path = Path()) -> Agreement:
    """Hold a proven certificate against the TOML `text` of a specification.

    Parameters
    ----------
    certificate : Certificate
    text : str
        The specification, which has been found to be valid.
    margin : Fraction
        Peak gain by which the ideal filter may differ, from `sosmith.verify.verification.Verdict`.
    folder : Path
        Where the specification lies: the `sos_file` of its filter is relative to it.

    Raises
    ------
    RejectedError
        For the first disagreement.
    """
    tree = words_of(text)
    try:
        return _checked(certificate, tree, margin, folder)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise RejectedError(f"the specification must be valid and complete, not: {error!r}") from None


def _checked(certificate: Certificate, tree: Mapping[str, Any], margin: Fraction, folder: Path) -> Agreement:
    polynomial, sections = certificate.ideal.polynomial, certificate.ideal.sections
    core = "filter" if polynomial is None else "instrument" if sections else "calibration"
    calibration: Mapping[str, Any] | None = tree.get("calibration")
    _equal("the name", certificate.name, tree["name"])
    unit = tree["output"].get("unit", "")
    output = stated_port("y" if calibration is None else "clearance", tree["output"], unit)
    inputs = [
        stated_port(name, tree["input"][name], unit if calibration is None else CALIBRATED[name])
        for name in (tree["input"] if calibration is None else CALIBRATED)
    ]
    if core == "filter" and calibration is not None:  # the filter alone takes what the calibration would give it
        inputs = [output.model_copy(update={"name": f"{output.name}_in"})]
    _equal("the number of inputs", len(certificate.inputs), len(inputs))
    for proven, stated in zip((*certificate.inputs, certificate.output), (*inputs, output), strict=True):
        for key in PortEntry.model_fields:
            _equal(f"{key} of {stated.name}", getattr(proven, key), getattr(stated, key))
    allowed = tree["output"].get("max_error", "faithful")
    _equal("max_error", certificate.max_error, output.lsb if allowed == "faithful" else stated_number(allowed))
    fitted = False
    if polynomial is not None:
        if calibration is None:
            raise RejectedError("the calibration must be left out as specified")
        fitted = "data" in calibration
        if not fitted:
            _check_polynomial(polynomial, calibration["coefficients"])
    require(bool(sections) or core == "calibration", "the filter must not be left out")
    if sections:
        stated = tree.get("hardware", {}).get("start", _START)
        down = certificate.downsampling
        filled = down is not None and down.filled > 0
        _equal("the start of the filter", "steady" if filled else certificate.ideal.start or "zero", stated)
        flagged = certificate.claims.settling is not None
        _equal("whether samples are flagged until the filter has settled", flagged, stated == "zero")
    if not sections:
        return Agreement(core, None, fitted)
    apart = _filter_distance(certificate, tree, margin, folder)
    return Agreement(core, apart or Fraction(0), fitted, by_losses=apart is None)


def _filter_distance(
    certificate: Certificate, tree: Mapping[str, Any], margin: Fraction, folder: Path
) -> Fraction | None:
    """Return how far the filter is from the specified one; None if it has to keep to losses only, and does."""
    table, rate = dict(tree["filter"]), stated_number(tree["sample_rate"])
    decimates, entry = table.pop("decimate", None), certificate.decimation
    table.pop("hold", None)  # how often a result leaves, which changes none
    correction = Fraction(0)
    if decimates != "auto":
        lowers = entry or certificate.downsampling
        _equal("the factor of the decimator", 1 if lowers is None else lowers.factor, decimates or 1)
    if entry is not None:
        _equal("the edge of the pass band", entry.edge, stated_number(table["cutoff"]) / rate)
        rate, correction = rate / entry.factor, entry.correction
    if "sos_file" in table:
        table["sos"] = sections_in(folder / table.pop("sos_file"))
    if "taps_file" in table:
        table["taps"] = taps_in(folder / table.pop("taps_file"))
    try:
        wanted = stated_filter(table, rate, correction)
        require(
            certificate.downsampling is None or "taps" in table or wanted.table.is_fir,
            "a filter that decimates by itself must be an FIR filter",
        )
        if wanted.table.by_losses:
            _check_losses(certificate.ideal.sections, wanted)
            return None
        apart = distance(wanted, certificate.ideal.sections)
        exact = exact_sections(wanted)
    except UndecidedError as error:
        raise RejectedError(f"the filter could not be compared with the specified one: {error}") from None
    require(
        apart <= margin,
        f"the filter must be the specified one within a peak gain of {float(margin):.3g}, "
        f"not differ from it by up to {float(apart):.3g}",
    )
    _check_digits(certificate.ideal.sections, exact)
    return apart


def _check_losses(proven: Sequence[SectionEntry], wanted: StatedFilter) -> None:
    """Check that a filter keeps to edges and losses; that its poles are stable has been proven."""
    table = wanted.table
    if table.is_fir:
        require(
            len(proven) == 1 and len(proven[0].denominator) == 1 and keeps_to_losses(proven[0].numerator, table),
            "the filter must keep to the edges and losses of the specification with symmetric taps",
        )
    else:
        most = decided(wanted.order)
        for name, parts in (("poles", "denominator"), ("zeros", "numerator")):
            found = sum(len(getattr(section, parts)) - 1 for section in proven)
            require(found <= most, f"the filter must have at most {most} {name}, as the family's has, not {found}")
        require(
            sections_keep_to_losses(proven, table), "the filter must keep to the edges and losses of the specification"
        )


def _check_digits(proven: Sequence[SectionEntry], exact: Sequence[SectionEntry]) -> None:
    """Check that the exact filter has the very digits that follow from the words, so that it is no other one."""
    require(len(proven) == len(exact), f"the exact filter must have {len(exact)} sections, not {len(proven)}")
    for k, (section, wanted) in enumerate(zip(proven, exact, strict=True)):
        for name in SectionEntry.model_fields:
            require(
                getattr(section, name) == getattr(wanted, name),
                f"the {name} of section {k} of the exact filter must have the digits that follow from the words",
            )


def _check_polynomial(proven: Sequence[Sequence[Fraction]], stated: Sequence[Sequence[Any]]) -> None:
    for i, (row, words) in enumerate(zip_longest(proven, stated, fillvalue=())):
        for j, (value, word) in enumerate(zip_longest(row, words, fillvalue=0)):
            _equal(f"coefficient [{i}][{j}] of the calibration", value, stated_number(word))


def stated_port(name: str, table: Mapping[str, Any], unit: str) -> PortEntry:
    """Return a port from the words of its table."""
    bits, signed = table["bits"], table.get("signed", False)
    low, high = map(stated_number, table["range"])
    return PortEntry(
        name=name,
        bits=bits,
        signed=signed,
        lsb=(high - low) / 2**bits,
        zero=Fraction(0) if signed else low,
        unit=unit,
    )


def stated_number(word: Any) -> Fraction:
    """Return a number as it is written."""
    if isinstance(word, bool) or not isinstance(word, int | Decimal):
        raise TypeError(f"{word!r} must be a number")
    return Fraction(word)


def _equal(what: str, proven: object, stated: object) -> None:
    require(proven == stated, f"{what} must be {stated} as specified, not {proven}")
