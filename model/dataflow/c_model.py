"""The bit-true C model of a datapath: what `generate` writes and what `compute` compiles.

Plain C99, no library. Each value has the narrowest type of 32, 64 and 128 bits that holds all that it can be, and is
computed in the narrowest that holds all on the way there: a microcontroller of 32 bits has products of 64 bits, and
nothing wider. Values wider than 64 bits use the compiler's 128-bit integer (GCC, Clang); every other datapath is
portable. Right shifts of negative numbers must be arithmetic, as they are in all compilers in use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.dataflow.status import Flag
from sosmith.model.templates import in_comment, render

if TYPE_CHECKING:
    from sosmith.model.dataflow.datapath import Datapath
    from sosmith.model.port import Port

_TYPES = {32: "int32_t", 64: "int64_t", 128: "__int128"}
"""The types by their bits; all are signed, whatever the sign of the values."""


class Range(Protocol):
    """Whole numbers from `low` to `high`."""

    @property
    def low(self) -> int: ...

    @property
    def high(self) -> int: ...


class _Span(NamedTuple):
    """A range of values that no node has."""

    low: int
    high: int


def c_header(datapath: Datapath) -> str:
    """Return the text of ``<name>.h``."""
    whole, datapath = datapath, datapath.behind_decimator
    return render(
        __package__,
        "c_model.h.jinja",
        name=datapath.name,
        ports=[_description(port) for port in (*datapath.inputs, datapath.output)],
        calibrated_ports=[] if whole.calibration is None else list(map(_description, whole.calibration.inputs)),
        taken=_parameters(whole),
        flags=[(f"{1 << flag:#04x}", flag.meaning) for flag in Flag],
        states=_states(datapath),
        parameters=_parameters(datapath),
        wear=datapath.wear,
        channels=len(datapath.wear) if _takes_channel(datapath) else 0,
        decimator=whole.decimator,
        downsampler=whole.downsampler,
    )


def _description(port: Port) -> str:
    """Say what the code of a port means."""
    return (
        f"{port.name}_code: {port.lowest} .. {port.highest}, value = {float(port.zero)!r} + "
        f"{float(port.lsb)!r} * code {in_comment(port.unit)}".rstrip()
    )


def c_source(datapath: Datapath) -> str:
    """Return the text of ``<name>.c``.

    Behind a decimator, the functions of the datapath work at the lower rate, and one more takes samples at the higher.
    Where one result out of several leaves, they have all results, and one more function hands on those.

    Without status, each stage works one sample behind the stage before it, as in a pipeline: then none waits for
    another, which a processor hides only where its window of instructions is long enough for the whole chain.

    Raises
    ------
    ValueError
        If a value inside is wider than 128 bits.
    """
    whole, datapath = datapath, datapath.behind_decimator
    count = len(datapath.inputs)
    names = [f"{port.name}_code" for port in datapath.inputs]
    codes = [f"in[(n * channels + c) * {count} + {i}]" for i in range(count)]
    judged = ((0, Flag.WEAR_WARNING), (1, Flag.WEAR_CRITICAL))
    return render(
        __package__,
        "c_model.c.jinja",
        name=datapath.name,
        inputs=[(name, _type_of_codes(port)) for name, port in zip(names, datapath.inputs, strict=True)],
        parameters=_parameters(datapath),
        arguments=["channel", *names] if _takes_channel(datapath) else names,
        codes=codes,
        block_arguments=["c", *codes] if _takes_channel(datapath) else codes,
        wires=_wires(datapath),
        stages=_stages(datapath),
        status=_status(datapath),
        result=_result(datapath),
        wear=datapath.wear,
        limits=", ".join(f"{{{warning}, {critical}}}" for warning, critical in datapath.wear),
        wear_flags=" | ".join(f"(code >= limit[{k}]) << {flag.value}" for k, flag in judged),
        decimator=whole.decimator,
        downsampler=whole.downsampler,
        rails=" || ".join(
            f"{name} == {end}"
            for name, port in zip(names, datapath.inputs, strict=True)
            for end in (port.lowest, port.highest)
        ),
        rail=f"{1 << Flag.INPUT_AT_RAIL:#04x}",
        channel="channel, " if _takes_channel(datapath) else "",
        of_input=f"{1 << Flag.INPUT_AT_RAIL | 1 << Flag.OUTSIDE_CALIBRATION:#04x}",
        calibration=None if whole.calibration is None else _calibration(whole.calibration),
        taken=_parameters(whole),
    )


def _calibration(datapath: Datapath) -> dict[str, object]:
    """Return what the text of a step of a datapath without memory takes, which stands before a decimator."""
    return {
        "wires": _wires(datapath),
        "stages": _stages(datapath),
        "parameters": _parameters_of(datapath),
        "inputs": [(f"{port.name}_code", _type_of_codes(port)) for port in datapath.inputs],
        "status": _status(datapath),
        "result": _result(datapath),
    }


def _takes_channel(datapath: Datapath) -> bool:
    """Whether a sample's status depends on its channel."""
    return len(datapath.wear) > 1


