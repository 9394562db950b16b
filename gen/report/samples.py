"""The samples of a run as a page holds them, for its script to draw and to read out."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.gen.quantity import scale
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.largest_error import close_up, error_limits
from sosmith.gen.report.run import Array
from sosmith.model.reference.accuracy import peak

MAX_POINTS = 16_000
"""Samples that a page holds, at most; of a longer run, of each stretch the one with the largest error."""


def viewer_data(evidence: Evidence, transient: int) -> dict[str, Any]:
    """Return what the viewer needs, in the types of JSON; `evidence` is of one channel.

    Returns
    -------
    dict
        ``start`` and ``step``: time of sample 0 and between samples, in s. ``samples``: length of the run; ``stride``:
        samples of the run for each one kept. ``lsb`` and ``zero``: value = zero + lsb * code. ``index``, ``code``,
        ``error``, ``truth`` and ``unfiltered`` as `packed` makes them, the last two possibly None. ``value``,
        ``fine`` and ``true_error``: factor and unit in which values, errors and errors against the true value are
        shown. ``limits``: of the error, with their colours. ``focus``: first and last sample to show at first;
        ``transient``: samples to shade.
    """
    facts, run = evidence.facts, evidence.run
    # One column after the other: a run may have ten million samples.
    error = run.error
    index = _chosen(error)
    chosen = packed(error[index])
    del error
    unfiltered = None if run.before is None else packed(_at(run.unfiltered, index))
    near, (inside, _outside) = close_up(evidence), error_limits(evidence)
    start, end, samples = run.at(0), run.at(-1), len(run)
    apart = None if run.truth is None else _shown(run.minus(run.truth)[min(transient, samples - 1) :], facts.unit)
    return {
        "start": start,
        "step": (end - start) / max(samples - 1, 1),
        "samples": samples,
        "stride": -(-samples // MAX_POINTS),
        "lsb": facts.lsb,
        "zero": float(facts.output.zero),
        "index": packed(index.astype(np.float64), exact=True),
        "code": packed(run.received[index].astype(np.float64), exact=True),
        "error": chosen,
        "truth": None if run.truth is None else packed(run.truth[index]),
        "unfiltered": unfiltered,
        "value": _shown(run.hardware, facts.unit),
        "fine": list(scale(facts.error_bound or facts.lsb, facts.unit)),
        "true_error": apart,
        "limits": [[limit.value, limit.role] for limit in inside],
        "focus": [near.start, near.stop - 1],
        "transient": transient,
    }


def packed(values: Array, *, exact: bool = False) -> dict[str, Any]:
    """Pack numbers into unsigned integers: value = low + step * integer.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Finite numbers; whole ones below 2**32 apart if `exact`.
    exact : bool
        Whether the step is 1; else the span is divided into 65,535 steps.

    Returns
    -------
    dict
        ``low``, ``step``, ``bytes`` of an integer (2 or 4), and ``data``: the integers, lowest byte first, in Base64.
    """
    low, span = float(np.min(values)), float(np.ptp(values))
    step = 1.0 if exact or span == 0 else span / 65535
    size = 2 if span / step < 65536 else 4
    kind: npt.DTypeLike = "<u2" if size == 2 else "<u4"
    integers = np.rint((values - low) / step).astype(kind)
    return {"low": low, "step": step, "bytes": size, "data": base64.b64encode(integers.tobytes()).decode("ascii")}


def _chosen(error: Array) -> npt.NDArray[np.int64]:
    """Return the indices of the samples to hold: all, or of each stretch the first with the largest error."""
    samples = len(error)
    stride = -(-samples // MAX_POINTS)
    if stride == 1:
        return np.arange(samples)
    padded = np.full(-(-samples // stride) * stride, -1.0)
    np.abs(error, out=padded[:samples])
    chosen: npt.NDArray[np.int64] = np.arange(0, samples, stride) + padded.reshape(-1, stride).argmax(axis=1)
    return chosen


def _at(values: Array | None, index: npt.NDArray[np.int64]) -> Array:
    assert values is not None, "a filter has an input"
    return values[index]


def _shown(values: Array, unit: str) -> list[Any]:
    return list(scale(peak(values), unit))
