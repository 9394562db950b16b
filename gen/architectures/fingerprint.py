"""What about the hardware new constants must not change, in one number."""

from __future__ import annotations

import zlib

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Node, Op
from sosmith.model.dataflow.program import Program


def structure(node: Node) -> tuple[object, ...]:
    """Everything about a node that a new set of constants must not change."""
    constant = node.op in {Op.SCALE, Op.CONSTANT}
    limits = (node.low, node.high) if node.op is Op.CLAMP else ()
    return node.op.value, node.operands, node.frac, 0 if constant else node.parameter, node.parameter_frac, limits


def fingerprint(
    name: str, datapath: Datapath, channels: int, program: Program | None, *, protect: str, restarts: bool
) -> int:
    """CRC-32 of everything about the hardware of the architecture `name` except its constants."""
    stages = [(stage.name, [structure(node) for node in stage.graph.nodes]) for stage in datapath.stages]
    shape = (name, channels, datapath.inputs, datapath.output, stages)
    sizes = "None"
    if program is not None:
        count = len(program.instructions)
        sizes = f"({program.digit_bits}, {program.locations}, {program.words}, {program.accumulator_bits}, {count})"
    # A core without them keeps the number that it had before there were protection and restarts.
    guarded = "" if protect == "none" else f", {protect!r}"
    restart = ", 'restarts'" if restarts else ""
    before = "" if datapath.decimator is None else f", {datapath.decimator!r}, {_constants(datapath.calibration)!r}"
    return zlib.crc32(f"({shape!r}, {sizes}{guarded}{restart}{before})".encode())


def _constants(calibration: Datapath | None) -> object:
    """Everything about a calibration before a decimator, whose constants are fixed."""
    return None if calibration is None else [stage.graph.nodes for stage in calibration.stages]
