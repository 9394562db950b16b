"""Cascades of stages in formats that a test states, their ranges proven; and their outputs bit for bit."""

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction

import numpy as np

from sosmith.gen.proof.cascade_proof import prove_cascade
from sosmith.gen.proof.linear_model import linear_model
from sosmith.gen.realizations.section_format import unknown_range
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import GraphBuilder, Range
from sosmith.model.dataflow.structure import Stage
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerStep

Ranges = Mapping[str, tuple[int, int]]
Build = Callable[[Range, Ranges], Stage]
"""Makes a stage for the format of its input (fraction bits, smallest and largest code), with the ranges known."""


def proven_cascade(builds: Sequence[Build], port: Port) -> list[Stage]:
    """Build stages one after the other, prove their ranges, and build them again with these."""
    entry = unknown_range(0)
    stages = []
    for build in builds:
        stages.append(build(entry, {}))
        entry = unknown_range(format_of(stages[-1]).frac)
    models = [linear_model(stage.graph) for stage in stages]
    exact = [(model.transfer, model.denominator) for model in models]
    proof = prove_cascade([(model,) for model in models], exact, Fraction(port.lowest), Fraction(port.highest))
    entry = Range(0, port.lowest, port.highest)
    result = []
    for build, stage, extents in zip(builds, stages, proof.nodes, strict=True):
        ranges = {}
        for index, extent in extents.items():
            node = stage.graph.nodes[index]
            unit = Fraction(2) ** node.frac
            ranges[node.name] = (math.floor(extent.low * unit), math.ceil(extent.high * unit))
        result.append(build(entry, ranges))
        entry = format_of(result[-1])
    return result


def format_of(stage: Stage) -> Range:
    """Format of a stage's output."""
    return stage.graph.output_ranges[0]


def datapath_of(stages: Sequence[Stage], port: Port) -> Datapath:
    """Datapath whose output codes are those of the last stage, bit for bit."""
    frac, low, high = format_of(stages[-1])
    g = GraphBuilder()
    last = HornerStep("code", g.build([g.shift(g.input("x", frac, low, high), frac)]))
    output = Port(name="y", bits=32, signed=True, lsb=Fraction(1), zero=Fraction(0))
    return Datapath(name="bits", inputs=(port,), output=output, stages=(*stages, last))


def run(stages: Sequence[Stage], port: Port, codes: np.ndarray) -> np.ndarray:
    """Output codes of the last stage for input codes, shape (samples,), by the compiled model."""
    return datapath_of(stages, port).compute(codes.reshape(-1, 1))
