"""The bit-true C model of a datapath: what `generate` writes and what `compute` compiles.

Plain C99, no library. Values wider than 64 bits use the compiler's 128-bit integer (GCC, Clang); every
other datapath is portable. Right shifts of negative numbers must be arithmetic, as they are in all
compilers in use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sosmith.model.dataflow.graph import Graph, Node, Op
from sosmith.model.dataflow.status import Flag

if TYPE_CHECKING:
    from sosmith.model.dataflow.datapath import Datapath

_NARROW = 64
_WIDEST = 128


def c_header(datapath: Datapath) -> str:
    """Return the text of ``<name>.h``."""
    name, states = datapath.name, max(state_count(datapath), 1)
    inputs = "".join(f", int64_t {port.name}_code" for port in datapath.inputs)
    guard = f"{name.upper()}_H"
    ports = "\n".join(
        f" *   {port.name}_code: {port.lowest} .. {port.highest}, value = {float(port.zero)!r} + "
        f"{float(port.lsb)!r} * code {port.unit.replace('*/', '* /')}".rstrip()
        for port in (*datapath.inputs, datapath.output)
    )
    flags = "\n".join(f" *   {1 << flag:#04x}: {flag.meaning}" for flag in Flag)
    return f"""/* {name}: bit-true model of the generated hardware, made by sosmith.
 *
 * Integer codes in, integer code out:
{ports}
 *
 * Bits of the status of a sample:
{flags}
 */
#ifndef {guard}
#define {guard}

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {{
#endif

/* The state of one channel. All zero is the state after reset. */
typedef struct {{
    {_type_of_states(datapath)} s[{states}];
}} {name}_state;

/* Put one channel into the state after reset. */
void {name}_reset({name}_state *state);

/* Compute one sample of one channel and advance its state; status may be NULL{_and_not_wear(datapath)}. */
int64_t {name}_step({name}_state *state{inputs}, uint8_t *status);
{_wear_declaration(datapath)}
/* Compute samples x channels: in[sample][channel][input], out[sample][channel], status[sample][channel] or NULL;
 * states[channel]. */
void {name}_block({name}_state *states, size_t samples, size_t channels, const int64_t *in, int64_t *out,
{" " * len(f"void {name}_block(")}uint8_t *status);

#ifdef __cplusplus
}}
#endif

#endif
"""


def c_source(datapath: Datapath) -> str:
    """Return the text of ``<name>.c``.

    Raises
    ------
    ValueError
        If a value inside is wider than 128 bits.
    """
    name, inputs = datapath.name, datapath.inputs
    parameters = "".join(f", int64_t {port.name}_code" for port in inputs)
    supply = "".join(f"    w.{port.name}_code = {port.name}_code;\n" for port in inputs)
    in_order = "".join(f"    stage{k}(state, &w);\n" for k in range(len(datapath.stages)))
    return f"""/* {name}: bit-true model of the generated hardware, made by sosmith. See {name}.h. */
#include "{name}.h"

#include <string.h>

#ifdef __GNUC__
#define ALWAYS_INLINE inline __attribute__((always_inline)) /* else the state of a loop goes through memory */
#else
#define ALWAYS_INLINE inline
#endif

/* What goes into the stages, and what passes from one to the next. */
typedef struct {{
{_wires(datapath)}}} wires;
{_stages(datapath)}
void {name}_reset({name}_state *state)
{{
    memset(state, 0, sizeof *state);
}}

static ALWAYS_INLINE int64_t step({name}_state *state{parameters}, uint8_t *status)
{{
    wires w;
{supply}{in_order}    if (status)
        *status = {_status(datapath)};
    return (int64_t)w.{_result(datapath)};
}}

