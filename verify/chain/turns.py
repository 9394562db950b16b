"""Reads the module that joins the cores of a stage that interpolates: it must be the one that is written here.

Each core takes every sample once, as it is offered until then and the sample stays until all cores have it. Result k of
each sample is that of core k: the results of a core come in the order of its samples, and `turn` goes round.

Where taps can be loaded, `between` is low behind a clock at which some of the cores have chosen the bank of the sample
on offer, and others have not: registers that change the bank only while it is high give all of them the same.
"""

from __future__ import annotations

from dataclasses import dataclass

from sosmith.verify.certificate_file import StreamEntry
from sosmith.verify.chain.written import check_written
from sosmith.verify.reader.syntax import Module

_FAULT = 6
"""Bit of the flag of a fault."""


@dataclass(frozen=True, kw_only=True)
class TurnsClaim:
    """What the module must be made of: its name, how many cores, their results, check bits, and taps to be loaded."""

    name: str
    cores: int
    results: StreamEntry
    guarded: bool = False
    loads: bool = False

    @property
    def signals(self) -> dict[str, int]:
        """Widths of the signals that go with a result."""
        dest = {"tdest": self.results.dest_width} if self.results.dest_width else {}
        return {"tdata": self.results.width, "tuser": self.results.user_width} | dest

    def nets(self, stage: str, before: dict[str, str], behind: dict[str, str]) -> dict[str, str]:
        """Return the net at each port in the module of the chain, from those of the stage's streams."""
        nets = {"aclk": "aclk", "aresetn": "aresetn"}
        nets |= {f"s_{signal}": before[signal] for signal in ("tvalid", "tready")}
        for k in range(self.cores):
            nets |= {f"o{k}_tvalid": f"stage_{stage}_p{k}_given", f"o{k}_tready": f"stage_{stage}_p{k}_taken"}
            nets |= {f"i{k}_{signal}": f"stage_{stage}_p{k}_{signal}" for signal in (*self.signals, "tvalid", "tready")}
        nets |= {f"m_{signal}": behind[signal] for signal in (*self.signals, "tvalid", "tready")}
        if self.loads:
            nets |= {f"i{k}_begun": f"stage_{stage}_p{k}_reload_begun" for k in range(self.cores)}
            nets |= {"between": f"stage_{stage}_between"}
        return nets


def check_turns(module: Module, claim: TurnsClaim) -> None:
    """Check that a module joins cores so.

    Raises
    ------
    RejectedError
        If it is another one.
    """
    check_written(module, _text(claim), claim.name, "what joins the cores of a stage")


