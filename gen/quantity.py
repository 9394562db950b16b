"""Numbers for people: three significant digits, SI prefixes that stand in steps of a thousand, units."""

from __future__ import annotations

import math

PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
BASE_UNITS = ("m", "s", "Hz", "V", "A", "W", "N", "Pa", "g", "bar", "Ω")
SYMBOLS = {"degC": "°C", "degF": "°F", "ohm": "Ω", "um": "µm", "uV": "µV", "us": "µs", "uA": "µA", "deg": "°"}
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MINUS = "−"
_NOTHING = 1e-300
"""What is smaller is shown as zero: its factor is beyond a double."""
_LEAST_DECIMAL = 1e-6
"""What is smaller is shown with a power of ten: nobody counts more zeros."""
LEAST_PART = 1 / 20_000
"""Least part of an error bound that is shown, in output LSB: at four decimals the others are zero. Beside other bounds,
it is a share of its own, which is about an LSB."""


def unit_symbol(unit: str) -> str:
    """Typeset form of a unit of the specification, such as ``°C`` for ``degC``."""
    return SYMBOLS.get(unit, unit)


def _split_unit(unit: str) -> tuple[int, str] | None:
    """Power of ten of the prefix, and the base unit; None if the unit takes no prefix."""
    symbol = unit_symbol(unit)
    for exponent, prefix in PREFIXES.items():
        base = symbol.removeprefix(prefix)
        if symbol.startswith(prefix) and base in BASE_UNITS:
            return exponent, base
    return None