int64_t {name}_step({name}_state *state{parameters}, uint8_t *status)
{{
    return step(state{"".join(f", {port.name}_code" for port in inputs)}, status);
}}
{_wear_definition(datapath)}{_block(datapath)}"""


def _and_not_wear(datapath: Datapath) -> str:
    return f",\n * and has no flags of wear: those are of {datapath.name}_wear_flags" if datapath.wear else ""


def _wear_declaration(datapath: Datapath) -> str:
    if not datapath.wear:
        return ""
    return (
        "\n/* Flags of the status that are about wear, for an output code of a channel. */\n"
        f"uint8_t {datapath.name}_wear_flags(size_t channel, int64_t code);\n"
    )


def _wear_definition(datapath: Datapath) -> str:
    """Return the function that judges wear, the only one that depends on the channel's number."""
    if not datapath.wear:
        return ""
    rows = ", ".join(f"{{{warning}, {critical}}}" for warning, critical in datapath.wear)
    several = len(datapath.wear) > 1
    flags = [f"(code >= limit[{k}]) << {flag.value}" for k, flag in enumerate((Flag.WEAR_WARNING, Flag.WEAR_CRITICAL))]
    return f"""
uint8_t {datapath.name}_wear_flags(size_t channel, int64_t code)
{{
    static const int64_t limits[{len(datapath.wear)}][2] = {{{rows}}};
    const int64_t *const limit = limits[{"channel" if several else "0"}];
{"" if several else "    (void)channel;" + chr(10)}    return (uint8_t)({" | ".join(flags)});
}}
"""


def _judge_wear(datapath: Datapath) -> str:
    if not datapath.wear:
        return ""
    at = "n * channels + c"
    return f"\n        status[{at}] |= {datapath.name}_wear_flags(c, out[{at}]);"


def state_count(datapath: Datapath) -> int:
    """Return the number of states of one channel."""
    return sum(len(stage.graph.delays) for stage in datapath.stages)


def state_bytes(datapath: Datapath) -> int:
    """Size of one channel's state in the compiled model, in bytes."""
    word = 16 if _type_of_states(datapath) == "__int128" else 8
    return max(state_count(datapath), 1) * word


def _type_of_states(datapath: Datapath) -> str:
    widths = [stage.graph.nodes[i].width for stage in datapath.stages for i in stage.graph.delays]
    return _type(max(widths, default=1))


def _type(width: int) -> str:
    if width > _WIDEST:
        raise ValueError(f"values of the C model must be at most {_WIDEST} bits wide, not {width}")
    return "int64_t" if width <= _NARROW else "__int128"


def _wire(index: int, node: int) -> str:
    return f"n{index}_{node}"


def _result(datapath: Datapath) -> str:
    last = datapath.stages[-1].graph
    return _wire(len(datapath.stages) - 1, last.outputs[0])


def _exported(datapath: Datapath, index: int) -> list[int]:
    """Return the nodes of a stage that others need: its outputs and, of the last stage, the value before the clamp."""
    graph = datapath.stages[index].graph
    exported = set(graph.outputs)
    if index == len(datapath.stages) - 1 and (node := graph.nodes[graph.outputs[0]]).op is Op.CLAMP:
        exported.add(node.operands[0])
    return sorted(exported)


def _wires(datapath: Datapath) -> str:
    lines = [f"    int64_t {port.name}_code;\n" for port in datapath.inputs]
    for index, stage in enumerate(datapath.stages):
        lines += [f"    {_type(stage.graph.nodes[i].width)} {_wire(index, i)};\n" for i in _exported(datapath, index)]
    return "".join(lines)


def _stages(datapath: Datapath) -> str:
    """Return one function for each stage."""
    text = []
    wires = [f"{port.name}_code" for port in datapath.inputs]
    offset = 0
    for index, stage in enumerate(datapath.stages):
        lines = _stage_lines(stage.graph, index, [f"w->{wire}" for wire in wires], offset)
        lines += [f"    w->{_wire(index, i)} = {_wire(index, i)};\n" for i in _exported(datapath, index)]
        unused = "" if stage.graph.delays else "    (void)state;\n"
        text.append(
            f"\n/* {stage.name} */\n"
            f"static ALWAYS_INLINE void stage{index}({datapath.name}_state *state, wires *w)\n"
            f"{{\n{''.join(lines)}{unused}}}\n"
        )
        wires = [_wire(index, i) for i in stage.graph.outputs]
        offset += len(stage.graph.delays)
    return "".join(text)


