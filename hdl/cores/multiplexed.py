"""The multiplexed architecture: sections of the same structure share hardware, and take turns with each sample.

As a filter of order 6 that starts from its first sample::

                      start          section0_to_section2         output_stage    output_buffer
    s_axis_tdata --> stage ---------> 3 turns of D clocks  -------> stage ------> StreamBuffer ---> m_axis_tdata
           |         1 clock            3 D clocks                  1 clock    +->   1 clock    ---> m_axis_tuser
           |                                                                   |      |
           +------> status --[status1]---[status2]-- ..  one for each clock ---+      |
           v                                                                          |
        [rest]: clocks until the next sample may enter <------- advance <-------------+

All of it is that of `sosmith.hdl.cores.parallel.Core` for one channel, but for the sections that share hardware
(`sosmith.hdl.stages.shared`), and for `rest`: a sample enters when as many clocks have gone by as the sections' turns
take, counted are those at which the pipeline moves. So each sample finds shared hardware free, however long the
pipeline is. Where these are the first of the datapath, a register keeps a sample for them, as it stays on offer only
until it is accepted.
"""

from __future__ import annotations

from collections.abc import Sequence

from amaranth.hdl import Module, Mux, Signal, Value

from sosmith.hdl.constant_banks import NO_CONSTANTS, ConstantBanks
from sosmith.hdl.cores.parallel import AnyStage, Core, Parts
from sosmith.hdl.plan.sharing.sections import SharedSections
from sosmith.hdl.plan.sharing.sharing import Sharing
from sosmith.hdl.shell.pipeline import Sample
from sosmith.hdl.stages.shared import SharedStage


class MultiplexedCore(Core):
    """A datapath for one channel, whose sections share hardware.

    Latency: `latency_cycles` of `sosmith.hdl.plan.sharing.sharing.Sharing`, without a stall. Throughput: one sample in
    `interval` clocks.

    Parameters
    ----------
    plan : Sharing
        Which sections share hardware.

    Members
    -------
    aclk, aresetn, s_axis_*, m_axis_*
        As those of `sosmith.hdl.shell.shell.Shell`.
    """

    def __init__(self, plan: Sharing) -> None:
        self._plan = plan
        super().__init__(plan.datapath)

    def _stages(self, banks: ConstantBanks | None) -> Sequence[AnyStage]:
        """Make a component for each unit."""
        del banks
        clocks = self._plan.clocks
        return [
            SharedStage(unit, clocks)
            if isinstance(unit, SharedSections)
            else self._stage_of_one(unit, NO_CONSTANTS, ())
            for unit in self._plan.units
        ]

    @property
    def _depth_of_stages(self) -> int:
        return self._plan.depth - self._plan.is_kept_at_entrance

    def _source(self, m: Module, parts: Parts) -> tuple[Sample, Value, Value | None]:
        """Return what is there for the first stage; a sample enters when those before leave it shared hardware."""
        interval, enters = self._plan.interval, Signal(name="enters")
        rest, rests = Signal(range(interval), name="rest"), Signal(name="rests")
        m.d.comb += [
            rests.eq(rest.any()),
            self.s_axis_tready.eq(parts.advance & ~rests),
            enters.eq(self.s_axis_tvalid & ~rests),
        ]
        with m.If(parts.advance & (rests | enters)):
            m.d.sync += rest.eq(Mux(rests, rest - 1, interval - 1))
        if not self._plan.is_kept_at_entrance:
            return Sample(enters), self.s_axis_tdata, None
        entered, kept = Signal(name="entered"), Signal.like(self.s_axis_tdata, name="kept", reset_less=True)
        with m.If(parts.advance):
            m.d.sync += entered.eq(enters)
            with m.If(enters):
                m.d.sync += kept.eq(self.s_axis_tdata)
        return Sample(entered), kept, None
