"""Within how many clocks a unit takes a sample and gives its result, while the sink is ready: the longest ways."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

from sosmith.verify.graph import require
from sosmith.verify.progress import Progress
from sosmith.verify.unit.control import Control, Step, apart, is_inside


class Pace(NamedTuple):
    """How fast a unit is while the sink is ready.

    Attributes
    ----------
    progress : Progress
        Within how many clocks it takes a sample and gives its result.
    latency : int
        Most clocks from the edge at which a sample is found to the edge at which its result leaves.
    interval : int
        Most clocks from one sample to the next, if there always is one, of a channel that exists.
    opening : int
        Most clocks from the edge at which a sample is found to the one at which it is taken.
    """

    progress: Progress
    latency: int
    interval: int
    opening: int


_Place = tuple[int, int]
"""A state, and how many results have to leave until the one in question has."""


def pace(control: Control, clearing: int, digits: Callable[[int], int]) -> Pace:
    """Return the most clocks that things take.

    Parameters
    ----------
    control : Control
        All of its states have been visited.
    clearing : int
        Clocks after a reset until a sample can be taken.
    digits : callable
        Most clocks that an instruction stays in the last stage, by its number.

    Raises
    ------
    RejectedError
        If there is no such number.
    """
    following: list[list[Step]] = [[] for _ in control.nodes]
    for step in control.steps:
        if step.event.ready and step.event.advance:
            following[step.before].append(step)

    def clocks(step: Step) -> int:
        last = control.nodes[step.before].machine.pipe[-1]
        return 1 if last is None else digits(last)

    def taking(place: _Place) -> Iterable[tuple[int, _Place | None]]:
        for step in following[place[0]]:
            if step.event.offered:
                yield clocks(step), None if step.event.accepted else (step.after, 0)

    def giving(place: _Place) -> Iterable[tuple[int, _Place | None]]:
        node, count = place
        for step in following[node]:
            rest = count - step.event.leaves
            yield clocks(step), None if not rest else (step.after, rest)

    def beginning(place: _Place) -> Iterable[tuple[int, _Place | None]]:
        for step in following[place[0]]:
            refused = control.nodes[step.before].machine.refused or control.nodes[step.after].machine.refused
            if step.event.offered and not refused:
                yield clocks(step), None if step.event.begins else (step.after, 0)

    def left(step: Step) -> _Place:
        """Return the state after a clock, and how many results leave until that of the last sample has."""
        machine = control.nodes[step.after].machine
        return step.after, 1 + apart(machine) + machine.waiting if is_inside(machine) else 1

    begun = [step for step in control.steps if step.event.begins]
    accepted = [step for step in control.steps if step.event.accepted and control.nodes[step.before].machine.begun]
    everywhere = [(number, 0) for number in range(len(control.nodes))]
    return Pace(
        Progress(_most(everywhere, taking), _most(map(left, accepted), giving), clearing),
        _most(map(left, begun), giving),
        _most([(step.after, 0) for step in begun if step.event.ready], beginning),
        _most([(step.after, 0) for step in begun if not step.event.accepted], taking),
    )


def _most(places: Iterable[_Place], ways: Callable[[_Place], Iterable[tuple[int, _Place | None]]]) -> int:
    """Return the most clocks that it takes from any of the places to its end; 0 without places."""
    starts = list(places)
    longest = _longest(starts, ways)
    return max((longest[place] for place in starts), default=0)


def _longest(
    places: Iterable[_Place], ways: Callable[[_Place], Iterable[tuple[int, _Place | None]]]
) -> dict[_Place, int]:
    """Return the most clocks that it takes from each place to its end.

    Raises
    ------
    RejectedError
        If a place leads to itself, or to nowhere.
    """
    longest: dict[_Place, int] = {}
    opened: set[_Place] = set()
    waiting = list(places)
    while waiting:
        place = waiting[-1]
        if place in longest:
            waiting.pop()
            continue
        steps = list(ways(place))
        missing = [after for _, after in steps if after is not None and after not in longest]
        if missing:
            standing = opened.intersection(missing) or place in opened
            require(not standing, "a sample must be taken and its result leave within some number of clocks")
            opened.add(place)
            waiting += missing
            continue
        require(bool(steps), "a sample must be taken and its result leave within some number of clocks")
        longest[place] = max(clocks + (0 if after is None else longest[after]) for clocks, after in steps)
        opened.discard(place)
        waiting.pop()
    return longest
