"""The flags beside a result, as of `sosmith.model.dataflow.status.Flag`."""

from __future__ import annotations

from collections.abc import Sequence

from amaranth.hdl import Cat, Const, Module, Value
from amaranth.lib.memory import Memory

from sosmith.hdl.axi_stream import fields
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.port import Port


def at_rail(inputs: Sequence[Port], tdata: Value) -> Value:
    """Whether an input's code is the lowest or the highest there is, `Flag.INPUT_AT_RAIL`."""
    found: Value = Const(0, 1)
    for field in fields(inputs):
        code = tdata[field.offset : field.offset + field.port.bits]
        body = code[:-1]
        # Both rails have equal bits below the top one; signed or not, the top bit says which of them can be.
        ones, zeros = (code[-1], ~code[-1]) if not field.port.signed else (~code[-1], code[-1])
        found = found | (body.all() & ones) | (~body.any() & zeros)
    return found


def outside_calibration(datapath: Datapath, tdata: Value) -> Value:
    """Whether an input lies outside the range of the calibration, `Flag.OUTSIDE_CALIBRATION`."""
    found: Value = Const(0, 1)
    for field, (low, high) in zip(fields(datapath.inputs), datapath.calibrated, strict=True):
        code = tdata[field.offset : field.offset + field.port.bits]
        value = code.as_signed() if field.port.signed else code
        if low > field.port.lowest:
            found = found | (value < low)
        if high < field.port.highest:
            found = found | (value > high)
    return found


def flag_count(datapath: Datapath) -> int:
    """Count the flags that the hardware can set: without limits of wear, not the last two."""
    return 5 if datapath.wear else 3


def worn(m: Module, datapath: Datapath, code: Value, channel: Value, enable: Value) -> Value:
    """Whether an output code has reached the warning and the limit of wear; nothing if they are not judged.

    If each channel has limits of its own, these come out of a memory: `code` must be of the channel that `channel`
    had at the clock before with `enable`.
    """
    if not datapath.wear:
        return Const(0, 0)
    bits = datapath.output.bits
    limits: Sequence[Value]
    if len(datapath.wear) == 1:
        limits = [Const(code_, code.shape()) for code_ in datapath.wear[0]]
    else:
        mask = (1 << bits) - 1
        init = [(warning & mask) | (critical & mask) << bits for warning, critical in datapath.wear]
        m.submodules.wear_limits = memory = Memory(shape=2 * bits, depth=len(init), init=init)
        port = memory.read_port()
        m.d.comb += [port.addr.eq(channel), port.en.eq(enable)]
        limits = [port.data[:bits], port.data[bits:]]
        if datapath.output.signed:
            limits = [limit.as_signed() for limit in limits]
    return Cat(*(code >= limit for limit in limits))
