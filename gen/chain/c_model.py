"""The C model of a chain: the models of its stages, in series."""

from __future__ import annotations

from sosmith.gen.chain.design import ChainDesign, StageDesign
from sosmith.model.dataflow.status import Flag


def _steps(stage: StageDesign) -> bool:
    """Whether each sample has a result."""
    return stage.design.datapath.samples_per_result == 1


def chain_header(design: ChainDesign) -> str:
    """Text of ``<name>.h``."""
    name = design.name
    cores = [core for stage in design.stages for core in stage.cores]
    includes = "".join(f'#include "{core.datapath.name}.h"\n' for core in cores)
    states = "".join(
        f"    {core.datapath.name}_{'state' if _steps(stage) else 'decimator'} {state};\n"
        for stage in design.stages
        for core, state in zip(stage.cores, _states(stage), strict=True)
    )
    return f"""/* {name}: bit-true model of the generated hardware, made by sosmith. */
#ifndef {name.upper()}_H
#define {name.upper()}_H

{includes}
#ifdef __cplusplus
extern "C" {{
#endif

/* The state of one channel. All zero is the state after reset. */
typedef struct {{
{states}{_kept(design)}}} {name}_state;

/* Put one channel into the state after reset. */
void {name}_reset({name}_state *state);

{_said(design)}
int {name}_push({name}_state *state, {_taken(design)}, int64_t *result, uint8_t *status);

#ifdef __cplusplus
}}
#endif

#endif
"""


def _states(stage: StageDesign) -> list[str]:
    """Names of the states of a stage's cores."""
    name = f"stage_{stage.spec.name}"
    return [name] if len(stage.cores) == 1 else [f"{name}_p{k}" for k in range(len(stage.cores))]


def _said(design: ChainDesign) -> str:
    """Say what a call gives."""
    if design.rise == 1:
        first = f"Return 1 if it brings a result, which the first does and then every {design.factor}-th, and 0"
        return f"/* Take one sample. {first}\n * otherwise; status may be NULL. */"
    return f"""/* Most results that a sample brings. */
#define {design.name.upper()}_RESULTS {most_results(design)[-1]}

/* Take one sample. Return how many results it brings; result and status have room for these, or status is NULL. */"""