def _engineering_exponent(value: float, digits: int) -> int:
    """Multiple of three that leaves one to three digits before the point once `value` is rounded."""
    exponent = int(f"{abs(value):.{digits - 1}e}".partition("e")[2])
    return 3 * (exponent // 3)


def power_of_ten(exponent: int) -> str:
    """``10`` with a superscript, such as ``10⁻⁶``."""
    return "10" + str(exponent).translate(SUPERSCRIPT)


def plain_number(value: float, digits: int = 3) -> str:
    """Decimal number of `digits` significant digits, with a true minus sign; a power of ten only below a millionth.

    Examples
    --------
    >>> plain_number(-0.01234), plain_number(1234567.0), plain_number(2.0), plain_number(2.63e-76)
    ('−0.0123', '1,234,567', '2.00', '263 × 10⁻⁷⁸')
    """
    if abs(value) < _NOTHING:
        return "0"
    if abs(value) < _LEAST_DECIMAL:
        exponent = _engineering_exponent(value, digits)
        return f"{plain_number(value * 10.0**-exponent, digits)} × {power_of_ten(exponent)}"
    rounded = float(f"{value:.{digits - 1}e}")
    exponent = math.floor(math.log10(abs(rounded)))
    if exponent >= digits:
        rounded = value
    return f"{rounded:,.{max(digits - 1 - exponent, 0)}f}".replace("-", MINUS)


def number(value: float) -> str:
    """Whole number in full, any other with four significant digits.

    Examples
    --------
    >>> number(1234567), number(0.5), number(7.6875)
    ('1,234,567', '0.5', '7.688')
    """
    return f"{int(value):,}" if value == int(value) else f"{value:,.4g}"


def frequency(*values: float) -> str:
    """Frequency in Hz, or several with "to" between, with up to six significant digits; from 1 MHz on in MHz.

    Examples
    --------
    >>> frequency(48000), frequency(3000, 6000.5), frequency(2.5e6, 10e6)
    ('48000 Hz', '3000 to 6000.5 Hz', '2.5 to 10 MHz')
    """
    divisor, unit = (1e6, "MHz") if max(values) >= 1e6 else (1.0, "Hz")
    return f"{' to '.join(f'{value / divisor:.6g}' for value in values)} {unit}"


def scale(peak: float, unit: str, digits: int = 3) -> tuple[float, str]:
    """Choose the factor and the unit in which values up to `peak` read well.

    Returns
    -------
    factor : float
        Multiply values in `unit` by it.
    unit : str
        Unit of the products: prefixed, with a power of ten, or `unit` itself.

    Examples
    --------
    >>> scale(0.00012, "mm"), scale(0.00012, "degC"), scale(20.0, "degC")
    ((1000000.0, 'nm'), (1000000.0, '10⁻⁶ °C'), (1.0, '°C'))
    """
    symbol = unit_symbol(unit)
    if not math.isfinite(peak) or abs(peak) < _NOTHING:
        return 1.0, symbol
    split = _split_unit(unit)
    if split is not None:
        own, base = split
        # 10 ** own times the value may round to just below a power of ten, so the exponents are added instead
        exponent = 3 * ((own + int(f"{abs(peak):.{digits - 1}e}".partition("e")[2])) // 3)
        if exponent in PREFIXES:
            return 10.0 ** (own - exponent), PREFIXES[exponent] + base
    if 1e-2 <= abs(peak) < 1e6:
        return 1.0, symbol
    exponent = _engineering_exponent(peak, digits)
    return 10.0**-exponent, f"{power_of_ten(exponent)} {symbol}".rstrip()


def quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """Value with its unit.

    Parameters
    ----------
    value : float or None
        In `unit`; None and values that are not finite give ``"—"``.
    unit : str
        Unit as in the specification, ``""`` for a plain number.
    digits : int
        Significant digits.

    Examples
    --------
    >>> quantity(0.00012207, "mm"), quantity(98.6, "degC"), quantity(3.05e-5, ""), quantity(0.0, "V")
    ('122 nm', '98.6 °C', '30.5 × 10⁻⁶', '0 V')
    """
    if value is None or not math.isfinite(value):
        return "—"
    value = 0.0 if abs(value) < _NOTHING else value
    factor, symbol = scale(value, unit, digits)
    joint = " × " if symbol.startswith("10") else " "
    return f"{plain_number(value * factor, digits)}{joint}{symbol}".rstrip()


def in_own_unit(value: float, unit: str) -> str:
    """Value in `unit` itself, as its readers think of it, unless it would be mostly zeros.

    Examples
    --------
    >>> in_own_unit(0.0939, "mm"), in_own_unit(0.00012, "mm")
    ('0.0939 mm', '120 nm')
    """
    if value and not 1e-3 <= abs(value) < 1e6:
        return quantity(value, unit)
    return f"{plain_number(value)} {unit_symbol(unit)}".rstrip()


def decibels(value: float | None) -> str:
    """Level in dB: two decimals, three significant digits below 1 dB, a power of ten below 0.01 dB.

    Examples
    --------
    >>> decibels(-80.126), decibels(0.50178), decibels(0.00028), decibels(None)
    ('−80.13 dB', '0.502 dB', '280 × 10⁻⁶ dB', '—')
    """
    if value is None or not math.isfinite(value):
        return "—"
    if abs(value) < 1:
        return quantity(value, "dB")
    return f"{value:.2f} dB".replace("-", MINUS)


def full_scale_level(value: float | None) -> str:
    """Level in dB of full scale.

    Examples
    --------
    >>> full_scale_level(-94.44), full_scale_level(0.0), full_scale_level(None)
    ('−94.4 dBFS', '0.0 dBFS', '—')
    """
    if value is None or not math.isfinite(value):
        return "—"
    return f"{round(value, 1) + 0.0:.1f} dBFS".replace("-", MINUS)


def duration(seconds: float) -> str:
    """Duration with a unit: prefixed below a minute, minutes and hours above.

    Examples
    --------
    >>> duration(0.0025), duration(12.34), duration(100.0), duration(7320.0)
    ('2.50 ms', '12.3 s', '1 min 40 s', '2 h 2 min')
    """
    if seconds < 60:
        return quantity(seconds, "s")
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest} s"
    return f"{minutes // 60} h {minutes % 60} min"


def count(value: int, noun: str, plural: str | None = None) -> str:
    """Count of things, such as ``1 channel`` or ``12,000 samples``."""
    return f"{value:,} {noun if value == 1 else plural or noun + 's'}"
