r"""An FIR filter that decimates by R, with a sample at each clock, and a multiplier for every R products of a result.

::

                 +-------------------------------------------+
    s_axis_tdata |  [line0] --> [line1] --> .. --> [lineL-1]  |   moves with each sample
        bits     +------|----------|-------------------|-----+
                        v          v                   v
          phase ---> places, chosen by phase:  [first0] [second0]  [first1] [second1]  ..   P multipliers
                                                    \   /               \   /
                                                     + -                 + -
          phase ---> [coefficients] ----------->     * <--- [pair0]       * <--- [pair1]    bits + 1
                                                     |                   |
                                                 [product0]          [product1]
                                                     +---------+---------+
                                                               v
                 base at the first phase of a result, or --> [sum] + [total] --> rounded, limited --> m_axis

    clock of the edge     0      1       2      3     ..   4 + levels     ..
    register             line  places   pair  product       total      limited, output_buffer

All move at the clocks at which `advance` is high; entrance and output are those of
`sosmith.hdl.cores.decimating.DecimatingCore`. `phase` goes along with each sample: a sample that comes p samples before
the one that brings the result has the phase R - p, that one 0. Which multiplier takes which product with which phase is
said by `sosmith.hdl.plan.decimating.polyphase`. The total of a result begins with half a step of the output, so that it
is rounded by what is left out of it. With a start from zero, a reset clears the line, and gives the total this half
step.
"""

from __future__ import annotations

from amaranth.hdl import Const, Module, Mux, Signal, Value, signed
from amaranth.lib.memory import Memory

from sosmith.hdl.cores.decimating import DecimatingCore, Entered, Summed
from sosmith.hdl.memory_ports import read_port
from sosmith.hdl.plan.decimating.polyphase import PolyphasePlan, polyphase_plan
from sosmith.hdl.plan.rounded_sum import finest, rounding, sum_bits
from sosmith.hdl.plan.tap_steps import TapStep
from sosmith.model.dataflow.datapath import Datapath


class Multipliers:
    """The multipliers of an FIR filter that decimates, with the sums of their products: a part of its core.

    Attributes
    ----------
    datapath : Datapath
        What the core computes.
    products : PolyphasePlan
        Which multiplier takes which product.
    """

    datapath: Datapath
    products: PolyphasePlan

    def multiplied(self, m: Module, advance: Value, line: list[Signal], phases: tuple[Value, Value]) -> Value:
        """Return the sum of the products of a sample in the line, for its phase and, a clock later, the second one."""
        phase, later = phases
        coefficients = self._coefficients(m, advance, later)
        products = [
            self._product(m, advance, k, (line, phase, later), coefficient)
            for k, coefficient in enumerate(coefficients)
        ]
        return self._summed(m, advance, products)

    def _coefficients(self, m: Module, advance: Value, phase: Value) -> list[Value]:
        """Read the coefficients of all multipliers for a phase: with the sums of two samples of that."""
        plan = self.products
        bits, count = plan.steps.factor_bits, plan.multipliers
        rows = [0] * plan.factor
        for number, steps in enumerate(plan.by_phase):
            place = -number % plan.factor  # a sample that comes so many samples before a result
            for k, step in enumerate(steps):
                code = 0 if step is None else step.coefficient
                rows[place] |= (code & (1 << bits) - 1) << bits * k
        m.submodules.coefficients_memory = memory = Memory(shape=bits * count, depth=plan.factor, init=rows)
        reader = read_port(memory, "coefficients")
        m.d.comb += [reader.addr.eq(phase), reader.en.eq(advance)]
        return [reader.data[bits * k : bits * (k + 1)].as_signed() for k in range(count)]

    def _product(
        self, m: Module, advance: Value, k: int, taken: tuple[list[Signal], Value, Value], coefficient: Value
    ) -> Signal:
        """Build multiplier k behind the places of the line that it takes, each with its phase."""
        plan, (line, phase, later) = self.products, taken
        steps = [plan.by_phase[-place % plan.factor][k] for place in range(plan.factor)]
        shape = line[0].shape()
        first = Signal(shape, name=f"first{k}", reset_less=True)
        pair = Signal(signed(plan.steps.pair_bits(self.datapath.inputs[0])), name=f"pair{k}", reset_less=True)
        chosen = [None if step is None else line[step.first - self._ahead(place)] for place, step in enumerate(steps)]
        with m.If(advance):
            m.d.sync += first.eq(self._choice(phase, chosen))
        both: Value = first
        if any(step is not None and step.second is not None for step in steps):
            second = Signal(shape, name=f"second{k}", reset_less=True)
            others = [self._second(line, place, step) for place, step in enumerate(steps)]
            with m.If(advance):
                m.d.sync += second.eq(self._choice(phase, others))
            signs = [None if step is None or step.second is None else step.sign < 0 for step in steps]
            both = self._added(later, first, second, signs)
        product = Signal(signed(len(pair) + plan.steps.factor_bits), name=f"product{k}", reset_less=True)
        with m.If(advance):
            m.d.sync += [pair.eq(both), product.eq(pair * coefficient)]
        return product

    def _ahead(self, place: int) -> int:
        """Return how many samples the one at this phase comes before the one that brings the result."""
        return -place % self.products.factor

    def _second(self, line: list[Signal], place: int, step: TapStep | None) -> Value | None:
        """Return the second sample of a product; 0 if it has one alone, None if it does not matter."""
        if step is None:
            return None
        return Const(0) if step.second is None else line[step.second - self._ahead(place)]

    def _choice(self, phase: Value, values: list[Value | None]) -> Value:
        """Choose a value by the phase, bit by bit; None stands for any."""
        known = [value for value in values if value is not None]
        if not known or all(value is known[0] for value in known):
            return known[0] if known else Const(0)
        size = 1 << len(phase)
        level: list[Value | None] = [*values, *[None] * (size - len(values))]
        for bit in range(len(phase)):
            level = [self._either(phase[bit], *level[k : k + 2]) for k in range(0, len(level), 2)]
        (only,) = level
        assert only is not None
        return only

    @staticmethod
    def _either(bit: Value, zero: Value | None, one: Value | None) -> Value | None:
        if zero is None or one is None or zero is one:
            return one if zero is None else zero
        return Mux(bit, one, zero)

    def _added(self, phase: Value, first: Value, second: Value, signs: list[bool | None]) -> Value:
        """Add two samples, or take the second off the first, with each phase as its product asks."""
        kinds = {sign for sign in signs if sign is not None}
        if kinds == {False}:
            return first + second
        if kinds == {True}:
            return first - second
        minus = self._choice(phase, [None if sign is None else Const(int(sign), 1) for sign in signs])
        return Mux(minus, first - second, first + second)

    def _summed(self, m: Module, advance: Value, products: list[Signal]) -> Value:
        """Add the products of a phase, two by two, a clock for each level."""
        level: list[Value] = [*products]
        for number in range(1, self.products.levels + 1):
            sums: list[Value] = []
            for k in range(0, len(level), 2):
                value = level[k] + level[k + 1] if k + 1 < len(level) else level[k]
                added = Signal(value.shape(), name=f"sum{number}_{k // 2}", reset_less=True)
                with m.If(advance):
                    m.d.sync += added.eq(value)
                sums.append(added)
            level = sums
        return level[0]


