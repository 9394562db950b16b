"""What stands around the stages of a C model: token for token, it can only be what is written here.

Why it is right. `product` is ``a * b`` for all numbers of 32 bits: with ``a = 2**16 A + x`` and ``b = 2**16 B + y``, x
and y from 0 to 2**16 - 1, A and B from -2**15 to 2**15 - 1, it is ``2**32 A B + 2**16 (A y + x B) + x y``. With ``f = A
y + (x y >> 16)`` and ``g = x B + f % 2**16`` that is ``2**32 (A B + (f >> 16) + (g >> 16)) + 2**16 (g % 2**16) + x y %
2**16``; f, g and the upper part fit 32 bits with a sign, x y without.

`step` runs the stages one after the other on one sample. `tick` runs stage k with sample n - k, the last stage first:
what stage k takes was stored by stage k - 1 at the tick before, with sample n - k, and no other stage stores it.
`partial_tick` runs those stages alone whose sample is one of 0..samples - 1. `without_status` runs the ticks 0..samples
+ behind - 1 in their order, those with all stages four at a time; so each stage works on each sample once, in order,
and its states, which no other stage has, are those of `step`. A decimator adds modulo 2**64, without a sign; its
differences are the moving sums, which fit 64 bits with a sign. Where one result out of several leaves, all are
computed; the first sample goes in as often as it must, and results then are counted from 0. Where all leave, `fill`
does that before the first `step` after a reset, and changes nothing later.
"""

from __future__ import annotations

import re

BEGIN = """
#include "NAME.h"

#include <string.h>

#ifdef __GNUC__
#define ALWAYS_INLINE inline __attribute__((always_inline))
#else
#define ALWAYS_INLINE inline
#endif

static ALWAYS_INLINE int64_t product(int32_t a, int32_t b) {
#if defined(__thumb__) && !defined(__thumb2__)
    const int32_t upper_a = a >> 16, upper_b = b >> 16;
    const int32_t lower_a = a & INT32_C(65535), lower_b = b & INT32_C(65535);
    const uint32_t lowest = (uint32_t)lower_a * (uint32_t)lower_b;
    const int32_t first = upper_a * lower_b + (int32_t)(lowest >> 16);
    const int32_t second = lower_a * upper_b + (first & INT32_C(65535));
    const int32_t upper = upper_a * upper_b + (first >> 16) + (second >> 16);
    return upper * INT64_C(4294967296) + ((uint32_t)second << 16 | (lowest & UINT32_C(65535)));
#else
    return (int64_t)a * b;
#endif
}
"""

RESET = "void NAME_reset(NAME_state *state) { memset(state, 0, sizeof *state); }"

WEAR = """
uint8_t NAME_wear_flags(size_t channel, int64_t code) {
    static const int64_t limits[COUNT][2] = { LIMITS };
    const int64_t *const limit = limits[WHICH];
    UNUSED
    return (uint8_t)((code >= limit[0]) << 3 | (code >= limit[1]) << 4);
}
"""

STEP = """
static ALWAYS_INLINE int64_t PREFIXstep(NAME_state *state, PARAMETERS, uint8_t *status) {
    PREFIXwires w;
    SET
    RUN
    if (status)
        *status = STATUS;
    return (int64_t)w.RESULT;
}
"""

BLOCK = """
FIRST_FILLS
int64_t NAME_step(NAME_state *state, PARAMETERS, uint8_t *status) {
    IN_STEP
    return step(state, ARGUMENTS, status);
}

static void with_status(NAME_state *state, size_t samples, size_t channels, size_t c, const int64_t *in,
                        int64_t *out, uint8_t *status) {
    NAME_state local = *state;
    for (size_t n = 0; n < samples; n++) {
        out[n * channels + c] = step(&local, CODES, &status[n * channels + c]);
    }
    *state = local;
}

static const size_t behind = BEHIND;

static ALWAYS_INLINE void tick(NAME_state *state, wires *w, size_t n, size_t first, size_t last, size_t channels,
                               size_t c, const int64_t *in, int64_t *out) {
    TICKS
}

static void partial_tick(NAME_state *state, wires *w, size_t n, size_t samples, size_t channels, size_t c,
                         const int64_t *in, int64_t *out) {
    tick(state, w, n, n < samples ? 0 : n - samples + 1, n > behind ? behind : n, channels, c, in, out);
}

static void without_status(NAME_state *state, size_t samples, size_t channels, size_t c, const int64_t *in,
                           int64_t *out) {
    NAME_state local;
    wires w, passing;
    size_t n;
    memset(&w, 0, sizeof w);
    for (n = 0; n != behind; n++)
        partial_tick(state, &w, n, samples, channels, c, in, out);
    local = *state;
    passing = w;
    for (; n + 4 <= samples; n += 4) {
        tick(&local, &passing, n, 0, behind, channels, c, in, out);
        tick(&local, &passing, n + 1, 0, behind, channels, c, in, out);
        tick(&local, &passing, n + 2, 0, behind, channels, c, in, out);
        tick(&local, &passing, n + 3, 0, behind, channels, c, in, out);
    }
    *state = local;
    w = passing;
    for (; n < samples + behind; n++)
        partial_tick(state, &w, n, samples, channels, c, in, out);
}

void NAME_block(NAME_state *states, size_t samples, size_t channels, const int64_t *in, int64_t *out, uint8_t *status) {
    const size_t turn = channels > 1 ? 64 + 16384 / channels : samples;
    for (size_t done = 0; done < samples; done += turn) {
        const size_t now = samples - done < turn ? samples - done : turn;
        const size_t at = done * channels;
        for (size_t c = 0; c < channels; c++) OPENS
            if (status)
                with_status(&states[c], now, channels, c, &in[at * INPUTS], &out[at], &status[at]);
            else
                without_status(&states[c], now, channels, c, &in[at * INPUTS], &out[at]);
        ENDS
    }
}
"""

