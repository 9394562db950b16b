"""Reads the top module of a chain: instances of the cores, and wires between their streams, and nothing else."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.verify.certificate_file import ItemEntry
from sosmith.verify.graph import require
from sosmith.verify.reader.source import read_source
from sosmith.verify.reader.syntax import Bits, Module
from sosmith.verify.verdict.item import check_ports

_CLOCKS = ("aclk", "aresetn")


def check_top(texts: Sequence[str], top: str, name: str, cores: Sequence[str], items: Sequence[ItemEntry]) -> None:
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

    Raises
    ------
    RejectedError
        If there is anything but instances and wires, or a wire that goes elsewhere.
    """
    module = read_source("\n".join([*texts, top]), name).modules[name]
    ends = items[-1].model_copy(update={"taken": items[0].taken})
    check_ports(module, ends)
    require(
        not module.registers and not module.depths and not module.clocked and not module.assigns,
        f"{name} must have instances and wires alone",
    )
    placed = [inside for inside, _, _ in module.instances]
    require(placed == list(cores), f"{name} must have an instance of {', '.join(cores)}, not of {', '.join(placed)}")
    wires = [{port: _whole(value, module, name) for port, value in ports.items()} for _, _, ports in module.instances]
    for core, ports in zip(cores, wires, strict=True):
        for clock in _CLOCKS:
            require(ports[clock] == clock, f"{clock} of {core} must be that of {name}, not {ports[clock]}")
    signals = [port.removeprefix("s_axis_") for port in wires[0] if port.startswith("s_axis_")]
    for signal in signals:
        _same(wires[0][f"s_axis_{signal}"], f"s_axis_{signal}", f"s_axis_{signal} of {cores[0]}")
    for signal in (port.removeprefix("m_axis_") for port in wires[-1] if port.startswith("m_axis_")):
        _same(wires[-1][f"m_axis_{signal}"], f"m_axis_{signal}", f"m_axis_{signal} of {cores[-1]}")
    for core, before, behind in zip(cores[1:], wires, wires[1:], strict=False):
        for signal in signals:
            _same(behind[f"s_axis_{signal}"], before[f"m_axis_{signal}"], f"s_axis_{signal} of {core}")


def _whole(value: object, module: Module, name: str) -> str:
    """Return the name of the net at a port, all of whose bits are there."""
    whole = isinstance(value, Bits) and value.low == 0 and value.width in {None, module.widths[value.name]}
    require(whole, f"the ports of the cores in {name} must be whole nets")
    assert isinstance(value, Bits)
    return value.name


def _same(net: str, wanted: str, what: str) -> None:
    require(net == wanted, f"{what} must be the net {wanted}, not {net}")
