"""The status flags of a result, in the order of `sosmith.model.dataflow.status.Flag`.

::

    s_axis_tdata --+--> at_rail -------------> input_at_rail       bit 0
                   +--> outside_calibration -> outside_calibration     1   `Core`; `FoldedCore` lets its program judge
    output code  --+--> CLAMP of the stage --> output_saturated        2
                   +--> worn: >= limits -----> wear_warning            3
      channel ----> memory of the limits       wear_critical           4   if each channel has its own
                          ^ not while
    counter of the stage -+-----------------> settling                5   of a filter that starts from zero
    check bits of the memories --------------> fault                   6   of a protected core

All are combinational, but for the memory of limits: it takes one clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Signal, Value
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from sosmith.hdl.axi_stream import codes_of
from sosmith.hdl.check_bits import CheckBits
from sosmith.hdl.memory_ports import read_port
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.status import Flag
from sosmith.model.port import Port


def at_rail(inputs: Sequence[Port], tdata: Value) -> Value:
    """Whether an input's code is the lowest or the highest of its port, `Flag.INPUT_AT_RAIL`."""
    rail: Value = Const(0, 1)
    for port, code in zip(inputs, codes_of(inputs, tdata), strict=True):
        body = code[:-1]
        # At a rail, all bits below the top one are equal; the top bit says which rail that would be.
        ones, zeros = (code[-1], ~code[-1]) if not port.signed else (~code[-1], code[-1])
        rail = rail | (body.all() & ones) | (~body.any() & zeros)
    return rail


def outside_calibration(datapath: Datapath, tdata: Value) -> Value:
    """Whether an input lies outside the range of the calibration, `Flag.OUTSIDE_CALIBRATION`."""
    outside: Value = Const(0, 1)
    for port, code, (low, high) in zip(
        datapath.inputs, codes_of(datapath.inputs, tdata), datapath.calibrated, strict=True
    ):
        if low > port.lowest:
            outside = outside | (code < low)
        if high < port.highest:
            outside = outside | (code > high)
    return outside


def flag_count(datapath: Datapath) -> int:
    """Return the number of the flags up to the last one that hardware without protection can set."""
    if datapath.settles:
        return Flag.SETTLING + 1
    return Flag.WEAR_CRITICAL + 1 if datapath.wear else Flag.OUTPUT_SATURATED + 1


RAIL_ALONE, OF_INPUT = 1, 2
"""Numbers of flags that come with a sample from a decimator: `input_at_rail`, or all flags of inputs."""


def members_beside_decimator(datapath: Datapath, given: int, *, before: bool, guarded: bool) -> dict[str, In | Out]:
    """Return the members of a core that differ where its samples come from a decimator, or its results go to one.

    The code is then as wide as it is. With a sample come the flags that are `given`, and above them whether a wrong bit
    may have changed it, if it is `guarded`; with a result, `before` the decimator, those of the inputs, or all.
    """
    members: dict[str, In | Out] = {}
    whole = Flag.FAULT + 1
    if given:
        (port,) = datapath.inputs
        members |= {"s_axis_tdata": In(port.bits), "s_axis_tuser": In(given + guarded)}
        members |= {"m_axis_tuser": Out(whole if guarded else flag_count(datapath))}
        members |= {"i_corrected": In(1)} if guarded else {}
    if before:
        members |= {"m_axis_tdata": Out(datapath.output.bits), "m_axis_tuser": Out(whole if guarded else OF_INPUT)}
        members |= {"o_corrected": Out(1)} if guarded else {}
    return members


def with_fault(flags: Value, fault: Value) -> Value:
    """Return the flags of a protected core: `flag_count` of them, and `fault`, in the bits of `Flag`."""
    return Cat(flags, Const(0, Flag.FAULT - len(flags)), fault)


class ResultStatus(NamedTuple):
    """What is known of a result.

    Attributes
    ----------
    flags : Value
        `flag_count` flags in the bits of `Flag`.
    corrected, failed : Value
        Whether the limits of wear just read had a wrong bit that was corrected, or one that could not be.
    """

    flags: Value
    corrected: Value
    failed: Value


NEVER: Value = Const(0, 1)
"""A flag that is never set, and the channel of a core that has one."""


def status_of_result(
    m: Module,
    datapath: Datapath,
    code: Value,
    *,
    inputs: Value,
    saturated: Value,
    settling: Value,
    channel: Value = NEVER,
    enable: Value = NEVER,
    protect: str = "none",
) -> ResultStatus:
    """Return the flags of a result.

    If each channel has limits of wear of its own, these are read from a memory, with check bits as `protect` asks:
    `code` must belong to the channel that `channel` was at the last clock with `enable`. Wear is not flagged for a
    sample that comes before the filter has settled.

    Parameters
    ----------
    m : Module
        Where the memory is made.
    datapath : Datapath
        What is computed.
    code : Value
        The output code.
    inputs : Value
        The first two flags, those of the inputs.
    saturated, settling : Value
        Flags of the output stage; the second has no bits if the filter is always settled.
    channel, enable : Value
        What the limits are read for.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    """
    worn, corrected, failed = _worn(m, datapath, code, channel, enable, protect)
    if datapath.settles and datapath.wear:
        worn = Cat(flag & ~settling for flag in worn)
    elif datapath.settles:
        worn = Const(0, 2)
    return ResultStatus(Cat(inputs, saturated, worn, settling), corrected, failed)


def _worn(
    m: Module, datapath: Datapath, code: Value, channel: Value, enable: Value, protect: str
) -> tuple[Value, Value, Value]:
    """Return whether a code has reached the warning and the limit, in two bits or none; and as in `ResultStatus`."""
    if not datapath.wear:
        return Const(0, 0), NEVER, NEVER
    bits = datapath.output.bits
    limits: Sequence[Value]
    corrected = failed = NEVER
    if len(datapath.wear) == 1:
        limits = [Const(code_, code.shape()) for code_ in datapath.wear[0]]
    else:
        mask = (1 << bits) - 1
        check = CheckBits(2 * bits, protect)
        init = [check.word((warning & mask) | (critical & mask) << bits) for warning, critical in datapath.wear]
        m.submodules.wear_limits = memory = Memory(shape=check.width, depth=len(init), init=init)
        port = read_port(memory, "wear_limits")
        m.d.comb += [port.addr.eq(channel), port.en.eq(enable)]
        data, corrected, failed = check.read(m, port.data, "limits")
        limits = [data[:bits], data[bits:]]
        if datapath.output.signed:
            limits = [limit.as_signed() for limit in limits]
    reached = [Signal(name=f"reached_{name}") for name in ("warning", "limit")]
    m.d.comb += [net.eq(code >= limit) for net, limit in zip(reached, limits, strict=True)]
    return Cat(reached), corrected, failed
