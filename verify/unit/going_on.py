"""Within how many clocks a unit takes a sample and gives its result, while the sink is ready: the longest ways."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from sosmith.verify.graph import require
from sosmith.verify.progress import Progress
from sosmith.verify.unit.control import Control, Step, apart, is_inside

_Place = tuple[int, int]
"""A state, and how many results have to leave until the one in question has."""


def progress(control: Control, clearing: int, digits: Callable[[int], int]) -> Progress:
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
            left = count - step.event.leaves
            yield clocks(step), None if not left else (step.after, left)

    longest = _longest([(number, 0) for number in range(len(control.nodes))], taking)
    taken = max(longest.values())
    accepted: list[_Place] = []
    for step in control.steps:
        if step.event.accepted and control.nodes[step.before].machine.begun:
            machine = control.nodes[step.after].machine
            accepted.append((step.after, 1 + apart(machine) + machine.waiting if is_inside(machine) else 1))
    ways = _longest(accepted, giving)
    return Progress(taken, max((ways[place] for place in accepted), default=0), clearing)


def _longest(
    places: Iterable[_Place], ways: Callable[[_Place], Iterable[tuple[int, _Place | None]]]
) -> dict[_Place, int]:
    """Return the most clocks that it takes from each place to its end.

    Raises
    ------
    RejectedError
        If a place leads to itself, or to nowhere.
    """
    found: dict[_Place, int] = {}
    opened: set[_Place] = set()
    waiting = list(places)
    while waiting:
        place = waiting[-1]
        if place in found:
            waiting.pop()
            continue
        steps = list(ways(place))
        missing = [after for _, after in steps if after is not None and after not in found]
        if missing:
            standing = opened.intersection(missing) or place in opened
            require(not standing, "a sample must be taken and its result leave within some number of clocks")
            opened.add(place)
            waiting += missing
            continue
        require(bool(steps), "a sample must be taken and its result leave within some number of clocks")
        found[place] = max(clocks + (0 if after is None else found[after]) for clocks, after in steps)
        opened.discard(place)
        waiting.pop()
    return found
