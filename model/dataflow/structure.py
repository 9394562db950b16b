"""What a frozen datapath consists of: a chain of stages between ports, and what follows from it without computing.

The C model (`sosmith.model.dataflow.c_model`) and what compiles it are made from this; `Datapath` computes with them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, Self

from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.dataflow.downsampler import Downsampler
from sosmith.model.dataflow.graph import Graph
from sosmith.model.port import Port


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
class Structure:
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
    calibration : Structure or None
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
    calibration: Structure | None = None
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

    def _check_calibration(self, calibration: Structure) -> None:
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
    def behind_decimator(self) -> Self:
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

    @property
    def fill(self) -> int:
        """Times that the first sample goes in before it counts, where all results leave; 0 for none."""
        down = self.downsampler
        return down.filled if down is not None and down.factor == 1 else 0

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


def _check_seam(before: Stage, after: Stage) -> None:
    sources = [before.graph.nodes[i] for i in before.graph.outputs]
    sinks = [after.graph.nodes[i] for i in after.graph.inputs]
    if len(sources) != len(sinks):
        raise ValueError(f"{after.name} must have {len(sources)} inputs, not {len(sinks)}")
    for source, sink in zip(sources, sinks, strict=True):
        if source.frac != sink.frac or source.low < sink.low or source.high > sink.high:
            raise ValueError(f"input {sink.name} of {after.name} must hold {source!r}, not {sink!r}")
