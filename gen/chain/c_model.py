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
    includes = "".join(f'#include "{stage.design.datapath.name}.h"\n' for stage in design.stages)
    states = "".join(
        f"    {stage.design.datapath.name}_{'state' if _steps(stage) else 'decimator'} stage_{stage.spec.name};\n"
        for stage in design.stages
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

/* Take one sample. Return 1 if it brings a result, which the first does and then every {design.factor}-th, and 0
 * otherwise; status may be NULL. */
int {name}_push({name}_state *state, {_taken(design)}, int64_t *result, uint8_t *status);

#ifdef __cplusplus
}}
#endif

#endif
"""


def chain_source(design: ChainDesign) -> str:
    """Text of ``<name>.c``."""
    name = design.name
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
    return f"""/* {name}: bit-true model of the generated hardware, made by sosmith. */
#include "{name}.h"

#include <string.h>

void {name}_reset({name}_state *state)
{{
    memset(state, 0, sizeof *state);
}}

int {name}_push({name}_state *state, {_taken(design)}, int64_t *result, uint8_t *status)
{{
{"".join(lines)}    return 1;
}}
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
