"""Rounding and saturation as a stage builds them, proven against what they mean, for every input code."""

from pathlib import Path
from types import ModuleType

import pytest
from amaranth.hdl import Assert, Assume, Const, Module, Signal, Value
from tests.formal.prover import INDUCTION, Proof, broken, prove

from sosmith.hdl import pipelined_logic
from sosmith.hdl.stages import pipelined as stage
from sosmith.model.dataflow.graph import GraphBuilder
from sosmith.model.sections.horner import HornerStep


class Quantizers(Proof):
    """All quantizers of one input: FLOOR, FRACTION, TRUNCATE, rounding to nearest, and CLAMP.

    With v the input code, k the bits that are dropped and ``2**k`` the unit that remains::

        floor:     floor * 2**k <= v < (floor + 1) * 2**k, and floor * 2**k + fraction = v, 0 <= fraction < 2**k
        truncate:  a distance below 2**k towards zero, never beyond it
        round:     to nearest, ties upward: -2**(k-1) <= v - round * 2**k < 2**(k-1)
        clamp:     v between the limits, else the limit that v is beyond

    Parameters
    ----------
    module : ModuleType
        `sosmith.hdl.stages.pipelined`, or one on broken logic.
    low, high : int
        Range of the input code, which the stage before keeps.
    drop : int
        k.
    limits : tuple of int
        Those of the clamp.
    """

    def __init__(self, module: ModuleType, low: int, high: int, drop: int, limits: tuple[int, int]) -> None:
        g = GraphBuilder()
        v = g.input("v", drop, low, high)
        outputs = [g.floor(v, 0), g.fraction(v, 0), g.truncate(v, 0), g.round(v, 0), g.clamp(v, *limits)]
        super().__init__(module.PipelinedStage(HornerStep("quantizers", g.build(outputs))))
        self.range, self.drop, self.limits = (low, high), drop, limits

    def state(self, m: Module) -> None:
        """State what each output is, of the input that was taken last."""
        d = self.design
        v = Signal(d.i0.shape())
        m.d.comb += Assume((d.i0 >= self.range[0]) & (d.i0 <= self.range[1]))
        with m.If(d.i_valid & d.advance):
            m.d.proof += v.eq(d.i0)
        with m.If(self.started & d.o_valid):
            m.d.comb += Assert((v >= self.range[0]) & (v <= self.range[1]))
            m.d.comb += [Assert(law) for law in self._laws(v)]

    def _laws(self, v: Value) -> list[Value]:
        d, unit, (low, high) = self.design, 1 << self.drop, self.limits
        floor, truncated = d.o0 * Const(unit), d.o2 * Const(unit)
        below, cut, error = v - floor, v - truncated, v - d.o3 * Const(unit)
        return [
            (below >= 0) & (below < unit),
            d.o1 == below,
            (cut == 0) | ((cut > 0) == (v > 0)),
            (cut < unit) & (-cut < unit),
            (2 * error >= -unit) & (2 * error < unit),
            (d.o4 >= low) & (d.o4 <= high),
            (d.o4 == v) | ((v < low) & (d.o4 == low)) | ((v > high) & (d.o4 == high)),
        ]


CASES = [
    (-8, 7, 1, (-3, 2)),
    (-(1 << 15), (1 << 15) - 1, 7, (-(1 << 11), (1 << 11) - 1)),
    (-1000, 3000, 5, (-17, 1234)),
    (0, (1 << 12) - 1, 4, (0, 1000)),
    (0, 3000, 11, (5, 2999)),
    (-(1 << 31), (1 << 31) - 1, 16, (0, (1 << 16) - 1)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("low", "high", "drop", "limits"), CASES)
def test_quantizers_are_what_they_are_called(
    low: int, high: int, drop: int, limits: tuple[int, int], tmp_path: Path
) -> None:
    assert prove(Quantizers(stage, low, high, drop, limits), tmp_path, INDUCTION) == "PASS"


def on_broken_logic(right: str, wrong: str) -> ModuleType:
    """Return the module of the stage on logic that has `wrong` in place of `right`."""
    module = broken(stage, "class PipelinedStage", "class PipelinedStage")  # a copy
    vars(module)["PipelinedLogic"] = vars(broken(pipelined_logic, right, wrong))["PipelinedLogic"]
    return module


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("operands[0].shift_right(fracs[0] - node.frac)", "(operands[0] + 1).shift_right(fracs[0] - node.frac)"),
        ("[: fracs[0] - node.parameter]", "[: fracs[0] - node.parameter - 1]"),
        ("(1 << shift) - 1, 0)", "1 << shift, 0)"),  # beyond zero
        ("operands[0] < 0, (1 << shift) - 1, 0", "0, 0, 0"),  # downwards
        ("value < Const(low)", "value < Const(low - 1)"),
        ("value > Const(high)", "value > Const(high + 1)"),
    ],
)
def test_a_broken_quantizer_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    assert prove(Quantizers(on_broken_logic(right, wrong), *CASES[0]), tmp_path) == "FAIL"


@pytest.mark.slow
def test_a_broken_limit_of_whole_bits_is_found_out(tmp_path: Path) -> None:
    module = on_broken_logic("top & ~value[bits:-1].all()", "top & ~value[bits + 1 : -1].all()")
    assert prove(Quantizers(module, *CASES[1]), tmp_path) == "FAIL"