FIRST_FILLS = """
static void fill(NAME_state *state, PARAMETERS) {
    if (state->started)
        return;
    for (size_t k = 0; k < FILLED; k++)
        step(state, ARGUMENTS, NULL);
    state->started = 1;
}
"""

SUMS = """
static void integrate(NAME_decimator *state, int64_t code) {
    uint64_t sum = (uint64_t)code;
    for (size_t k = 0; k < STAGES; k++)
        sum = state->sums[k] += sum;
}

static int64_t comb(NAME_decimator *state) {
    uint64_t value = state->sums[LAST];
    for (size_t k = 0; k < STAGES; k++) {
        const uint64_t now = value;
        value -= state->combs[k];
        state->combs[k] = now;
    }
    return (int64_t)value;
}

int NAME_push(NAME_decimator *state, TAKEN, int64_t *result, uint8_t *status) {
    FIRST
    int found = 0;
    WARM_UP
    integrate(state, code);
    state->KEPT |= SEEN;
    if (state->phase == 0) {
        const int64_t rounded = (comb(state) + HALF) >> DROPPED;
        *result = step(&state->filter, CHANNEL rounded, &flags);
        if (status)
            *status = (uint8_t)((flags & ~MASK) | PASSED);
        state->KEPT = 0;
        found = 1;
    }
    state->phase = (state->phase + 1) % FACTOR;
    return found;
}
"""

WARM_UP = """
    if (!state->started) {
        for (size_t k = 0; k < WARM; k++) {
            integrate(state, code);
            if (k % FACTOR == 0)
                comb(state);
        }
        state->started = 1;
    }
"""

HEADER = """
#ifndef GUARD_H
#define GUARD_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct { STATES } NAME_state;

void NAME_reset(NAME_state *state);
int64_t NAME_step(NAME_state *state, PARAMETERS, uint8_t *status);
WEAR
void NAME_block(NAME_state *states, size_t samples, size_t channels, const int64_t *in, int64_t *out, uint8_t *status);
DECIMATOR

#ifdef __cplusplus
}
#endif

#endif
"""

DOWNSAMPLED = """
int NAME_push(NAME_decimator *state, TAKEN, int64_t *result, uint8_t *status) {
    uint8_t flags;
    int64_t code;
    int found = 0;
    FILL
    code = step(&state->filter, ARGUMENTS, &flags);
    state->at_rail |= SEEN;
    if (state->phase == 0) {
        *result = code;
        if (status)
            *status = (uint8_t)((flags & ~0x01) | (state->at_rail ? 0x01 : 0));
        state->at_rail = 0;
        found = 1;
    }
    state->phase = (state->phase + 1) % FACTOR;
    return found;
}
"""

FILL = """
    if (!state->started) {
        for (size_t k = 0; k < FILLED; k++)
            step(&state->filter, ARGUMENTS, NULL);
        state->started = 1;
    }
"""

DOWNSAMPLER = """
typedef struct {
    unsigned phase, STARTED at_rail;
    NAME_state filter;
} NAME_decimator;

int NAME_push(NAME_decimator *state, TAKEN, int64_t *result, uint8_t *status);
"""

DECIMATOR = """
typedef struct {
    uint64_t sums[STAGES], combs[STAGES];
    unsigned phase, STARTED KEPT;
    NAME_state filter;
} NAME_decimator;

int NAME_push(NAME_decimator *state, TAKEN, int64_t *result, uint8_t *status);
"""


def filled(text: str, **words: object) -> str:
    """Return a text with its words in capitals replaced, all at once."""
    keys = "|".join(sorted(words, key=len, reverse=True))
    return re.sub(rf"\b(?:{keys})", lambda match: str(words[match[0]]), text)


def ticks(given: str, stages: int, result: str) -> str:
    """Return the body of `tick`; `given` sets the members of the inputs."""
    parts = []
    for k in reversed(range(stages)):
        condition = f"first <= {k} && {k} <= last" if k else "first == 0"
        taken = f"out[(n - behind) * channels + c] = (int64_t)w->{result};" if k == stages - 1 else ""
        parts.append(f"if ({condition}) {{ {given if k == 0 else ''} stage{k}(state, w); {taken} }}")
    return "\n".join(parts)
