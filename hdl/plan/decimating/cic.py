"""What a CIC filter made of adders is: integrators and combs, their width, and their clocks.

An FIR filter that decimates by R and whose taps are those of N moving sums of R samples each, times a power of two, is
a cascaded integrator-comb (CIC) filter (E. B. Hogenauer, "An economical class of digital filters for decimation and
interpolation", 1981): N integrators at each sample, N combs at every R-th, modulo ``2**width``, without a product.
"""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.hdl.plan.decimating.plan import DecimatingPlan, paced
from sosmith.hdl.plan.rounded_sum import finest
from sosmith.model.dataflow.cic import impulse_response, order_of
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.sections.fir import FirSection


@dataclass(frozen=True, kw_only=True)
class CicPlan(DecimatingPlan):
    """Integrators and combs.

    Attributes
    ----------
    order : int
        N, from 1 on: pairs of an integrator and a comb.
    width : int
        Bits of each, in which every result is exact.
    frac : int
        Fraction bits of what leaves the last comb.
    factor, filled, settling, limits, channels
        As of `DecimatingPlan`.
    """

    order: int
    width: int
    frac: int

    @property
    def fills(self) -> int:
        """N: once as many combs hold results of the first sample, nothing counts that was there before."""
        return self.order if self.filled else 0

    @property
    def clocks(self) -> int:
        """One for each integrator and comb, and one for the rounding."""
        return 2 * self.order + 1

    @property
    def adder_bits(self) -> int:
        """Result bits of integrators and combs."""
        return 2 * self.order * self.width

    @property
    def register_bits(self) -> int:
        """Bits of integrators, and of what combs remember and give, of one channel."""
        return 3 * self.order * self.width


def cic_plan(datapath: Datapath, channels: int = 1) -> CicPlan:
    """Return the integrators and combs of a datapath that is one FIR filter which decimates, for so many channels.

    Raises
    ------
    ValueError
        If it is another one, or its taps are not those of a CIC filter.
    """
    section, *others = datapath.stages
    if not isinstance(section, FirSection) or len(others) != 1:
        raise ValueError("stages must be an FIR filter and the output")
    pace = paced(datapath)
    frac = max(product.frac for product in section.products)
    taps = [0] * section.length
    for product in section.products:
        for delay, sign in product.taps:
            taps[delay] = sign * product.coefficient << frac - product.frac
    order = order_of(taps, pace.factor)
    scale = taps[0]
    if order is None or scale & (scale - 1):
        raise ValueError("taps must be those of moving sums, times a power of two")
    (port,) = datapath.inputs
    most = sum(impulse_response(pace.factor, order))
    return CicPlan(
        **pace._asdict(),
        channels=channels,
        order=order,
        width=max((port.highest * most).bit_length(), (-port.lowest * most - 1).bit_length()) + port.signed,
        frac=finest([datapath]) - (scale.bit_length() - 1),
    )
