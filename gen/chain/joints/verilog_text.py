"""Pieces of the SystemVerilog that a chain has of its own."""

from __future__ import annotations

from collections.abc import Iterator


def range_of(width: int) -> str:
    """Range of a declaration, with a blank behind it; "" for a single bit."""
    return "" if width == 1 else f"[{width - 1}:0] "


def part_of(width: int, low: int = 0) -> str:
    """Select `width` bits from bit `low` on."""
    return f"[{low}]" if width == 1 else f"[{low + width - 1}:{low}]"


def net(name: str, width: int, value: str, before: str = "") -> Iterator[str]:
    """Declare a net with a value, behind a line `before` if there is one."""
    if before:
        yield before
    yield f"wire {range_of(width)}{name};"
    yield f"assign {name} = {value};"


def register(name: str, cleared: str, enable: str, value: str) -> Iterator[str]:
    """Let a register load a value at clocks that are enabled, and be cleared by a reset."""
    yield "always_ff @(posedge aclk)"
    yield f"  if (reset) {name} <= {cleared};"
    yield f"  else if ({enable}) {name} <= {value};"


def emptied(memory: str, words: int, width: int) -> Iterator[str]:
    """Let a memory begin with zeros."""
    yield f"initial begin : {memory}_cleared"
    yield "  integer i;"
    yield f"  for (i = 0; i < {words}; i = i + 1)"
    yield f"    {memory}[i] = {width}'h0;"
    yield "end"
