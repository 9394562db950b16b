"""Reads the top module of a chain: instances of the cores, their flags, and wires between them, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sosmith.verify.certificate_file import ItemEntry
from sosmith.verify.chain.flags import FlagsClaim, check_flags
from sosmith.verify.chain.shared import check_shared
from sosmith.verify.chain.turns import TurnsClaim, check_turns
from sosmith.verify.graph import require
from sosmith.verify.reader.source import read_source
from sosmith.verify.reader.syntax import Bits, Module
from sosmith.verify.verdict.item import check_ports

_CLOCKS = ("aclk", "aresetn")
_STREAMS = ("s_axis_", "m_axis_")
_SIGNALS = ("tdata", "tvalid", "tready", "tdest", "tuser")


@dataclass(frozen=True)
class Stage:
    """A stage: its name, the names of its cores' modules, and what each of these is."""

    name: str
    cores: tuple[str, ...]
    item: ItemEntry

    @property
    def modules(self) -> tuple[str, ...]:
        """Modules of its hardware: of each core, or the one that all share."""
        return (self.shared_module,) if self.item.shared else self.cores

    @property
    def shared_module(self) -> str:
        """Module that computes all results of a sample."""
        return self.cores[0].removesuffix("_p0")

    @property
    def placed(self) -> list[str]:
        """Modules of which it has an instance: those of its hardware, and what joins several."""
        if len(self.modules) == 1:
            return [*self.modules]
        return [*self.cores, self.joining, *([self.registers] if self.loads else [])]

    @property
    def loads(self) -> bool:
        """Whether the taps of several cores can be loaded, through registers that they share."""
        return len(self.cores) > 1 and self.item.reload

    @property
    def joining(self) -> str:
        """Module that joins its cores."""
        return f"{self.cores[0].removesuffix('_p0')}_turns"

    @property
    def registers(self) -> str:
        """Module of the registers that its cores share."""
        return f"{self.cores[0].removesuffix('_p0')}_registers"


def check_top(texts: Sequence[str], top: str, name: str, stages: Sequence[Stage], flags: FlagsClaim | None) -> None:
    """Check that the top module joins the cores in their order, each stream of one to that of the next.

    Parameters
    ----------
    texts : sequence of str
        SystemVerilog of the cores.
    top : str
        That of the top module.
    name : str
        Its name.
    stages : sequence of Stage
        In the order of the samples.
    flags : FlagsClaim or None
        What their flags must be; None for a single stage.

    Raises
    ------
    RejectedError
        If there is anything but instances and wires, or a wire that goes elsewhere.
    """
    modules = read_source("\n".join([*texts, top]), name).modules
    module = modules[name]
    has = {"taken": stages[0].item.taken, "reload": True, "reload_registers": True}
    check_ports(module, stages[-1].item.model_copy(update=has))
    require(
        not module.registers and not module.depths and not module.clocked and not module.assigns,
        f"{name} must have instances and wires alone",
    )
    wanted = [*(each for stage in stages for each in stage.placed), *([] if flags is None else [flags.name])]
    placed = [inside for inside, _, _ in module.instances]
    require(placed == wanted, f"{name} must have an instance of {', '.join(wanted)}, not of {', '.join(placed)}")
    wires = [{port: _whole(value, module, name) for port, value in ports.items()} for _, _, ports in module.instances]
    rest, alone = iter(wires), dict[str, dict[str, str]]()
    for k, stage in enumerate(stages):
        own = [next(rest) for _ in stage.placed]
        alone |= {stage.name: own[0]} if len(stage.modules) == 1 else {stage.name: own[-1]} if stage.loads else {}
        nets = _nets_of(stages, k, gated=flags is not None)
        for core, ports in zip(stage.modules, own, strict=False):
            for clock in _CLOCKS:
                require(ports[clock] == clock, f"{clock} of {core} must be that of {name}, not {ports[clock]}")
        if len(stage.modules) == 1:
            _check_streams(stage.modules[0], own[0], nets)
        else:
            _check_in_turn(stage, own, nets, modules)
        if stage.loads:
            check_shared(stage, own, modules)
    _check_registers(module, name, alone)
    if flags is not None:
        for port, net in flags.inputs(f"stage_{stages[0].name}").items():
            require(port in wires[-1], f"{flags.name} must have the port {port}")
            _same(wires[-1][port], net, f"{port} of {flags.name}")
        check_flags(modules[flags.name], flags)


def _nets_of(stages: Sequence[Stage], k: int, *, gated: bool) -> dict[str, str]:
    """Return the net at each signal of a stage's streams: that of the stage before, and its own."""
    before = "s_axis" if k == 0 else f"stage_{stages[k - 1].name}"
    behind = "m_axis" if k == len(stages) - 1 else f"stage_{stages[k].name}"
    nets = {f"s_axis_{signal}": f"{before}_{signal}" for signal in _SIGNALS}
    nets |= {f"m_axis_{signal}": f"{behind}_{signal}" for signal in _SIGNALS}
    if gated:
        nets |= {"m_axis_tready": "gated_tready"} if k == 0 else {}
        nets |= {"s_axis_tvalid": "gated_tvalid"} if k == 1 else {}
        nets |= {"m_axis_tuser": "last_tuser"} if k == len(stages) - 1 else {}
    return nets


def _check_streams(core: str, ports: Mapping[str, str], nets: Mapping[str, str]) -> None:
    """Check that a core's streams are at these nets."""
    for port, net in ports.items():
        if port.startswith(_STREAMS):
            require(port in nets, f"{core} must have no port {port} in its streams")
            _same(net, nets[port], f"{port} of {core}")


def _check_in_turn(
    stage: Stage, own: Sequence[Mapping[str, str]], nets: Mapping[str, str], modules: Mapping[str, Module]
) -> None:
    """Check the cores of a stage that interpolates: all get the sample, and its handshake from what joins them."""
    claim = TurnsClaim(
        name=stage.joining,
        cores=len(stage.cores),
        results=stage.item.given,
        guarded=stage.item.protect != "none",
        loads=stage.loads,
    )
    for k, (core, ports) in enumerate(zip(stage.cores, own, strict=False)):
        each = f"stage_{stage.name}_p{k}"
        inner = {port: f"{each}_{port.removeprefix('m_axis_')}" for port in nets if port.startswith("m_axis_")}
        inner |= {"s_axis_tvalid": f"{each}_given", "s_axis_tready": f"{each}_taken"}
        _check_streams(core, ports, {**nets, **inner})
    before, behind = (
        {port.removeprefix(prefix): net for port, net in nets.items() if port.startswith(prefix)} for prefix in _STREAMS
    )
    joined, ports = claim.nets(stage.name, before, behind), own[len(stage.cores)]
    require(ports.keys() == joined.keys(), f"{claim.name} must have the ports {', '.join(joined)}")
    for port, net in joined.items():
        _same(ports[port], net, f"{port} of {claim.name}")
    check_turns(modules[claim.name], claim)


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