def most_results(design: ChainDesign) -> list[int]:
    """Return how many results of each stage a sample brings at most."""
    most, counts = 1, []
    for rise, factor in design.rates:
        most = -(-most * rise // factor)
        counts.append(most)
    return counts


def _rising(design: ChainDesign) -> list[str]:
    """Return the body of the function of a chain that interpolates: the results of a stage lie in an array.

    Names of variables end in another way than the parameters, which are named by the inputs.
    """
    most, (first, *later) = most_results(design), design.stages
    given = ", ".join(f"{port.name}_code" for port in design.spec.base.inputs)
    names = [stage.spec.name for stage in design.stages]
    lines = [f"int64_t {', '.join(f'{name}_at[{count}]' for name, count in zip(names, most, strict=True))};"]
    lines += [f"int {', '.join(f'{name}_count = 0' for name in names)}, total = 0, i{', k' if later else ''};"]
    lines += [f"uint8_t first[{most[0]}], last[{most[-1]}], flags;"]
    lines += _appended(first, given, "first")
    lines += [f"for (i = 0; i < {names[0]}_count; i++) {{"]
    if not later:
        lines += _indented(["last[i] = first[i];", "flags = 0;", *_handed_out(names[0], "i")])
        return [*lines, "}", "return total;"]
    inner = [f"state->kept |= first[i] & {(1 << design.carried_flags) - 1};"]
    for stage, before in zip(later, names, strict=False):
        told = "last" if stage is later[-1] else ""
        inner += [f"{stage.spec.name}_count = 0;"]
        if before == names[0]:
            inner += _appended(stage, f"{before}_at[i]", told)
        else:
            loop = _indented(_appended(stage, f"{before}_at[k]", told))
            inner += [f"for (k = 0; k < {before}_count; k++) {{", *loop, "}"]
    inner += [f"if ({names[-1]}_count == 0)", "    continue;", "flags = state->kept;", "state->kept = 0;"]
    if design.settling:
        young = _indented(["state->results++;", f"flags |= {1 << Flag.SETTLING};"])
        inner += [f"if (state->results < {design.settling_entries}) {{", *young, "}"]
    inner += [f"for (k = 0; k < {names[-1]}_count; k++) {{", *_indented(_handed_out(names[-1], "k")), "}"]
    return [*lines, *_indented(inner), "}", "return total;"]


def _appended(stage: StageDesign, code: str, told: str) -> list[str]:
    """Let the cores of a stage take a value, whose results are appended to its array."""
    name, lines = stage.spec.name, list[str]()
    place, count = f"{name}_at[{name}_count]", f"{name}_count"
    status = f"&{told}[{count}]" if told else "NULL"
    for core, state in zip(stage.cores, _states(stage), strict=True):
        if _steps(stage):
            lines += [f"{place} = {core.datapath.name}_step(&state->{state}, {code}, {status});", f"{count}++;"]
        else:
            lines += [f"{count} += {core.datapath.name}_push(&state->{state}, {code}, &{place}, {status});"]
    return lines


def _handed_out(name: str, index: str) -> list[str]:
    """Hand out a result with its flags."""
    flags = ["if (status)", f"    status[total] = last[{index}] | flags;"]
    return [f"result[total] = {name}_at[{index}];", *flags, "total++;"]


def _indented(lines: list[str]) -> list[str]:
    return [f"    {line}" for line in lines]


def chain_source(design: ChainDesign) -> str:
    """Text of ``<name>.c``."""
    if design.rise > 1:
        return _source(design, "".join(f"{line}\n" for line in _indented(_rising(design))))
    lines = [] if len(design.stages) == 1 else ["    uint8_t flags;\n"]
    given = ", ".join(f"{port.name}_code" for port in design.spec.base.inputs)
    for stage in design.stages:
        core, state = stage.design.datapath.name, f"&state->stage_{stage.spec.name}"
        flags = _flags(design, stage)
        if _steps(stage):
            lines.append(f"    *result = {core}_step({state}, {given}, {flags});\n")
        else:
            lines += [f"    if (!{core}_push({state}, {given}, result, {flags}))\n", "        return 0;\n"]
        if stage is design.stages[0] and stage is not design.stages[-1]:
            lines.append(f"    state->kept |= flags & {(1 << design.carried_flags) - 1};\n")
        given = "*result"
    lines += _gathered(design)
    return _source(design, f"{''.join(lines)}    return 1;\n")


def _source(design: ChainDesign, body: str) -> str:
    name = design.name
    return f"""/* {name}: bit-true model of the generated hardware, made by sosmith. */
#include "{name}.h"

#include <string.h>

void {name}_reset({name}_state *state)
{{
    memset(state, 0, sizeof *state);
}}

int {name}_push({name}_state *state, {_taken(design)}, int64_t *result, uint8_t *status)
{{
{body}}}
"""


def _flags(design: ChainDesign, stage: StageDesign) -> str:
    """Where the flags of a stage go: those between the first and the last cannot be set."""
    if len(design.stages) == 1:
        return "status"
    return "&flags" if stage in (design.stages[0], design.stages[-1]) else "NULL"


def _kept(design: ChainDesign) -> str:
    """Return what the flags of a chain need beside the states of its stages."""
    if len(design.stages) == 1:
        return ""
    return "    uint8_t kept;\n" + ("    int32_t results;\n" if design.settling else "")


def _gathered(design: ChainDesign) -> list[str]:
    """Set flags of all samples since the last result, and that of the first results."""
    if len(design.stages) == 1:
        return []
    lines = ["    flags |= state->kept;\n", "    state->kept = 0;\n"]
    if design.settling:
        lines += [
            f"    if (state->results < {design.settling}) {{\n",
            "        state->results++;\n",
            f"        flags |= {1 << Flag.SETTLING};\n",
            "    }\n",
        ]
    return [*lines, "    if (status)\n", "        *status = flags;\n"]


def _taken(design: ChainDesign) -> str:
    return ", ".join(f"int64_t {port.name}_code" for port in design.spec.base.inputs)
