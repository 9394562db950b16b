"""Whose sample the flags of a result are of: followed through all states, beside the control.

Samples are counted backwards from the last one that has begun, which is 0. A register of flags is of a sample once it
has taken over its inputs, and for outside_calibration, once all instructions of that sample that judge it have done so.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sosmith.verify.graph import require
from sosmith.verify.program.text import ProgramText
from sosmith.verify.unit.control import Control, Event, Machine, apart, is_inside
from sosmith.verify.unit.output import Output


class _Ages(NamedTuple):
    """The samples that flags are of; None if that is not known. `outside` has been judged `judged` times."""

    rail: int | None = None
    outside: int | None = None
    judged: int = 0
    settling: int | None = None
    copied: int | None = None

    def older(self) -> _Ages:
        """Return the same once another sample has begun."""
        samples = {name: each for name, each in self._asdict().items() if name != "judged" and each is not None}
        return self._replace(**{name: each + 1 for name, each in samples.items()})


def check_order(control: Control, program: ProgramText, output: Output) -> None:
    """Check that a result leaves with the flags of its sample.

    Raises
    ------
    RejectedError
        If it may leave with those of another one.
    """
    judging = [
        number
        for number, instruction in enumerate(program.instructions)
        if instruction.end == "judge" and not (output.settles and instruction.target % 2)
    ]
    following: list[list[tuple[int, Event]]] = [[] for _ in control.nodes]
    for step in control.steps:
        following[step.before].append((step.after, step.event))
    seen = {(0, _Ages())}
    waiting = [(0, _Ages())]
    while waiting:
        number, ages = waiting.pop()
        machine = control.nodes[number].machine
        if machine.waiting:
            _check_result(apart(machine) + 1 if is_inside(machine) else 0, ages, output, len(judging))
        for after, event in following[number]:
            now = _after(ages, machine, event, output, judging)
            if (after, now) not in seen:
                seen.add((after, now))
                waiting.append((after, now))


def _check_result(sample: int, ages: _Ages, output: Output, judging: int) -> None:
    if output.copies:
        require(ages.copied == sample, "the flags of a result must be those of its sample")
        return
    _check_inputs(sample, ages, output, judging)


def _check_inputs(sample: int, ages: _Ages, output: Output, judging: int) -> None:
    require(ages.rail == sample, "input_at_rail of a result must be that of its sample")
    complete = (ages.outside, ages.judged) == (sample, judging) or not judging
    require(complete, "outside_calibration of a result must be that of its sample")
    require(not output.settles or ages.settling == sample, "settling of a result must be that of its sample")


def _after(ages: _Ages, machine: Machine, event: Event, output: Output, judging: Sequence[int]) -> _Ages:
    """Return the samples that flags are of after a clock."""
    sample, judges = apart(machine), output.judges(machine, event)
    now = ages
    if judges == "outside":
        position = judging.index(machine.pipe[-1] or 0)
        require(
            (ages.outside, ages.judged) == (sample, position), "outside must be judged after its sample has been taken"
        )
        now = now._replace(judged=position + 1)
    elif judges is not None:
        now = now._replace(settling=sample)
    if event.ends and output.copies:
        _check_inputs(sample, ages, output, len(judging))
        now = now._replace(copied=sample)
    if event.begins:
        now = now.older()
    if output.samples_inputs(event):
        now = now._replace(rail=0, outside=0, judged=0)
    return now
