"""The frozen datapath: a chain of stages between ports, and its bit-true computation.

This object is the one source of truth: the software (`Datapath.compute`), the C model, the hardware
(`sosmith.hdl.cores.parallel`) and the manifest are made from the dataflow graphs of its stages alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from sosmith.model.arrays import Codes
from sosmith.model.dataflow.compiled import block_for
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.dataflow.downsampler import Downsampler, gathered
from sosmith.model.dataflow.graph import Graph
from sosmith.model.dataflow.status import Flag
from sosmith.model.port import Port

_Kind = TypeVar("_Kind", bound=np.generic)

_OF_INPUT = 1 << Flag.INPUT_AT_RAIL | 1 << Flag.OUTSIDE_CALIBRATION
"""Flags of the inputs."""


class Stage(Protocol):
    """A part of a datapath: a name and a dataflow graph."""

    @property
    def name(self) -> str:
        """Name of the stage."""
        ...

    @property
    def graph(self) -> Graph:
        """What the stage computes."""
        ...


@dataclass(frozen=True, kw_only=True)
class Datapath:
    """Stages in a chain, from the input ports' codes to the output port's code.

    Inside, values are in output LSBs: 1.0 is one step of the output code.

    Attributes
    ----------
    name : str
        Name of the core.
    inputs : tuple of Port
        Input quantities, in the order of the first stage's inputs; with a decimator the one that it takes, or those of
        the calibration before it.
    output : Port
        Output quantity.
    stages : tuple of Stage
        At least one; the outputs of each are the inputs of the next.
    calibrated : tuple of (int, int)
        Lowest and highest code of each input that the calibration's measurements covered; by default, all codes.
    wear : tuple of (int, int)
        Lowest output codes at which the wear is a warning, and at which it is critical: one pair for all channels, or
        one for each; empty if wear is not judged.
    decimator : Decimator or None
        What stands before the first stage and hands on one sample out of several; None if all go in.
    calibration : Datapath or None
        What stands before the decimator, at the rate of the input, and whose output that takes. None if it takes the
        input itself.
    downsampler : Downsampler or None
        What hands on one result out of several behind the last stage; None if all leave. Not beside a decimator.
    """

    name: str
    inputs: tuple[Port, ...]
    output: Port
    stages: tuple[Stage, ...]
    calibrated: tuple[tuple[int, int], ...] = ()
    wear: tuple[tuple[int, int], ...] = ()
    decimator: Decimator | None = None
    calibration: Datapath | None = None
    downsampler: Downsampler | None = None

    def __post_init__(self) -> None:
        if not self.calibrated:
            object.__setattr__(self, "calibrated", tuple((port.lowest, port.highest) for port in self.inputs))
        if self.decimator is not None and self.downsampler is not None:
            raise ValueError("downsampler must be left out behind a decimator")
        first, last = self.stages[0].graph, self.stages[-1].graph
        if self.calibration is not None:
            self._check_calibration(self.calibration)
        elif self.decimator is not None and self.inputs != (self.decimator.input,):
            raise ValueError(f"inputs must be what the decimator takes, {self.decimator.input}, not {self.inputs}")
        ports = [(port.lowest, port.highest) for port in self.entry]
        expected = [(first.nodes[i].low, first.nodes[i].high) for i in first.inputs]
        if ports != expected:
            raise ValueError(f"input ports must have the ranges {expected}, not {ports}")
        for before, after in zip(self.stages, self.stages[1:], strict=False):
            _check_seam(before, after)
        if len(last.outputs) not in {1, 2}:
            raise ValueError(f"the last stage must have one output, or a flag beside it, not {len(last.outputs)}")
        node = last.nodes[last.outputs[0]]
        if node.frac != 0 or node.low < self.output.lowest or node.high > self.output.highest:
            raise ValueError(f"the last stage's output must fit the output port, not {node!r}")
        for warning, critical in self.wear:
            if not self.output.lowest < warning < critical <= self.output.highest:
                raise ValueError(
                    f"wear must be codes that rise within {self.output.lowest + 1}..{self.output.highest}, "
                    f"not {warning}, {critical}"
                )

    def _check_calibration(self, calibration: Datapath) -> None:
        if self.decimator is None:
            raise ValueError("calibration must be left out where there is no decimator")
        if calibration.output != self.decimator.input:
            raise ValueError(
                f"calibration must give what the decimator takes, {self.decimator.input}, not {calibration.output}"
            )
        taken = self.inputs, self.calibrated
        if (calibration.inputs, calibration.calibrated) != taken:
            raise ValueError(
                f"calibration must take the inputs, {taken}, not {(calibration.inputs, calibration.calibrated)}"
            )
        if calibration.decimator is not None or any(stage.graph.delays for stage in calibration.stages):
            raise ValueError(
                "calibration must be without memory, which one sample alone fills, and without a decimator"
            )

    @property
    def entry(self) -> tuple[Port, ...]:
        """The quantities that the first stage takes: `inputs`, or what the decimator makes of them."""
        return self.inputs if self.decimator is None else (self.decimator.output,)

    @property
    def behind_decimator(self) -> Datapath:
        """The datapath at the lower rate, without the decimator; itself if it has none."""
        if self.decimator is None:
            return self
        return replace(self, inputs=self.entry, calibrated=(), decimator=None, calibration=None)

    @property
    def result_range(self) -> tuple[int, int]:
        """Lowest and highest code that can leave, which need not fill the output port."""
        last = self.stages[-1].graph
        node = last.nodes[last.outputs[0]]
        return node.low, node.high

    @property
    def decimated_range(self) -> tuple[int, int]:
        """Lowest and highest code that the decimator can take, or the first input where there is none."""
        if self.calibration is not None:
            return self.calibration.result_range
        return self.inputs[0].lowest, self.inputs[0].highest

    @property
    def samples_per_result(self) -> int:
        """Samples of a channel for each result: the first one brings one, and then every so many of them."""
        lowers = self.decimator or self.downsampler
        return 1 if lowers is None else lowers.factor

    def results(self, samples: int) -> int:
        """Count the results of so many samples of a channel."""
        return -(-samples // self.samples_per_result)

    @property
    def settles(self) -> bool:
        """Whether samples before the filter has settled are flagged: the last stage's second output, -1 for those."""
        return len(self.stages[-1].graph.outputs) > 1

    @property
    def restarts(self) -> bool:
        """Whether hardware into which other constants are loaded restarts with them: if it judges wear by its states.

        A swap that keeps the states is a step, and what the filter makes of that is not the wear.
        """
        return bool(self.wear) and any(stage.graph.delays for stage in self.stages)

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


def _check_seam(before: Stage, after: Stage) -> None:
    sources = [before.graph.nodes[i] for i in before.graph.outputs]
    sinks = [after.graph.nodes[i] for i in after.graph.inputs]
    if len(sources) != len(sinks):
        raise ValueError(f"{after.name} must have {len(sources)} inputs, not {len(sinks)}")
    for source, sink in zip(sources, sinks, strict=True):
        if source.frac != sink.frac or source.low < sink.low or source.high > sink.high:
            raise ValueError(f"input {sink.name} of {after.name} must hold {source!r}, not {sink!r}")
