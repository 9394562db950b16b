"""Independent random generators by name, so that draws in one part of a model do not change those in another."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Streams = Callable[[str], np.random.Generator]
"""Maps a name to its random generator."""


def streams(seed: int, *scope: str) -> Streams:
    """Return the generators of a seed and scope: equal seed, scope and name give equal numbers.

    Parameters
    ----------
    seed : int
        Seed, 0 or more.
    *scope : str
        Prefix that separates equal names, such as ``"excerpt 2"``.
    """

    def stream(name: str) -> np.random.Generator:
        return np.random.default_rng([seed, *"/".join([*scope, name]).encode()])

    return stream


def one_stream(generator: np.random.Generator) -> Streams:
    """Return `generator` for every name, so that draws follow the order of the calls."""
    return lambda _: generator
