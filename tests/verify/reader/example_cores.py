"""The SystemVerilog of an example in every architecture, for the readers to read."""

from dataclasses import replace
from functools import cache

from tests.gen.designs import EXAMPLES

from sosmith.gen.core import design_core
from sosmith.gen.output.verilog import core_verilog
from sosmith.gen.specification.specification import load

NAME = "audio_lowpass"
CORES = {
    "parallel": {"architecture": "parallel"},
    "folded": {"architecture": "folded"},
    "serial": {"architecture": "serial"},
    "online": {"architecture": "online"},
    "protected": {"architecture": "parallel", "protect": "correct"},
    "loadable": {"architecture": "folded", "reload": True},
    "beats": {"architecture": "parallel", "samples_per_clock": 2},
}


@cache
def core(kind: str) -> str:
    spec = load(EXAMPLES / f"{NAME}.toml")
    return core_verilog(design_core(replace(spec, hardware=replace(spec.hardware, **CORES[kind]))))
