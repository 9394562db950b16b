"""Hostile messages to boards: what they answer is what docs/protocol.md says, byte by byte, and nothing else."""

from __future__ import annotations

import os
import random
import select
import time
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from sosmith.gen.output.identity import identity
from sosmith.gen.output.verilog import core_verilog
from sosmith.model.link.device import Device
from sosmith.model.link.identity import Identity, Reload
from sosmith.model.link.integer_core import IntegerCore
from sosmith.sim.virtual_board.netlist import build
from sosmith.sim.virtual_board.terminal import Terminal
from tests.edge.document_client import ExpectedBoard
from tests.edge.hostile_host import asked
from tests.host.lines import plain_device
from tests.host.reloadable import ReloadableCore
from tests.interface.small import filter_design

CLOCK, BAUD = Fraction(4_000_000), 1_000_000
IDLE = bytes(80)
"""Zero bytes, which are no frame, for as long as the hardware looks at the longest one: two in a row beyond the host's
credit would be dropped."""

PATIENCE = 60.0
"""Seconds for an answer, on however busy a machine."""


@dataclass(frozen=True)
class Answered:
    """What became of hostile messages.

    Attributes
    ----------
    messages : int
        Hostile ones.
    findings : tuple of str
        Answers that must not be.
    """

    messages: int
    findings: tuple[str, ...]


def to_model(seed: int, count: int) -> Answered:
    """Send messages to the model of a board, with registers for odd seeds; cut the bytes at any place."""
    rng = random.Random(seed)
    registers, window = seed % 2 == 1, rng.choice((2, 4, 8, 16))
    about = _identity(registers=registers)
    device = Device(about, _core(registers=registers), window=window)
    sizes = (about.sample_bytes, about.samples, about.channels)
    expected = ExpectedBoard(_core(registers=registers), about.memory, sizes, registers=registers, window=window)
    hostile, findings = 0, []
    for message in asked(expected, rng, count):
        hostile += message.hostile
        cut = rng.randrange(len(message.data) + 1)
        answer = device.feed(message.data[:cut]) + device.feed(message.data[cut:])
        wanted = expected.feed(message.data)
        if answer != wanted:
            findings.append(f"{message.data.hex()} must be answered by {wanted.hex()}, not {answer.hex()}")
            break
    if device.counters != expected.counters:
        findings.append(f"the counters must be {expected.counters}, not {device.counters}")
    return Answered(hostile, tuple(findings))


def to_netlist(folder: Path, seed: int, count: int) -> Answered:
    """Send messages to the hardware of a board in Verilator, over a pseudo-terminal, each when the last is answered."""
    core, rng = filter_design().core, random.Random(seed)
    about = identity(core, core_verilog(core), baud=BAUD, clock=float(CLOCK))
    sizes = (about.sample_bytes, about.samples, about.channels)
    expected = ExpectedBoard(_core(registers=False), about.memory, sizes, window=2)
    netlist = build(core, folder, clock=CLOCK, baud=BAUD)
    hostile = 0
    with Terminal() as terminal, netlist.at(terminal.end):
        handle, read = line_of(terminal.path)
        for n, message in enumerate(asked(expected, rng, count)):
            hostile += message.hostile
            data = message.data + IDLE
            os.write(handle, data)
            answer, wanted = b"", expected.feed(data)
            end = time.monotonic() + PATIENCE
            while len(answer) < len(wanted) and time.monotonic() < end:
                answer += read(1.0)
            if answer != wanted:
                return Answered(hostile, (f"message {n} must be answered by {wanted.hex()}, not {answer.hex()}",))
        os.close(handle)
    return Answered(hostile, ())


def line_of(path: str) -> tuple[int, Callable[[float], bytes]]:
    """Open a pseudo-terminal; return its descriptor, and what reads from it."""
    handle = os.open(path, os.O_RDWR | os.O_NOCTTY)

    def read(seconds: float) -> bytes:
        ready, _, _ = select.select([handle], [], [], seconds)
        return os.read(handle, 4096) if ready else b""

    return handle, read


def _identity(*, registers: bool) -> Identity:
    made = plain_device()._identity
    return made if not registers else made.model_copy(update={"reload": Reload(design=1, words=3)})


def _core(*, registers: bool) -> IntegerCore | ReloadableCore:
    path = filter_design().core.datapath
    return ReloadableCore(path, 1, 3, {}) if registers else IntegerCore(path, 1)
