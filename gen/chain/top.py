"""The top module of a chain: an instance of each core, wires between their streams, and what joins their flags.

::

    s_axis ──> stage_1 ──> gate ──> stage_2 ── .. ──> stage_n ──> m_axis
                  │          │                           │
                  └─ tuser ──┴──────> flags <── tuser ───┘
                                        └─────────────────────> tuser of m_axis

    Every core registers its output and takes samples by tvalid and tready alone, so that back-pressure of a core
    reaches the one before it, and the whole keeps the rules of the streams that each core keeps.
    The gate belongs to the flags: `sosmith.gen.chain.joints.flags`. A stage whose constants can be loaded has its own
    AXI4-Lite port, s_axil_NAME. A stage that interpolates is several cores, which `sosmith.gen.chain.joints.turns`
    joins; if its constants can be loaded, these cores have pins for that, and `sosmith.gen.chain.joints.registers` the
    port.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence

from amaranth.hdl import Shape
from amaranth.lib.wiring import Out

from sosmith.gen.chain.design import ChainDesign, StageDesign
from sosmith.gen.chain.joints.flags import FlagsUnit, flags_unit
from sosmith.gen.chain.joints.registers import RegistersUnit, registers_unit
from sosmith.gen.chain.joints.registers_text import SHARED, nets_of, pins_of, registers_text
from sosmith.gen.chain.joints.turns import TurnsUnit, modules_of, turns_unit
from sosmith.gen.chain.joints.verilog_text import range_of
from sosmith.gen.output.core_facts import InterfaceFacts, StreamFacts, interface_facts
from sosmith.gen.version import __version__
from sosmith.hdl.bus.axi_lite import slave_members
from sosmith.model.reload.registers import ADDRESS_BITS
from sosmith.model.templates import in_comment


def chain_interface(design: ChainDesign) -> InterfaceFacts:
    """Facts needed to drive a chain: the streams of its ends, and the clocks of all stages together."""
    faces, unit = [_slowest(stage) for stage in design.stages], flags_unit(design)
    waits = 0 if unit is None else unit.clearing
    return InterfaceFacts(
        name=design.name,
        inputs=faces[0].inputs,
        outputs=faces[-1].outputs,
        reset_cycles=max(face.reset_cycles for face in faces),
        latency_cycles=sum(face.reset_cycles + face.latency_cycles for face in faces) + waits,
        samples_per_result=design.factor,
        rates=design.rates if design.rise > 1 else (),
    )


def _slowest(stage: StageDesign) -> InterfaceFacts:
    """Facts about a stage: of cores side by side, those of the one that takes longest."""
    return max(map(interface_facts, stage.cores), key=lambda face: face.reset_cycles + face.latency_cycles)


def top_ports(design: ChainDesign) -> list[tuple[str, str, int]]:
    """Return direction, name and width of the ports: clock and reset, streams, and the registers of each stage."""
    face = chain_interface(design)
    return [
        ("input", "aclk", 1),
        ("input", "aresetn", 1),
        *_stream("s_axis", face.inputs, "input"),
        *_stream("m_axis", face.outputs, "output"),
        *(
            (way, f"{registers_port(stage)}_{signal}", width)
            for stage in design.stages
            for way, signal, width in _registers(stage)
        ),
    ]


def top_text(design: ChainDesign) -> str:
    """SystemVerilog of the top module and its flags; the modules of the cores stand in their own files."""
    faces = [interface_facts(stage.design) for stage in design.stages]
    names = [f"stage_{stage.spec.name}" for stage in design.stages]
    outputs, unit = faces[-1].outputs, flags_unit(design)
    ports = top_ports(design)
    lines = [f"module {design.name}({', '.join(name for _, name, _ in ports)});"]
    for direction, name, width in ports:
        lines += [f"  {direction} {range_of(width)}{name};", f"  wire {range_of(width)}{name};"]
    nets = [net for name, face in zip(names[:-1], faces, strict=False) for net in _stream(name, face.outputs, "output")]
    if unit is not None:
        nets += [("", "gated_tvalid", 1), ("", "gated_tready", 1), ("", "last_tuser", outputs.user_width)]
    lines += [f"  wire {range_of(width)}{net};" for _, net, width in nets]
    for k, (stage, name, face) in enumerate(zip(design.stages, names, faces, strict=True)):
        before = "s_axis" if k == 0 else names[k - 1]
        behind = "m_axis" if k == len(names) - 1 else name
        given = _pins("s_axis", before, face.inputs) | _pins("m_axis", behind, face.outputs)
        if unit is not None and k == 0:
            given["m_axis_tready"] = "gated_tready"
        if unit is not None and k == 1:
            given["s_axis_tvalid"] = "gated_tvalid"
        if unit is not None and behind == "m_axis":
            given["m_axis_tuser"] = "last_tuser"
        turns = turns_unit(design, stage)
        loads = registers_unit(design, stage)
        lines += _core(stage, name, given) if turns is None else _in_turn(turns, loads, stage, name, given)
    if unit is not None:
        lines += _instance(unit.name, "flags", _joined(unit, names[0]))
    loads_of = (registers_unit(design, stage) for stage in design.stages)
    own = [
        *(each.text() for each in modules_of(design)),
        *(registers_text(each) for each in loads_of if each is not None),
    ]
    own += [] if unit is None else [unit.text()]
    before = "".join(f"{text}\n" for text in own)
    return _header(design, chain_interface(design)) + before + "\n".join([*lines, "endmodule", ""])


def _core(stage: StageDesign, name: str, given: Mapping[str, str]) -> list[str]:
    pins = {"aclk": "aclk", "aresetn": "aresetn", **given}
    pins |= {f"s_axil_{signal}": f"{registers_port(stage)}_{signal}" for _, signal, _ in _registers(stage)}
    return _instance(stage.modules[0], name, pins)


def _in_turn(
    unit: TurnsUnit, loads: RegistersUnit | None, stage: StageDesign, name: str, given: Mapping[str, str]
) -> list[str]:
    """Instances of the cores of a stage that interpolates, and of what joins them; all get the sample as it is."""
    lines, pins = list[str](), {"aclk": "aclk", "aresetn": "aresetn"}
    if loads is not None:
        shared = [pin for _, pin, _ in pins_of(loads, 0) if pin in SHARED]
        lines += [f"  wire {name}_{net};" for net in ("between", *shared)]
    pins |= {f"s_{signal}": given[f"s_axis_{signal}"] for signal in ("tvalid", "tready")}
    for k, core in enumerate(stage.cores):
        own = f"{name}_p{k}"
        for signal, width in [*unit.payload, ("tvalid", 1), ("tready", 1)]:
            lines.append(f"  wire {range_of(width)}{own}_{signal};")
        lines += [f"  wire {own}_given;", f"  wire {own}_taken;"]
        ports = {"aclk": "aclk", "aresetn": "aresetn"} | {p: n for p, n in given.items() if p.startswith("s_axis_")}
        ports |= {"s_axis_tvalid": f"{own}_given", "s_axis_tready": f"{own}_taken"}
        ports |= {port: f"{own}_{port.removeprefix('m_axis_')}" for port in given if port.startswith("m_axis_")}
        if loads is not None:
            joined = nets_of(loads, name, k)
            widths = {pin: width for _, pin, width in pins_of(loads, k)}
            lines += [f"  wire {range_of(widths[pin])}{net};" for pin, net in joined.items() if pin not in SHARED]
            ports |= joined
            pins |= {f"i{k}_begun": joined["reload_begun"]}
        lines += _instance(core.datapath.name, own, ports)
        pins |= {f"o{k}_tvalid": f"{own}_given", f"o{k}_tready": f"{own}_taken"}
    for k in range(unit.phases):
        pins |= {f"i{k}_{signal}": f"{name}_p{k}_{signal}" for signal, _ in unit.payload}
        pins |= {f"i{k}_{signal}": f"{name}_p{k}_{signal}" for signal in ("tvalid", "tready")}
    pins |= {f"m_{port.removeprefix('m_axis_')}": net for port, net in given.items() if port.startswith("m_axis_")}
    if loads is None:
        return lines + _instance(unit.name, name, pins)
    slave = {f"s_axil_{signal}": f"{registers_port(stage)}_{signal}" for _, signal, _ in _registers(stage)}
    return [
        *lines,
        *_instance(unit.name, name, pins | {"between": f"{name}_between"}),
        *_instance(loads.name, f"{name}_registers", loads.nets(name) | slave),
    ]


def _joined(unit: FlagsUnit, first: str) -> dict[str, str]:
    """Nets at the ports of the flags, between the first two stages and beside the last."""
    nets = {
        "i_tuser": f"{first}_tuser",
        "i_tdest": f"{first}_tdest",
        "i_tvalid": f"{first}_tvalid",
        "i_tready": "gated_tready",
        "o_tvalid": "gated_tvalid",
        "o_tready": f"{first}_tready",
        "r_tuser": "last_tuser",
        "r_tvalid": "m_axis_tvalid",
        "m_tready": "m_axis_tready",
        "m_tuser": "m_axis_tuser",
    }
    return {name: nets.get(name, name) for _, name, _ in unit.ports}


def _instance(module: str, name: str, pins: Mapping[str, str]) -> list[str]:
    rows = [f"    .{pin}({net})" for pin, net in pins.items()]
    return [f"  {module} {name} (", *(f"{row}," for row in rows[:-1]), rows[-1], "  );"]


def registers_port(stage: StageDesign) -> str:
    """Prefix of the ports of a stage's registers."""
    return f"s_axil_{stage.spec.name}"


