"""The Pareto front of proven error against cost."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.sim.exploration.evaluation import Point


def pareto_front(points: Sequence[Point]) -> list[Point]:
    """Points that pass and that no other one beats: neither dearer nor with a larger bound, and better in one of both.

    Costs are compared only if they count the same and are of as many samples a clock. Of points that are equal in both,
    the first stays. The order is that of rising cost within each kind of cost.
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
    """Name what the cost counts, and what else must be the same for costs to be compared: the rate.

    Several samples a clock are asked for where one of them is too slow, at a multiple of its cost. Estimates of an
    earlier version, which do not tell for which FPGA, are of one architecture each.
    """
    known = point["cost"]["source"] == "synthesis" or "device" in point["cost"]
    lanes = point.get("samples_per_clock", 1)  # points of an earlier version do not tell
    parts = ["" if known else point["architecture"], f"{lanes} samples a clock" if lanes > 1 else ""]
    return point["cost"]["unit"], ", ".join(filter(None, parts))
