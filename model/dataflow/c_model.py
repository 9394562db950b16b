"""The bit-true C model of a datapath: what `generate` writes and what `compute` compiles.

Plain C99, no library. The statements are those of `sosmith.model.dataflow.statements`. Values wider than 64 bits use
the compiler's 128-bit integer (GCC, Clang); every other datapath is portable. Right shifts of negative numbers must be
arithmetic, as they are in all compilers in use.
"""

from __future__ import annotations

from sosmith.model.dataflow.c_types import TYPES, Span, bits_of, literal
from sosmith.model.dataflow.graph import Op
from sosmith.model.dataflow.statements import ModelText, statements_of
from sosmith.model.dataflow.status import Flag
from sosmith.model.dataflow.structure import Structure
from sosmith.model.port import Port
from sosmith.model.templates import in_comment, render


def c_header(datapath: Structure) -> str:
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
        states=[*_states(_text(datapath)), *([("int32_t", "started")] if whole.fill else [])],
        parameters=_parameters(datapath),
        wear=datapath.wear,
        channels=len(datapath.wear) if _takes_channel(datapath) else 0,
        decimator=whole.decimator,
        downsampler=whole.downsampler if whole.samples_per_result > 1 else None,
    )


def _description(port: Port) -> str:
    """Say what the code of a port means."""
    return (
        f"{port.name}_code: {port.lowest} .. {port.highest}, value = {float(port.zero)!r} + "
        f"{float(port.lsb)!r} * code {in_comment(port.unit)}".rstrip()
    )


def c_source(datapath: Structure) -> str:
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
    text = _text(datapath)
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
        wires=_wires(datapath, text),
        stages=text.stages,
        status=_status(datapath, text),
        result=_result(datapath, text),
        wear=datapath.wear,
        limits=", ".join(f"{{{warning}, {critical}}}" for warning, critical in datapath.wear),
        wear_flags=" | ".join(f"(code >= limit[{k}]) << {flag.value}" for k, flag in judged),
        decimator=whole.decimator,
        fill=whole.fill,
        channel_of_block="c, " if _takes_channel(datapath) else "",
        downsampler=whole.downsampler if whole.samples_per_result > 1 else None,
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


def _calibration(datapath: Structure) -> dict[str, object]:
    """Return what the text of a step of a datapath without memory takes, which stands before a decimator."""
    text = _text(datapath)
    return {
        "wires": _wires(datapath, text),
        "stages": text.stages,
        "parameters": _parameters_of(datapath),
        "inputs": [(f"{port.name}_code", _type_of_codes(port)) for port in datapath.inputs],
        "status": _status(datapath, text),
        "result": _result(datapath, text),
    }


def _takes_channel(datapath: Structure) -> bool:
    """Whether a sample's status depends on its channel."""
    return len(datapath.wear) > 1


def _parameters(datapath: Structure) -> str:
    """Return the parameters of a step between state and status."""
    codes = _parameters_of(datapath)
    return f"size_t channel, {codes}" if _takes_channel(datapath) else codes


def _parameters_of(datapath: Structure) -> str:
    """Return the parameters that are the codes of the inputs."""
    return ", ".join(f"int64_t {port.name}_code" for port in datapath.inputs)


def _text(datapath: Structure) -> ModelText:
    """Return the statements of all stages."""
    graphs = [stage.graph for stage in datapath.stages]
    return statements_of(
        [stage.name for stage in datapath.stages],
        graphs,
        _exported(datapath),
        [f"{port.name}_code" for port in datapath.inputs],
    )


def _states(text: ModelText) -> list[tuple[str, str]]:
    """Type and name of each state, the widest first, so that no room is lost between them; at least one, as C asks."""
    bits = [(width, f"s{k}") for k, width in enumerate(text.states)]
    return [(TYPES[width], name) for width, name in sorted(bits, key=lambda each: -each[0])] or [("int32_t", "none")]


def state_bytes(datapath: Structure) -> int:
    """Size of one channel's state in the compiled model, in bytes."""
    widths = [width // 8 for width in _text(datapath).states] or [4]
    widths += [4] if datapath.fill else []
    return -(-sum(widths) // max(widths)) * max(widths)


def _result(datapath: Structure, text: ModelText) -> str:
    return text.names[datapath.stages[-1].graph.outputs[0]]


def _exported(datapath: Structure) -> list[int]:
    """Nodes of the last stage that others need: its outputs, and what the output stage clamps."""
    graph = datapath.stages[-1].graph
    exported = set(graph.outputs)
    if (node := graph.nodes[graph.outputs[0]]).op is Op.CLAMP:
        exported.add(node.operands[0])
    return sorted(exported)


def _wires(datapath: Structure, text: ModelText) -> list[tuple[str, str]]:
    """Type and name of each input and of what stages hand on."""
    wires = [(_type_of_codes(port), f"{port.name}_code") for port in datapath.inputs]
    return wires + [member for stage in text.stages for member in stage.members]


def _type_of_codes(port: Port) -> str:
    return TYPES[bits_of(Span(port.lowest, port.highest))]


def _status(datapath: Structure, text: ModelText) -> str:
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
        before = f"w.{text.names[node.operands[0]]}"
        conditions[Flag.OUTPUT_SATURATED] += [f"{before} < {literal(node.low)}", f"{before} > {literal(node.high)}"]
    terms = [
        f"({' || '.join(alternatives)}) << {flag.value}" for flag, alternatives in conditions.items() if alternatives
    ]
    settling = ""
    if datapath.settles:
        settling = f"w.{text.names[last.outputs[1]]} < 0"
        terms.append(f"({settling}) << {Flag.SETTLING.value}")
    if datapath.wear:
        channel = "channel" if _takes_channel(datapath) else "0"
        worn = f"{datapath.name}_wear_flags({channel}, (int64_t)w.{_result(datapath, text)})"
        terms.append(f"({settling} ? 0 : {worn})" if settling else worn)
    return f"(uint8_t)({' | '.join(terms)})"