def _parameters(datapath: Datapath) -> str:
    """Return the parameters of a step between state and status."""
    codes = _parameters_of(datapath)
    return f"size_t channel, {codes}" if _takes_channel(datapath) else codes


def _parameters_of(datapath: Datapath) -> str:
    """Return the parameters that are the codes of the inputs."""
    return ", ".join(f"int64_t {port.name}_code" for port in datapath.inputs)


def _delays(datapath: Datapath) -> list[Node]:
    """Return the delays of all stages, in their order, which is that of the states' numbers."""
    return [stage.graph.nodes[i] for stage in datapath.stages for i in stage.graph.delays]


def _states(datapath: Datapath) -> list[tuple[str, str]]:
    """Type and name of each state, the widest first, so that no room is lost between them; at least one, as C asks."""
    bits = [(_bits(node), f"s{k}") for k, node in enumerate(_delays(datapath))]
    return [(_TYPES[width], name) for width, name in sorted(bits, key=lambda each: -each[0])] or [("int32_t", "none")]


def state_bytes(datapath: Datapath) -> int:
    """Size of one channel's state in the compiled model, in bytes."""
    widths = [_bits(node) // 8 for node in _delays(datapath)] or [4]
    return -(-sum(widths) // max(widths)) * max(widths)


def _bits(*ranges: Range) -> int:
    """Return the bits of the narrowest type that holds all values of all `ranges`."""
    width = max((signed_width(each.low, each.high) for each in ranges), default=1)
    narrowest = next((bits for bits in _TYPES if width <= bits), None)
    if narrowest is None:
        raise ValueError(f"values of the C model must be at most {max(_TYPES)} bits wide, not {width}")
    return narrowest


def _type(*ranges: Range) -> str:
    return _TYPES[_bits(*ranges)]


def signed_width(low: int, high: int) -> int:
    """Count the bits of two's complement that hold `low` to `high`, also where neither is negative.

    Examples
    --------
    >>> signed_width(0, 2**63 - 1), signed_width(0, 2**63), signed_width(-(2**63), 0)
    (64, 65, 64)
    """
    return max((-low - 1).bit_length() if low < 0 else 0, max(high, 0).bit_length()) + 1


def _wire(index: int, node: int) -> str:
    return f"n{index}_{node}"


def _result(datapath: Datapath) -> str:
    last = datapath.stages[-1].graph
    return _wire(len(datapath.stages) - 1, last.outputs[0])


def _exported(datapath: Datapath, index: int) -> list[int]:
    """Nodes of a stage that others need: its outputs and, of the last stage, what the output stage clamps."""
    graph = datapath.stages[index].graph
    exported = set(graph.outputs)
    if index == len(datapath.stages) - 1 and (node := graph.nodes[graph.outputs[0]]).op is Op.CLAMP:
        exported.add(node.operands[0])
    return sorted(exported)


def _wires(datapath: Datapath) -> list[tuple[str, str]]:
    """Type and name of each input and of what stages hand on."""
    wires = [(_type_of_codes(port), f"{port.name}_code") for port in datapath.inputs]
    for index, stage in enumerate(datapath.stages):
        wires += [(_type(stage.graph.nodes[i]), _wire(index, i)) for i in _exported(datapath, index)]
    return wires


def _type_of_codes(port: Port) -> str:
    return _type(_Span(port.lowest, port.highest))


class _StageText(NamedTuple):
    """A stage as a C function: its name, and the statements of the body."""

    name: str
    statements: list[str]


def _stages(datapath: Datapath) -> list[_StageText]:
    stages = []
    wires = [f"{port.name}_code" for port in datapath.inputs]
    offset = 0
    for index, stage in enumerate(datapath.stages):
        statements = _statements(stage.graph, index, [f"w->{wire}" for wire in wires], offset)
        statements += [f"w->{_wire(index, i)} = {_wire(index, i)};" for i in _exported(datapath, index)]
        if not stage.graph.delays:
            statements.append("(void)state;")
        stages.append(_StageText(stage.name, statements))
        wires = [_wire(index, i) for i in stage.graph.outputs]
        offset += len(stage.graph.delays)
    return stages


def _statements(graph: Graph, index: int, wires: list[str], offset: int) -> list[str]:
    """Compute the nodes in order, then store the states, from `offset` on."""
    statements = []
    supply, memory = iter(wires), iter(range(offset, offset + len(graph.delays)))
    for i, node in enumerate(graph.nodes):
        if node.op is Op.INPUT:
            expression = next(supply)
        elif node.op is Op.DELAY:
            expression = f"state->s{next(memory)}"
        else:
            expression = _expression(graph, node, f"n{index}_")
        comment = f" /* {node.name}, {node.format} */" if node.name else ""
        statements.append(f"const {_type(node)} {_wire(index, i)} = {expression};{comment}")
    statements += [
        f"state->s{offset + k} = {_wire(index, graph.nodes[i].operands[0])};" for k, i in enumerate(graph.delays)
    ]
    used = {i for node in graph.nodes for i in node.operands} | set(graph.outputs)
    statements += [f"(void){_wire(index, i)};" for i in range(len(graph.nodes)) if i not in used]
    return statements


def _status(datapath: Datapath) -> str:
    """Expression of the flags."""
    last = datapath.stages[-1].graph
    node = last.nodes[last.outputs[0]]
    conditions: dict[Flag, list[str]] = {flag: [] for flag in Flag}
    for port, (low, high) in zip(datapath.inputs, datapath.calibrated, strict=True):
        code = f"w.{port.name}_code"
        conditions[Flag.INPUT_AT_RAIL] += [f"{code} == {port.lowest}", f"{code} == {port.highest}"]
        if low > port.lowest:
            conditions[Flag.OUTSIDE_CALIBRATION].append(f"{code} < {low}")
        if high < port.highest:
            conditions[Flag.OUTSIDE_CALIBRATION].append(f"{code} > {high}")
    if node.op is Op.CLAMP:
        before = f"w.{_wire(len(datapath.stages) - 1, node.operands[0])}"
        conditions[Flag.OUTPUT_SATURATED] += [f"{before} < {_literal(node.low)}", f"{before} > {_literal(node.high)}"]
    terms = [
        f"({' || '.join(alternatives)}) << {flag.value}" for flag, alternatives in conditions.items() if alternatives
    ]
    settling = ""
    if datapath.settles:
        settling = f"w.{_wire(len(datapath.stages) - 1, last.outputs[1])} < 0"
        terms.append(f"({settling}) << {Flag.SETTLING.value}")
    if datapath.wear:
        channel = "channel" if _takes_channel(datapath) else "0"
        worn = f"{datapath.name}_wear_flags({channel}, (int64_t)w.{_result(datapath)})"
        terms.append(f"({settling} ? 0 : {worn})" if settling else worn)
    return f"(uint8_t)({' | '.join(terms)})"


def _expression(graph: Graph, node: Node, prefix: str) -> str:
    operands = [graph.nodes[i] for i in node.operands]
    names = [f"{prefix}{i}" for i in node.operands]
    if node.op is Op.CONSTANT:
        return _literal(node.parameter)
    if node.op in {Op.ADD, Op.SUBTRACT}:
        sign = 1 if node.op is Op.ADD else -1
        terms = [_times(operand, 1 << node.frac - operand.frac) for operand in operands]
        whole = _Span(*map(sum, zip(terms[0], _times(terms[1], sign), strict=True)))
        kind = _bits(*terms, whole)
        left, right = (
            _scaled(kind, name, operand, node.frac - operand.frac)
            for name, operand in zip(names, operands, strict=True)
        )
        return _narrowed(node, kind, f"{left} {'+' if sign > 0 else '-'} {right}")
    if node.op is Op.SCALE:
        kind = _bits(operands[0], _times(operands[0], node.parameter), _Span(node.parameter, node.parameter))
        return _narrowed(node, kind, f"{_cast(kind, names[0], operands[0])} * {_literal(node.parameter)}")
    if node.op is Op.MULTIPLY:
        kind = _bits(*operands, *(_times(operands[0], end) for end in (operands[1].low, operands[1].high)))
        return _narrowed(node, kind, f"{_cast(kind, names[0], operands[0])} * {names[1]}")
    bits = _bits(*operands)
    if node.op is Op.FLOOR:
        # By one bit less than the word has at most, as C leaves more undefined; that is the sign already.
        return _narrowed(node, bits, f"{names[0]} >> {min(operands[0].frac - node.frac, bits - 1)}")
    if node.op is Op.TRUNCATE:  # as C99 divides
        return _narrowed(node, bits, f"{names[0]} / {_power(operands[0].frac - node.frac)}")
    if node.op is Op.FRACTION:
        return _narrowed(node, bits, f"{names[0]} & {_literal((1 << operands[0].frac - node.parameter) - 1)}")
    if node.op is Op.CLAMP:
        low, high = _literal(node.low), _literal(node.high)
        return _narrowed(node, bits, f"{names[0]} < {low} ? {low} : {names[0]} > {high} ? {high} : {names[0]}")
    return _narrowed(node, bits, names[0])  # SHIFT and BOUND keep the code


def _times(values: Range, factor: int) -> _Span:
    """Return the range of a product with a number."""
    ends = values.low * factor, values.high * factor
    return _Span(min(ends), max(ends))


def _cast(kind: int, name: str, values: Range) -> str:
    """Return an operand in the type that is computed in."""
    return name if _bits(values) == kind else f"({_TYPES[kind]}){name}"


def _narrowed(node: Node, kind: int, expression: str) -> str:
    """Return an expression of the type `kind` in the type of its node."""
    wanted = _bits(node)
    if wanted >= kind:
        return expression
    return f"({_TYPES[wanted]})" + (expression if expression.isidentifier() else f"({expression})")


def _scaled(kind: int, name: str, values: Range, shift: int) -> str:
    # A multiplication, because shifting a negative number to the left is undefined in C.
    return f"{_cast(kind, name, values)} * {_power(shift)}" if shift else _cast(kind, name, values)


def _power(exponent: int) -> str:
    return _literal(1 << exponent)


def _literal(number: int) -> str:
    if -(1 << 31) < number < 1 << 31:
        return f"INT32_C({number})"
    if -(1 << 63) < number < 1 << 63:
        return f"INT64_C({number})"
    high, low = divmod(number, 1 << 62)
    return f"((__int128)INT64_C({high}) * (INT64_C(1) << 62) + INT64_C({low}))"
