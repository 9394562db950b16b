"""Parallel cores in memory, with their SystemVerilog and their certificates."""

from __future__ import annotations

import json
import tomllib
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests.verify.small_specifications import PLAIN

from sosmith.gen.architectures.blocks import NO_LIMIT, Blocks
from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.specification.specification import Specification, from_tree
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.parallel.check import HardwareVerdict, check_hardware

ODD = PLAIN.replace("order = 2", "order = 3")


class Made(NamedTuple):
    """A core with its text and its certificate."""

    design: CoreDesign
    text: str
    certificate: Certificate
    channels: int
    lanes: int
    latency: int

    def check(self, text: str | None = None) -> HardwareVerdict:
        return check_hardware(text or self.text, self.certificate, self.channels, self.lanes)


def specified(text: str) -> Specification:
    return from_tree(tomllib.loads(text, parse_float=Decimal), Path("small.toml"))


def made(
    design: CoreDesign,
    channels: int = 1,
    lanes: int = 1,
    *,
    reload: bool = False,
    blocks: Blocks = NO_LIMIT,
    look_ahead: bool = False,
) -> Made:
    core = ARCHITECTURES["parallel"](
        design.datapath,
        channels,
        reload=reload,
        blocks=blocks,
        samples_per_clock=lanes,
        look_ahead=look_ahead,
    )
    text = to_verilog(to_rtlil(core.component(), design.datapath.name))
    read = json.loads(certificate_text(certificate(design.quantized, design.spec.max_error)))
    return Made(design, text, Certificate.model_validate(read), channels, lanes, core.latency_cycles)


@cache
def small_design(spec: str, realization: str) -> CoreDesign:
    return design_core(specified(spec), realization=realization)


@cache
def small(spec: str = PLAIN, realization: str = "df1_ef1", channels: int = 1, lanes: int = 1) -> Made:
    return made(small_design(spec, realization), channels, lanes)


@cache
def looking_ahead(spec: str = PLAIN, lanes: int = 1, multipliers: int = 0) -> Made:
    """Return a core with look-ahead for 100 MHz."""
    hardware = f"""
hardware.architecture = "parallel"
hardware.clock = 100.0e6
hardware.pipeline = "look-ahead"
hardware.samples_per_clock = {lanes}
hardware.multipliers = {multipliers}
"""
    design = design_core(specified(spec + hardware))
    return made(design, lanes=lanes, look_ahead=True, blocks=Blocks(multipliers))