def _stage_lines(graph: Graph, index: int, wires: list[str], offset: int) -> list[str]:
    lines = []
    supply, memory = iter(wires), iter(range(offset, offset + len(graph.delays)))
    for i, node in enumerate(graph.nodes):
        if node.op is Op.INPUT:
            expression = next(supply)
        elif node.op is Op.DELAY:
            expression = f"state->s[{next(memory)}]"
        else:
            expression = _expression(graph, node, f"n{index}_")
        comment = f" /* {node.name}, {node.format} */" if node.name else ""
        lines.append(f"    const {_type(node.width)} {_wire(index, i)} = {expression};{comment}\n")
    lines += [
        f"    state->s[{offset + k}] = {_wire(index, graph.nodes[i].operands[0])};\n"
        for k, i in enumerate(graph.delays)
    ]
    used = {i for node in graph.nodes for i in node.operands} | set(graph.outputs)
    lines += [f"    (void){_wire(index, i)};\n" for i in range(len(graph.nodes)) if i not in used]
    return lines


def _status(datapath: Datapath) -> str:
    """Return the C expression of the status."""
    last = datapath.stages[-1].graph
    node = last.nodes[last.outputs[0]]
    conditions: dict[Flag, list[str]] = {flag: [] for flag in Flag}
    for port, (low, high) in zip(datapath.inputs, datapath.calibrated, strict=True):
        code = f"{port.name}_code"
        conditions[Flag.INPUT_AT_RAIL] += [f"{code} == {port.lowest}", f"{code} == {port.highest}"]
        if low > port.lowest:
            conditions[Flag.OUTSIDE_CALIBRATION].append(f"{code} < {low}")
        if high < port.highest:
            conditions[Flag.OUTSIDE_CALIBRATION].append(f"{code} > {high}")
    if node.op is Op.CLAMP:
        before = f"w.{_wire(len(datapath.stages) - 1, node.operands[0])}"
        conditions[Flag.OUTPUT_SATURATED] += [f"{before} < {_literal(node.low)}", f"{before} > {_literal(node.high)}"]
    terms = [f"({' || '.join(found)}) << {flag.value}" for flag, found in conditions.items() if found]
    return f"(uint8_t)({' | '.join(terms)})"


_UNROLLED = 4  # samples: four save the processor the moves from x[n-1] to x[n-2], more gain nothing


