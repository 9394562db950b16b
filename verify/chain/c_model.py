"""The C model of a chain: each sample goes through the models of the stages, which are proven by themselves, in order.

Only one text says that, apart from comments and blanks, so that it is compared token by token.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from sosmith.verify.c_model.tokens import tokens_of
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.chain.chain_file import ChainCertificate, ChainStageEntry
from sosmith.verify.chain.flags import FlagsClaim
from sosmith.verify.chain.responses import factor_of, parts_of
from sosmith.verify.graph import require

_SETTLING = 1 << 5


Groups = Sequence[tuple[Certificate, ...]]
"""The certificates of each stage's cores."""


def check_chain_model(
    source: str, header: str, chain: ChainCertificate, groups: Groups, flags: FlagsClaim | None
) -> None:
    """Check the two files of a chain's C model; `flags` is what its flags must be, None for a single stage.

    Raises
    ------
    RejectedError
        If a token is another one.
    """
    name = chain.name
    samples = ", ".join(f"int64_t {port.name}_code" for port in chain.inputs)
    push = f"int {name}_push({name}_state *state, {samples}, int64_t *result, uint8_t *status)"
    reset = f"void {name}_reset({name}_state *state)"
    guard = f"{name.upper()}_H"
    cpp = "#ifdef __cplusplus"
    rises = any(len(cores) > 1 for cores in groups)
    state = f"{' '.join(('typedef struct {', *_fields(chain, groups, flags)))} }} {name}_state; {reset};"
    wanted = [f"#ifndef {guard}", f"#define {guard}", *(f'#include "{core.name}.h"' for own in groups for core in own)]
    wanted += [cpp, 'extern "C" {', "#endif", state]
    wanted += [f"#define {name.upper()}_RESULTS {_most(groups)[-1]}"] if rises else []
    wanted += [f"{push};", cpp, "}", "#endif", "#endif"]
    _same(header, wanted, f"{name}.h")
    calls = _several(chain, groups, flags) if rises else [*_calls(chain, groups, flags), "return 1;"]
    body = f"{reset} {{ memset(state, 0, sizeof *state); }} {push} {{ {' '.join(calls)} }}"
    _same(source, [f'#include "{name}.h"', "#include <string.h>", body], f"{name}.c")


def _decimates(cores: Sequence[Certificate]) -> bool:
    return factor_of(parts_of(cores)) > 1


def _kept(entry: ChainStageEntry, cores: Sequence[Certificate]) -> list[str]:
    """Return the names of the states of a stage's cores."""
    several = len(cores) > 1
    return [f"stage_{entry.name}_p{k}" if several else f"stage_{entry.name}" for k in range(len(cores))]


