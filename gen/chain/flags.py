"""The flags of a chain: those of the first stage's inputs, settling and faults, kept beside the results.

::

                      i_t*                  o_t*
    first stage ──────────> gate ─────────────────> second stage ── .. ──> last stage
                              │ taken                                          │ r_tuser, r_tvalid
                              v                                                v
          i_tuser ──> or of the samples ──> queue ──> at the head ──> or ──> m_tuser
                      of each result,                                 ^
                      settling by its number                          │
          fault of each protected stage before the last ──> held while a result waits

    A sample of the first stage that brings a result of the chain puts an entry into the queue, and that result takes
    it out. A protected stage accepts a sample only as it gives the result, which then has the entry at once. The gate
    holds samples back while the queue is full, so that its depth decides on speed alone.

    Every result has the flags of all samples of its channel since the result before. With several channels, what is
    known of each lies in a memory, which is cleared after reset; no sample passes meanwhile.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.output.core_facts import interface_facts
from sosmith.hdl.plan.streams import dest_width
from sosmith.model.dataflow.status import STATUS_BITS, Flag

_MOST_ENTRIES = 256


@dataclass(frozen=True, kw_only=True)
class FlagsUnit:
    """What the flags of a chain need.

    Attributes
    ----------
    name : str
        Name of the module.
    carried : int
        Flags of the inputs, the lowest bits of ``tuser``.
    factor : int
        Samples of the second stage for each result.
    settling : int
        Results of a channel that are flagged as settling.
    channels : int
    depth : int
        Entries of the queue, a power of two.
    guarded : tuple of str
        Names of the protected stages before the last one.
    """

    name: str
    carried: int
    factor: int
    settling: int
    channels: int
    depth: int
    guarded: tuple[str, ...]

    @property
    def ports(self) -> list[tuple[str, str, int]]:
        """Direction, name and width of each port."""
        dest = dest_width(self.channels)
        return [
            ("input", "aclk", 1),
            ("input", "aresetn", 1),
            ("input", "i_tuser", STATUS_BITS),
            *([("input", "i_tdest", dest)] if dest else []),
            ("input", "i_tvalid", 1),
            ("output", "i_tready", 1),
            ("output", "o_tvalid", 1),
            ("input", "o_tready", 1),
            *((way, f"stage_{stage}_{signal}", width) for stage in self.guarded for way, signal, width in _WATCHED),
            ("input", "r_tuser", STATUS_BITS),
            ("input", "r_tvalid", 1),
            ("input", "m_tready", 1),
            ("output", "m_tuser", STATUS_BITS),
        ]

    @property
    def _parts(self) -> dict[str, int]:
        """What is known of a channel, and its bits: the flags since the last result, and two counts."""
        gathers = self.factor > 1
        bits = {
            "kept": self.carried if gathers else 0,
            "left": (self.factor - 1).bit_length(),
            "count": self.settling.bit_length(),
        }
        return {name: width for name, width in bits.items() if width}

    @property
    def clearing(self) -> int:
        """Clocks after a reset until a sample passes."""
        return 1 << (self.channels - 1).bit_length() if self.channels > 1 and self._parts else 0

    def text(self) -> str:
        """SystemVerilog of the module."""
        lines = [f"module {self.name}({', '.join(name for _, name, _ in self.ports)});"]
        for way, name, width in self.ports:
            lines += [f"{way} {_range(width)}{name};", f"wire {_range(width)}{name};"]
        body = [*self._gate(), *self._known(), *self._entry(), *self._queue(), *self._faults()]
        return "\n".join([lines[0], *(f"  {line}" for line in [*lines[1:], *body]), "endmodule", ""])

    def _gate(self) -> Iterator[str]:
        yield from _net("reset", 1, "~aresetn")
        yield from _net("offered", 1, "i_tvalid & room", before="wire room;")
        yield "assign o_tvalid = offered;"
        yield "assign i_tready = o_tready & room;"
        yield from _net("taken", 1, "offered & o_tready")

    def _known(self) -> Iterator[str]:
        """Say what is known of the channel of the sample, and what will be."""
        parts, whole = self._parts, sum(self._parts.values())
        if self.channels == 1 or not parts:
            for name, width in parts.items():
                yield f"reg {_range(width)}{name} = {width}'h0;"
                yield f"wire {_range(width)}next_{name};"
                yield from _register(name, f"{width}'h0", "taken", f"next_{name}")
            return
        bits = self.clearing.bit_length() - 1
        yield f"reg {_range(whole)}known [{self.clearing - 1}:0];"
        yield from _cleared("known", self.clearing, whole)
        yield from _net("word", whole, f"known[i_tdest{_slice(bits)}]")
        low = 0
        for name, width in parts.items():
            yield from _net(name, width, f"word{_slice(width, low) if whole > 1 else ''}")
            yield f"wire {_range(width)}next_{name};"
            low += width
        yield f"reg [{bits}:0] cleared = {bits + 1}'h0;"
        yield from _net("more_cleared", bits + 1, f"cleared + {bits + 1}'h1")
        yield from _net("open", 1, f"cleared[{bits}]")
        yield from _net("clears", 1, "~open")
        yield from _register("cleared", f"{bits + 1}'h0", "clears", "more_cleared")
        joined = ", ".join(f"next_{name}" for name in reversed(parts))
        yield from _net("place", bits, f"open ? i_tdest{_slice(bits)} : cleared{_slice(bits)}")
        yield from _net("value", whole, f"open ? {{{joined}}} : {whole}'h0")
        yield from _net("stores", 1, "taken | clears")
        yield from ("always_ff @(posedge aclk)", "  if (stores)", "    known[place] <= value;")

    def _entry(self) -> Iterator[str]:
        """Say what goes into the queue, and when."""
        carried = self.carried
        fresh = f"i_tuser{_slice(carried)}"
        if self.factor > 1:
            bits = (self.factor - 1).bit_length()
            yield from _net("due", 1, f"left == {bits}'h0")
            yield from _net("less", bits, f"left - {bits}'h1")
            yield f"assign next_left = due ? {bits}'h{self.factor - 1:x} : less;"
            yield from _net("gathered", carried, f"{fresh} | kept")
            yield f"assign next_kept = due ? {carried}'h0 : gathered;"
            yield from _net("brings", 1, "taken & due")
        else:
            yield from _net("gathered", carried, fresh)
            yield from _net("brings", 1, "taken")
        if self.settling:
            bits = self.settling.bit_length()
            yield from _net("young", 1, f"count != {bits}'h{self.settling:x}")
            yield from _net("older", bits, f"count + {bits}'h1")
            yield from _net("grows", 1, "brings & young")
            yield "assign next_count = grows ? older : count;"

    def _queue(self) -> Iterator[str]:
        bits, wide = self.depth.bit_length() - 1, self.carried + bool(self.settling)
        yield f"reg {_range(wide)}queue [{self.depth - 1}:0];"
        yield from _cleared("queue", self.depth, wide)
        for name, step in (("head", "leaves"), ("tail", "brings")):
            yield f"reg [{bits}:0] {name} = {bits + 1}'h0;"
            if name == "head":
                yield from _net("leaves", 1, "r_tvalid & m_tready")
            yield from _net(f"next_{name}", bits + 1, f"{name} + {bits + 1}'h1")
            yield from _register(name, f"{bits + 1}'h0", step, f"next_{name}")
        entry = "{young, gathered}" if self.settling else "gathered"
        yield from (
            "always_ff @(posedge aclk)",
            "  if (brings)",
            f"    queue[tail{_slice(bits)}] <= {entry};",
        )
        yield from _net("waiting", bits + 1, "tail - head")
        yield from _net("spare", 1, f"~waiting[{bits}]")
        yield f"assign room = {'spare & open' if self.clearing else 'spare'};"
        yield from _net("stored", wide, f"queue[head{_slice(bits)}]")
        yield from _net("empty", 1, "tail == head")
        yield from _net("front", wide, f"empty ? {entry} : stored")

    def _faults(self) -> Iterator[str]:
        """Say what the fault of the result is, and all its flags."""
        any_of = "1'h0"
        for stage in (f"stage_{name}" for name in self.guarded):
            yield f"reg {stage}_fault = 1'h0;"
            now = f"{stage}_tuser[{Flag.FAULT.value}]"
            yield from _register(f"{stage}_fault", "1'h0", f"{stage}_tvalid", now)
            yield from _net(f"{stage}_now", 1, f"{stage}_tvalid ? {now} : {stage}_fault")
            yield from _net(f"{stage}_any", 1, f"{stage}_now | {any_of}")
            any_of = f"{stage}_any"
        if self.guarded:
            yield "reg fault = 1'h0;"
            yield from _net("moves", 1, "r_tvalid ? m_tready : 1'h1")
            yield from _register("fault", "1'h0", "moves", any_of)
        wide = self.carried + bool(self.settling)
        bits = [
            "1'h0",
            "fault" if self.guarded else "1'h0",
            f"front[{self.carried}]" if self.settling else "1'h0",
            f"{Flag.SETTLING - self.carried}'h0",
            f"front{_slice(self.carried)}" if wide > 1 else "front",
        ]
        yield f"assign m_tuser = r_tuser | {{{', '.join(bits)}}};"


_WATCHED = (("input", "tuser", STATUS_BITS), ("input", "tvalid", 1))
"""Ports that tell whether a protected stage has a fault."""


def flags_unit(design: ChainDesign) -> FlagsUnit | None:
    """Return what joins the flags of a chain; None for a single stage, whose flags are those of the chain."""
    *early, _ = design.stages
    if not early:
        return None
    return FlagsUnit(
        name=f"{design.name}_flags",
        carried=design.carried_flags,
        factor=design.factor // early[0].design.datapath.samples_per_result,
        settling=design.settling,
        channels=design.spec.base.channels,
        depth=_depth(design),
        guarded=tuple(stage.spec.name for stage in early if stage.design.spec.hardware.protect != "none"),
    )


def _depth(design: ChainDesign) -> int:
    """Entries for all results that can be on their way behind the first stage at full speed."""
    later = design.stages[1:]
    total, interval = sum(interface_facts(stage.design).latency_cycles for stage in later), 1
    if design.spec.base.channels == 1:
        each, behind = [], 1
        for stage in reversed(later):
            behind *= stage.design.datapath.samples_per_result
            each.append(math.floor(stage.design.architecture.clocks_per_sample * behind))
        interval = max(1, *each)
    most = total // interval + 2 * len(later) + 1
    return min(1 << most.bit_length(), _MOST_ENTRIES)


def _range(width: int) -> str:
    return "" if width == 1 else f"[{width - 1}:0] "


def _slice(width: int, low: int = 0) -> str:
    return f"[{low}]" if width == 1 else f"[{low + width - 1}:{low}]"


def _net(name: str, width: int, value: str, before: str = "") -> Iterator[str]:
    if before:
        yield before
    yield f"wire {_range(width)}{name};"
    yield f"assign {name} = {value};"


def _register(name: str, cleared: str, enable: str, value: str) -> Iterator[str]:
    yield "always_ff @(posedge aclk)"
    yield f"  if (reset) {name} <= {cleared};"
    yield f"  else if ({enable}) {name} <= {value};"


def _cleared(memory: str, words: int, width: int) -> Iterator[str]:
    yield f"initial begin : {memory}_cleared"
    yield "  integer i;"
    yield f"  for (i = 0; i < {words}; i = i + 1)"
    yield f"    {memory}[i] = {width}'h0;"
    yield "end"
