"""The C model of a chain: each sample goes through the models of the stages, which are proven by themselves, in order.

Only one text says that, apart from comments and blanks, so that it is compared token by token.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from sosmith.verify.c_model.tokens import tokens_of
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.chain.chain_file import ChainCertificate
from sosmith.verify.chain.flags import FlagsClaim
from sosmith.verify.chain.responses import factor_of, parts_of
from sosmith.verify.graph import require

_SETTLING = 1 << 5


def check_chain_model(
    source: str, header: str, chain: ChainCertificate, cores: Sequence[Certificate], flags: FlagsClaim | None
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
    state = f"{' '.join(('typedef struct {', *_fields(chain, cores, flags)))} }} {name}_state; {reset}; {push};"
    wanted = [f"#ifndef {guard}", f"#define {guard}", *(f'#include "{core.name}.h"' for core in cores)]
    wanted += [cpp, 'extern "C" {', "#endif", state, cpp, "}", "#endif", "#endif"]
    _same(header, wanted, f"{name}.h")
    body = (
        f"{reset} {{ memset(state, 0, sizeof *state); }} {push} {{ {' '.join(_calls(chain, cores, flags))} return 1; }}"
    )
    _same(source, [f'#include "{name}.h"', "#include <string.h>", body], f"{name}.c")


def _decimates(core: Certificate) -> bool:
    return factor_of(parts_of(core)) > 1


def _fields(chain: ChainCertificate, cores: Sequence[Certificate], flags: FlagsClaim | None) -> Iterator[str]:
    for entry, core in zip(chain.stages, cores, strict=True):
        yield f"{core.name}_{'decimator' if _decimates(core) else 'state'} stage_{entry.name};"
    if flags is not None:
        yield "uint8_t kept;"
        if flags.settling:
            yield "int32_t results;"


def _calls(chain: ChainCertificate, cores: Sequence[Certificate], flags: FlagsClaim | None) -> Iterator[str]:
    given = ", ".join(f"{port.name}_code" for port in chain.inputs)
    if flags is not None:
        yield "uint8_t flags;"
    for k, (entry, core) in enumerate(zip(chain.stages, cores, strict=True)):
        told = "status" if flags is None else "&flags" if k in {0, len(cores) - 1} else "NULL"
        if _decimates(core):
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


def _same(text: str, wanted: Sequence[str], what: str) -> None:
    own = [token.text for token in tokens_of(text, what)]
    other = [token.text for token in tokens_of("\n".join(wanted), what)]
    for k, token in enumerate(other):
        read = own[k] if k < len(own) else ""
        require(read == token, f"{what} must have {token} after {' '.join(other[max(0, k - 4) : k])!r}, not {read!r}")
    require(len(own) == len(other), f"{what} must end after {' '.join(other[-4:])!r}, not go on")
