"""Inputs of a design by name: checked, broadcast to one shape, and converted to codes and traces."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike, fspath

import numpy as np
import numpy.typing as npt

from sosmith.gen.core import CoreDesign
from sosmith.model.arrays import Codes
from sosmith.model.errors import SpecificationError
from sosmith.model.suggestion import did_you_mean
from sosmith.model.traces.trace import Trace


def encoded(design: CoreDesign, inputs: Mapping[str, npt.ArrayLike]) -> Codes:
    """Return the codes nearest to physical values, shape (samples, inputs) or (samples, channels, inputs).

    Raises
    ------
    SpecificationError
        If an input is missing, unknown, not a number or not finite, or the shapes do not match.
    """
    columns = []
    for port, values in zip(design.datapath.inputs, _in_one_shape(design, inputs), strict=True):
        try:
            columns.append(port.encode(np.asarray(values, dtype=np.float64)))
        except (TypeError, ValueError) as error:
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
        if not np.issubdtype(values.dtype, np.integer):
            raise SpecificationError(f"codes of {port.name} must be integers, not {values.dtype}")
        if values.min() < port.lowest or values.max() > port.highest:
            found = f"{values.min()}..{values.max()}"
            raise SpecificationError(f"codes of {port.name} must be in {port.lowest}..{port.highest}, not {found}")
        columns.append(values.astype(np.int64))
    return np.stack(columns, axis=-1)


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

        source = default_scenario(design) if trace is None else fspath(trace)
        return traces_for(design, source, seed=seed, seconds=seconds)
    if seconds is not None:
        raise SpecificationError("seconds must come with the name of a built-in trace, not with arrays")
    codes, channels = encoded(design, trace), design.spec.channels
    ports, rate = design.datapath.inputs, design.spec.sample_rate
    if codes.ndim == 2:
        first = Trace(name="arrays", ports=ports, sample_rate=rate, codes=codes)
        return tuple(first.delayed(k) for k in range(channels))
    return tuple(Trace(name="arrays", ports=ports, sample_rate=rate, codes=codes[:, k]) for k in range(channels))


def _in_one_shape(design: CoreDesign, inputs: Mapping[str, npt.ArrayLike]) -> list[npt.NDArray[np.generic]]:
    """Return arrays of all inputs in the order of the ports, broadcast to (samples,) or (samples, channels)."""
    names = [port.name for port in design.datapath.inputs]
    for name in inputs:
        if name not in names:
            raise SpecificationError(f"the inputs must be {' and '.join(names)}, not {name}{did_you_mean(name, names)}")
    missing = [name for name in names if name not in inputs]
    if missing:
        raise SpecificationError(f"the inputs must be {' and '.join(names)}, not without {' and '.join(missing)}")
    try:
        arrays = np.broadcast_arrays(*(np.asarray(inputs[name]) for name in names))
    except ValueError:
        shapes = " and ".join(str(np.shape(inputs[name])) for name in names)
        raise SpecificationError(f"the inputs must have shapes that broadcast, not {shapes}") from None
    shape, channels = arrays[0].shape, design.spec.channels
    if len(shape) not in {1, 2} or not arrays[0].size or shape[1:] not in {(), (channels,)}:
        raise SpecificationError(f"the inputs must have the shape (samples,) or (samples, {channels}), not {shape}")
    return list(arrays)
