"""Analog prototypes as TOML: zeros, poles and gain in rad/s, and how to make a digital filter of them.

::

    zeros = [[0.0, 250.0], [0.0, -250.0]]      # rad/s, [real, imaginary]; a number alone is real
    poles = [[-15.0, 22.0], [-15.0, -22.0], -30.0]
    gain = 4.5                                 # of the product of all (s - zero) / (s - pole)
    method = "bilinear"                        # or "impulse_invariant"
    prewarp = 3.0                              # Hz that stay where they are; left out for none
"""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

from sosmith.gen.specification.coefficients.content import Complex, ZerosAndPoles
from sosmith.model.errors import SpecificationError
from sosmith.model.suggestion import did_you_mean
from sosmith.model.tables.toml_file import read_toml
from sosmith.model.tables.toml_tables import shown

_MAX_BYTES = 1 << 16
_KEYS = ("zeros", "poles", "gain", "method", "prewarp")
_METHODS = ("bilinear", "impulse_invariant")
_MAX_EXPONENT = 30


def read_prototype(path: Path) -> ZerosAndPoles:
    """Read an analog prototype.

    Raises
    ------
    SpecificationError
        If the file cannot be read, a key is missing, unknown or has another value than it must have.
    """
    tree = read_toml(path, what="the prototype", max_bytes=_MAX_BYTES, parse_float=Decimal)
    for key in tree:
        if key not in _KEYS:
            raise SpecificationError(
                f"{path}: keys must be some of {', '.join(_KEYS)}, not {key!r}{did_you_mean(key, _KEYS)}"
            )
    for key in ("poles", "gain"):
        if key not in tree:
            raise SpecificationError(f"{path}: {key} must be given, not left out")
    method = tree.get("method", _METHODS[0])
    if method not in _METHODS:
        raise SpecificationError(f"{path}: method must be {' or '.join(_METHODS)}, not {method!r}")
    prewarp = None if "prewarp" not in tree else _number(path, "prewarp", tree["prewarp"])
    if prewarp is not None and (prewarp <= 0 or method != _METHODS[0]):
        raise SpecificationError(f"{path}: prewarp must be above 0 Hz and with bilinear, not {tree['prewarp']}")
    return ZerosAndPoles(
        format="an analog prototype",
        zeros=_places(path, "zeros", tree.get("zeros", [])),
        poles=_places(path, "poles", tree["poles"]),
        gain=_number(path, "gain", tree["gain"]),
        analog=True,
        method=method,
        prewarp=prewarp,
    )


def _places(path: Path, key: str, value: Any) -> tuple[Complex, ...]:
    if not isinstance(value, list):
        raise SpecificationError(f"{path}: {key} must be a list of numbers or of [real, imaginary], not {value!r}")
    return tuple(_place(path, f"{key}[{k}]", item) for k, item in enumerate(value))


def _place(path: Path, where: str, value: Any) -> Complex:
    if not isinstance(value, list):
        return _number(path, where, value), Fraction(0)
    if len(value) != 2:
        raise SpecificationError(f"{path}: {where} must be a number or [real, imaginary], not {len(value)} values")
    real, imaginary = (_number(path, where, item) for item in value)
    return real, imaginary


def _number(path: Path, where: str, value: Any) -> Fraction:
    if isinstance(value, bool) or not isinstance(value, int | Decimal):
        raise SpecificationError(f"{path}: {where} must be a number, not {shown(value)}")
    exact = value if isinstance(value, Decimal) else Decimal(value)
    if not exact.is_finite() or (exact and abs(exact.adjusted()) > _MAX_EXPONENT):
        raise SpecificationError(f"{path}: {where} must be a finite number within reason, not {shown(value)}")
    return Fraction(value)
