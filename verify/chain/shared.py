"""Reads how the registers that several cores share are joined to them: every pin of a core, and none of another.

The module of the registers itself is not read further, as those of a single core are not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from sosmith.verify.certificate_file import ItemEntry
from sosmith.verify.graph import require
from sosmith.verify.reader.syntax import Module

_COMMON = ("reload_bank", "reload_acknowledge")
"""Pins that are at one net for all cores."""


class LoadedStage(Protocol):
    """A stage of several cores whose constants can be loaded: its name, those of its modules, and what a core is."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def cores(self) -> tuple[str, ...]:
        """Modules of its cores."""
        ...

    @property
    def registers(self) -> str:
        """Module of the registers."""
        ...

    @property
    def item(self) -> ItemEntry:
        """What a core is."""
        ...


def check_shared(
    stage: LoadedStage,
    placed: Sequence[Mapping[str, str]],
    modules: Mapping[str, Module],
) -> None:
    """Check the nets between the cores of a stage and their registers.

    Parameters
    ----------
    stage : LoadedStage
    placed : sequence of mapping of str to str
        The net at each port: of each core, of what joins them, and of the registers, which are last.
    modules : mapping of str to Module
        All modules by their names.

    Raises
    ------
    RejectedError
        If a pin is missing, superfluous, of another direction, or at another net.
    """
    net, registers = f"stage_{stage.name}", dict(placed[-1])
    wanted = {"aclk": "aclk", "aresetn": "aresetn", "i_between": f"{net}_between", "o_bank": f"{net}_reload_bank"}
    ins, outs = ["write", "address", "data"], ["free"]
    if stage.item.protect != "none":
        outs += ["corrected", "failed"]
        wanted |= {"o_acknowledge": f"{net}_reload_acknowledge"}
    for k, (core, ports) in enumerate(zip(stage.cores, placed, strict=False)):
        pins = {f"reload_{each}": f"{net}_p{k}_reload_{each}" for each in (*ins, *outs, "begun")}
        pins |= {pin: f"{net}_{pin}" for pin in _COMMON if pin == "reload_bank" or stage.item.protect != "none"}
        own = {port: at for port, at in ports.items() if port.startswith("reload_")}
        require(own == pins, f"the pins of {core} at which constants are loaded must be at {pins}, not {own}")
        ways = modules[core].ports
        for pin in pins:
            way = "output" if pin.removeprefix("reload_") in {*outs, "begun"} else "input"
            require(ways[pin] == way, f"{pin} of {core} must be an {way}, not an {ways[pin]}")
        wanted |= {f"o{k}_{each}": f"{net}_p{k}_reload_{each}" for each in ins}
        wanted |= {f"i{k}_{each}": f"{net}_p{k}_reload_{each}" for each in outs}
    slave = {port: at for port, at in registers.items() if port.startswith("s_axil_")}
    rest = {port: at for port, at in registers.items() if port not in slave}
    require(rest == wanted, f"the ports of {stage.registers} must be at {wanted}, not {rest}")
    module = modules[stage.registers]
    for port in registers:
        way = "input" if port in {"aclk", "aresetn"} or port.startswith("i") else "output"
        if port not in slave:
            require(module.ports[port] == way, f"{port} of {stage.registers} must be an {way}, not the other way")
