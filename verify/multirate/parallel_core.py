"""Proves a parallel core behind a decimator, and a parallel calibration before one, each by itself.

Its ports are connected to those that a core with streams has, in a top that is made here::

    s_axis_tdata: code, flags --> code  --> [ core. ] --> results, flags, channel --> m_axis_tdata, m_axis_tuser, ..
                                  flags -->

and that is proven like any parallel core (`sosmith.verify.parallel.check`). Which bit of a port leaves the core
where is taken from the shell around it, which `sosmith.verify.multirate.cic` proves: flags that the core behind makes
are then proven to leave at their places. Flags of the inputs come with each result of the decimator, and the core must
hand on those of the same sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import require
from sosmith.verify.multirate.calibration import CHANNEL, CODE, FLAGS, layout_of
from sosmith.verify.multirate.cic import MultirateTop, multirate_top
from sosmith.verify.multirate.connections import AHEAD, BEHIND, CIC, CLOCK, DATA, DEST, calibration_connections
from sosmith.verify.multirate.decimation import at_lower_rate, calibration_alone
from sosmith.verify.multirate.passed_flags import origins
from sosmith.verify.parallel.check import FLAGS as LEAVING_FLAGS
from sosmith.verify.parallel.check import OUTPUT, OUTPUT_DEST, HardwareVerdict, Inside, check_modules
from sosmith.verify.parallel.control import RESET, SINK, SOURCE
from sosmith.verify.reader.syntax import Bits, Expression, Joined, Module, Number

_TOP, _CORE = "", "core"
_VALID, _READY = "m_axis_tvalid", "s_axis_tready"
_BYTE = 8


def check_behind(text: str, certificate: Certificate, channels: int = 1) -> HardwareVerdict:
    """Prove that the parallel core behind a decimator computes the graph of its certificate.

    Parameters
    ----------
    text : str
        SystemVerilog of the core, of which `check_decimator` has accepted the shell around it.
    certificate : Certificate
        Its certificate, with a decimator, which `verify` has accepted.
    channels : int
        Number of channels.

    Raises
    ------
    RejectedError
        If it computes anything else.
    """
    shell, behind = multirate_top(text, certificate, channels), at_lower_rate(certificate)
    (port,) = behind.inputs
    whole = -(-port.bits // _BYTE) * _BYTE
    flag_bits = shell.netlist.widths[shell.flags]
    supplied: dict[str, Expression] = {
        RESET: Bits(RESET),
        CIC + "o_data": Bits(DATA, 0, port.bits),
        shell.flags: Bits(DATA, whole, flag_bits),
        CIC + "o_valid": Bits(SOURCE),
    }
    widths = {DATA: whole + flag_bits}
    if shell.names is not None:
        supplied[shell.names.dest] = Bits(DEST)
        (taken,) = (name for name, source in shell.connections.entering.items() if source == shell.names.dest)
        widths[DEST] = shell.netlist.widths[taken]
    wires = {name: supplied[source] for name, source in shell.connections.entering.items()}
    wires |= {
        shell.connections.ready: Bits(SINK),
        shell.connections.taken: Bits(_READY),
        shell.connections.valid: Bits(_VALID),
    }
    top = _top(shell, f"{certificate.name}_behind", BEHIND, wires, widths, _leaving(shell))
    return check_modules({_TOP: top, **shell.modules}, behind, channels, Inside(f"{_CORE}.", flag_bits))


def check_ahead(text: str, certificate: Certificate, channels: int = 1) -> HardwareVerdict:
    """Prove that the parallel calibration before a decimator computes its graph; the rest is as of `check_behind`."""
    shell, alone = multirate_top(text, certificate, channels), calibration_alone(certificate)
    assert alone is not None
    port, count = alone.output, (channels - 1).bit_length()
    name = f"{certificate.name}_ahead"
    connections = calibration_connections(shell.netlist, shell.modules.get(name), port.bits, count)
    wires = {entry: Bits(source) for entry, source in connections.entering.items()}
    wires |= {connections.offered: Bits(SOURCE), connections.taken: Bits(_READY)}
    wires |= {connections.ready: Bits(SINK), connections.valid: Bits(_VALID)}
    bits: dict[str, list[Expression]] = {}
    for outlet, fields in layout_of(shell.netlist, connections, port, count).items():
        place = 0
        for field in fields:
            bits.setdefault(field.signal, []).extend(Bits(outlet, place + k, 1) for k in range(field.width))
            place += field.width
    code, zero = bits[CODE], Number(0, 1)
    left = {OUTPUT: [*code, *[code[-1] if port.signed else zero] * (-port.bits % _BYTE)]}
    left[LEAVING_FLAGS] = [*(bit for flag in FLAGS for bit in bits[flag]), *[zero] * (_BYTE - len(FLAGS))]
    widths = {DATA: shell.netlist.widths[DATA]}
    if channels > 1:
        left[OUTPUT_DEST] = [*bits[CHANNEL], *[zero] * (-count % _BYTE)]
        widths[DEST] = shell.netlist.widths[DEST]
    top = _top(shell, name, AHEAD, wires, widths, left)
    return check_modules({_TOP: top, **shell.modules}, alone, channels, Inside(f"{_CORE}."))


def _leaving(shell: MultirateTop) -> dict[str, list[Expression]]:
    """Return the bits of the core behind that leave at each port."""
    logic, left = origins(shell.netlist, shell.word)
    leaving: dict[str, list[Expression]] = {}
    for name, bits in left.items():
        for bit in bits:
            source = logic.sources[bit]
            own = bit == 0 or (source.kind.startswith(BEHIND) and not source.operands)
            require(own, f"{name} must have bits of the core")
            leaving.setdefault(name, []).append(Bits(source.kind, source.place, 1) if bit else Number(0, 1))
    return leaving


def _top(
    shell: MultirateTop,
    box: str,
    prefix: str,
    wires: Mapping[str, Expression],
    widths: Mapping[str, int],
    left: Mapping[str, Sequence[Expression]],
) -> Module:
    """Make a top with the ports of a core with streams, and in it the core.

    `wires` are what its ports have by their names with the `prefix`, but for the clock and for outputs that are words,
    of which `left` has the bits that leave.
    """
    ports = {CLOCK: "input", RESET: "input", SOURCE: "input", SINK: "input", _READY: "output", _VALID: "output"}
    ports |= dict.fromkeys(widths, "input") | dict.fromkeys(left, "output")
    top = Module(ports=ports, widths={**dict.fromkeys(ports, 1), **widths})
    connected: dict[str, Expression] = {}
    for port, direction in shell.modules[box].ports.items():
        name = prefix + port
        if name in wires:
            connected[port] = wires[name]
        elif direction == "output":
            top.widths[name] = shell.modules[box].widths[port]
            connected[port] = Bits(name)
        else:
            connected[port] = Bits(CLOCK)
    for name, bits in left.items():
        top.widths[name] = len(bits)
        top.assigns.append((Bits(name), Joined(tuple(reversed(bits)))))
    top.instances.append((box, _CORE, connected))
    return top
