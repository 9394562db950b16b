"""The way of a sample through stages in a pipeline that moves as one.

::

    valid, codes --> stage --> stage -- .. --> stage --> valid, codes
                       ^         ^               ^
    advance -----------+---------+---------------+
                       v         v               v
    status --------> [status1] [status2]  ..  [statusN] --> status     one register for each clock

Latency: that of the stages; `delayed` takes as many clocks as it is asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from amaranth.hdl import Const, Module, Signal, Value
from amaranth.lib import wiring

from sosmith.hdl.status import NEVER


class Sample(NamedTuple):
    """What goes through a pipeline with the codes of a sample.

    Attributes
    ----------
    valid : Value
        Whether there is a sample.
    bank : Value or None
        Bank of constants that it uses; None if there is only one.
    fault : Value
        Whether a wrong bit was found for it.
    channel : Value
        Its channel; no bits if there is only one.
    scrub : Value
        Whether there is a scrub in place of a sample.
    """

    valid: Value
    bank: Value | None = None
    fault: Value = NEVER
    channel: Value = Const(0, 0)
    scrub: Value = NEVER


class NamedStage(Protocol):
    """A component with the name of its stage, and those of the nodes at its outputs ``o0``, ``o1``, .."""

    name: str
    outputs: list[str]

    @property
    def signature(self) -> wiring.Signature:
        """Its ports."""
        ...


def through(
    m: Module, stages: Sequence[NamedStage], sample: Sample, codes: Sequence[Value]
) -> tuple[Sample, list[Value]]:
    """Connect stages one behind the other.

    Parameters
    ----------
    m : Module
        Where the stages are.
    stages : sequence of Component
        Those of `sosmith.hdl.stages`. What a sample has beside its codes goes through a stage that takes it, and past
        one that does not. So do the last codes, if a stage has fewer inputs: what is the same for all samples to come.
    sample, codes : Sample, sequence of Value
        What comes in.

    Returns
    -------
    sample, codes : Sample, list of Value
        What is behind the last stage.
    """
    codes = list(codes)
    for stage in stages:
        members = stage.signature.members
        beside = {
            name: value for name, value in sample._asdict().items() if value is not None and f"i_{name}" in members
        }
        taken = [(f"i{k}", code) for k, code in enumerate(codes) if f"i{k}" in members]
        m.d.comb += [getattr(stage, name).eq(code) for name, code in taken]
        m.d.comb += [getattr(stage, f"i_{name}").eq(value) for name, value in beside.items()]
        sample = sample._replace(**{name: _named(m, stage, getattr(stage, f"o_{name}"), name) for name in beside})
        given = [_named(m, stage, getattr(stage, f"o{k}"), name) for k, name in enumerate(stage.outputs)]
        codes = [*given, *codes[len(taken) :]]
    return sample, codes


def _named(m: Module, stage: NamedStage, output: Value, name: str) -> Signal:
    """Return what leaves a stage as a net with a name of its own: that of the stage, and what it is."""
    net = Signal(output.shape(), name=f"{stage.name}_{name}")
    m.d.comb += net.eq(output)
    return net


def delayed(m: Module, advance: Value, value: Value, clocks: int, name: str) -> Value:
    """Return a value so many clocks of the pipeline later; it is not reset."""
    for k in range(clocks):
        later = Signal(len(value), name=f"{name}{k + 1}", reset_less=True)
        with m.If(advance):
            m.d.sync += later.eq(value)
        value = later
    return value
