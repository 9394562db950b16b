"""Random designs whose certificates Rocq is to accept: every realization, family, kind and start in turn.

Each draw has one of `VARIANTS` (a realization that is asked for, several samples a clock, look-ahead, a decimator, ...)
and what of families, kinds and starts had the fewest turns so far, among specifications that can be met. Orders go from
1 to 8, edges from 0.003 of the sample rate on, poles up to 0.999, inputs and outputs from 4 to 24 bits. The seeds are
fixed.
"""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from benchmarks.random_designs import random_specification

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.realizations.registry import FIR, SECTIONS
from sosmith.gen.specification.choices import FIR_FAMILIES, KINDS, STARTS
from sosmith.gen.specification.specification import from_text
from sosmith.model.errors import SosmithError
from sosmith.verify.certificate_file import Certificate

MAX_ORDER, LOWEST = 8, -2.523
"""Orders, and the power of ten of the lowest edge over the sample rate, 0.003."""

SLOWEST = 0.999
"""Poles nearer to the unit circle have responses of more than 60,000 samples: theorems, but not in minutes."""

_TRIES = 400
"""Specifications that a draw is chosen from."""


@dataclass(frozen=True)
class Draw:
    """A specification.

    Attributes
    ----------
    variant, family, kind, start : str
    name : str
        All of it, for people.
    text : str
        TOML.
    """

    variant: str
    family: str
    kind: str
    start: str
    name: str
    text: str


def _with_realization(text: str, name: str) -> str:
    return text.replace('realization = "auto"', f'realization = "{name}"')


def _parallel(text: str, lines: str) -> str:
    return text.replace('architecture = "auto"', f'architecture = "parallel"\n{lines}')


def _recursive(name: str) -> Callable[[str, random.Random], str]:
    return lambda text, rng: _with_realization(text, name)


def _lanes(text: str, rng: random.Random) -> str:
    return _parallel(text, f"samples_per_clock = {rng.choice((2, 4, 8, 16))}")


def _look_ahead(text: str, rng: random.Random) -> str:
    return _parallel(text, f'pipeline = "look-ahead"\nsamples_per_clock = {rng.choice((1, 2, 4))}').replace(
        "clock = 1000.0", "clock = 1.0"
    )


def _decimated(text: str, rng: random.Random) -> str:
    text = text.replace('start = "zero"', 'start = "steady"')  # others cannot be had behind a decimator
    return text.replace("[filter]\n", f"[filter]\ndecimate = {rng.choice((2, 4, 8, 16))}\n")


def _calibrated(text: str, rng: random.Random) -> str:
    ports = "".join(
        f"[input.{name}]\nbits = {rng.randint(8, 14)}\nrange = [0.0, {top}]\n"
        for name, top in (("voltage", "10.0"), ("temperature", "128.0"))
    )
    table = "[calibration]\ncoefficients = [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]\n"
    text = re.sub(r"\[input\.x\]\n.*?(?=\[filter\])", ports + table, text, flags=re.DOTALL)
    output = f'[output]\nbits = {rng.randint(8, 14)}\nrange = [0.0, 16.0]\nunit = "mm"\nmax_error = "faithful"\n'
    return re.sub(r"\[output\]\n.*?(?=\[hardware\])", output, text, flags=re.DOTALL)


def _both(text: str, rng: random.Random) -> str:
    return _decimated(_calibrated(text, rng), rng)


def _given(text: str, rng: random.Random) -> str:
    """Give the sections themselves: poles anywhere in a disc, zeros too."""
    rows = []
    for _ in range(rng.randint(1, 3)):
        (r, c), (s, d) = ((rng.uniform(0.1, most), rng.uniform(-1, 1)) for most in (0.9, 1.0))
        rows.append(f"[{', '.join(f'{v:.6f}' for v in (0.25, -0.5 * s * d, 0.25 * s * s, 1.0, -2 * r * c, r * r))}]")
    return re.sub(r"(?<=\[filter\]\n).*?(?=\[output\])", f"sos = [{', '.join(rows)}]\n", text, flags=re.DOTALL)


