"""Pipeline stages of a datapath stage for one channel: the stage in which each of its nodes is computed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from graphlib import TopologicalSorter

from sosmith.model.dataflow.graph import Graph, Node, Op

NO_LOGIC = {Op.INPUT, Op.CONSTANT, Op.DELAY, Op.SHIFT, Op.FLOOR, Op.FRACTION, Op.BOUND}
"""Operations that are wires or registers only and take no time."""

ADDITION, _MULTIPLICATION, _PARTIAL_PRODUCT = 5, 12, 2
"""Delays of operations, in units of about half a nanosecond of an ECP5; a product of several multiplier blocks takes
more, because its partial products are added up."""

REGISTERED_MULTIPLICATION = 7
"""Delay of a product of one block that a register follows at once, which is inside the block."""

_BLOCK_BITS = 18
"""Bits of each operand of a multiplier block, its sign bit included."""


def pipeline_depth(graph: Graph) -> int:
    """Return the number of pipeline stages that `graph` takes: 1 to 3 with a recursion."""
    return max(pipeline_stages(graph)) + 1


def pipeline_stages(graph: Graph) -> list[int]:
    """Return the pipeline stage of each node.

    With a recursion, there are at most three. First comes what it does not reach. Then comes what depends on a
    recursion only through states that are at least two samples old, which are known a clock before they are needed; and
    last the rest of the loop. An FIR filter, which has states but no recursion, has as many as it takes to have one
    product and one sum after the other in each, at most.
    """
    loop = recursive(graph)
    if not loop and graph.delays:
        return _one_after_another(graph)
    late = _late(graph, loop)
    stages = [0] * len(graph.nodes)
    for part, whole in ((loop, _needed(graph, loop)), (late, loop)):
        if part and any(graph.nodes[i].op not in NO_LOGIC for i in whole - part):
            for i in part:
                stages[i] += 1
    return _with_products_later(graph, _with_errors_earlier(graph, stages))


def _with_errors_earlier(graph: Graph, stages: list[int]) -> list[int]:
    """Add what a tap sum dropped to what waits for it a pipeline stage before, from where its few bits are seen."""
    stages = [*stages]
    for index, node in enumerate(graph.nodes):
        if node.op is not Op.ADD or graph.concatenated(node) is not None:
            continue
        for error, other in (node.operands, node.operands[::-1]):
            state = graph.nodes[error]
            fed_back = state.op is Op.DELAY and graph.nodes[state.operands[0]].op is Op.FRACTION
            if fed_back and stages[error] == stages[index] > stages[other] and graph.nodes[other].op is not Op.DELAY:
                stages[index] -= 1
    return stages


def _with_products_later(graph: Graph, stages: list[int]) -> list[int]:
    """Move products from the slowest pipeline stage into the next one, where that makes no other as slow.

    A product behind sums is then registered before it is multiplied, which takes fewer bits than behind.
    """
    for index, node in enumerate(graph.nodes):
        if node.op not in {Op.SCALE, Op.MULTIPLY} or graph.is_gate(node):
            continue
        own, moved = stages[index], {index}
        users = {user: other for user, other in enumerate(graph.nodes) if moved & set(other.operands)}
        while any(stages[user] == own and other.op in NO_LOGIC - {Op.DELAY} for user, other in users.items()):
            moved |= {user for user, other in users.items() if other.op in NO_LOGIC - {Op.DELAY}}
            users = {
                user: other
                for user, other in enumerate(graph.nodes)
                if user not in moved and moved & set(other.operands)
            }
        before = _times(graph, stages)
        if (
            moved & set(graph.outputs)
            or before[own] + _PARTIAL_PRODUCT < max(before)
            or any(stages[user] == own for user in users)
        ):
            continue
        later = [stage + (i in moved and stage == own) for i, stage in enumerate(stages)]
        after = _times(graph, later) if max(later) == max(stages) else [max(before) + 1]
        if max(after) <= max(before) and after[own] < before[own]:
            stages = later
    return stages


def _times(graph: Graph, stages: Sequence[int]) -> list[int]:
    """Return the time of each pipeline stage, in units of `operation_time`."""
    times = [0] * (max(stages) + 1)
    there: list[int] = []
    for index, node in enumerate(graph.nodes):
        before = [there[i] for i in node.operands if node.op is not Op.DELAY and stages[i] == stages[index]]
        there.append(max(before, default=0) + operation_time(graph, node))
        times[stages[index]] = max(times[stages[index]], there[-1])
    return times


def _one_after_another(graph: Graph) -> list[int]:
    """Return pipeline stages of nodes without a recursion, each as early as its operands are there.

    A state belongs to the pipeline stage in which its next value is computed: it then holds the sample before that one.
    """
    there: dict[int, tuple[int, int]] = {}  # pipeline stage in which a value is there, and after what time in it
    for index in TopologicalSorter({index: node.operands for index, node in enumerate(graph.nodes)}).static_order():
        node = graph.nodes[index]
        stage, time = max((there[i] for i in node.operands), default=(0, 0))
        took = operation_time(graph, node)
        if node.op is Op.DELAY:
            time = 0
        elif time and time + took > _MULTIPLICATION + ADDITION:
            stage, time = stage + 1, 0
        there[index] = stage, time + took
    return [there[index][0] for index in range(len(graph.nodes))]


def _needed(graph: Graph, nodes: set[int]) -> set[int]:
    """Return `nodes` and all that they depend on."""
    needed, left = set[int](), [*nodes]
    while left:
        index = left.pop()
        if index not in needed:
            needed.add(index)
            left += graph.nodes[index].operands
    return needed


def inner_sums(graph: Graph, stages: Sequence[int]) -> set[int]:
    """Return the sums that another sum of their pipeline stage takes up.

    Synthesis has to keep them apart. It would otherwise merge all of them into one, which delays a product by what is
    known before it, and takes two LUT for each bit of a third operand where a carry chain of its own takes one.
    """
    inner = set[int]()
    for index, node in enumerate(graph.nodes):
        left = [*node.operands] if _is_sum(graph, index) else []
        while left:
            source = left.pop()
            if graph.nodes[source].op in {Op.SHIFT, Op.BOUND} or graph.concatenated(graph.nodes[source]) is not None:
                left += graph.nodes[source].operands
            elif _is_sum(graph, source) and stages[source] == stages[index]:
                inner.add(source)
    return inner


def _is_sum(graph: Graph, index: int) -> bool:
    """Whether a node takes an adder."""
    node = graph.nodes[index]
    return node.op in {Op.ADD, Op.SUBTRACT} and graph.concatenated(node) is None


def loop_delays(graph: Graph) -> frozenset[int]:
    """Return the DELAYs that depend on themselves."""
    return frozenset(delay for delay in graph.delays if delay in _users(graph, [delay]))


def recursive(graph: Graph) -> set[int]:
    """Return the nodes that depend on a state that depends on itself."""
    return _users(graph, loop_delays(graph))


def _users(graph: Graph, nodes: Iterable[int]) -> set[int]:
    """Return all that depends on `nodes`, through any number of samples."""
    direct: dict[int, list[int]] = {}
    for index, node in enumerate(graph.nodes):
        for i in node.operands:
            direct.setdefault(i, []).append(index)
    users, left = set[int](), [*nodes]
    while left:
        new = set(direct.get(left.pop(), ())) - users
        users |= new
        left += new
    return users


def _late(graph: Graph, loop: set[int]) -> set[int]:
    """Return the nodes of the loop that depend on the newest sample that it remembers, or all if there is but one."""
    late = {i for i in graph.delays if i in loop and graph.nodes[i].operands[0] in loop and _is_followed(graph, i)}
    if not late:
        return loop
    while more := {i for i in loop - late if any(_is_new(graph, i, k, late) for k in graph.nodes[i].operands)}:
        late |= more
    return late


def _is_new(graph: Graph, user: int, operand: int, late: set[int]) -> bool:
    """Whether `user` can have `operand` in the last pipeline stage only."""
    return operand in late and not (_is_older(graph, operand) and graph.nodes[user].op is not Op.DELAY)


def _is_followed(graph: Graph, delay: int) -> bool:
    """Whether a delay is delayed again."""
    return any(graph.nodes[other].operands[0] == delay for other in graph.delays)


def _is_older(graph: Graph, index: int) -> bool:
    """Whether a node is a delay of another delay."""
    node = graph.nodes[index]
    return node.op is Op.DELAY and graph.nodes[node.operands[0]].op is Op.DELAY


def longest_time(graph: Graph) -> int:
    """Return the time of the slowest of `pipeline_stages`, in units of `operation_time`."""
    return max(_times(graph, pipeline_stages(graph)))


def operation_time(graph: Graph, node: Node, *, powers: bool = False) -> int:
    """Delay of a node in the unit of `ADDITION`; `powers` says that a product by a power of two takes none."""
    if powers and node.op is Op.SCALE and node.parameter > 0 and not node.parameter & (node.parameter - 1):
        return 0
    if node.op in NO_LOGIC or graph.concatenated(node) is not None:
        return 0
    if node.op in {Op.SCALE, Op.MULTIPLY} and not graph.is_gate(node):
        return _MULTIPLICATION + takes_several(graph, node) * _PARTIAL_PRODUCT
    return ADDITION


def is_block_product(graph: Graph, node: Node) -> bool:
    """Whether a node is a product that one multiplier block computes, so that the block's registers can hold it."""
    if node.op not in {Op.SCALE, Op.MULTIPLY} or graph.is_gate(node):
        return False
    return all(bits <= _BLOCK_BITS for bits, _ in _factors(graph, node))  # some take one signed and the other not


def _factors(graph: Graph, node: Node) -> list[tuple[int, bool]]:
    """Return the bits of the factors of a product, a sign bit included, and whether they are signed."""
    factors = [(graph.nodes[i].width, graph.nodes[i].signed) for i in node.operands]
    if node.op is Op.SCALE:
        factors.append((abs(node.parameter).bit_length() + (node.parameter < 0), node.parameter < 0))
    return factors


def takes_several(graph: Graph, node: Node) -> bool:
    """Whether a product takes more than one multiplier block."""
    factors = _factors(graph, node)
    signed = any(sign for _, sign in factors)  # a block takes both operands signed or neither
    return any(bits + (signed and not sign) > _BLOCK_BITS for bits, sign in factors)
