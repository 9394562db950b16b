"""Small folded designs, and edits of their programs."""

import json
import re
import tomllib
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import NamedTuple

from sosmith.gen.architectures.blocks import Blocks
from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.specification.specification import Specification, from_tree
from sosmith.hdl.plan.instructions import instruction_bits
from sosmith.model.dataflow.program import Opcode, Program
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.program.check import ProgramVerdict, check_program


class Made(NamedTuple):
    """A core with its text and its certificate."""

    design: CoreDesign
    program: Program
    text: str
    certificate: Certificate

    def check(self, text: str | None = None) -> ProgramVerdict:
        return check_program(text or self.text, self.certificate, calibrated=self.design.datapath.calibrated)


def specified(text: str) -> Specification:
    return from_tree(tomllib.loads(text, parse_float=Decimal), Path("small.toml"))


def made(design: CoreDesign, architecture: str, channels: int = 1, products: int = 1) -> Made:
    core = ARCHITECTURES[architecture](design.datapath, channels, blocks=Blocks(products, asked=products))
    assert core.program is not None
    text = to_verilog(to_rtlil(core.component(), design.datapath.name))
    read = json.loads(certificate_text(certificate(design.quantized, design.spec.max_error)))
    return Made(design, core.program, text, Certificate.model_validate(read))


@cache
def small(
    spec: str, architecture: str = "folded", realization: str = "df1_ef1", channels: int = 1, products: int = 1
) -> Made:
    return made(design_core(specified(spec), realization=realization), architecture, channels, products)


def changed(core: Made, number: int, code: int) -> str:
    """Return the core's text with another instruction."""
    digits = -(-instruction_bits(core.program) // 4)
    text, count = re.subn(rf"(instructions\[{number}\] = \d+'h)[0-9a-f]+;", rf"\g<1>{code:0{digits}x};", core.text)
    assert count == 1
    return text


def number_of(core: Made, opcode: Opcode) -> int:
    return next(k for k, instruction in enumerate(core.program.instructions) if instruction.opcode is opcode)
