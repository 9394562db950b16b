"""The status flags of a result, in the order of `sosmith.model.dataflow.status.Flag`.

::

    s_axis_tdata --+--> at_rail -------------> input_at_rail       bit 0
                   +--> outside_calibration -> outside_calibration     1   `Core`; `FoldedCore` lets its program judge
    output code  --+--> CLAMP of the stage --> output_saturated        2
                   +--> worn: >= limits -----> wear_warning            3
      channel ----> memory of the limits       wear_critical           4   if each channel has its own

All are combinational, but for the memory of limits: it takes one clock.
"""

from __future__ import annotations

from collections.abc import Sequence

from amaranth.hdl import Cat, Const, Module, Value
from amaranth.lib.memory import Memory

from sosmith.hdl.axi_stream import fields
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.port import Port


def at_rail(inputs: Sequence[Port], tdata: Value) -> Value:
    """Whether an input's code is the lowest or the highest of its port, `Flag.INPUT_AT_RAIL`."""
    found: Value = Const(0, 1)
    for field in fields(inputs):
        code = tdata[field.offset : field.offset + field.port.bits]
        body = code[:-1]
        # At a rail, all bits below the top one are equal; the top bit says which rail that would be.
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
    """Return the number of flags that the hardware can set: without limits of wear, all but the last two."""
    return 5 if datapath.wear else 3


def worn(m: Module, datapath: Datapath, code: Value, channel: Value, enable: Value) -> Value:
    """Return two bits: whether an output code has reached the warning, and the limit of wear; none without limits.

    If each channel has limits of its own, these are read from a memory: `code` must belong to the channel that
    `channel` was at the last clock with `enable`.
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
