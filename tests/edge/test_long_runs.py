"""Memory of long runs, as bytes for each sample: what is read, written and compared is in memory once, or in pieces."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sosmith.gen.report.run import run_of
from sosmith.model import foreign_files
from sosmith.model.port import Port
from sosmith.model.reference import golden
from sosmith.model.tables import csv_table
from sosmith.model.traces import trace_file
from sosmith.model.traces.trace import Trace
from sosmith.model.traces.trace_file import read_traces, trace_pieces
from sosmith.sim.beats import Beats
from sosmith.sim.stream_packing import pack, random_order, unpack
from tests.interface.small import filter_design

ROWS = 40_000
PORT = Port(name="x", bits=16, signed=True, lsb=Fraction(1), zero=Fraction(0), unit="")


def bytes_a_row(work: Callable[[], Any], rows: int = ROWS) -> float:
    """Return the most memory that something takes, for each row."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1] / rows
    finally:
        tracemalloc.stop()


def test_a_trace_is_read_in_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreign_files, "_PIECE", 1 << 14)
    for module in (csv_table, trace_file):
        monkeypatch.setattr(module, "CHUNK", 1 << 11)
    path = tmp_path / "trace.csv"
    path.write_text("x_code\n" + "".join(f"{n % 1000}\n" for n in range(ROWS)))
    # code and line of each row; a piece and a chunk, however long the file is
    assert bytes_a_row(lambda: read_traces(path, (PORT,), Fraction(100))) < 8 + 4 + 24


@pytest.mark.slow
def test_a_trace_is_written_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace_file, "_WRITTEN", 1 << 10)
    trace = Trace(name="t", ports=(PORT,), sample_rate=Fraction(100), codes=np.zeros((ROWS, 1), dtype=np.int64))
    assert bytes_a_row(lambda: [None for _ in trace_pieces([trace])]) < 24


def test_streams_of_one_channel_keep_no_zeros(tmp_path: Path) -> None:
    streams = filter_design().facts.interface
    codes = np.arange(ROWS, dtype=np.int64).reshape(-1, 1, 1) % 500

    def there_and_back() -> None:
        sent = pack(codes, order := random_order(ROWS, 1, 1), streams.inputs)
        sent.save(tmp_path / "sent.npy")
        unpack(Beats(order, np.zeros(ROWS, np.uint64), np.zeros(ROWS, np.uint64)), order, streams.outputs)

    there_and_back()
    assert (tmp_path / "sent.npy").stat().st_size < 9 * ROWS
    again = Beats.load(tmp_path / "sent.npy")
    assert again.same_as(pack(codes, random_order(ROWS, 1, 1), streams.inputs))


def test_a_comparison_keeps_codes_and_the_exact_result(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(golden, "BLOCK", 1 << 11)
    design = filter_design().core
    codes = np.zeros((ROWS, 1), dtype=np.int64)
    codes.setflags(write=False)
    trace = Trace(name="t", ports=design.datapath.inputs, sample_rate=design.spec.sample_rate, codes=codes)
    run_of(design, [trace])  # compiled by now
    # received, exact, flags and differences; a block of the exact chain
    assert bytes_a_row(lambda: run_of(design, [trace])) < 8 + 8 + 3 + 9


@pytest.mark.slow
def test_ten_million_samples_are_simulated_in_little_memory() -> None:
    memory = pytest.importorskip("benchmarks.memory")
    assert memory.losses([], memory.measured()) == []
