"""Reads the module that joins the flags of a chain: it must be the one that is written here.

It holds back samples of the first stage while its queue is full, and gives each result an entry of the queue, which
leaves with the last result that has it. That the flags of a result are those of its samples follows once: of this
module, for cores that give results in the order of their samples. Its queue may be of any depth that is a power of two:
a shallow one is slow, not wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from operator import mul

from sosmith.verify.chain.written import check_written
from sosmith.verify.graph import require
from sosmith.verify.reader.syntax import Module

_USER = 8
_FAULT, _SETTLING = 6, 5
_MOST_ENTRIES = 1 << 12


@dataclass(frozen=True)
class Timing:
    """What stages behind the first make of its results: `up` times as many, and one of `down`.

    They are left out first if `down_first`, and each left brings `up` results. If not, each brings up / down results,
    rounded to a whole number of one or the other side, so that there is never less than that in all.
    """

    up: int
    down: int
    down_first: bool

    @property
    def sure(self) -> int:
        """Results that come whenever any do, or always."""
        return self.up if self.down_first else self.up // self.down

    @property
    def share(self) -> int:
        """Of `down`, how many bring one more, or any."""
        return 1 if self.down_first else self.up % self.down

    @property
    def uneven(self) -> bool:
        """Whether some bring more than others."""
        return self.down > 1 and self.share > 0

    @property
    def silent(self) -> bool:
        """Whether some bring none."""
        return self.uneven and (self.down_first or self.sure == 0)

    @property
    def most(self) -> int:
        """Results that one brings at most."""
        return self.sure if self.down_first or not self.uneven else self.sure + 1

    def bringing(self, results: int) -> tuple[int, int]:
        """Count those that bring at least so many results, the first of which bring any, and these results."""
        if self.down_first:
            count = -(-results // self.up)
            return count, count * self.up
        if not self.sure or not results:
            return results, results
        count = (results - 1) * self.down // self.up + 1
        return count, -(-count * self.up // self.down)


def timing_of(rates: Sequence[tuple[int, int]]) -> Timing:
    """Return the timing of stages that put in zeros, or leave results out, by these factors.

    Raises
    ------
    RejectedError
        If they do one, the other, and the first again.
    """
    turns = [up > 1 for up, down in rates if (up, down) != (1, 1)]
    require(
        sum(one != other for one, other in pairwise(turns)) < 2,
        "the rate must turn once at most behind the first stage",
    )
    up, down = (reduce(mul, factors, 1) for factors in zip(*rates, strict=True)) if rates else (1, 1)
    return Timing(up, down, down_first=up > 1 and not turns[0])


@dataclass(frozen=True, kw_only=True)
class FlagsClaim:
    """What the flags of a chain must be made of.

    Attributes
    ----------
    name : str
        Name of the module.
    carried : int
        Flags of the inputs: 1 for `input_at_rail`, 2 with `outside_calibration`.
    timing : Timing
        Which results of the first stage bring how many of the chain.
    settling : int
        Of those of a channel that bring any, how many have results that are flagged as settling.
    channels, dest : int
        Channels, and bits of ``tdest``.
    guarded : tuple of str
        The protected stages before the last one.
    """

    name: str
    carried: int
    timing: Timing
    settling: int
    channels: int
    dest: int
    guarded: tuple[str, ...]

    def inputs(self, first: str) -> dict[str, str]:
        """Return the net at each port, in the module of the chain; `first` is that of the first stage's results."""
        dest = {"i_tdest": f"{first}_tdest"} if self.dest else {}
        watched = {f"stage_{name}_{signal}": f"stage_{name}_{signal}" for name in self.guarded for signal in _SIGNALS}
        return {
            "aclk": "aclk",
            "aresetn": "aresetn",
            "i_tuser": f"{first}_tuser",
            **dest,
            "i_tvalid": f"{first}_tvalid",
            "i_tready": "gated_tready",
            "o_tvalid": "gated_tvalid",
            "o_tready": f"{first}_tready",
            **watched,
            "r_tuser": "last_tuser",
            "r_tvalid": "m_axis_tvalid",
            "m_tready": "m_axis_tready",
            "m_tuser": "m_axis_tuser",
        }


_SIGNALS = ("tuser", "tvalid")


def check_flags(module: Module, claim: FlagsClaim) -> None:
    """Check that a module is the one that joins such flags.

    Raises
    ------
    RejectedError
        If it is another one.
    """
    depth = module.depths.get("queue", 0)
    require(
        2 <= depth <= _MOST_ENTRIES and depth & (depth - 1) == 0,
        f"the queue of {claim.name} must have a power of two of entries up to {_MOST_ENTRIES}, not {depth}",
    )
    check_written(module, _text(claim, depth), claim.name, "the flags of the chain")


