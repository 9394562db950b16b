"""Recursive filters in double precision, to the last bit as `scipy.signal.lfilter` and `scipy.signal.sosfilt`.

Both are compiled functions of scipy with no need of anything else. To import `scipy.signal` for them would load
statistics, interpolation and more, which takes longer than everything else that a design loads. A scipy that keeps
them in other modules than that of 2026 is asked through `scipy.signal`, which gives the same numbers.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import cache
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_SECOND_ORDER = 6
"""Numbers in a row of second-order sections."""


def lfilter(numerator: npt.ArrayLike, denominator: npt.ArrayLike, values: npt.ArrayLike) -> Array:
    """Filter values by a rational transfer function, from rest.

    Parameters
    ----------
    numerator, denominator : array_like, shape (m,)
        Coefficients of 1, 1/z, 1/z^2 and so on.
    values : array_like, shape (samples,)

    Returns
    -------
    ndarray, shape (samples,)

    Examples
    --------
    >>> lfilter([1.0], [1.0, -0.5], [1.0, 0.0, 0.0]).tolist()
    [1.0, 0.5, 0.25]
    """
    b, a, x = (np.atleast_1d(np.asarray(given, dtype=np.float64)) for given in (numerator, denominator, values))
    if len(a) == 1:
        return np.asarray(np.convolve(b / a[0], x)[: len(x)], dtype=np.float64)
    return np.asarray(_recursion()(b, a, x), dtype=np.float64)


def sosfilt(sections: npt.ArrayLike, values: npt.ArrayLike, states: Array | None = None) -> Array:
    """Filter values by a cascade of sections, from rest or from where it was left.

    Parameters
    ----------
    sections : array_like, shape (sections, 2 * (order + 1))
        b0, b1, b2, 1, a1, a2 of each second-order section; of an FIR filter, its taps and as many of 1, 0, 0, ...
    values : array_like, shape (samples,)
    states : ndarray, shape (sections, order), optional
        Values of each section, zero at rest; the last ones are left there.

    Returns
    -------
    ndarray, shape (samples,)

    Examples
    --------
    >>> sosfilt([[1, 0, 0, 1, -0.5, 0], [2, 0, 0, 1, 0, 0]], [1.0, 0.0, 0.0]).tolist()
    [2.0, 1.0, 0.5]
    """
    sos = np.array(sections, dtype=np.float64)
    filtered = np.array(values, dtype=np.float64)
    if sos.shape[1] != _SECOND_ORDER:
        return _taken_through(sos, filtered, states)
    _cascade()(sos, filtered[np.newaxis], (np.zeros((len(sos), 2)) if states is None else states)[np.newaxis])
    return filtered


def dc_gain(sections: Array) -> float:
    """Gain of a cascade of sections at zero frequency.

    Examples
    --------
    >>> dc_gain(np.array([[1.0, 2.0, 1.0, 1.0, -0.5, 0.0]]))
    8.0
    """
    taps = sections.shape[1] // 2
    return float(np.prod(sections[:, :taps].sum(axis=1) / sections[:, taps:].sum(axis=1)))


def _taken_through(sections: Array, values: Array, states: Array | None) -> Array:
    """Filter values by a cascade of sections without poles, whose states are the latest values that each took."""
    taps = sections.shape[1] // 2
    if sections[:, taps + 1 :].any():
        raise ValueError(f"sections of {taps} taps must have no poles")
    for k, row in enumerate(sections):
        past = np.zeros(taps - 1) if states is None else states[k]
        known = np.concatenate([past, values])
        values = np.convolve(known, row[:taps] / row[taps], "valid") if len(values) else values
        if states is not None:
            states[k] = known[len(known) - taps + 1 :]
    return values


@cache
def _recursion() -> Callable[[Array, Array, Array], Array]:
    compiled: Callable[[Array, Array, Array], Array] | None = _compiled("_sigtools", "_linear_filter")
    if compiled is not None:
        return compiled
    from scipy import signal  # noqa: PLC0415

    return lambda b, a, x: np.asarray(signal.lfilter(b, a, x))


@cache
def _cascade() -> Callable[[Array, Array, Array], None]:
    """Return what filters the rows of its second argument in their place."""
    compiled: Callable[[Array, Array, Array], None] | None = _compiled("_sosfilt", "_sosfilt")
    if compiled is not None:
        return compiled
    from scipy import signal  # noqa: PLC0415

    def through(sos: Array, rows: Array, states: Array) -> None:
        rows[:], left = signal.sosfilt(sos, rows, zi=states.swapaxes(0, 1))
        states[:] = left.swapaxes(0, 1)

    return through


def _compiled(module: str, function: str) -> Any:
    """Return a compiled function of `scipy.signal` without the rest of it; None if it is not where it was."""
    name = f"scipy.signal.{module}"
    if name not in sys.modules:
        places: Sequence[str] = getattr(find_spec("scipy"), "submodule_search_locations", None) or ()
        spec = PathFinder.find_spec(name, [f"{place}/signal" for place in places])
        if spec is None or spec.loader is None:
            return None
        sys.modules[name] = loaded = module_from_spec(spec)  # an import of scipy.signal finds it there
        try:
            spec.loader.exec_module(loaded)
        except ImportError:
            del sys.modules[name]
    return getattr(sys.modules.get(name), function, None)
