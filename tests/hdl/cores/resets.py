"""Runs a core in Icarus at random handshakes, with resets in mid-stream, and compares each result with the model."""

from __future__ import annotations

import random
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

import sosmith
from sosmith.gen.output.verilog import core_verilog
from sosmith.hdl.plan.streams import dest_width

BENCH = """
module bench;
  reg aclk = 0, aresetn = 1, s_axis_tvalid = 0, m_axis_tready = 0;
  reg [{sample}:0] s_axis_tdata = 0;
  wire s_axis_tready, m_axis_tvalid;
  wire [{result}:0] m_axis_tdata;
  wire [7:0] m_axis_tuser;
  reg [{channel}:0] s_axis_tdest = 0;
  wire [{channel}:0] m_axis_tdest;
  reg [{word}:0] beats [0:{last}];
  integer next = 0, clock = 0, offers = 4, takes = 4;
  {name} core (.*);
  always @(posedge aclk) begin
    if (!aresetn) $display("reset");
    else begin
      if (m_axis_tvalid && m_axis_tready) $display("result %h %h %h", m_axis_tdest, m_axis_tdata, m_axis_tuser);
      if (s_axis_tvalid && s_axis_tready) $display("sample %h %h", s_axis_tdest, s_axis_tdata);
    end
  end
  initial begin
    $readmemh("beats.hex", beats);
    for (clock = 0; clock < {clocks}; clock = clock + 1) begin
      #1 aclk = 1;
      #1;
      if (!s_axis_tvalid || s_axis_tready_before || !aresetn) begin
        s_axis_tvalid = next <= {last} && $urandom % 4 < offers;
        {{s_axis_tdest, s_axis_tdata}} = beats[next];
        if (!s_axis_tvalid) {{s_axis_tdest, s_axis_tdata}} = $urandom;
        next = next + s_axis_tvalid;
      end
      m_axis_tready = next > {last} || $urandom % 4 < takes;
      aresetn = !(clock > 0 && next <= {last} && $urandom % {every} == 0);
      if ($urandom % 64 == 0) begin
        offers = 1 + $urandom % 4;
        takes = $urandom % 8 == 0 ? 0 : 1 + $urandom % 4;
      end
      #1 aclk = 0;
      #1;
    end
    $finish;
  end
  reg s_axis_tready_before = 0;
  always @(posedge aclk) s_axis_tready_before <= s_axis_tready;
endmodule
"""


class Seen(NamedTuple):
    """How many samples were taken, results came, and resets there were."""

    samples: int
    results: int
    resets: int


def check_resets(design: sosmith.Design, folder: Path, seed: int, *, beats: int = 400, text: str | None = None) -> Seen:
    """Check each result of a core, or of another text, between resets; raise AssertionError at a wrong one.

    Channels come in random order, some of them that do not exist. Behind the last sample, all results must leave.
    """
    spec, rng = design.specification.checked, random.Random(seed)
    (port,), channels = design.core.datapath.inputs, spec.channels
    bits = 8 * -(-port.bits // 8)
    several = channels > 1
    dest_bits = dest_width(channels) if several else 1
    words = [_beat(rng, port, channels) for _ in range(beats)]
    lines = [f"{channel << bits | code % (1 << port.bits):x}" for channel, code in words]
    (folder / "beats.hex").write_text("\n".join(lines) + "\n", encoding="utf-8")
    bench = BENCH.format(
        sample=bits - 1,
        result=8 * -(-spec.output.bits // 8) - 1,
        channel=dest_bits - 1,
        word=bits + dest_bits - 1,
        last=beats - 1,
        name=spec.name,
        clocks=beats * 20 + 4 * design.core.architecture.latency_cycles * (channels + 2) + 400,
        every=max(100, 3 * design.core.architecture.latency_cycles),
    )
    if not several:
        bench = bench.replace("(.*)", _ports())
    (folder / "bench.sv").write_text(bench, encoding="utf-8")
    (folder / "core.sv").write_text(core_verilog(design.core) if text is None else text, encoding="utf-8")
    subprocess.run(["iverilog", "-g2012", "-o", "bench", "bench.sv", "core.sv"], cwd=folder, check=True)
    ran = subprocess.run(["vvp", "-n", "bench"], cwd=folder, check=True, capture_output=True, text=True)
    runs = list(_runs(ran.stdout.splitlines()))
    for number, (samples, results) in enumerate(runs):
        _check_run(design, samples, results, last=number == len(runs) - 1)
    return Seen(sum(len(run[0]) for run in runs), sum(len(run[1]) for run in runs), len(runs) - 1)


def _ports() -> str:
    stream = ("tvalid", "tready", "tdata")
    names = ["aclk", "aresetn", *(f"{side}_axis_{name}" for side in "sm" for name in stream), "m_axis_tuser"]
    return f"({', '.join(f'.{name}({name})' for name in names)})"


def _beat(rng: random.Random, port: sosmith.Port, channels: int) -> tuple[int, int]:
    """Draw a channel, of few that are there more often, and a code, often at an end of its range."""
    code = rng.choice([port.lowest, port.highest, rng.randint(port.lowest, port.highest)])
    if channels == 1:
        return 0, code
    channel = rng.choice([0, channels - 1, rng.randrange(channels), rng.randrange(channels)])
    beyond = 1 << dest_width(channels)
    return (channel if rng.random() < 0.95 or channels == beyond else rng.randrange(channels, beyond)), code


Run = tuple[list[list[str]], list[list[str]]]


def _runs(lines: list[str]) -> Iterator[Run]:
    """Yield the samples and the results between resets."""
    samples: list[list[str]] = []
    results: list[list[str]] = []
    for line in lines:
        kind, *words = line.split()
        if kind == "reset":
            if samples or results:
                yield samples, results
            samples, results = [], []
        elif kind in {"sample", "result"}:
            (samples if kind == "sample" else results).append(words)
    yield samples, results


def _wanted(design: sosmith.Design, codes: list[int], channel: int) -> tuple[list[int], list[int]]:
    """Return the results and flags of a channel: as of the same samples in all of them, as each may have own limits."""
    block = np.repeat(np.array(codes, np.int64)[:, np.newaxis], design.specification.checked.channels, axis=1)
    results, status = design.core.datapath.compute_with_status(block[:, :, np.newaxis])
    return results[:, channel].tolist(), status[:, channel].tolist()


def _check_run(design: sosmith.Design, samples: list[list[str]], results: list[list[str]], *, last: bool) -> None:
    """Check the results that came between two resets."""
    spec = design.specification.checked
    factor, port = int(spec.filter.decimate or 1), design.core.datapath.inputs[0]
    codes: dict[int, list[int]] = {}
    order: list[tuple[int, int]] = []
    for where, word in samples:
        channel = int(where, 16) if spec.channels > 1 else 0
        if channel >= spec.channels:
            continue
        own = codes.setdefault(channel, [])
        if len(own) % factor == 0:
            order += [(channel, len(own) // factor)] * design.core.architecture.copies_per_result
        code = int(word, 16) % (1 << port.bits)
        own.append(code - (1 << port.bits) if code > port.highest else code)
    wanted = {channel: _wanted(design, own, channel) for channel, own in codes.items()}
    assert len(results) <= len(order)
    assert not last or len(results) == len(order), f"{len(results)} of {len(order)} results left"
    for (channel, number), (where, word, flags) in zip(order, results, strict=False):
        assert spec.channels == 1 or int(where, 16) == channel
        values, status = (each[number] for each in wanted[channel])
        bits = 8 * len(word) // 2
        assert int(word, 16) == int(values) % (1 << bits)
        assert int(flags, 16) == int(status)
