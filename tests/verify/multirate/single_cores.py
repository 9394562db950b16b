"""Cores by themselves, each with its certificate, and single changes of their text."""

from __future__ import annotations

import re
from typing import NamedTuple

import sosmith
from sosmith.gen.output.certificate import about, certificate
from sosmith.gen.output.verilog import core_verilog
from sosmith.verify.certificate_file import Certificate, ItemEntry


class Made(NamedTuple):
    """A core with its certificate."""

    design: sosmith.Design
    text: str
    certificate: Certificate
    item: ItemEntry


def proven_alone(design: sosmith.Design) -> Made:
    core = design.core
    text = core_verilog(core)
    own = certificate(core.quantized, core.spec.max_error, about(core, {}))
    assert own.about is not None
    assert own.about.item is not None
    return Made(design, text, own, own.about.item)


def changed(text: str, pattern: str, by: str) -> str:
    """Change the first match of a pattern."""
    other, count = re.subn(pattern, by, text, count=1)
    assert count == 1, f"there must be {pattern} in the text"
    return other
