"""Attributes of memories, for synthesis."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

NO_COLLISIONS: Mapping[str, int] = MappingProxyType({"no_rw_check": 1})
"""Nobody uses what a memory reads at the clock at which that very word is written.

Simulators give the old word. Block RAMs give anything, and Yosys, unless told that this is good enough, puts registers,
a comparison and a multiplexer around them.
"""
