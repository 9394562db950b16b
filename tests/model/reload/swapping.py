"""The exact reference of a reloadable core: datapaths that take over from one another between two samples."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.model.arrays import Codes
from sosmith.model.dataflow.datapath import Datapath


def compute_swapping(first: Datapath, swaps: Sequence[tuple[int, Datapath]], codes: Codes) -> list[int]:
    """Compute one channel in exact integers, from reset.

    Each datapath starts from the states of the one before or, if it `restarts`, from reset.

    Parameters
    ----------
    first : Datapath
        The datapath that the core starts with.
    swaps : sequence of (int, Datapath)
        The other datapaths, and the first sample of each, counted from 0; ascending. Of several at the same sample, the
        last one counts.
    codes : integer array, shape (samples, inputs)
        Input codes.

    Returns
    -------
    list of int
        Output codes.

    Raises
    ------
    ValueError
        If the states of a datapath differ from those of the one before in name or fraction bits.
    RangeError
        If a value inside leaves the range that its node states.
    """
    states = [stage.graph.reset() for stage in first.stages]
    pending = list(swaps)
    active, results = first, []
    for number, sample in enumerate(codes.tolist()):
        while pending and pending[0][0] <= number:
            _, new = pending.pop(0)
            if _states(new) != _states(active):
                raise ValueError(f"states must be {_states(active)}, not {_states(new)}")
            active = new
            if active.restarts:
                states = [stage.graph.reset() for stage in active.stages]
        wires = sample
        for stage, state in zip(active.stages, states, strict=True):
            wires = stage.graph.step(wires, state)
        results.append(wires[0])
    return results


def _states(datapath: Datapath) -> list[tuple[str, str, int]]:
    return [
        (stage.name, stage.graph.nodes[i].name, stage.graph.nodes[i].frac)
        for stage in datapath.stages
        for i in stage.graph.delays
    ]
