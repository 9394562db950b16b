"""Decimation filters whose largest gains are asked for."""

from tests.gen.filter.decimations import decimation, lowpass

from sosmith.gen.filter.decimation import Decimation, decimated
from sosmith.gen.filter.design import Filter

CASES = [
    ("butterworth", 7, 16, 4, "0.2587802"),
    ("butterworth", 1, 2, 3, "0.3"),
    ("chebyshev1", 4, 4, 2, "3"),
    ("chebyshev2", 5, 8, 3, "1"),
    ("elliptic", 8, 16, 5, "0.1"),
    ("bessel", 2, 8, 3, "1"),
]


def made(family: str, order: int, factor: int, stages: int, cutoff: str) -> tuple[Decimation, Filter]:
    found = decimation(factor, stages, cutoff)
    return found, decimated(lowpass(order, cutoff, family=family), found)
