"""Reads the top module of a chain: instances of the cores, their flags, and wires between them, and nothing else."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.verify.certificate_file import ItemEntry
from sosmith.verify.chain.flags import FlagsClaim, check_flags
from sosmith.verify.graph import require
from sosmith.verify.reader.source import read_source
from sosmith.verify.reader.syntax import Bits, Module
from sosmith.verify.verdict.item import check_ports

_CLOCKS = ("aclk", "aresetn")


def check_top(
    texts: Sequence[str],
    top: str,
    name: str,
    cores: Sequence[str],
    items: Sequence[ItemEntry],
    stages: Sequence[str],
    flags: FlagsClaim | None,
) -> None:
    """Check that the top module joins the cores in their order, each stream of one to that of the next.

    Parameters
    ----------
    texts : sequence of str
        SystemVerilog of the cores.
    top : str
        That of the top module.
    name : str
        Its name.
    cores : sequence of str
        Names of the cores' modules, in the order of the samples.
    items : sequence of ItemEntry
        What the cores are.
    stages : sequence of str
        Names of the stages.
    flags : FlagsClaim or None
        What their flags must be; None for a single stage.

    Raises
    ------
    RejectedError
        If there is anything but instances and wires, or a wire that goes elsewhere.
    """
    modules = read_source("\n".join([*texts, top]), name).modules
    module = modules[name]
    check_ports(module, items[-1].model_copy(update={"taken": items[0].taken, "reload": True}))
    require(
        not module.registers and not module.depths and not module.clocked and not module.assigns,
        f"{name} must have instances and wires alone",
    )
    wanted = [*cores, *([] if flags is None else [flags.name])]
    placed = [inside for inside, _, _ in module.instances]
    require(placed == wanted, f"{name} must have an instance of {', '.join(wanted)}, not of {', '.join(placed)}")
    wires = [{port: _whole(value, module, name) for port, value in ports.items()} for _, _, ports in module.instances]
    for core, ports in zip(cores, wires, strict=False):
        for clock in _CLOCKS:
            require(ports[clock] == clock, f"{clock} of {core} must be that of {name}, not {ports[clock]}")
    _check_registers(module, name, dict(zip(stages, wires, strict=False)))
    _check_streams(cores, wires[: len(cores)], stages, gated=flags is not None)
    if flags is not None:
        for port, net in flags.inputs(f"stage_{stages[0]}").items():
            require(port in wires[-1], f"{flags.name} must have the port {port}")
            _same(wires[-1][port], net, f"{port} of {flags.name}")
        check_flags(modules[flags.name], flags)


def _check_streams(
    cores: Sequence[str], wires: Sequence[dict[str, str]], stages: Sequence[str], *, gated: bool
) -> None:
    """Check that the nets of a stage's results are those that the next one takes, but for what the flags hold back."""
    for k, (core, stage, ports) in enumerate(zip(cores, stages, wires, strict=True)):
        before = "s_axis" if k == 0 else f"stage_{stages[k - 1]}"
        behind = "m_axis" if k == len(cores) - 1 else f"stage_{stage}"
        nets = {port: f"{before}_{port.removeprefix('s_axis_')}" for port in ports if port.startswith("s_axis_")}
        nets |= {port: f"{behind}_{port.removeprefix('m_axis_')}" for port in ports if port.startswith("m_axis_")}
        if gated:
            nets |= {"m_axis_tready": "gated_tready"} if k == 0 else {}
            nets |= {"s_axis_tvalid": "gated_tvalid"} if k == 1 else {}
            nets |= {"m_axis_tuser": "last_tuser"} if k == len(cores) - 1 else {}
        for port, net in nets.items():
            _same(ports[port], net, f"{port} of {core}")


def _check_registers(module: Module, name: str, wires: dict[str, dict[str, str]]) -> None:
    """Check that the registers of each stage are at ports of their own, of the name of the stage."""
    wanted = {}
    for stage, ports in wires.items():
        for port, net in ports.items():
            if port.startswith("s_axil_"):
                wanted[f"s_axil_{stage}_{port.removeprefix('s_axil_')}"] = net
    there = [port for port in module.ports if port.startswith("s_axil_")]
    require(sorted(there) == sorted(wanted), f"{name} must have the ports {', '.join(wanted)}, not {', '.join(there)}")
    for port, net in wanted.items():
        _same(net, port, f"the registers' net {port}")


def _whole(value: object, module: Module, name: str) -> str:
    """Return the name of the net at a port, all of whose bits are there."""
    whole = isinstance(value, Bits) and value.low == 0 and value.width in {None, module.widths[value.name]}
    require(whole, f"the ports of the cores in {name} must be whole nets")
    assert isinstance(value, Bits)
    return value.name


def _same(net: str, wanted: str, what: str) -> None:
    require(net == wanted, f"{what} must be the net {wanted}, not {net}")
