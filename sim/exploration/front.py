"""The Pareto front of proven error against cost."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.sim.exploration.evaluation import Point


def pareto_front(points: Sequence[Point]) -> list[Point]:
    """Points that pass and that no other one beats: neither dearer nor with a larger bound, and better in one of both.

    Costs are compared only if they count the same and are of one architecture where they are not synthesized. Of points
    that are equal in both, the first stays. The order is that of rising cost within each kind of cost.
    """
    kinds: dict[tuple[str, str], list[Point]] = {}
    for point in points:
        if point["refused"] is None and point["passed"]:
            kinds.setdefault(cost_kind(point), []).append(point)
    front = []
    for kind in sorted(kinds):
        best = float("inf")
        for point in sorted(kinds[kind], key=lambda one: (one["cost"]["value"], one["error"]["bound"])):
            if point["error"]["bound"] < best:
                best = point["error"]["bound"]
                front.append(point)
    return front


def cost_kind(point: Point) -> tuple[str, str]:
    """Name what the cost counts, and the architecture if it matters to that."""
    architecture = "" if point["cost"]["source"] == "synthesis" else point["architecture"]
    return point["cost"]["unit"], architecture
