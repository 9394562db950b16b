"""Cores by themselves, each with its certificate, and single changes of their text."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

from tests.verify.parallel.edits import random_edits, swept
from tests.verify.parallel.simulated import outputs

import sosmith
from sosmith.gen.output.certificate import about, certificate
from sosmith.gen.output.verilog import core_verilog
from sosmith.verify.certificate_file import Certificate, ItemEntry
from sosmith.verify.graph import RejectedError


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


Check = Callable[[str, Certificate, ItemEntry], object]


def rejection(check: Check, core: Made, text: str) -> str:
    """Return the sentence of a rejection; nothing if a text is accepted."""
    try:
        check(text, core.certificate, core.item)
    except RejectedError as error:
        return str(error)
    return ""


def rejected(check: Check, core: Made, count: int, seed: int) -> int:
    """Edit a text at random; what is accepted must do the same in simulation. Return how many are rejected."""

    def seen(text: str) -> object:
        return outputs(text, 400, seed, core.item.channels)

    edited = random_edits(core.text, count, seed)
    return swept(edited, lambda text: rejection(check, core, text), seen, core.text)["rejected"]


def with_more(text: str, more: str) -> str:
    """Return a core's text with more in its top module, before all that is computed."""
    start = text.index("  assign ", text.index("module "))
    return f"{text[:start]}{more}{text[start:]}"