def _registers(stage: StageDesign) -> list[tuple[str, str, int]]:
    """Direction, name and width of the signals of a stage's registers, if it has any."""
    if stage.design.architecture.fingerprint is None:
        return []
    members = slave_members(ADDRESS_BITS).items()
    return [
        ("output" if member.flow is Out else "input", name.removeprefix("s_axil_"), Shape.cast(member.shape).width)
        for name, member in members
    ]


def _stream(prefix: str, stream: StreamFacts, direction: str) -> list[tuple[str, str, int]]:
    back = {"input": "output", "output": "input"}[direction]
    rows = [(direction, "tdata", stream.width), (direction, "tvalid", 1), (back, "tready", 1)]
    if stream.dest_width:
        rows.append((direction, "tdest", stream.dest_width))
    if stream.flags:
        rows.append((direction, "tuser", stream.user_width))
    return [(way, f"{prefix}_{signal}", width) for way, signal, width in rows]


def _pins(prefix: str, net: str, stream: StreamFacts) -> dict[str, str]:
    names = [name.removeprefix(prefix) for _, name, _ in _stream(prefix, stream, "input")]
    return {f"{prefix}{name}": f"{net}{name}" for name in names}


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
    if design.rise > 1:
        rows.append(f"{design.rise} results for each {design.factor} samples of a channel, the first with the first.")
    elif design.factor > 1:
        rows.append(f"A result for each {interface.samples_per_result} samples of a channel, the first with the first.")
    return "".join(f"// {row}".rstrip() + "\n" for row in rows) + "\n"


def _sources(design: ChainDesign) -> Sequence[str]:
    return [f"{module}.sv" for stage in design.stages for module in stage.modules]