def _text(claim: FlagsClaim, depth: int) -> str:
    """Return the module as it must be."""
    carried, settling, timing = claim.carried, claim.settling, claim.timing
    phase, age, pointer = (timing.down - 1).bit_length(), settling.bit_length(), depth.bit_length() - 1
    longer = timing.uneven and not timing.silent
    entry = carried + (1 if settling else 0) + (1 if longer else 0)
    known = [("kept", carried)] if timing.silent else []
    known += [("left", phase)] if timing.uneven else []
    known += [("count", age)] if settling else []
    swept = claim.channels > 1 and bool(known)
    ports = [("input", name, width) for name, width in (("aclk", 1), ("aresetn", 1), ("i_tuser", _USER))]
    ports += [("input", "i_tdest", claim.dest)] if claim.dest else []
    ports += [("input", "i_tvalid", 1), ("output", "i_tready", 1), ("output", "o_tvalid", 1), ("input", "o_tready", 1)]
    for stage in claim.guarded:
        ports += [("input", f"stage_{stage}_tuser", _USER), ("input", f"stage_{stage}_tvalid", 1)]
    ports += [
        ("input", "r_tuser", _USER),
        ("input", "r_tvalid", 1),
        ("input", "m_tready", 1),
        ("output", "m_tuser", _USER),
    ]
    text = [f"module {claim.name}({', '.join(name for _, name, _ in ports)});"]
    for way, name, width in ports:
        text += [_declared(way, width, name), _declared("wire", width, name)]
    text += [
        *_assigned("reset", 1, "~aresetn"),
        "wire room;",
        *_assigned("offered", 1, "i_tvalid & room"),
        "assign o_tvalid = offered;",
        "assign i_tready = o_tready & room;",
        *_assigned("taken", 1, "offered & o_tready"),
    ]
    text += _channels(claim, known) if swept else _one_channel(known)
    inputs = "i_tuser[0]" if carried == 1 else f"i_tuser[{carried - 1}:0]"
    text += _bringing(timing, carried, inputs)
    if settling:
        text += [
            *_assigned("young", 1, f"count != {age}'d{settling}"),
            *_assigned("older", age, f"count + {age}'h1"),
            *_assigned("grows", 1, "brings & young"),
            "assign next_count = grows ? older : count;",
        ]
    text += [_declared("reg", entry, f"queue [{depth - 1}:0]"), *_emptied("queue", depth, entry)]
    text += [_declared("reg", pointer + 1, f"head = {pointer + 1}'h0"), *_leaving(timing, entry, longer=longer)]
    text += _counts("head", pointer + 1, "leaves")
    text += [_declared("reg", pointer + 1, f"tail = {pointer + 1}'h0"), *_counts("tail", pointer + 1, "brings")]
    joined = [*(["due"] if longer else []), *(["young"] if settling else []), "gathered"]
    stored = f"{{{', '.join(joined)}}}" if len(joined) > 1 else "gathered"
    text += [f"always_ff @(posedge aclk) if (brings) queue[tail[{pointer - 1}:0]] <= {stored};"]
    front = f"empty ? {stored} : stored"
    text += [
        *_assigned("waiting", pointer + 1, "tail - head"),
        *_assigned("spare", 1, f"~waiting[{pointer}]"),
        f"assign room = {'spare & open' if swept else 'spare'};",
        *_assigned("stored", entry, f"queue[head[{pointer - 1}:0]]"),
        *_assigned("empty", 1, "tail == head"),
        *([f"assign front = {front};"] if longer else _assigned("front", entry, front)),
    ]
    others = "1'h0"
    for stage in claim.guarded:
        user, valid, own = f"stage_{stage}_tuser[{_FAULT}]", f"stage_{stage}_tvalid", f"stage_{stage}"
        text += [
            f"reg {own}_fault = 1'h0;",
            _loaded(f"{own}_fault", 1, valid, user),
            *_assigned(f"{own}_now", 1, f"{valid} ? {user} : {own}_fault"),
            *_assigned(f"{own}_any", 1, f"{own}_now | {others}"),
        ]
        others = f"{own}_any"
    if claim.guarded:
        text += ["reg fault = 1'h0;", *_assigned("moves", 1, "r_tvalid ? m_tready : 1'h1")]
        text += [_loaded("fault", 1, "moves", others)]
    rails = "front" if entry == 1 else "front[0]" if carried == 1 else f"front[{carried - 1}:0]"
    placed = ["1'h0", "fault" if claim.guarded else "1'h0", f"front[{carried}]" if settling else "1'h0"]
    placed += [f"{_SETTLING - carried}'h0", rails]
    return "\n".join([*text, f"assign m_tuser = r_tuser | {{{', '.join(placed)}}};", "endmodule", ""])