def _block(datapath: Datapath) -> str:
    """Return the functions for many samples.

    Without status, each stage works one sample behind the stage before it, as in a pipeline, so that none waits for
    another. A processor could hide such waits only if its window of instructions held the whole chain.
    """
    name, inputs, behind = datapath.name, datapath.inputs, len(datapath.stages) - 1
    codes = [f"in[(n * channels + c) * {len(inputs)} + {i}]" for i in range(len(inputs))]
    work = []
    for k in range(behind, -1, -1):
        lines = [f"stage{k}(state, w);"]
        if k == 0:
            lines[:0] = [f"w->{port.name}_code = {code};" for port, code in zip(inputs, codes, strict=True)]
        if k == behind:
            lines.append(f"out[(n - behind) * channels + c] = (int64_t)w->{_result(datapath)};")
        condition = f"first <= {k} && {k} <= last" if k else "first == 0"
        work += [f"    if ({condition}) {{\n", *(f"        {line}\n" for line in lines), "    }\n"]
    ticks = "".join(
        f"        tick(&local, &passing, n{f' + {k}' if k else ''}, 0, behind, channels, c, in, out);\n"
        for k in range(_UNROLLED)
    )
    return f"""
static void with_status({name}_state *state, size_t samples, size_t channels, size_t c, const int64_t *in,
                        int64_t *out, uint8_t *status)
{{
    {name}_state local = *state; /* a local copy stays in registers */
    for (size_t n = 0; n < samples; n++) {{
        out[n * channels + c] = step(&local, {", ".join(codes)}, &status[n * channels + c]);{_judge_wear(datapath)}
    }}
    *state = local;
}}

static const size_t behind = {behind}; /* samples, the last stage behind the first */

/* Stages `first` to `last`, the last first, stage k with sample n - k: none waits for another. */
static ALWAYS_INLINE void tick({name}_state *state, wires *w, size_t n, size_t first, size_t last, size_t channels,
                               size_t c, const int64_t *in, int64_t *out)
{{
{"".join(work)}}}

/* The same where some stages have no sample yet, or no more. */
static void partial_tick({name}_state *state, wires *w, size_t n, size_t samples, size_t channels, size_t c,
                         const int64_t *in, int64_t *out)
{{
    tick(state, w, n, n < samples ? 0 : n - samples + 1, n > behind ? behind : n, channels, c, in, out);
}}

static void without_status({name}_state *state, size_t samples, size_t channels, size_t c, const int64_t *in,
                           int64_t *out)
{{
    {name}_state local;
    wires w, passing;
    size_t n;
    memset(&w, 0, sizeof w);
    for (n = 0; n != behind; n++)
        partial_tick(state, &w, n, samples, channels, c, in, out);
    local = *state; /* local copies stay in registers */
    passing = w;
    for (; n + {_UNROLLED} <= samples; n += {_UNROLLED}) {{
{ticks}    }}
    *state = local;
    w = passing;
    for (; n < samples + behind; n++)
        partial_tick(state, &w, n, samples, channels, c, in, out);
}}

void {name}_block({name}_state *states, size_t samples, size_t channels, const int64_t *in, int64_t *out,
{" " * len(f"void {name}_block(")}uint8_t *status)
{{
    for (size_t c = 0; c < channels; c++)
        if (status)
            with_status(&states[c], samples, channels, c, in, out, status);
        else
            without_status(&states[c], samples, channels, c, in, out);
}}
"""


def _expression(graph: Graph, node: Node, prefix: str) -> str:
    operands = [graph.nodes[i] for i in node.operands]
    names = [f"{prefix}{i}" for i in node.operands]
    kind = _type(max([node.width, *(operand.width for operand in operands)]))
    if node.op is Op.CONSTANT:
        return _literal(node.parameter)
    if node.op in {Op.ADD, Op.SUBTRACT}:
        sign = "+" if node.op is Op.ADD else "-"
        terms = [_scaled(kind, name, node.frac - operand.frac) for name, operand in zip(names, operands, strict=True)]
        return f" {sign} ".join(terms)
    if node.op is Op.SCALE:
        return f"({kind}){names[0]} * {_literal(node.parameter)}"
    if node.op is Op.MULTIPLY:
        return f"({kind}){names[0]} * {names[1]}"
    if node.op is Op.FLOOR:
        return f"{names[0]} >> {operands[0].frac - node.frac}"
    if node.op is Op.TRUNCATE:  # as C99 divides
        return f"{names[0]} / {_power(operands[0].frac - node.frac)}"
    if node.op is Op.FRACTION:
        return f"{names[0]} & ({_power(operands[0].frac - node.parameter)} - 1)"
    if node.op is Op.CLAMP:
        low, high = _literal(node.low), _literal(node.high)
        return f"{names[0]} < {low} ? {low} : {names[0]} > {high} ? {high} : {names[0]}"
    return names[0]  # SHIFT and BOUND keep the code


def _scaled(kind: str, name: str, shift: int) -> str:
    # A multiplication, because shifting a negative number to the left is undefined in C.
    return f"({kind}){name} * {_power(shift)}" if shift else f"({kind}){name}"


def _power(exponent: int) -> str:
    return _literal(1 << exponent)


def _literal(number: int) -> str:
    if -(1 << 63) < number < 1 << 63:
        return f"INT64_C({number})"
    high, low = divmod(number, 1 << 62)
    return f"((__int128)INT64_C({high}) * (INT64_C(1) << 62) + INT64_C({low}))"
