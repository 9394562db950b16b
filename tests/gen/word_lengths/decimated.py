"""Specifications of decimated filters for the tests."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from tests.gen.designs import EXAMPLES

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.certificate import about, certificate
from sosmith.gen.specification.specification import Specification, from_text
from sosmith.verify.certificate_file import Certificate, certificate_text


def locomotive_text(decimate: str = '"auto"', architecture: str = "auto", *, hold: bool = False) -> str:
    """Return the locomotive's specification with a decimator before its filter."""
    text = (EXAMPLES / "flange_wear_locomotive.toml").read_text(encoding="utf-8")
    text = text.replace("order = 7\n", f"order = 7\ndecimate = {decimate}\nhold = {str(hold).lower()}\n")
    return text.replace('architecture = "auto"', f'architecture = "{architecture}"')


def locomotive_spec(decimate: str = '"auto"', architecture: str = "auto", *, hold: bool = False) -> Specification:
    """Return the same, read."""
    return from_text(locomotive_text(decimate, architecture, hold=hold), Path("locomotive.toml"))


@cache
def locomotive(
    decimate: str = '"auto"', architecture: str = "auto", core: str = "filter", *, hold: bool = False
) -> CoreDesign:
    """Design its filter, or all of it."""
    return design_core(locomotive_spec(decimate, architecture, hold=hold), core=core)


INSTRUMENT = """
name = "slight"
sample_rate = 100.0
input.voltage = {{ bits = 10, range = [0.0, 10.0] }}
input.temperature = {{ bits = 10, range = [0.0, 128.0] }}
calibration.coefficients = [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]
filter = {{ family = "butterworth", kind = "lowpass", order = 2, cutoff = 1.0, decimate = 4 }}
output = {{ bits = 10, range = [0.0, 16.0], unit = "mm", max_error = "faithful" }}
{extra}
"""


@cache
def small(extra: str = "", core: str = "instrument") -> CoreDesign:
    """Design a small instrument with a decimator, or its filter alone; `extra` are lines of its specification."""
    return design_core(from_text(INSTRUMENT.format(extra=extra), Path("slight.toml")), core=core)


_TEXTS: dict[int, tuple[CoreDesign, str]] = {}


def tree_of(made: CoreDesign) -> Any:
    """Return the certificate of a design as it is in its file, for the caller to change."""
    if id(made) not in _TEXTS:  # kept with its design, so that no other one gets its number
        entries = certificate(made.quantized, made.spec.max_error, about(made, {}))
        _TEXTS[id(made)] = made, certificate_text(entries)
    return json.loads(_TEXTS[id(made)][1])


def read(tree: Any) -> Certificate:
    """Return the certificate with this content."""
    return Certificate.model_validate(tree)
