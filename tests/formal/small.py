"""Datapaths small enough for a proof, and a reference for them that is nothing but their graphs."""

from collections.abc import Sequence
from fractions import Fraction

from amaranth.hdl import Const, Module, Mux, Signal, Value

from sosmith.hdl.pipelined_logic import shape_of
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, GraphBuilder, Node, Op
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerStep
from sosmith.model.sections.output import OutputStage

_X = (0, -2, 1)
"""Fraction bits and range of the input, two bits wide."""


def port(name: str, bits: int) -> Port:
    """Make a signed port."""
    return Port.from_range(name, bits, Fraction(-1), Fraction(1), signed=True)


def limiter() -> Datapath:
    """Make ``y(n) = x(n) + x(n-1)``, limited to two bits."""
    g = GraphBuilder()
    x = g.input("x", *_X)
    return _limited(g.build([g.add(x, g.previous(x, "x1"))]))


def leaky() -> Datapath:
    """Make ``y(n) = x(n) + floor(y(n-1) / 2)``, which never leaves -4..3."""
    g = GraphBuilder()
    x = g.input("x", *_X)
    y1 = g.delay("y1", 0, -4, 3)
    y = g.bound(g.add(x, g.floor(g.shift(y1, -1), 0)), -4, 3, "y")
    g.connect(y1, y)
    stage = HornerStep("section", g.build([y]))
    return Datapath(name="small", inputs=(port("x", 2),), output=port("y", 3), stages=(stage,))


def distant(turns: int) -> Datapath:
    """Make ``y(n) = x(n) + x(n-1) - floor(y(n - turns) / 4) + floor(y(n - turns) / 2)``, limited to two bits."""
    g = GraphBuilder()
    x = g.input("x", *_X)
    past = [g.delay("y1", 0, -8, 5)]
    for k in range(2, turns + 1):
        past.append(g.previous(past[-1], f"y{k}"))
    early = g.subtract(g.add(x, g.previous(x, "x1")), g.floor(g.shift(past[-1], -2), 0))
    y = g.bound(g.add(early, g.floor(g.shift(past[-1], -1), 0)), -8, 5, "y")
    g.connect(past[0], y)
    return _limited(g.build([y]))


def resonator(low: int = -12, high: int = 11) -> Datapath:
    """Make ``v(n) = x(n) + x(n-1) + floor(v(n-1) / 2) - floor(v(n-2) / 4)``, limited to two bits at the output.

    It takes all three pipeline stages: what no recursion reaches, what depends on the older state alone, and the rest.
    """
    g = GraphBuilder()
    x = g.input("x", *_X)
    v1 = g.delay("v1", 0, low, high)
    v2 = g.previous(v1, "v2")
    older = g.subtract(g.add(x, g.previous(x, "x1")), g.floor(g.shift(v2, -2), 0))
    v = g.bound(g.add(older, g.floor(g.shift(v1, -1), 0)), low, high, "v")
    g.connect(v1, v)
    return _limited(g.build([v]))


def _limited(graph: Graph) -> Datapath:
    node = graph.nodes[graph.outputs[0]]
    y = port("y", 2)
    last = OutputStage(offset=0, offset_frac=0, x=node.range, low=y.lowest, high=y.highest)
    return Datapath(name="small", inputs=(port("x", 2),), output=y, stages=(HornerStep("section", graph), last))


def reference(m: Module, datapath: Datapath, code: Value, take: Value, clear: Value) -> Value:
    """Build a datapath of one input without a pipeline, in the domain `proof`.

    Parameters
    ----------
    m : Module
        Where to.
    datapath : Datapath
        What.
    code : Value
        Input code.
    take : Value
        Whether there is a sample at this clock; else the state stays.
    clear : Value
        Whether the state returns to zero.

    Returns
    -------
    Value
        Output code for the input code.
    """
    for stage in datapath.stages:
        (code,) = _walk(m, stage.graph, [code], take, clear)
    return code


def reference_of_beats(m: Module, datapath: Datapath, codes: Sequence[Value], take: Value, clear: Value) -> list[Value]:
    """Build the same for beats of several samples, one code each: a sample finds the state that the one before left."""
    found = list(codes)
    for stage in datapath.stages:
        graph, state = stage.graph, {i: Signal(shape_of(stage.graph.nodes[i])) for i in stage.graph.delays}
        held: dict[int, Value] = dict(state)
        for lane, code in enumerate(found):
            wires: list[Value] = []
            for index, node in enumerate(graph.nodes):
                operands = [] if node.op is Op.DELAY else [wires[i] for i in node.operands]
                value = held[index] if node.op is Op.DELAY else code
                wires.append(Signal(shape_of(node), name=f"reference{lane}_{node.name}"))
                m.d.comb += wires[-1].eq(_result(graph, node, operands) if operands or not _is_source(node) else value)
            held = {i: wires[graph.nodes[i].operands[0]] for i in graph.delays}
            (output,) = graph.outputs
            found[lane] = wires[output]
        for i, register in state.items():
            with m.If(clear):
                m.d.proof += register.eq(0)
            with m.Elif(take):
                m.d.proof += register.eq(held[i])
    return found


def _is_source(node: Node) -> bool:
    return node.op in {Op.INPUT, Op.DELAY}


def _walk(m: Module, graph: Graph, inputs: Sequence[Value], take: Value, clear: Value) -> list[Value]:
    supply = iter(inputs)
    wires: list[Value] = []
    for node in graph.nodes:
        wire = Signal(shape_of(node), name=f"reference_{node.name}")
        if node.op is Op.INPUT:
            m.d.comb += wire.eq(next(supply))
        elif node.op is not Op.DELAY:
            m.d.comb += wire.eq(_result(graph, node, [wires[i] for i in node.operands]))
        wires.append(wire)
    for i in graph.delays:
        with m.If(clear):
            m.d.proof += wires[i].eq(0)
        with m.Elif(take):
            m.d.proof += wires[i].eq(wires[graph.nodes[i].operands[0]])
    return [wires[i] for i in graph.outputs]


def _result(graph: Graph, node: Node, operands: list[Value]) -> Value:
    """Value of a node; all operands of a sum must have the same fraction bits."""
    if node.op is Op.ADD:
        return operands[0] + operands[1]
    if node.op is Op.CONSTANT:
        return Const(node.parameter)
    if node.op is Op.SUBTRACT:
        return operands[0] - operands[1]
    if node.op is Op.FLOOR:
        return operands[0] >> (graph.nodes[node.operands[0]].frac - node.frac)
    if node.op is Op.CLAMP:
        low, high = Const(node.low), Const(node.high)
        return Mux(operands[0] <= low, low, Mux(operands[0] >= high, high, operands[0]))
    assert node.op in {Op.SHIFT, Op.BOUND}
    return operands[0]