def _text(claim: TurnsClaim) -> str:
    count, bits = claim.cores, (claim.cores - 1).bit_length()
    ports = [("input", name, 1) for name in ("aclk", "aresetn", "s_tvalid")] + [("output", "s_tready", 1)]
    for k in range(count):
        ports += [("output", f"o{k}_tvalid", 1), ("input", f"o{k}_tready", 1)]
    for k in range(count):
        ports += [("input", f"i{k}_{signal}", width) for signal, width in claim.signals.items()]
        ports += [("input", f"i{k}_tvalid", 1), ("output", f"i{k}_tready", 1)]
    ports += [("output", f"m_{signal}", width) for signal, width in claim.signals.items()]
    ports += [("output", "m_tvalid", 1), ("input", "m_tready", 1)]
    if claim.loads:
        ports += [*(("input", f"i{k}_begun", 1) for k in range(count)), ("output", "between", 1)]
    text = [f"module {claim.name}({', '.join(name for _, name, _ in ports)});"]
    for way, name, width in ports:
        text += [f"{way} {_sized(name, width)};", f"wire {_sized(name, width)};"]
    text += ["wire reset;", "assign reset = ~aresetn;"]
    for k in range(count):
        others = f" & all{k - 1}" if k else ""
        text += [f"reg given{k} = 1'h0;", f"wire lacks{k};", f"assign lacks{k} = ~given{k};"]
        text += [f"assign o{k}_tvalid = s_tvalid & lacks{k};"]
        text += [f"wire has{k};", f"assign has{k} = given{k} | o{k}_tready;"]
        text += [f"wire all{k};", f"assign all{k} = has{k}{others};"]
    text += [f"assign s_tready = all{count - 1};", "wire stays;", f"assign stays = ~all{count - 1};"]
    for k in range(count):
        text += [f"wire next{k};", f"assign next{k} = has{k} & stays;"]
        text += [f"always_ff @(posedge aclk) if (reset) given{k} <= 1'h0; else if (s_tvalid) given{k} <= next{k};"]
    text += [f"reg {_sized('turn', bits)} = {bits}'h0;"]
    for k in range(count):
        text += [f"wire is{k};", f"assign is{k} = turn == {bits}'d{k};", f"assign i{k}_tready = is{k} & m_tready;"]
    for signal, width in {**claim.signals, "tvalid": 1}.items():
        rest = f"i{count - 1}_{signal}"
        for k in range(count - 2, 0, -1):
            own = f"from{k}_{signal}"
            text += [f"wire {_sized(own, width)};", f"assign {own} = is{k} ? i{k}_{signal} : {rest};"]
            rest = own
        target = "m_" + signal
        if claim.guarded and signal == "tuser":
            target = "own"
            text += [f"wire {_sized(target, width)};"]
        text += [f"assign {target} = is0 ? i0_{signal} : {rest};"]
    text += ["wire moves;", "assign moves = m_tvalid & m_tready;"]
    text += [f"wire {_sized('later', bits)};", f"assign later = turn + {bits}'h1;"]
    text += [f"wire {_sized('next_turn', bits)};", f"assign next_turn = is{count - 1} ? {bits}'h0 : later;"]
    text += [f"always_ff @(posedge aclk) if (reset) turn <= {bits}'h0; else if (moves) turn <= next_turn;"]
    if claim.guarded:
        text += _faults(count)
    if claim.loads:
        text += _swaps(count)
    return "\n".join([*text, "endmodule", ""])


def _faults(count: int) -> list[str]:
    """Return what gives a result a fault: its own, or that of the last result of any of the cores."""
    text = []
    for k in range(count):
        rest = f"any{k - 1}" if k else f"own[{_FAULT}]"
        text += [f"reg fault{k} = 1'h0;", f"wire leaves{k};", f"assign leaves{k} = moves & is{k};"]
        loads = f"else if (leaves{k}) fault{k} <= i{k}_tuser[{_FAULT}];"
        text += [f"always_ff @(posedge aclk) if (reset) fault{k} <= 1'h0; {loads}"]
        text += [f"wire any{k};", f"assign any{k} = fault{k} | {rest};"]
    return [*text, f"assign m_tuser = own | {{1'h0, any{count - 1}, {_FAULT}'h0}};"]


def _swaps(count: int) -> list[str]:
    """Return what says that all cores have chosen the bank of the sample on offer, or none."""
    text = []
    for k in range(count):
        text += [f"wire chooses{k};", f"assign chooses{k} = i{k}_begun | o{k}_tready;"]
        text += [f"wire offered{k};", f"assign offered{k} = s_tvalid & chooses{k};"]
        text += [f"wire chosen{k};", f"assign chosen{k} = given{k} | offered{k};"]
        for what, sign in (("some", "|"), ("every", "&")):
            rest = f"{what}{k - 1} {sign} " if k else ""
            text += [f"wire {what}{k};", f"assign {what}{k} = {rest}chosen{k};"]
    return [*text, "wire none;", f"assign none = ~some{count - 1};", f"assign between = none | every{count - 1};"]


def _sized(name: str, width: int) -> str:
    return name if width == 1 else f"[{width - 1}:0] {name}"