class PolyphaseCore(DecimatingCore, Multipliers):
    """An FIR filter that decimates, for one channel.

    Latency: `latency_cycles` of `sosmith.hdl.plan.decimating.polyphase.PolyphasePlan`, without a stall. Throughput: one
    sample a clock.

    Parameters
    ----------
    datapath : Datapath
        What it computes: one FIR section that keeps samples, the output stage, and a downsampler.
    copies : int
        Times that each result is handed out.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(self, datapath: Datapath, copies: int = 1) -> None:
        self.products = polyphase_plan(datapath)
        super().__init__(datapath, self.products, copies)

    def sums(self, m: Module, sample: Entered) -> Summed:
        """Build the line, the multipliers and the total."""
        plan, advance = self.products, sample.advance
        valid = [self.later(m, advance, sample.valid, "valid1")]
        phase = [self.later(m, advance, sample.phase, "phase1", reset_less=True)]
        for k in range(2, plan.clocks):
            valid.append(self.later(m, advance, valid[-1], f"valid{k}"))
            phase.append(self.later(m, advance, phase[-1], f"phase{k}", reset_less=True))
        line = self._line(m, sample)
        added = self.multiplied(m, advance, line, (phase[0], phase[1]))
        return self._totalled(m, advance, added, valid[-1], phase[-1])

    def _line(self, m: Module, sample: Entered) -> list[Signal]:
        """Keep the last samples."""
        line: list[Signal] = []
        before: Value = sample.code
        for k in range(self.products.length):
            place = Signal(sample.code.shape(), name=f"line{k}", reset_less=self.products.filled)
            with m.If(sample.enters):
                m.d.sync += place.eq(before)
            line.append(place)
            before = place
        return line

    def _totalled(self, m: Module, advance: Value, added: Value, valid: Value, phase: Value) -> Summed:
        """Add up the sums of all phases of a result, from the first of them on, and leave out what rounds it."""
        grid, begin = rounding([self.datapath])
        shape = signed(sum_bits([self.datapath], grid))
        # The first sample from zero brings a result by itself: it finds what the samples before would have left.
        total = Signal(shape, name="total", init=begin, reset_less=self.products.filled)
        begins, rounded = Signal(name="begins"), self.rounded()
        m.d.comb += begins.eq(phase == 1)
        base = Mux(begins, Const(begin, signed(len(total))), total)
        with m.If(advance & valid):
            m.d.sync += total.eq(base + (added << grid - finest([self.datapath])))
        m.d.comb += rounded.eq(total >> grid if grid > 0 else total << -grid)
        return Summed(rounded, valid & ~phase.any())
