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

    A sample of the first stage that brings results of the chain puts an entry into the queue, and the last of these
    results takes it out. A protected stage accepts a sample only as it gives the result, which then has the entry at
    once. The gate holds samples back while the queue is full, so that its depth decides on speed alone.

    Every result has the flags of all samples of its channel since the last result that came with another sample. With
    several channels, what is known of each lies in a memory, which is cleared after reset; no sample passes meanwhile.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.joints.verilog_text import emptied, net, part_of, range_of, register
from sosmith.gen.chain.rates import Pattern
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
    pattern : Pattern
        Which samples of the second stage bring how many results.
    settling : int
        Samples of a channel whose results are flagged as settling, of those that bring any.
    channels : int
    depth : int
        Entries of the queue, a power of two.
    guarded : tuple of str
        Names of the protected stages before the last one.
    """

    name: str
    carried: int
    pattern: Pattern
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
        bits = {
            "kept": self.carried if self._skips else 0,
            "left": (self.pattern.factor - 1).bit_length() if self._varies else 0,
            "count": self.settling.bit_length(),
        }
        return {name: width for name, width in bits.items() if width}

    @property
    def _skips(self) -> bool:
        """Whether there are samples that bring no result."""
        return self.pattern.factor > 1 and (self.pattern.rises_last or self.pattern.least == 0)

    @property
    def _varies(self) -> bool:
        """Whether samples bring different numbers of results."""
        return self.pattern.factor > 1 and self.pattern.extra > 0

    @property
    def _tells(self) -> bool:
        """Whether an entry says that there is one result more than the least."""
        return self._varies and not self._skips

    @property
    def _wide(self) -> int:
        """Bits of an entry."""
        return self.carried + bool(self.settling) + self._tells

    @property
    def _most(self) -> int:
        """Most results that a sample brings."""
        return max(1, self.pattern.least + (self._varies and not self.pattern.rises_last))

    @property
    def clearing(self) -> int:
        """Clocks after a reset until a sample passes."""
        return 1 << (self.channels - 1).bit_length() if self.channels > 1 and self._parts else 0

    def text(self) -> str:
        """SystemVerilog of the module."""
        lines = [f"module {self.name}({', '.join(name for _, name, _ in self.ports)});"]
        for way, name, width in self.ports:
            lines += [f"{way} {range_of(width)}{name};", f"wire {range_of(width)}{name};"]
        body = [*self._gate(), *self._known(), *self._entry(), *self._queue(), *self._faults()]
        return "\n".join([lines[0], *(f"  {line}" for line in [*lines[1:], *body]), "endmodule", ""])

    def _gate(self) -> Iterator[str]:
        yield from net("reset", 1, "~aresetn")
        yield from net("offered", 1, "i_tvalid & room", before="wire room;")
        yield "assign o_tvalid = offered;"
        yield "assign i_tready = o_tready & room;"
        yield from net("taken", 1, "offered & o_tready")

    def _known(self) -> Iterator[str]:
        """Say what is known of the channel of the sample, and what will be."""
        parts, whole = self._parts, sum(self._parts.values())
        if self.channels == 1 or not parts:
            for name, width in parts.items():
                yield f"reg {range_of(width)}{name} = {width}'h0;"
                yield f"wire {range_of(width)}next_{name};"
                yield from register(name, f"{width}'h0", "taken", f"next_{name}")
            return
        bits = self.clearing.bit_length() - 1
        yield f"reg {range_of(whole)}known [{self.clearing - 1}:0];"
        yield from emptied("known", self.clearing, whole)
        yield from net("word", whole, f"known[i_tdest{part_of(bits)}]")
        low = 0
        for name, width in parts.items():
            yield from net(name, width, f"word{part_of(width, low) if whole > 1 else ''}")
            yield f"wire {range_of(width)}next_{name};"
            low += width
        yield f"reg [{bits}:0] cleared = {bits + 1}'h0;"
        yield from net("more_cleared", bits + 1, f"cleared + {bits + 1}'h1")
        yield from net("open", 1, f"cleared[{bits}]")
        yield from net("clears", 1, "~open")
        yield from register("cleared", f"{bits + 1}'h0", "clears", "more_cleared")
        joined = ", ".join(f"next_{name}" for name in reversed(parts))
        yield from net("place", bits, f"open ? i_tdest{part_of(bits)} : cleared{part_of(bits)}")
        yield from net("value", whole, f"open ? {{{joined}}} : {whole}'h0")
        yield from net("stores", 1, "taken | clears")
        yield from ("always_ff @(posedge aclk)", "  if (stores)", "    known[place] <= value;")

    def _entry(self) -> Iterator[str]:
        """Say what goes into the queue, and when."""
        carried = self.carried
        fresh = f"i_tuser{part_of(carried)}"
        if self._varies:
            extra, factor = self.pattern.extra, self.pattern.factor
            bits = (factor - 1).bit_length()
            yield from net("due", 1, f"left == {bits}'h0" if extra == 1 else f"left < {bits}'h{extra:x}")
            yield from net("less", bits, f"left - {bits}'h{extra:x}")
            more = f"{bits}'h{factor - 1:x}"
            if extra > 1:
                yield from net("more", bits, f"left + {bits}'h{factor - extra:x}")
                more = "more"
            yield f"assign next_left = due ? {more} : less;"
        if self._skips:
            yield from net("gathered", carried, f"{fresh} | kept")
            yield f"assign next_kept = due ? {carried}'h0 : gathered;"
            yield from net("brings", 1, "taken & due")
        else:
            yield from net("gathered", carried, fresh)
            yield from net("brings", 1, "taken")
        if self.settling:
            bits = self.settling.bit_length()
            yield from net("young", 1, f"count != {bits}'h{self.settling:x}")
            yield from net("older", bits, f"count + {bits}'h1")
            yield from net("grows", 1, "brings & young")
            yield "assign next_count = grows ? older : count;"

    def _queue(self) -> Iterator[str]:
        bits, wide = self.depth.bit_length() - 1, self._wide
        yield f"reg {range_of(wide)}queue [{self.depth - 1}:0];"
        yield from emptied("queue", self.depth, wide)
        for name, step in (("head", "leaves"), ("tail", "brings")):
            yield f"reg [{bits}:0] {name} = {bits + 1}'h0;"
            if name == "head":
                yield from self._leaving()
            yield from net(f"next_{name}", bits + 1, f"{name} + {bits + 1}'h1")
            yield from register(name, f"{bits + 1}'h0", step, f"next_{name}")
        entry = self._value
        yield from (
            "always_ff @(posedge aclk)",
            "  if (brings)",
            f"    queue[tail{part_of(bits)}] <= {entry};",
        )
        yield from net("waiting", bits + 1, "tail - head")
        yield from net("spare", 1, f"~waiting[{bits}]")
        yield f"assign room = {'spare & open' if self.clearing else 'spare'};"
        yield from net("stored", wide, f"queue[head{part_of(bits)}]")
        yield from net("empty", 1, "tail == head")
        if self._tells:
            yield f"assign front = empty ? {entry} : stored;"
        else:
            yield from net("front", wide, f"empty ? {entry} : stored")

    @property
    def _value(self) -> str:
        parts = [*(["due"] if self._tells else []), *(["young"] if self.settling else []), "gathered"]
        return f"{{{', '.join(parts)}}}" if len(parts) > 1 else "gathered"

    def _leaving(self) -> Iterator[str]:
        """Say when an entry leaves: with the last of its results."""
        most = self._most
        if most == 1:
            yield from net("leaves", 1, "r_tvalid & m_tready")
            return
        bits = (most - 1).bit_length()
        yield f"reg {range_of(bits)}turn = {bits}'h0;"
        yield from net("goes", 1, "r_tvalid & m_tready")
        if self._tells:
            yield from net("longer", 1, f"front[{self._wide - 1}]", before=f"wire {range_of(self._wide)}front;")
            ends = f"longer ? {bits}'h{most - 1:x} : {bits}'h{most - 2:x}"
            yield from net("end_turn", bits, ends)
            yield from net("last", 1, "turn == end_turn")
        else:
            yield from net("last", 1, f"turn == {bits}'h{most - 1:x}")
        yield from net("leaves", 1, "goes & last")
        yield from net("later", bits, f"turn + {bits}'h1")
        yield from net("next_turn", bits, f"last ? {bits}'h0 : later")
        yield from register("turn", f"{bits}'h0", "goes", "next_turn")

    def _faults(self) -> Iterator[str]:
        """Say what the fault of the result is, and all its flags."""
        any_of = "1'h0"
        for stage in (f"stage_{name}" for name in self.guarded):
            yield f"reg {stage}_fault = 1'h0;"
            now = f"{stage}_tuser[{Flag.FAULT.value}]"
            yield from register(f"{stage}_fault", "1'h0", f"{stage}_tvalid", now)
            yield from net(f"{stage}_now", 1, f"{stage}_tvalid ? {now} : {stage}_fault")
            yield from net(f"{stage}_any", 1, f"{stage}_now | {any_of}")
            any_of = f"{stage}_any"
        if self.guarded:
            yield "reg fault = 1'h0;"
            yield from net("moves", 1, "r_tvalid ? m_tready : 1'h1")
            yield from register("fault", "1'h0", "moves", any_of)
        bits = [
            "1'h0",
            "fault" if self.guarded else "1'h0",
            f"front[{self.carried}]" if self.settling else "1'h0",
            f"{Flag.SETTLING - self.carried}'h0",
            f"front{part_of(self.carried)}" if self._wide > 1 else "front",
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
        pattern=design.pattern,
        settling=design.settling_entries,
        channels=design.spec.base.channels,
        depth=_depth(design),
        guarded=tuple(stage.spec.name for stage in early if stage.design.spec.hardware.protect != "none"),
    )


def _depth(design: ChainDesign) -> int:
    """Entries for all results that can be on their way behind the first stage at full speed."""
    later, pattern = design.stages[1:], design.pattern
    total = sum(max(interface_facts(core).latency_cycles for core in stage.cores) for stage in later)
    interval = 1
    if design.spec.base.channels == 1:
        each, behind = Fraction(pattern.rise if pattern.rises_last else max(1, pattern.least)), Fraction(1)
        slowest = Fraction(0)
        for stage in reversed(later):
            behind *= Fraction(stage.rate.factor, stage.rate.rise)
            clocks = max(stage.rate.rise, *(core.architecture.clocks_per_sample for core in stage.cores))
            slowest = max(slowest, Fraction(clocks) * behind * each)
        interval = max(1, math.floor(slowest))
    most = total // interval + 2 * sum(len(stage.cores) for stage in later) + 1
    return min(1 << most.bit_length(), _MOST_ENTRIES)
