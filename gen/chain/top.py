"""The top module of a chain: an instance of each core, and wires between their streams.

::

    s_axis ──> stage_1 ──tdata, tvalid [, tdest]──> stage_2 ── .. ──> stage_n ──> m_axis
                       <──tready──                                         ──> tuser of the last stage

    Every core registers its output and takes samples by tvalid and tready alone, so that back-pressure of a core
    reaches the one before it, and the whole keeps the rules of the streams that each core keeps.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.output.core_facts import InterfaceFacts, StreamFacts, interface_facts
from sosmith.gen.version import __version__
from sosmith.model.templates import in_comment


def chain_interface(design: ChainDesign) -> InterfaceFacts:
    """Facts needed to drive a chain: the streams of its ends, and the clocks of all stages together."""
    faces = [interface_facts(stage.design) for stage in design.stages]
    return InterfaceFacts(
        name=design.name,
        inputs=faces[0].inputs,
        outputs=faces[-1].outputs,
        reset_cycles=max(face.reset_cycles for face in faces),
        latency_cycles=sum(face.reset_cycles + face.latency_cycles for face in faces),
        samples_per_result=design.factor,
    )


def top_text(design: ChainDesign) -> str:
    """SystemVerilog of the top module alone; the modules of the cores stand in their own files."""
    faces = [interface_facts(stage.design) for stage in design.stages]
    names = [f"stage_{stage.spec.name}" for stage in design.stages]
    inputs, outputs = faces[0].inputs, faces[-1].outputs
    ports = [("input", "aclk", 1), ("input", "aresetn", 1)]
    ports += [*_stream("s_axis", inputs, "input"), *_stream("m_axis", outputs, "output")]
    lines = [f"module {design.name}({', '.join(name for _, name, _ in ports)});"]
    for direction, name, width in ports:
        lines += [f"  {direction} {_range(width)}{name};", f"  wire {_range(width)}{name};"]
    for k, (name, face) in enumerate(zip(names, faces, strict=True)):
        if k < len(names) - 1:
            lines += [f"  wire {_range(width)}{net};" for _, net, width in _stream(name, face.outputs, "output")]
    for k, (name, face) in enumerate(zip(names, faces, strict=True)):
        before = "s_axis" if k == 0 else names[k - 1]
        behind = "m_axis" if k == len(names) - 1 else name
        pins = [("aclk", "aclk"), ("aresetn", "aresetn")]
        pins += _pins("s_axis", before, face.inputs) + _pins("m_axis", behind, face.outputs)
        lines.append(f"  {face.name} {name} (")
        lines += [f"    .{pin}({net})," for pin, net in pins[:-1]]
        lines += [f"    .{pins[-1][0]}({pins[-1][1]})", "  );"]
    return _header(design, chain_interface(design)) + "\n".join([*lines, "endmodule", ""])


def _stream(prefix: str, stream: StreamFacts, direction: str) -> list[tuple[str, str, int]]:
    back = {"input": "output", "output": "input"}[direction]
    rows = [(direction, "tdata", stream.width), (direction, "tvalid", 1), (back, "tready", 1)]
    if stream.dest_width:
        rows.append((direction, "tdest", stream.dest_width))
    if stream.flags:
        rows.append((direction, "tuser", stream.user_width))
    return [(way, f"{prefix}_{signal}", width) for way, signal, width in rows]


def _pins(prefix: str, net: str, stream: StreamFacts) -> list[tuple[str, str]]:
    names = [name.removeprefix(prefix) for _, name, _ in _stream(prefix, stream, "input")]
    return [(f"{prefix}{name}", f"{net}{name}") for name in names]


def _range(width: int) -> str:
    return "" if width == 1 else f"[{width - 1}:0] "


def _header(design: ChainDesign, interface: InterfaceFacts) -> str:
    spec = design.spec
    unit = in_comment(spec.base.output.unit)
    rows = [
        f"{design.name}: {' -> '.join(stage.spec.name for stage in design.stages)}",
        "",
        "SPDX-License-Identifier: Apache-2.0",
        f"Made by sosmith {__version__} from the specification with SHA-256",
        f"  {hashlib.sha256(spec.text.encode()).hexdigest()}",
        "",
        f"Proven for all inputs in range: |y - exact| <= {float(design.bound):.6g} {unit}".rstrip() + ".",
        f"{design.name}.certificate.json has the proof; `sosmith verify` repeats it.",
        "",
        f"Needs the files {', '.join(_sources(design))}.",
    ]
    if design.factor > 1:
        rows.append(f"A result for each {interface.samples_per_result} samples of a channel, the first with the first.")
    return "".join(f"// {row}".rstrip() + "\n" for row in rows) + "\n"


def _sources(design: ChainDesign) -> Sequence[str]:
    return [f"{stage.design.datapath.name}.sv" for stage in design.stages]
