"""Independent random generators by name, so that what one part draws never shifts the numbers of another."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Streams = Callable[[str], np.random.Generator]
"""Gives the generator of a name."""


def streams(seed: int, *scope: str) -> Streams:
    """Make the generators of one seed and scope; the same seed, scope and name give the same numbers.

    Parameters
    ----------
    seed : int
        0 or more.
    *scope : str
        What the names belong to, such as ``"excerpt 2"``.
    """

    def stream(name: str) -> np.random.Generator:
        return np.random.default_rng([seed, *"/".join([*scope, name]).encode()])

    return stream


def one_stream(generator: np.random.Generator) -> Streams:
    """Give `generator` for every name: the draws come in the order of the calls."""
    return lambda _: generator