def _most(groups: Groups) -> list[int]:
    """Return how many results of each stage a sample brings at most."""
    counts = [1]
    for cores in groups:
        down = factor_of(parts_of(cores))
        counts.append((counts[-1] * len(cores) + down - 1) // down)
    return counts[1:]


def _fields(chain: ChainCertificate, groups: Groups, flags: FlagsClaim | None) -> Iterator[str]:
    for entry, cores in zip(chain.stages, groups, strict=True):
        for core, kept in zip(cores, _kept(entry, cores), strict=True):
            yield f"{core.name}_{'decimator' if _decimates(cores) else 'state'} {kept};"
    if flags is not None:
        yield "uint8_t kept;"
        if flags.settling:
            yield "int32_t results;"


def _calls(chain: ChainCertificate, groups: Groups, flags: FlagsClaim | None) -> Iterator[str]:
    given = ", ".join(f"{port.name}_code" for port in chain.inputs)
    if flags is not None:
        yield "uint8_t flags;"
    for k, (entry, cores) in enumerate(zip(chain.stages, groups, strict=True)):
        told = "status" if flags is None else "&flags" if k in {0, len(groups) - 1} else "NULL"
        (core,) = cores
        if _decimates(cores):
            yield f"if (!{core.name}_push(&state->stage_{entry.name}, {given}, result, {told})) return 0;"
        else:
            yield f"*result = {core.name}_step(&state->stage_{entry.name}, {given}, {told});"
        if flags is not None and k == 0:
            yield f"state->kept |= flags & {(1 << flags.carried) - 1};"
        given = "*result"
    if flags is not None:
        yield "flags |= state->kept; state->kept = 0;"
        if flags.settling:
            yield f"if (state->results < {flags.settling}) {{ state->results++; flags |= {_SETTLING}; }}"
        yield "if (status) *status = flags;"


def _several(chain: ChainCertificate, groups: Groups, flags: FlagsClaim | None) -> Iterator[str]:
    """Yield the statements of a chain with stages that interpolate, whose results lie in arrays."""
    names, most = [entry.name for entry in chain.stages], _most(groups)
    yield "int64_t " + ", ".join(f"{name}_at[{count}]" for name, count in zip(names, most, strict=True)) + ";"
    yield (
        "int " + "".join(f"{name}_count = 0, " for name in names) + f"total = 0, i{', k' if flags is not None else ''};"
    )
    yield f"uint8_t first[{most[0]}], last[{most[-1]}], flags;"
    inputs = ", ".join(f"{port.name}_code" for port in chain.inputs)
    yield from _put(chain.stages[0], groups[0], inputs, "first")
    yield f"for (i = 0; i < {names[0]}_count; i++) {{"
    if flags is None:
        yield f"last[i] = first[i]; flags = 0; {_leave(names[0], 'i')} }} return total;"
        return
    yield f"state->kept |= first[i] & {(1 << flags.carried) - 1};"
    for n in range(1, len(names)):
        told = "last" if n == len(names) - 1 else ""
        yield f"{names[n]}_count = 0;"
        if n == 1:
            yield from _put(chain.stages[n], groups[n], f"{names[0]}_at[i]", told)
        else:
            yield f"for (k = 0; k < {names[n - 1]}_count; k++) {{"
            yield from _put(chain.stages[n], groups[n], f"{names[n - 1]}_at[k]", told)
            yield "}"
    yield f"if ({names[-1]}_count == 0) continue; flags = state->kept; state->kept = 0;"
    if flags.settling:
        yield f"if (state->results < {flags.settling}) {{ state->results++; flags |= {_SETTLING}; }}"
    yield f"for (k = 0; k < {names[-1]}_count; k++) {{ {_leave(names[-1], 'k')} }} }} return total;"


def _put(entry: ChainStageEntry, cores: Sequence[Certificate], code: str, told: str) -> Iterator[str]:
    """Yield the calls by which a stage's cores take a code, and put their results into its array."""
    count = f"{entry.name}_count"
    place, status = f"{entry.name}_at[{count}]", f"&{told}[{count}]" if told else "NULL"
    for core, kept in zip(cores, _kept(entry, cores), strict=True):
        if _decimates(cores):
            yield f"{count} += {core.name}_push(&state->{kept}, {code}, &{place}, {status});"
        else:
            yield f"{place} = {core.name}_step(&state->{kept}, {code}, {status}); {count}++;"


def _leave(name: str, index: str) -> str:
    """Return the statements that hand out a result with its flags."""
    status = f"if (status) status[total] = last[{index}] | flags;"
    return f"result[total] = {name}_at[{index}]; {status} total++;"


def _same(text: str, wanted: Sequence[str], what: str) -> None:
    own = [token.text for token in tokens_of(text, what)]
    other = [token.text for token in tokens_of("\n".join(wanted), what)]
    for k, token in enumerate(other):
        read = own[k] if k < len(own) else ""
        require(read == token, f"{what} must have {token} after {' '.join(other[max(0, k - 4) : k])!r}, not {read!r}")
    require(len(own) == len(other), f"{what} must end after {' '.join(other[-4:])!r}, not go on")
