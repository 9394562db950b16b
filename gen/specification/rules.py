"""Rules that involve several keys of a specification.

Each function checks one subject and raises `UnfitError` with the path of the key at fault.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction

from sosmith.gen.specification.choices import (
    AUTO,
    CALIBRATION_INPUTS,
    FAMILIES,
    FIR_FAMILIES,
    KINDS,
    LOOK_AHEAD,
    LOSSES,
    MAX_RATIO,
)
from sosmith.gen.specification.combinations import check_combinations
from sosmith.gen.specification.converters import ADCS, DACS, OUTPUT
from sosmith.gen.specification.schema import MAX_ORDER, ConverterTable, Document, FilterTable, InputTable, OutputTable
from sosmith.gen.specification.uncertainty import check_coefficients
from sosmith.gen.specification.values import UnfitError, identifier, key_text, listed, literal, one_of, together
from sosmith.model.converters.i2s_converter import I2sConverter
from sosmith.model.converters.spi_converter import Converter
from sosmith.model.converters.spi_dac import SpiDac

MARGIN = Fraction(1, 10**6)
"""Minimum distance of a band edge from 0 and from half the sample rate, as a fraction of the sample rate.

At this ratio a section's 1 + a1 + a2, about ``(2 * pi * MARGIN)**2``, is already below 2**-34, so that
coefficients would have that many leading bits without information.
"""

_BY_ORDER = ("order", "cutoff")
_BY_EDGES = ("passband_edge", "stopband_edge", "passband_loss", "stopband_loss")
_BY_SECTIONS = ("sos", "sos_file")
_BY_TAPS = ("taps", "taps_file")
_DECIMATE = "filter.decimate"
_FORMS = (
    "given by order and cutoff, by passband_edge, stopband_edge, passband_loss and stopband_loss, "
    "by one of sos and sos_file, or by one of taps and taps_file"
)


def check(document: Document) -> None:
    """Check the rules that `sosmith.gen.specification.schema.parse` cannot check on single keys.

    Raises
    ------
    UnfitError
        For all findings, one of each subject.
    """
    findings = []
    for rules in _SUBJECTS:
        try:
            for rule in rules:
                rule(document)
        except UnfitError as unfit:
            findings.append(unfit)
    if findings:
        raise together(findings)


def _check_clock(document: Document) -> None:
    lanes = document.hardware.samples_per_clock
    if document.hardware.clock * lanes < document.sample_rate:
        share = f" divided by hardware.samples_per_clock = {lanes}" if lanes > 1 else ""
        raise UnfitError(
            f"at least the sample_rate ({literal(document.sample_rate)} Hz){share}",
            literal(document.hardware.clock),
            where="hardware.clock",
        )


def _check_lock(document: Document) -> None:
    """Check that what is locked can be loaded."""
    if document.hardware.reload_lock and not document.hardware.reload:
        raise UnfitError(
            "false where nothing is loaded (hardware.reload = false)", "true", where="hardware.reload_lock"
        )


def _check_pins(document: Document) -> None:
    """Check that a core whose registers are elsewhere has something to load, and no reason to restart."""
    hardware = document.hardware
    if hardware.reload_registers:
        return
    beside = (
        ("hardware.reload = false", not hardware.reload),
        ("hardware.reload_lock = true", hardware.reload_lock),
        ("filter.decimate", document.filter.decimate is not None),
        ("[wear]", document.wear is not None),
    )
    for what, there in beside:
        if there:
            raise UnfitError(f"true with {what}", "false", where="hardware.reload_registers")


def _check_pipeline(document: Document) -> None:
    """Check what look-ahead and several samples a clock exclude beside other options of the hardware."""
    hardware, most = document.hardware, max(LOOK_AHEAD) // 2
    if hardware.pipeline == "look-ahead" and hardware.realization != AUTO:
        expected = "'auto' with hardware.pipeline = \"look-ahead\""
        raise UnfitError(expected, literal(hardware.realization), where="hardware.realization")
    if hardware.pipeline == "look-ahead" and hardware.samples_per_clock > most:
        expected = f'at most {most} with hardware.pipeline = "look-ahead"'
        raise UnfitError(expected, literal(hardware.samples_per_clock), where="hardware.samples_per_clock")
    if hardware.samples_per_clock > 1 and document.converter:
        expected = f"left out with hardware.samples_per_clock = {hardware.samples_per_clock}"
        tables = ", ".join(map(literal, document.converter))
        raise UnfitError(expected, tables, where="converter", later=True)


def _check_inputs(document: Document) -> None:
    names = list(document.input)
    given = ", ".join(literal(name) for name in names) or "none"
    if document.calibration is not None and set(names) != set(CALIBRATION_INPUTS):
        raise UnfitError("the two tables voltage and temperature with [calibration]", given, where="input")
    if document.calibration is None and len(names) != 1:
        raise UnfitError("a single table if there is no [calibration]", given, where="input")
    for name, table in document.input.items():
        try:
            identifier(name)
        except UnfitError as unfit:
            where = f"input.{key_text(name)}"
            raise UnfitError(f"named by {unfit.expected}", unfit.found, where=where) from None
        _check_range(table, f"input.{name}")


def _check_converters(document: Document) -> None:
    tables = document.converter
    inputs = {name: table for name, table in tables.items() if name in document.input or name != OUTPUT}
    if tables and set(inputs) != set(document.input):
        expected = f"a table for each of the inputs {listed(list(document.input))}, or none"
        raise UnfitError(expected, ", ".join(map(literal, tables)), where="converter")
    for name, table in tables.items():
        _check_converter(key_text(name), table, ADCS if name in inputs else DACS)


def _check_converter(
    name: str, table: ConverterTable, devices: Mapping[str, Converter | I2sConverter | SpiDac]
) -> None:
    where = f"converter.{name}"
    if table.device not in devices:
        kind = "a DAC" if devices is DACS else "an ADC"
        raise UnfitError(f"{kind}, {one_of(tuple(devices))}", literal(table.device), where=f"{where}.device")
    device = devices[table.device]
    by_range = isinstance(device, Converter) and device.step is None
    if by_range and table.range is None:
        expected = f"the values of the input at the readings 0 and {2**device.width}, [low, high]"
        raise UnfitError(expected, "missing", where=f"{where}.range")
    without = () if by_range else ("range", "supply") if isinstance(device, Converter) else ("supply",)
    for key in without:
        if (given := getattr(table, key)) is not None:
            raise UnfitError(f"left out for {table.device}", literal(given), where=f"{where}.{key}")


def _check_range(table: InputTable, where: str) -> None:
    low, high = table.range
    if table.signed and low != -high:
        raise UnfitError("symmetric, [-high, high], where signed = true", literal(table.range), where=f"{where}.range")


def _check_calibration(document: Document) -> None:
    calibration = document.calibration
    if calibration is None:
        return
    if (calibration.coefficients is None) == (calibration.data is None):
        given = "none of them" if calibration.data is None else "both"
        raise UnfitError("given by one of coefficients and data", given, where="calibration")
    if calibration.coefficients is not None and not any(map(any, calibration.coefficients)):
        raise UnfitError("a polynomial that is not zero", "zeros only", where="calibration.coefficients")
    check_coefficients(calibration)


def _check_uncertainty(document: Document) -> None:
    table = document.uncertainty
    if table is None:
        return
    if document.calibration is None:
        raise UnfitError("left out without a table [calibration]", "given", where="uncertainty")
    nyquist = document.sample_rate / 2
    for k, (frequency, amplitude) in enumerate(table.motion):
        if not 0 < frequency < nyquist:
            expected = f"above 0 and below half the sample rate, {float(nyquist):g} Hz"
            raise UnfitError(expected, f"{float(frequency):g} Hz", where=f"uncertainty.motion[{k}]")
        if amplitude < 0:
            raise UnfitError("of an amplitude of 0 or more", f"{float(amplitude):g}", where=f"uncertainty.motion[{k}]")


def _check_filter(document: Document) -> None:
    table, sample_rate = document.filter, document.sample_rate
    given = [key for key in (*_BY_ORDER, *_BY_EDGES, *_BY_SECTIONS, *_BY_TAPS) if getattr(table, key) is not None]
    match [any(key in given for key in form) for form in (_BY_ORDER, _BY_EDGES[:2], _BY_SECTIONS, _BY_TAPS)]:
        case [True, False, False, False]:
            _check_by_order(table, given, sample_rate)
        case [False, True, False, False]:
            _check_by_edges(table, given, sample_rate)
        case [False, False, True, False]:
            _check_sections(table, given)
        case [False, False, False, True]:
            _check_taps(table, given)
        case _:
            raise UnfitError(_FORMS, f"by {listed(given) if given else 'none of them'}", where="filter")
    if table.freedom != "none":
        _check_freedom(table, given)


def _check_by_order(table: FilterTable, given: Sequence[str], sample_rate: Fraction) -> None:
    family, kind = _family_and_kind(table)
    if family in FIR_FAMILIES:
        raise UnfitError(f"given by {listed(_BY_EDGES)} for {family}", "by order and cutoff", where="filter")
    if table.method == "impulse_invariant":
        _check_impulse_invariant(table, family, kind)
    losses = LOSSES.get(family, ())
    beside = f"with order and cutoff for {family}"
    _check_given(given, _BY_ORDER)
    for key in _BY_EDGES[2:]:
        if key in losses and key not in given:
            raise UnfitError(f"given in dB {beside}", "missing", where=f"filter.{key}")
        if key in given and key not in losses:
            raise UnfitError(f"left out {beside}", literal(getattr(table, key)), where=f"filter.{key}")
    _check_losses(table)
    _check_band(table, "cutoff", kind, sample_rate)
    limit = MAX_ORDER // 2 if _is_band(kind) else MAX_ORDER
    if table.order is not None and table.order > limit:
        raise UnfitError(
            f"at most {limit} for {kind}, which doubles the order", literal(table.order), where="filter.order"
        )


def _check_by_edges(table: FilterTable, given: Sequence[str], sample_rate: Fraction) -> None:
    family, kind = _family_and_kind(table)
    if family in FIR_FAMILIES and table.method is not None:
        raise UnfitError(f"left out for {family}", literal(table.method), where="filter.method")
    if table.method == "impulse_invariant":
        raise UnfitError(
            "given by order and cutoff with impulse_invariant, as no formula for the minimum order covers its aliasing",
            "by edges",
            where="filter",
        )
    if family == "bessel":
        raise UnfitError(
            "given by order and cutoff for bessel, which has no formula for the minimum order",
            "by edges",
            where="filter",
        )
    _check_given(given, _BY_EDGES)
    _check_losses(table)
    passband = _check_band(table, "passband_edge", kind, sample_rate)
    stopband = _check_band(table, "stopband_edge", kind, sample_rate)
    relation, holds = _relation(kind, passband, stopband)
    if not holds:
        raise UnfitError(
            f"{relation} stopband_edge ({_frequencies(stopband)} Hz) for {kind}",
            _frequencies(passband),
            where="filter.passband_edge",
        )
    if family == "halfband":
        _check_halfband(kind, passband, stopband, sample_rate)


def _check_freedom(table: FilterTable, given: Sequence[str]) -> None:
    """Check that there is a mask."""
    if _BY_EDGES[0] not in given:
        raise UnfitError(
            f"left out unless the filter is given by {listed(_BY_EDGES)}",
            literal(table.freedom),
            where="filter.freedom",
        )


def _check_halfband(
    kind: str, passband: tuple[Fraction, ...], stopband: tuple[Fraction, ...], sample_rate: Fraction
) -> None:
    """Check that a half-band filter is a low-pass, whose edges lie at equal distances from a quarter of the rate."""
    if kind != "lowpass":
        expected = "lowpass for halfband: the taps of a high-pass are the same with alternating signs"
        raise UnfitError(expected, literal(kind), where="filter.kind")
    if passband[0] + stopband[0] != sample_rate / 2:
        expected = f"{literal(sample_rate / 2 - passband[0])} Hz for halfband, half the sample_rate less passband_edge"
        raise UnfitError(expected, _frequencies(stopband), where="filter.stopband_edge")


def _check_impulse_invariant(table: FilterTable, family: str, kind: str) -> None:
    if kind == "bandpass":
        raise UnfitError("lowpass with impulse_invariant", literal(kind), where="filter.kind", later=True)
    if kind != "lowpass":
        raise UnfitError(
            "lowpass with impulse_invariant, as everything that the analog filter passes above half the sample rate "
            "would alias",
            literal(kind),
            where="filter.kind",
        )
    if family in ("chebyshev2", "elliptic") and table.order is not None and table.order % 2 == 0:
        raise UnfitError(
            f"odd for {family} with impulse_invariant, as the gain of an even one does not fall to zero",
            literal(table.order),
            where="filter.order",
        )


def _check_sections(table: FilterTable, given: Sequence[str]) -> None:
    _check_alone(table, given, "sos" if table.sos is not None else "sos_file")
    for k, (b0, b1, b2, a0, a1, a2) in enumerate(table.sos or ()):
        where = f"filter.sos[{k}]"
        if a0 != 1:
            raise UnfitError("a section with a0 = 1", literal(a0), where=where)
        if not (b0 or b1 or b2):
            raise UnfitError("a section with at least one nonzero b", "b0 = b1 = b2 = 0", where=where)
        # The triangle of Jury's criterion: both poles strictly inside the unit circle, exact in rationals.
        if not (abs(a2) < 1 and abs(a1) < 1 + a2):
            raise UnfitError(
                "a stable section, |a2| < 1 and |a1| < 1 + a2",
                f"a1 = {literal(a1)}, a2 = {literal(a2)}",
                where=where,
            )


def _check_taps(table: FilterTable, given: Sequence[str]) -> None:
    form = "taps" if table.taps is not None else "taps_file"
    labels = [key for key in ("family", "kind", "method") if getattr(table, key) is not None]
    _check_alone(table, [*labels, *given], form)
    if table.taps is not None and not any(table.taps):
        raise UnfitError("a list of numbers that are not all 0", "zeros only", where="filter.taps")


def _check_alone(table: FilterTable, given: Sequence[str], form: str) -> None:
    """Check that no other key is given beside the one that gives all of the filter."""
    for key in given:
        if key != form:
            raise UnfitError(f"left out with {form}", literal(getattr(table, key)), where=f"filter.{key}")


def _family_and_kind(table: FilterTable) -> tuple[str, str]:
    if table.family is None:
        raise UnfitError(one_of((*FAMILIES, *FIR_FAMILIES)), "missing", where="filter.family")
    if table.kind is None:
        raise UnfitError(one_of(KINDS), "missing", where="filter.kind")
    return table.family, table.kind


def _check_given(given: Sequence[str], needed: Sequence[str]) -> None:
    for key in needed:
        if key not in given:
            others = [other for other in needed if other in given]
            raise UnfitError(f"given together with {listed(others)}", "missing", where=f"filter.{key}")


def _check_losses(table: FilterTable) -> None:
    passband, stopband = table.passband_loss, table.stopband_loss
    if passband is not None and stopband is not None and passband >= stopband:
        raise UnfitError(
            f"below stopband_loss ({literal(stopband)} dB)", literal(passband), where="filter.passband_loss"
        )


def _is_band(kind: str) -> bool:
    return kind in ("bandpass", "bandstop")


def _check_band(table: FilterTable, key: str, kind: str, sample_rate: Fraction) -> tuple[Fraction, ...]:
    """Check the frequencies of `key` by themselves, and return them."""
    frequencies: tuple[Fraction, ...] = getattr(table, key)
    where = f"filter.{key}"
    given = _frequencies(frequencies)
    if _is_band(kind) and len(frequencies) != 2:
        raise UnfitError(f"two frequencies [low, high] for {kind}", given, where=where)
    if not _is_band(kind) and len(frequencies) != 1:
        raise UnfitError(f"one frequency for {kind}", given, where=where)
    if not all(0 < frequency < sample_rate / 2 for frequency in frequencies):
        raise UnfitError(f"above 0 and below half the sample_rate ({literal(sample_rate / 2)} Hz)", given, where=where)
    _check_margin(table, frequencies, kind, sample_rate, where)
    if list(frequencies) != sorted(set(frequencies)):
        raise UnfitError("rising, [low, high]", given, where=where)
    return frequencies


def _check_margin(
    table: FilterTable, frequencies: Sequence[Fraction], kind: str, sample_rate: Fraction, where: str
) -> None:
    """Check that no pole lies too close to the unit circle, at the rate at which the filter works."""
    factor = 1 if table.decimate in {None, AUTO} or table.is_fir else int(table.decimate)
    margin = MARGIN * sample_rate
    if all(margin / factor <= frequency <= sample_rate / 2 - margin for frequency in frequencies):
        return
    rate = "the sample_rate" if factor == 1 else f"the sample_rate / {factor}"
    cure = " without filter.decimate" if kind == "lowpass" and factor == 1 and frequencies[0] < margin else ""
    raise UnfitError(
        f"at least a millionth of {rate} ({literal(margin / factor)} Hz) away from 0 and from half the sample_rate,"
        f" as no word length suffices for a filter closer to them{cure}",
        _frequencies(frequencies),
        where=where,
    )


def _frequencies(frequencies: Sequence[Fraction]) -> str:
    return literal(frequencies if len(frequencies) > 1 else frequencies[0])


def _relation(kind: str, passband: Sequence[Fraction], stopband: Sequence[Fraction]) -> tuple[str, bool]:
    """Return the required position of the passband edges relative to the stopband edges, and whether it holds."""
    match kind:
        case "lowpass":
            return "below", passband[0] < stopband[0]
        case "highpass":
            return "above", passband[0] > stopband[0]
        case "bandpass":
            return "inside", stopband[0] < passband[0] and passband[1] < stopband[1]
        case _:
            return "around", passband[0] < stopband[0] and stopband[1] < passband[1]


def _check_decimation(document: Document) -> None:
    """Check that what else is asked for is there behind a decimator."""
    table = document.filter
    if table.decimate is None and table.hold:
        raise UnfitError("false without filter.decimate, as every sample has a result", "true", where="filter.hold")
    if table.decimate is None:
        return
    if table.is_fir:
        _check_downsampling(document)
        return
    given, where = literal(table.decimate), _DECIMATE
    if table.order is None or table.cutoff is None:
        raise UnfitError("left out unless the filter is given by order and cutoff", given, where=where, later=True)
    if table.kind != "lowpass":
        raise UnfitError(f"left out for {table.kind}, whose pass band would alias", given, where=where)
    if table.method == "impulse_invariant":
        raise UnfitError("left out with impulse_invariant", given, where=where, later=True)
    most = MAX_RATIO * document.sample_rate / table.cutoff[0]
    factor = 2 if table.decimate == AUTO else int(table.decimate)
    if factor > most:
        raise UnfitError(
            f"at most {2 ** (math.floor(most).bit_length() - 1)}, so that the cutoff is at most {MAX_RATIO} of the "
            "lower sample rate"
            if most >= 2
            else f"left out, as the cutoff would be more than {MAX_RATIO} of the lower sample rate",
            given,
            where=where,
        )
    if document.converter:
        tables = ", ".join(map(literal, document.converter))
        raise UnfitError("left out with filter.decimate", tables, where="converter", later=True)


def _check_downsampling(document: Document) -> None:
    """Check that what else is asked for is there beside an FIR filter that decimates."""
    if document.calibration is not None:
        raise UnfitError("left out with an FIR filter", literal(document.filter.decimate), where=_DECIMATE, later=True)
    if document.converter:
        tables = ", ".join(map(literal, document.converter))
        raise UnfitError("left out with filter.decimate", tables, where="converter", later=True)
    if document.wear is not None and document.hardware.reload:
        raise UnfitError("left out with filter.decimate and hardware.reload = true", "given", where="wear", later=True)
    ((name, port),) = document.input.items()
    ratio = _lsb(port) / _lsb(document.output)
    if port.signed is False and port.range[0] != 0:
        raise UnfitError("from 0 on with filter.decimate", literal(port.range), where=f"input.{name}.range", later=True)
    if ratio.numerator & (ratio.numerator - 1) or ratio.denominator & (ratio.denominator - 1):
        raise UnfitError(
            f"such with filter.decimate that one LSB of {name} is a power of two of those of the output",
            literal(document.output.range),
            where="output.range",
            later=True,
        )


def _lsb(port: InputTable | OutputTable) -> Fraction:
    low, high = port.range
    return Fraction((high - low) / 2**port.bits)


def _check_output(document: Document) -> None:
    output = document.output
    _check_range(output, "output")
    low, high = output.range
    half = (high - low) / 2 ** (output.bits + 1)
    if output.max_error is not None and output.max_error <= half:
        raise UnfitError(
            f"more than half an LSB of the output ({literal(half)}), which output rounding alone takes",
            literal(output.max_error),
            where="output.max_error",
        )


def _check_wear(document: Document) -> None:
    wear, output = document.wear, document.output
    if wear is None:
        return
    if len(wear.initial) not in {1, document.channels}:
        expected = "one number" if document.channels == 1 else f"one number, or a list of {document.channels}"
        raise UnfitError(expected, literal(wear.initial), where="wear.initial")
    if wear.warning >= wear.limit:
        raise UnfitError(f"below limit ({literal(wear.limit)})", literal(wear.warning), where="wear.warning")
    low, high = output.range
    last = high - (high - low) / 2**output.bits  # of the highest code
    for initial in wear.initial:
        if not low <= initial <= last:
            raise UnfitError(
                f"in the range of the output, {literal(output.range)}", literal(initial), where="wear.initial"
            )
        end = initial + wear.limit if wear.sensor_range is None else min(initial + wear.limit, wear.sensor_range)
        if wear.sensor_range is not None and initial + wear.warning >= wear.sensor_range:
            raise UnfitError(
                f"above the clearance of the warning ({literal(initial + wear.warning)})",
                literal(wear.sensor_range),
                where="wear.sensor_range",
            )
        if end > last:
            raise UnfitError(
                f"at most {literal(last - initial)}, so that the output can represent it",
                literal(wear.limit),
                where="wear.limit",
            )
        step = (high - low) / 2**output.bits
        if math.ceil((initial + wear.warning - low) / step) >= math.ceil((end - low) / step):
            raise UnfitError(
                f"at least an LSB of the output ({literal(step)}) below limit",
                literal(wear.warning),
                where="wear.warning",
            )


_SUBJECTS: tuple[tuple[Callable[[Document], None], ...], ...] = (
    (_check_inputs, _check_converters),
    (_check_calibration, _check_uncertainty),
    (_check_filter, _check_decimation),
    (_check_output, _check_wear),
    (_check_clock,),
    (check_combinations, _check_pipeline, _check_lock, _check_pins),
)
"""The rules by subject; those after the first one take it to be kept."""
