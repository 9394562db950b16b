"""The frozen datapath: a chain of stages between ports, and its bit-true computation.

This object is the one source of truth: the software (`Datapath.compute`), the C model, the hardware
(`sosmith.hdl.cores.parallel`) and the manifest are made from the dataflow graphs of its stages alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Codes
from sosmith.model.dataflow.compiled import block_for
from sosmith.model.dataflow.downsampler import gathered
from sosmith.model.dataflow.status import Flag
from sosmith.model.dataflow.structure import Structure

_Kind = TypeVar("_Kind", bound=np.generic)

_OF_INPUT = 1 << Flag.INPUT_AT_RAIL | 1 << Flag.OUTSIDE_CALIBRATION
"""Flags of the inputs."""


@dataclass(frozen=True, kw_only=True)
class Datapath(Structure):
    """Stages in a chain that compute: the output port's codes from the input ports' codes.

    Attributes
    ----------
    calibration : Datapath or None
        As of a `Structure`, which has all other attributes.
    """

    calibration: Datapath | None = None

    def compute(self, codes: Codes) -> Codes:
        """Compute the output codes for input codes, from reset, bit for bit as the hardware does.

        The C model is compiled at the first call, which takes some tenths of a second.

        Parameters
        ----------
        codes : integer array, shape (samples, inputs) or (samples, channels, inputs)
            Input codes, each in its port's range.

        Returns
        -------
        int64 array, shape (samples,) or (samples, channels)
            Output codes; behind a decimator, as many as `results` says.

        Raises
        ------
        ValueError
            If the shape is wrong or a code is outside its port's range.
        ToolError
            If no C compiler is found.
        """
        checked = self._checked(codes)
        block = self._entering(checked[:, np.newaxis, :] if checked.ndim == 2 else checked)
        result, _ = block_for(self.behind_decimator, block.shape[0] * block.shape[1])(block)
        result = self._handed_on(result)
        return result[:, 0] if checked.ndim == 2 else result

    def compute_status(self, codes: Codes) -> npt.NDArray[np.uint8]:
        """Compute the status of each sample, from reset, bit for bit as the hardware does.

        Parameters, errors and the shape of the result are those of `compute`. If each channel has its own limits of
        wear, there must be as many channels. The bits are those of `sosmith.model.dataflow.status.Flag`.
        """
        return self.compute_with_status(codes)[1]

    def compute_with_status(self, codes: Codes) -> tuple[Codes, npt.NDArray[np.uint8]]:
        """Compute the output codes and the status of each sample in one pass; see `compute` and `compute_status`."""
        checked = self._checked(codes)
        block = checked[:, np.newaxis, :] if checked.ndim == 2 else checked
        if len(self.wear) not in {0, 1, block.shape[1]}:
            raise ValueError(
                f"codes must be of {len(self.wear)} channels, for each of which wear is judged, not {block.shape[1]}"
            )
        if self.decimator is None:
            filled = self._entering(block)
            result, status = block_for(self, filled.shape[0] * filled.shape[1])(filled, with_status=True)
            if self.downsampler is not None:
                _, flags = self._flagged(block)
                result, status = self._handed_on(result), self._handed_on(status)
                status &= ~np.uint8(_OF_INPUT)
                status |= _in_columns(partial(gathered, factor=self.downsampler.factor), flags)
        else:
            taken, flags = self._flagged(block)
            entering = _in_columns(self.decimator.compute, taken)[:, :, np.newaxis]
            behind = block_for(self.behind_decimator, entering.shape[0] * entering.shape[1])
            result, status = behind(entering, with_status=True)
            status &= ~np.uint8(_OF_INPUT)
            status |= _in_columns(self.decimator.gathered, flags)
        return (result[:, 0], status[:, 0]) if checked.ndim == 2 else (result, status)

    def compute_exact(self, codes: Codes) -> list[int]:
        """Compute one channel in exact integers, from reset, and check every node's range; slow.

        Raises
        ------
        RangeError
            If a value inside leaves the range that its node states.
        """
        states = [stage.graph.reset() for stage in self.stages]
        results = []
        taken = self._checked(codes)
        if self.decimator is not None:
            column = (
                taken[:, 0]
                if self.calibration is None
                else np.array(self.calibration.compute_exact(taken), dtype=np.int64)
            )
            taken = self.decimator.compute(column)[:, np.newaxis]
        elif self.downsampler is not None:
            taken = self.downsampler.preceded(taken)
        for sample in taken.tolist():
            wires = sample
            for stage, state in zip(self.stages, states, strict=True):
                wires = stage.graph.step(wires, state)
            results.append(wires[0])
        return results if self.downsampler is None else results[self.downsampler.filled :: self.downsampler.factor]

    def _flagged(self, block: Codes) -> tuple[Codes, npt.NDArray[np.uint8]]:
        """Codes that the decimator takes, and the flags of the inputs behind them; both (samples, channels)."""
        if self.calibration is not None:
            taken, flags = self.calibration.compute_with_status(block)
            return taken, flags & np.uint8(_OF_INPUT)
        taken, port = block[:, :, 0], self.inputs[0]
        at_rail = (taken == port.lowest) | (taken == port.highest)
        return taken, at_rail * np.uint8(1 << Flag.INPUT_AT_RAIL)

    def _entering(self, block: Codes) -> Codes:
        """Codes that the first stage takes, for input codes of shape (samples, channels, inputs)."""
        if self.downsampler is not None:
            return self.downsampler.preceded(block)
        if self.decimator is None:
            return block
        taken = block[:, :, 0] if self.calibration is None else self.calibration.compute(block)
        return _in_columns(self.decimator.compute, taken)[:, :, np.newaxis]

    def _handed_on(self, values: npt.NDArray[_Kind]) -> npt.NDArray[_Kind]:
        """Return what leaves of results at the rate of the stages, or of what is known of these."""
        down = self.downsampler
        return values if down is None else np.ascontiguousarray(values[down.filled :: down.factor])

    def _checked(self, codes: Codes) -> Codes:
        array = np.asarray(codes)
        if array.ndim not in {2, 3} or array.shape[-1] != len(self.inputs):
            raise ValueError(
                f"codes must have the shape (samples, {len(self.inputs)}) or "
                f"(samples, channels, {len(self.inputs)}), not {array.shape}"
            )
        if not np.issubdtype(array.dtype, np.integer):
            raise ValueError(f"codes must be integers, not {array.dtype}")
        for index, port in enumerate(self.inputs):
            column = array[..., index]
            if column.size and (column.min() < port.lowest or column.max() > port.highest):
                raise ValueError(
                    f"codes of {port.name} must be in {port.lowest}..{port.highest}, not {column.min()}..{column.max()}"
                )
        return array.astype(np.int64, copy=False)


def _in_columns(of: Callable[[npt.NDArray[Any]], npt.NDArray[_Kind]], block: npt.NDArray[Any]) -> npt.NDArray[_Kind]:
    """Apply a function to each column of `block`."""
    return np.stack([of(block[:, k]) for k in range(block.shape[1])], axis=1)
