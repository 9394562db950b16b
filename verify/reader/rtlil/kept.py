"""Which nets stay through synthesis: the same in both texts, and all that have names if that was asked for."""

from __future__ import annotations

from collections.abc import Mapping

from sosmith.verify.graph import require
from sosmith.verify.reader.rtlil.syntax import read_rtlil
from sosmith.verify.reader.syntax import Module


def check_kept(text: str, modules: Mapping[str, Module], *, asked: bool) -> None:
    """Check the attribute ``keep`` of the nets of a SystemVerilog text against the RTLIL with the same modules.

    Raises
    ------
    RejectedError
        If a net is kept in one of them only, or one of the RTLIL is not that has a name, is no register and no port,
        though it was `asked` for.
    """
    for name, own in read_rtlil(text).items():
        module = modules[name]
        for net, wire in own.wires.items():
            if asked and not wire.direction and wire.first is None and wire.width and "$" not in net:
                require(wire.kept, f"{net} of {name} must be kept, as specified")
        for net in module.widths.keys() - module.registers.keys() - module.depths.keys() - module.ports.keys():
            wanted = net in own.wires and own.wires[net].kept
            said = "be kept" if wanted else "not be kept"
            require((net in module.kept) == wanted, f"{net} of {name} must {said}, as in the RTLIL")
