"""What joins the cores of a stage that interpolates: each takes every sample, and their results leave in turn.

::

                      ┌─> o0_t* ── core of phase 0 ── i0_t* ──┐
    s_t* ──> given ───┼─> o1_t* ── core of phase 1 ── i1_t* ──┼──> turn ──> m_t*
                      └─> o2_t* ── core of phase 2 ── i2_t* ──┘

A sample is offered to each core until that has taken it, and is taken itself once all of them have. So the cores may
work at different paces. Result k of a sample is that of core k: `turn` counts them. The data of a sample goes to all
cores past this module. Where cores have check bits, a fault of one is a fault of all results from then on.

Where their taps can be loaded, `between` is high at a clock behind which either all cores have chosen the bank for
their sample, or none: the bank may change then, and all results of a sample have taps of one set. A core has chosen
while `i0_begun` is high, or at the latest as it takes the sample.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from sosmith.gen.chain.design import ChainDesign, StageDesign
from sosmith.gen.chain.joints.verilog_text import net, range_of, register
from sosmith.gen.output.core_facts import StreamFacts, interface_facts
from sosmith.model.dataflow.status import Flag


@dataclass(frozen=True, kw_only=True)
class TurnsUnit:
    """What joins the cores of a stage.

    Attributes
    ----------
    name : str
        Name of the module.
    phases : int
        Number of cores, at least 2.
    results : StreamFacts
        Stream of the results of each.
    guarded : bool
        Whether they have check bits: a fault of one is then one of all.
    loads : bool
        Whether their taps can be loaded.
    """

    name: str
    phases: int
    results: StreamFacts
    guarded: bool = False
    loads: bool = False

    @property
    def payload(self) -> list[tuple[str, int]]:
        """Signals that go with a result, and their widths."""
        dest = [("tdest", self.results.dest_width)] if self.results.dest_width else []
        return [("tdata", self.results.width), ("tuser", self.results.user_width), *dest]

    @property
    def ports(self) -> list[tuple[str, str, int]]:
        """Direction, name and width of each port."""
        offered = [
            (way, f"o{k}_{signal}", 1)
            for k in range(self.phases)
            for way, signal in (("output", "tvalid"), ("input", "tready"))
        ]
        given = [
            (way, f"i{k}_{signal}", width)
            for k in range(self.phases)
            for way, signal, width in (
                *(("input", signal, width) for signal, width in self.payload),
                ("input", "tvalid", 1),
                ("output", "tready", 1),
            )
        ]
        return [
            ("input", "aclk", 1),
            ("input", "aresetn", 1),
            ("input", "s_tvalid", 1),
            ("output", "s_tready", 1),
            *offered,
            *given,
            *(("output", f"m_{signal}", width) for signal, width in self.payload),
            ("output", "m_tvalid", 1),
            ("input", "m_tready", 1),
            *(("input", f"i{k}_begun", 1) for k in range(self.phases if self.loads else 0)),
            *([("output", "between", 1)] if self.loads else []),
        ]

    def text(self) -> str:
        """SystemVerilog of the module."""
        lines = [f"module {self.name}({', '.join(name for _, name, _ in self.ports)});"]
        for way, name, width in self.ports:
            lines += [f"{way} {range_of(width)}{name};", f"wire {range_of(width)}{name};"]
        body = [*self._offer(), *self._turn(), *(self._swap() if self.loads else [])]
        return "\n".join([lines[0], *(f"  {line}" for line in [*lines[1:], *body]), "endmodule", ""])

    def _offer(self) -> Iterator[str]:
        yield from net("reset", 1, "~aresetn")
        for k in range(self.phases):
            yield f"reg given{k} = 1'h0;"
            yield from net(f"lacks{k}", 1, f"~given{k}")
            yield f"assign o{k}_tvalid = s_tvalid & lacks{k};"
            yield from net(f"has{k}", 1, f"given{k} | o{k}_tready")
            before = f" & all{k - 1}" if k else ""
            yield from net(f"all{k}", 1, f"has{k}{before}")
        yield f"assign s_tready = all{self.phases - 1};"
        yield from net("stays", 1, f"~all{self.phases - 1}")
        for k in range(self.phases):
            yield from net(f"next{k}", 1, f"has{k} & stays")
            yield from register(f"given{k}", "1'h0", "s_tvalid", f"next{k}")

    def _turn(self) -> Iterator[str]:
        bits, last = (self.phases - 1).bit_length(), self.phases - 1
        yield f"reg {range_of(bits)}turn = {bits}'h0;"
        for k in range(self.phases):
            yield from net(f"is{k}", 1, f"turn == {bits}'h{k:x}")
            yield f"assign i{k}_tready = is{k} & m_tready;"
        for signal, width in [*self.payload, ("tvalid", 1)]:
            value = f"i{last}_{signal}"
            for k in reversed(range(1, last)):
                yield from net(f"from{k}_{signal}", width, f"is{k} ? i{k}_{signal} : {value}")
                value = f"from{k}_{signal}"
            value = f"is0 ? i0_{signal} : {value}"
            if self.guarded and signal == "tuser":
                yield from net("own", width, value)
            else:
                yield f"assign m_{signal} = {value};"
        yield from net("moves", 1, "m_tvalid & m_tready")
        yield from net("later", bits, f"turn + {bits}'h1")
        yield from net("next_turn", bits, f"is{last} ? {bits}'h0 : later")
        yield from register("turn", f"{bits}'h0", "moves", "next_turn")
        if self.guarded:
            yield from self._faults()

    def _swap(self) -> Iterator[str]:
        """Say whether the bank may change: all cores have chosen that of the sample on offer, or none."""
        for k in range(self.phases):
            yield from net(f"chooses{k}", 1, f"i{k}_begun | o{k}_tready")
            yield from net(f"offered{k}", 1, f"s_tvalid & chooses{k}")
            yield from net(f"chosen{k}", 1, f"given{k} | offered{k}")
            before = (f"some{k - 1} | ", f"every{k - 1} & ") if k else ("", "")
            yield from net(f"some{k}", 1, f"{before[0]}chosen{k}")
            yield from net(f"every{k}", 1, f"{before[1]}chosen{k}")
        yield from net("none", 1, f"~some{self.phases - 1}")
        yield f"assign between = none | every{self.phases - 1};"

    def _faults(self) -> Iterator[str]:
        """Say whether the last result of any core had a fault: so has each result then, in all turns."""
        any_of = f"own[{Flag.FAULT.value}]"
        for k in range(self.phases):
            yield f"reg fault{k} = 1'h0;"
            yield from net(f"leaves{k}", 1, f"moves & is{k}")
            yield from register(f"fault{k}", "1'h0", f"leaves{k}", f"i{k}_tuser[{Flag.FAULT.value}]")
            yield from net(f"any{k}", 1, f"fault{k} | {any_of}")
            any_of = f"any{k}"
        yield f"assign m_tuser = own | {{1'h0, {any_of}, {Flag.FAULT.value}'h0}};"


def turns_unit(design: ChainDesign, stage: StageDesign) -> TurnsUnit | None:
    """Return what joins the cores of a stage; None for a single one, or one multiplier for all."""
    if len(stage.modules) == 1:
        return None
    return TurnsUnit(
        name=f"{design.name}_{stage.spec.name}_turns",
        phases=len(stage.cores),
        results=interface_facts(stage.design).outputs,
        guarded=stage.design.spec.hardware.protect != "none",
        loads=stage.design.spec.hardware.reload,
    )


def modules_of(design: ChainDesign) -> Sequence[TurnsUnit]:
    """Return the modules of all stages that interpolate."""
    units = (turns_unit(design, stage) for stage in design.stages)
    return [unit for unit in units if unit is not None]
