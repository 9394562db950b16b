"""Inputs of a design by name: checked, broadcast to one shape, and converted to codes and traces."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from numbers import Real
from os import PathLike
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.gen.core import CoreDesign
from sosmith.interface.arrays import number_array, real_numbers
from sosmith.interface.specification import path_of
from sosmith.model.arrays import Codes
from sosmith.model.errors import SpecificationError
from sosmith.model.suggestion import did_you_mean
from sosmith.model.traces.trace import Trace


def encoded(design: CoreDesign, inputs: Mapping[str, npt.ArrayLike]) -> Codes:
    """Return the codes nearest to physical values, shape (samples, inputs) or (samples, channels, inputs).

    Raises
    ------
    SpecificationError
        If an input is missing, unknown, masked, not a real number or not finite, or the shapes do not match.
    """
    columns = []
    for port, values in zip(design.datapath.inputs, _in_one_shape(design, inputs), strict=True):
        try:
            columns.append(port.encode(real_numbers(values, f"values of {port.name}")))
        except ValueError as error:
            raise SpecificationError(str(error)) from None
    return np.stack(columns, axis=-1)


def codes_of(design: CoreDesign, inputs: Mapping[str, npt.ArrayLike]) -> Codes:
    """Return integer codes unchanged, in the shape of `encoded`.

    Raises
    ------
    SpecificationError
        As `encoded`, or if a code is not an integer or is outside the range of its input.
    """
    columns = []
    for port, values in zip(design.datapath.inputs, _in_one_shape(design, inputs), strict=True):
        if not np.issubdtype(values.dtype, np.integer) and not _whole(values):
            raise SpecificationError(f"codes of {port.name} must be integers, not {values.dtype}")
        if values.min() < port.lowest or values.max() > port.highest:
            extremes = f"{values.min()}..{values.max()}"
            raise SpecificationError(f"codes of {port.name} must be in {port.lowest}..{port.highest}, not {extremes}")
        columns.append(values.astype(np.int64))
    return np.stack(columns, axis=-1)


def _whole(values: npt.NDArray[np.generic]) -> bool:
    """Whether an array of objects has integers only: those that are too long for the types of numpy."""
    return values.dtype.kind == "O" and all(type(value) is int for value in values.ravel().tolist())


def traces_of(
    design: CoreDesign,
    trace: str | PathLike[str] | Mapping[str, npt.ArrayLike] | None,
    *,
    seed: int,
    seconds: float | None,
) -> tuple[Trace, ...]:
    """Make a trace for each channel from arrays, a file or the name of a built-in trace.

    Raises
    ------
    SpecificationError
        As `encoded` and `sosmith.instrument.scenarios.traces.traces_for`.
    """
    if not isinstance(trace, Mapping):
        from sosmith.instrument.scenarios.traces import default_scenario, traces_for  # and with it all scenarios

        what = "the trace must be the name of one, a path, or arrays by the names of the inputs"
        source = default_scenario(design) if trace is None else path_of(trace, what)
        if seconds is not None and not isinstance(seconds, Real):
            raise SpecificationError(f"seconds must be a number, not {seconds!r}")
        return traces_for(design, source, seed=seed, seconds=seconds)
    if seconds is not None:
        raise SpecificationError("seconds must come with the name of a built-in trace, not with arrays")
    codes, channels = encoded(design, trace), design.spec.channels
    ports, rate = design.datapath.inputs, design.spec.sample_rate
    values = [real_numbers(each, "values") for each in _in_one_shape(design, trace)]

    def one(of: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> Trace:
        limited = tuple(port.outside(of(each)) for port, each in zip(ports, values, strict=True))
        return Trace(name="arrays", ports=ports, sample_rate=rate, codes=of(codes), limited=limited)

    if codes.ndim == 2:
        first = one(lambda array: array)
        return tuple(first.delayed(k) for k in range(channels))
    return tuple(one(lambda array, k=k: array[:, k]) for k in range(channels))  # type: ignore[misc]


def _in_one_shape(design: CoreDesign, inputs: Mapping[str, npt.ArrayLike]) -> list[npt.NDArray[np.generic]]:
    """Return arrays of all inputs in the order of the ports, broadcast to (samples,) or (samples, channels)."""
    names = [port.name for port in design.datapath.inputs]
    for name in inputs:
        if name not in names:
            raise SpecificationError(f"the inputs must be {' and '.join(names)}, not {name}{did_you_mean(name, names)}")
    missing = [name for name in names if name not in inputs]
    if missing:
        raise SpecificationError(f"the inputs must be {' and '.join(names)}, not without {' and '.join(missing)}")
    arrays = [number_array(inputs[name], f"values of {name}") for name in names]
    shapes = " and ".join(str(array.shape) for array in arrays)
    # A column of samples is the same for every channel; numpy would take it for a row of one value a channel.
    samples = {len(array) for array in arrays if array.ndim == 2}
    columns = [array[:, np.newaxis] if array.ndim == 1 and samples == {len(array)} else array for array in arrays]
    try:
        together = np.broadcast_arrays(*columns)
    except ValueError:
        raise SpecificationError(f"the inputs must have shapes that broadcast, not {shapes}") from None
    shape, channels = together[0].shape or (1,), design.spec.channels
    if len(shape) not in {1, 2} or shape[1:] not in {(), (channels,)}:
        raise SpecificationError(f"the inputs must have the shape (samples,) or (samples, {channels}), not {shapes}")
    if not shape[0]:
        raise SpecificationError("the inputs must have at least one sample, not none")
    return [array.reshape(shape) for array in together]