def _bringing(timing: Timing, carried: int, inputs: str) -> list[str]:
    """Return what says that a sample brings results, and which flags go with it."""
    phase, share, text = (timing.down - 1).bit_length(), timing.share, list[str]()
    if timing.uneven:
        text += _assigned("due", 1, f"left == {phase}'h0" if share == 1 else f"left < {phase}'d{share}")
        text += _assigned("less", phase, f"left - {phase}'d{share}")
        if share == 1:
            text += [f"assign next_left = due ? {phase}'d{timing.down - 1} : less;"]
        else:
            text += _assigned("more", phase, f"left + {phase}'d{timing.down - share}")
            text += ["assign next_left = due ? more : less;"]
    if not timing.silent:
        return [*text, *_assigned("gathered", carried, inputs), *_assigned("brings", 1, "taken")]
    return [
        *text,
        *_assigned("gathered", carried, f"{inputs} | kept"),
        f"assign next_kept = due ? {carried}'h0 : gathered;",
        *_assigned("brings", 1, "taken & due"),
    ]


def _leaving(timing: Timing, entry: int, *, longer: bool) -> list[str]:
    """Return what says that an entry leaves, with the last result that has it."""
    if timing.most <= 1:
        return _assigned("leaves", 1, "r_tvalid & m_tready")
    bits = (timing.most - 1).bit_length()
    text = [_declared("reg", bits, f"turn = {bits}'h0"), *_assigned("goes", 1, "r_tvalid & m_tready")]
    if longer:
        text += [_declared("wire", entry, "front"), *_assigned("longer", 1, f"front[{entry - 1}]")]
        text += _assigned("end_turn", bits, f"longer ? {bits}'d{timing.most - 1} : {bits}'d{timing.most - 2}")
        text += _assigned("last", 1, "turn == end_turn")
    else:
        text += _assigned("last", 1, f"turn == {bits}'d{timing.most - 1}")
    text += [*_assigned("leaves", 1, "goes & last"), *_assigned("later", bits, f"turn + {bits}'h1")]
    text += _assigned("next_turn", bits, f"last ? {bits}'h0 : later")
    return [*text, _loaded("turn", bits, "goes", "next_turn")]


def _one_channel(known: list[tuple[str, int]]) -> list[str]:
    text = []
    for name, width in known:
        text += [_declared("reg", width, f"{name} = {width}'h0"), _declared("wire", width, f"next_{name}")]
        text += [_loaded(name, width, "taken", f"next_{name}")]
    return text


def _channels(claim: FlagsClaim, known: list[tuple[str, int]]) -> list[str]:
    """Return what is known of each channel, in a memory that is cleared word by word after a reset."""
    bits, whole = (claim.channels - 1).bit_length(), sum(width for _, width in known)
    channel, cleared = (
        ("i_tdest[0]", "cleared[0]") if bits == 1 else (f"i_tdest[{bits - 1}:0]", f"cleared[{bits - 1}:0]")
    )
    text = [_declared("reg", whole, f"known [{(1 << bits) - 1}:0]"), *_emptied("known", 1 << bits, whole)]
    text += _assigned("word", whole, f"known[{channel}]")
    low = 0
    for name, width in known:
        part = "word" if whole == 1 else f"word[{low}]" if width == 1 else f"word[{low + width - 1}:{low}]"
        text += [*_assigned(name, width, part), _declared("wire", width, f"next_{name}")]
        low += width
    joined = ", ".join(f"next_{name}" for name, _ in reversed(known))
    return [
        *text,
        _declared("reg", bits + 1, f"cleared = {bits + 1}'h0"),
        *_assigned("more_cleared", bits + 1, f"cleared + {bits + 1}'h1"),
        *_assigned("open", 1, f"cleared[{bits}]"),
        *_assigned("clears", 1, "~open"),
        _loaded("cleared", bits + 1, "clears", "more_cleared"),
        *_assigned("place", bits, f"open ? {channel} : {cleared}"),
        *_assigned("value", whole, f"open ? {{{joined}}} : {whole}'h0"),
        *_assigned("stores", 1, "taken | clears"),
        "always_ff @(posedge aclk) if (stores) known[place] <= value;",
    ]


def _declared(kind: str, width: int, name: str) -> str:
    return f"{kind} {name};" if width == 1 else f"{kind} [{width - 1}:0] {name};"


def _assigned(name: str, width: int, value: str) -> list[str]:
    return [_declared("wire", width, name), f"assign {name} = {value};"]


def _loaded(name: str, width: int, enable: str, value: str) -> str:
    return f"always_ff @(posedge aclk) if (reset) {name} <= {width}'h0; else if ({enable}) {name} <= {value};"


def _counts(name: str, width: int, enable: str) -> list[str]:
    return [*_assigned(f"next_{name}", width, f"{name} + {width}'h1"), _loaded(name, width, enable, f"next_{name}")]


def _emptied(memory: str, words: int, width: int) -> list[str]:
    loop = f"for (i = 0; i < {words}; i = i + 1) {memory}[i] = {width}'h0;"
    return [f"initial begin : {memory}_cleared integer i; {loop} end"]