def _sampled(text: str, rng: random.Random) -> str:
    return text.replace('method = "bilinear"', 'method = "impulse_invariant"')


VARIANTS: dict[str, Callable[[str, random.Random], str]] = {
    **{name: _recursive(name) for name in (*SECTIONS, *FIR)},
    "several samples a clock": _lanes,
    "look-ahead": _look_ahead,
    "decimator": _decimated,
    "calibration": _calibrated,
    "calibration and decimator": _both,
    "given sections": _given,
    "impulse_invariant": _sampled,
}
"""What a draw asks for beside a filter: a change of the specification's text."""


def drawn(seed: int, variant: str) -> Draw:
    """Draw a specification of a variant."""
    rng = random.Random(f"rocq {variant} {seed}")
    name, text = random_specification(seed, max_order=MAX_ORDER, lowest=LOWEST)
    family, kind = name.replace(",", "").split()[:2]
    start = rng.choice(STARTS)
    text = VARIANTS[variant](text.replace("[hardware]\n", f'[hardware]\nstart = "{start}"\n'), rng)
    if variant in FIR:
        family, kind = rng.choice(FIR_FAMILIES), rng.choice(KINDS)
        name = f"{family} {kind}"
        text = re.sub(r"(?<=\[filter\]\n).*?(?=\[output\])", _fir_table(rng, family, kind), text, flags=re.DOTALL)
    elif variant == "given sections":
        family, kind, name = "given", "sections", "given sections"
    start = "zero" if 'start = "zero"' in text else "steady"
    return Draw(variant, family, kind, start, f"{name}, {variant}, {start}", text)


def _fir_table(rng: random.Random, family: str, kind: str) -> str:
    low, width = rng.uniform(0.05, 0.2), rng.uniform(0.05, 0.2)
    one, other = [low], [0.5 - low if family == "halfband" else low + width]
    if kind in {"bandpass", "bandstop"}:
        top = rng.uniform(other[0] + 0.02, 0.4)
        one, other = [low, min(0.49, top + width)], [other[0], top]
    inside = kind in {"lowpass", "bandstop"}
    edges = {"passband_edge": one if inside else other, "stopband_edge": other if inside else one}
    lines = [f"{key} = [{', '.join(f'{edge:.4f}' for edge in ends)}]\n" for key, ends in edges.items()]
    head = f'family = "{family}"\nkind = "{kind}"\n'
    return "".join([head, *lines, "passband_loss = 0.5\nstopband_loss = 40.0\n"])


def designed(draw: Draw) -> Certificate | None:
    """Return the certificate of a draw; None if it cannot be met, or has a pole beyond `SLOWEST`."""
    try:
        spec = from_text(draw.text, Path("random.toml"))
        made = design_core(spec)
    except SosmithError:
        return None
    read = certificate(made.quantized, spec.max_error, online=made.architecture.online)
    return read if slowest_pole(read) < SLOWEST else None


def slowest_pole(certificate: Certificate) -> float:
    """Return the largest magnitude of the exact filter's poles; 0 without poles."""
    poles = [np.roots([float(value) for value in section.denominator]) for section in certificate.ideal.sections]
    return max((float(abs(pole)) for each in poles for pole in each), default=0.0)


def draws(count: int, done: Collection[str] = ()) -> Iterator[tuple[Draw, Certificate]]:
    """Draw designs that can be met: the variants in turn, then families, kinds and starts that had few turns yet.

    Those whose names are in `done` are drawn as well, so that the others are the same, and left out.
    """
    had, variants = Counter[str](), tuple(VARIANTS)
    for index in range(count):
        variant = variants[index % len(variants)]
        seeds = range(1000 * index, 1000 * index + _TRIES)
        candidates = [drawn(seed, variant) for seed in seeds]
        candidates.sort(key=lambda one: had[one.family] + had[one.kind] + had[one.start])
        for draw in candidates:
            made = designed(draw)
            if made is not None:
                had.update((draw.family, draw.kind, draw.start))
                if draw.name not in done:
                    yield draw, made
                break
