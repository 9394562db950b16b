"""What each stage of the C model computes, takes from the stage before, and keeps from sample to sample."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sosmith.model.dataflow.c_types import TYPES, Span, bits_of, signed_width, wire
from sosmith.model.dataflow.graph import Graph, Node
from sosmith.model.dataflow.signals import Floor, Root, Signal, StageSums, Sum


class StagePlan:
    """The signals of a stage by where they come from.

    Parameters
    ----------
    index : int
        Number of the stage.
    graph : Graph
    signals : sequence of Signal
        Those of its nodes.
    sums : StageSums
    wanted : sequence of int
        Nodes that are taken from it.
    before : StagePlan or None
        The stage before it, which then hands on what this one takes.

    Attributes
    ----------
    needed : dict of Signal to None
        All that have a name, in no order.
    taken : set of Signal
        What the stage before hands on.
    states : list of Signal
        What is kept, as it is read a sample later.
    handed_on : list of Signal
        What the next stage takes, or is wanted of the last.
    scales : dict of Root to int
        Exponents of the powers of two that sums are kept times.
    """

    def __init__(
        self,
        index: int,
        graph: Graph,
        signals: Sequence[Signal],
        sums: StageSums,
        wanted: Sequence[int],
        before: StagePlan | None,
    ) -> None:
        self.index, self.graph, self.signals, self.sums, self.before = index, graph, signals, sums, before
        self.needed: dict[Signal, None] = {}
        self.taken: set[Signal] = set()
        self.states: list[Signal] = []
        self.scales: dict[Root, int] = {}
        self._of_kept: set[Signal] = set()
        self.handed_on = list(dict.fromkeys(signals[i] for i in wanted))
        for each in self.handed_on:
            self._need(each)
        while floors := self._open_floors():
            self._settle(floors[0])
        if before is not None:
            before.handed_on = [each for each in before.needed if each in self.taken]

    def node(self, signal: Signal) -> Node:
        """Return the node whose name a signal has."""
        return self.graph.nodes[self.sums.nodes[signal]]

    def scale(self, signal: Signal) -> int:
        """Return the exponent of the power of two that a signal is kept times."""
        return self.scales.get(signal.root, 0)

    def values(self, signal: Signal) -> Span:
        """Return the range of a signal as it is kept."""
        node, scale = self.node(signal), self.scale(signal)
        return Span(node.low << scale, node.high << scale)

    def name(self, signal: Signal) -> str:
        """Return the name of a signal in the text."""
        scale = self.scale(signal)
        return wire(self.index, self.sums.nodes[signal]) + (f"s{scale}" if scale else "")

    def members(self) -> list[tuple[str, str]]:
        """Type and name of what is handed on."""
        return [(TYPES[bits_of(self.node(each))], self.name(each)) for each in self.handed_on]

    def sources(self, signal: Signal) -> list[Signal]:
        """Return what a signal is computed from in this sample; nothing if it is taken or read."""
        if signal in self.taken or signal in self.states:
            return []
        if signal in self.sums.sums:
            return list(self.sums.sums[signal].terms)
        return self._operands(signal)

    def operation(self, signal: Signal) -> Node:
        """Return the node that computes a signal of this stage which is no sum and no floor."""
        assert isinstance(signal.root, tuple)
        assert not isinstance(signal.root, Floor)
        return self.graph.nodes[signal.root[1]]

    def _operands(self, signal: Signal) -> list[Signal]:
        if isinstance(signal.root, Floor):
            return [self.floored(signal)]
        return [self.signals[i] for i in self.operation(signal).operands]

    @staticmethod
    def floored(signal: Signal) -> Signal:
        """Return what a signal is the floor of."""
        assert isinstance(signal.root, Floor)
        return Signal(signal.root.of, signal.delay)

    @staticmethod
    def stored(signal: Signal) -> Signal:
        """Return what is stored for a signal that is kept."""
        return Signal(signal.root, signal.delay - 1)

    def _need(self, signal: Signal) -> None:
        """Note a signal, and what it is computed from."""
        waiting = [signal]
        while waiting:
            each = waiting.pop()
            if each not in self.needed:
                self.needed[each] = None
                waiting += self._further(each)

    def _further(self, signal: Signal) -> Iterable[Signal]:
        """Return what else is needed for a signal."""
        if self.before is not None and signal in self.before.needed:
            self.taken.add(signal)
            return []
        if signal in self.sums.sums:
            return self.sums.sums[signal].terms
        if isinstance(signal.root, Floor) and signal.delay:
            return []  # comes later: it depends on what else is needed
        if signal.delay:
            self.states.append(signal)
            return [self.stored(signal)]
        return self._operands(signal)

    def _open_floors(self) -> list[Signal]:
        """Return the floors of earlier sums of which it is not known where they come from, the inner ones first."""
        floors = [
            each
            for each in self.needed
            if isinstance(each.root, Floor)
            and each.delay
            and each not in self.taken
            and each not in self.states
            and each not in self._of_kept
        ]
        return sorted(floors, key=lambda each: (_depth(each.root), -each.delay))

    def _settle(self, floor: Signal) -> None:
        """Compute a floor of an earlier sum from that if it is at hand, or keep it in a word of its own."""
        source = self.stored(floor)
        if self.floored(floor) not in self.needed and source in self.sums.nodes:
            self.states.append(floor)
            self._need(source)
        else:
            self._of_kept.add(floor)
            self._need(self.floored(floor))

    def width(self) -> int:
        """Return the bits that hold all sums on the way to them, none of them times a power of two."""
        return max((self._width(self.sums.sums[each], 0) for each in self.needed if each in self.sums.sums), default=1)

    def choose_scales(self) -> None:
        """Keep sums of 64 bits so that their most frequent floor is their upper word, as far as all uses allow it."""
        for signal in self.sums.sums:
            if signal in self.needed and bits_of(self.node(signal)) == 64:
                places = [
                    each.root.bits
                    for each in self.needed
                    if isinstance(each.root, Floor) and each.root.of == signal.root and each not in self.taken
                ]
                place = max(places, key=lambda k: (places.count(k), k), default=0)
                if 0 < place < 32:
                    self.scales[signal.root] = 32 - place
        while bad := [root for root in self.scales if not self._may_be_scaled(root)]:
            for root in bad:
                del self.scales[root]

    def _may_be_scaled(self, root: Root) -> bool:
        kept = [each for each in self.needed if each.root == root]
        if any(each in self.handed_on or signed_width(*self.values(each)) > 64 for each in kept):
            return False
        return all(self._takes_scaled(signal, root) for signal in self.needed)

    def _takes_scaled(self, signal: Signal, root: Root) -> bool:
        """Whether what computes a signal can take a root times its power of two."""
        if signal in self.taken or signal in self.states or isinstance(signal.root, Floor):
            return True
        whole = self.sums.sums.get(signal)
        if whole is None:
            return all(each.root != root for each in self.sources(signal))
        own, rest = self.scale(signal), (1 << self.scales[root]) - 1
        if any((value << own) & rest for each, value in whole.terms.items() if each.root == root):
            return False
        if signal.root != root:
            return True
        factors = [(each, factor << own) for each, factor in whole.terms.items() if each.root != root]
        if any(bits_of(self.node(each)) > 32 or not _is_short(factor) for each, factor in factors):
            return False  # then the sum would cost more than its floor is worth
        return self._width(whole, own) <= 64

    def _width(self, whole: Sum, scale: int) -> int:
        """Return the bits that hold each term of a sum and all on the way to it, in any order."""
        ends = [part for each, value in whole.terms.items() for part in term_ranges(self, each, value, scale)]
        constant = whole.constant << scale
        low = sum(min(each.low, 0) for each in ends) + min(constant, 0)
        high = sum(max(each.high, 0) for each in ends) + max(constant, 0)
        return signed_width(low, high)


def term_ranges(plan: StagePlan, signal: Signal, factor: int, scale: int) -> list[Span]:
    """Return the ranges of the products that a signal times a factor is added by, in a sum kept times ``2**scale``."""
    values = plan.values(signal)
    parts = halves((factor << scale) >> plan.scale(signal))
    return [Span(*sorted((values.low * part, values.high * part))) for part in parts]


def halves(factor: int) -> list[int]:
    """Split a factor of more than 32 bits into a multiple of ``2**32`` and a rest of 32 bits; powers of two stay."""
    if abs(factor) < 1 << 31 or _is_power(factor):
        return [factor]
    upper = (factor + (1 << 31)) >> 32
    return [each for each in (upper << 32, factor - (upper << 32)) if each]


def _is_power(factor: int) -> bool:
    return abs(factor) & (abs(factor) - 1) == 0


def _is_short(factor: int) -> bool:
    """Whether a product by a factor is one by 32 bits, with a power of two besides at most."""
    return all(_is_power(part) or abs(part) < 1 << 31 for part in halves(factor))


def _depth(root: Root) -> int:
    depth = 0
    while isinstance(root, Floor):
        root, depth = root.of, depth + 1
    return depth
