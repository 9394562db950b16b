"""What a CIC filter made of adders is: integrators and combs, their width, and their clocks.

An FIR filter that decimates by R and whose taps are those of N moving sums of R samples each, times a power of two, is
a cascaded integrator-comb (CIC) filter (E. B. Hogenauer, "An economical class of digital filters for decimation and
interpolation", 1981): N integrators at each sample, N combs at every R-th, modulo ``2**width``, without a product.
"""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.hdl.plan.rounded_sum import finest, last_node
from sosmith.model.dataflow.cic import impulse_response, order_of
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Op
from sosmith.model.sections.fir import FirSection


@dataclass(frozen=True)
class CicPlan:
    """Integrators and combs.

    Attributes
    ----------
    factor : int
        R, from 2 on.
    order : int
        N, from 1 on: pairs of an integrator and a comb.
    width : int
        Bits of each, in which every result is exact.
    frac : int
        Fraction bits of what leaves the last comb.
    filled : bool
        Whether the first sample goes in N R times before it is accepted, as if it had been there for ever.
    settling : int
        Results that are flagged as settling after a start from zero.
    limits : bool
        Whether results are limited to the range of the output.
    """

    factor: int
    order: int
    width: int
    frac: int
    filled: bool
    settling: int
    limits: bool

    @property
    def skipped(self) -> int:
        """Results that do not count: those of the first sample as it goes in before it is accepted."""
        return self.order if self.filled else 0

    @property
    def reset_cycles(self) -> int:
        """Clocks after a reset until the first sample is accepted, which is on offer."""
        return self.order * self.factor if self.filled else 0

    @property
    def latency_cycles(self) -> int:
        """Clocks from the edge that accepts a sample to the one that can output its result.

        One for each integrator and comb, one for the rounding, one where results are limited, one for the buffer.
        """
        return 2 * self.order + 2 + self.limits

    @property
    def adder_bits(self) -> int:
        """Result bits of integrators and combs."""
        return 2 * self.order * self.width

    @property
    def register_bits(self) -> int:
        """Bits of integrators, and of what combs remember and give."""
        return 3 * self.order * self.width


def cic_plan(datapath: Datapath) -> CicPlan:
    """Return the integrators and combs of a datapath that is one FIR filter which decimates.

    Raises
    ------
    ValueError
        If its taps are not those of a CIC filter.
    """
    section, *others = datapath.stages
    down = datapath.downsampler
    if not isinstance(section, FirSection) or len(others) != 1 or down is None:
        raise ValueError("stages must be an FIR filter that decimates, and the output")
    frac = max(product.frac for product in section.products)
    taps = [0] * section.length
    for product in section.products:
        for delay, sign in product.taps:
            taps[delay] = sign * product.coefficient << frac - product.frac
    order = order_of(taps, down.factor)
    scale = taps[0]
    if order is None or scale & (scale - 1):
        raise ValueError("taps must be those of moving sums, times a power of two")
    (port,) = datapath.inputs
    most = sum(impulse_response(down.factor, order))
    graph = others[0].graph
    counted = next((graph.nodes[index].high for index in graph.delays), 0)
    return CicPlan(
        factor=down.factor,
        order=order,
        width=max((port.highest * most).bit_length(), (-port.lowest * most - 1).bit_length()) + port.signed,
        frac=finest([datapath]) - (scale.bit_length() - 1),
        filled=down.filled > 0,
        settling=-(-counted // down.factor),
        limits=last_node(datapath).op is Op.CLAMP,
    )
