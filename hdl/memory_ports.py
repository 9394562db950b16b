"""Ports of memories whose nets say of which memory they are.

::

    address ---> name_read_address  +--------+  name_read_data ----> data, one clock later
    enable ----> name_read_enable   | memory |
    address ---> name_write_address |  name  |
    data ------> name_write_data    +--------+
    enable ----> name_write_enable
"""

from __future__ import annotations

from amaranth.hdl import Signal
from amaranth.lib.memory import Memory, ReadPort, WritePort

_MEMBERS = {"addr": "address", "data": "data", "en": "enable"}


def read_port(memory: Memory, name: str, domain: str = "sync") -> ReadPort:
    """Return a port that reads a memory, one clock later; at once in the domain "comb", where nothing enables it."""
    port = memory.read_port(domain=domain)
    _name(port, f"{name}_read")
    return port


def write_port(memory: Memory, name: str) -> WritePort:
    """Return a port that writes a memory."""
    port = memory.write_port()
    _name(port, f"{name}_write")
    return port


def _name(port: ReadPort | WritePort, name: str) -> None:
    for member, word in _MEMBERS.items():
        if isinstance(signal := getattr(port, member), Signal):
            signal.name = f"{name}_{word}"
