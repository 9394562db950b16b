"""Worst-case inputs: those that maximize a filter's output, or the response of an error path to it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sosmith.gen.stimuli.run import MAX_SAMPLES, MIN_SAMPLES, Bench, Emulated, Run
from sosmith.model.arrays import Codes, Values
from sosmith.model.polynomial import Polynomial

STRONG_PART = 0.999
"""Share of the sum of an impulse response's magnitudes that is kept; the rest is a long tail."""


def sign_matched(response: Values) -> npt.NDArray[np.bool_]:
    """Return at which samples an input must be at its high end to maximize the output with this impulse response.

    The pattern follows the signs of the reversed response, so that at its last sample every term ``h[k] x[n - k]`` is
    at its maximum. The same pattern with low and high exchanged follows.

    Parameters
    ----------
    response : ndarray, shape (n,)

    Returns
    -------
    ndarray of bool, shape (2 n,)
    """
    towards_high = (response >= 0)[::-1]
    return np.concatenate([towards_high, ~towards_high])


def worst_cases(run: Run, responses: Sequence[Values]) -> Emulated:
    """Repeat the patterns of `responses` in turn, at the extreme codes; long responses lose their tails."""
    low, high = _extreme_codes(run.bench)
    most = max(run.samples // (2 * len(responses)), 1)
    pattern = np.concatenate([sign_matched(response[:most]) for response in responses])
    return Emulated(np.where(np.resize(pattern, run.samples)[:, np.newaxis], high, low))


def worst_cases_samples(responses: Sequence[Values]) -> int:
    """Return the number of samples in which `worst_cases` completes every pattern."""
    patterns = 2 * len(responses) * max(map(len, responses))
    return min(patterns * math.ceil(MIN_SAMPLES / patterns), MAX_SAMPLES)


def _strong(response: Values) -> Values:
    """Return the beginning of a response, up to `STRONG_PART` of the sum of its magnitudes."""
    so_far = np.cumsum(np.abs(response))
    return response[: int(np.searchsorted(so_far, STRONG_PART * so_far[-1])) + 1]


def all_responses(bench: Bench) -> list[Values]:
    """Return the responses to the input and to every quantizer, each without its long tail."""
    return [_strong(response) for response in (bench.impulse_response, *bench.error_responses)]


def _extreme_codes(bench: Bench) -> tuple[Codes, Codes]:
    """Return the input codes, shape (n_inputs,), that give the lowest and the highest filter input."""
    if bench.polynomial is None:
        return np.array([bench.ports[0].lowest]), np.array([bench.ports[0].highest])
    return _lowest_codes(bench, bench.polynomial, 1.0), _lowest_codes(bench, bench.polynomial, -1.0)


def _lowest_codes(bench: Bench, polynomial: Polynomial, sign: float) -> Codes:
    """Return the codes that minimize ``sign * polynomial``: on a grid over all codes, then on finer grids.

    With 257 points per axis, the first grid separates the valleys of a low-order polynomial.
    """
    low = np.array([port.lowest for port in bench.ports])
    high = np.array([port.highest for port in bench.ports])
    first, last = low, high
    while True:
        axes = [np.unique(np.linspace(a, b, 257).round().astype(np.int64)) for a, b in zip(first, last, strict=True)]
        grid = np.meshgrid(*axes, indexing="ij")
        values = sign * polynomial(*(port.decode(codes) for port, codes in zip(bench.ports, grid, strict=True)))
        best = int(np.argmin(values))
        codes = np.array([axis.flat[best] for axis in grid])
        step = np.array([np.diff(axis).max(initial=1) for axis in axes])
        if np.all(step == 1):
            return codes
        first, last = np.maximum(codes - step, low), np.minimum(codes + step, high)
