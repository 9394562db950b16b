"""Structures of a decimation chain: which kinds of stages there are in which order, and by how much each decimates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from math import prod
from typing import NamedTuple

from sosmith.gen.specification.choices import MAX_DOWNSAMPLING

MAX_STAGES = 8
"""Most stages of a chain."""

_MOST_CIC, _MOST_FIR = 2, 3
"""Most CIC and FIR filters in a row; half-band filters between them are as many as there can be."""

_TITLES = {"cic": "CIC", "halfband": "half-band", "fir": "FIR", "iir": "IIR"}


class Step(NamedTuple):
    """A stage: ``every`` hands on some of the results of an IIR filter, which cannot decimate by itself."""

    kind: str
    factor: int


@dataclass(frozen=True)
class Structure:
    """Stages in the order of the samples."""

    steps: tuple[Step, ...]

    @property
    def family(self) -> tuple[str, ...]:
        """The kinds in order, each once where several of a kind follow each other."""
        return tuple(kind for kind, _ in groupby(step.kind for step in self.steps))

    @property
    def factor(self) -> int:
        """By how much it decimates."""
        return prod(step.factor for step in self.steps)

    def __str__(self) -> str:
        """Say what it is, with the factors of all but half-band filters: CIC 16, 2 half-bands, FIR 2.

        An IIR filter has that of the stage behind it, which takes its results apart.
        """
        texts = []
        for step, same in groupby(step for step in self.steps if step.kind != "every"):
            number = len(list(same))
            title = _TITLES[step.kind] if number == 1 else f"{number} {_TITLES[step.kind]}s"
            factor = self.steps[-1].factor if step.kind == "iir" else step.factor
            texts.append(title if step.kind == "halfband" or factor == 1 else f"{title} {factor}")
        return ", ".join(texts)


def structures(factor: int, most: int = MAX_STAGES) -> Iterator[Structure]:
    """Return the structures that decimate by `factor`, of at most so many stages.

    CIC filters first, as they cost least where samples are many, FIR filters that take any factor, half-band filters,
    and an FIR filter, which makes the pass band; or an IIR filter in its place.

    Examples
    --------
    >>> [str(each) for each in structures(4)][:4]
    ['FIR 4', '2 FIRs 2', 'half-band, FIR 2', 'half-band, IIR 2']
    """
    return (each for each in _structures(factor) if len(each.steps) <= most)


def _structures(factor: int) -> Iterator[Structure]:
    for cics in _powers(factor, _MOST_CIC):
        after_cic = factor // prod(cics)
        first = tuple(Step("cic", each) for each in cics)
        for halves in range(_twos(after_cic) + 1):
            half = (Step("halfband", 2),) * halves
            for firs in _products(after_cic >> halves, _MOST_FIR):
                *early, last = firs
                before = (*first, *(Step("fir", each) for each in early), *half)
                yield Structure((*before, Step("fir", last)))
                if not early and last == 2 and (cics or halves):
                    yield Structure((*before, Step("iir", 1), Step("every", 2)))
            if 1 << halves == after_cic:
                if halves and not cics:
                    yield Structure(half)
                if cics:
                    yield Structure((*first, *half, Step("fir", 1)))


def _twos(value: int) -> int:
    return (value & -value).bit_length() - 1


def _powers(factor: int, most: int) -> Iterator[tuple[int, ...]]:
    """Return falling powers of two in series, at most so many, whose product divides `factor`."""
    yield ()
    largest = min(_twos(factor), MAX_DOWNSAMPLING.bit_length() - 1)
    for exponent in range(1, largest + 1):
        yield (1 << exponent,)
        if most > 1 and exponent >= 3:
            for other in range(2, min(exponent, _twos(factor >> exponent)) + 1):
                yield (1 << exponent, 1 << other)


def _products(value: int, most: int, largest: int = MAX_DOWNSAMPLING) -> Iterator[tuple[int, ...]]:
    """Return falling factors from 2 on, at most so many, with this product."""
    if 2 <= value <= largest:
        yield (value,)
    if most > 1:
        for first in range(min(largest, value // 2), 1, -1):
            if value % first == 0:
                yield from ((first, *rest) for rest in _products(value // first, most - 1, first))
