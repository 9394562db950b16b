"""Fields of ports on an AXI4-Stream, and the number of a channel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sosmith.model.port import Port


@dataclass(frozen=True)
class Field:
    """A port on a stream, extended to whole bytes: `offset` is that of its lowest bit."""

    port: Port
    offset: int

    @property
    def padded(self) -> int:
        """Width on the bus, in bits."""
        return 8 * self.port.bytes


def fields(ports: Sequence[Port]) -> tuple[Field, ...]:
    """Return the fields of `ports` on a stream, the first one lowest."""
    placed: list[Field] = []
    offset = 0
    for port in ports:
        placed.append(Field(port, offset))
        offset += placed[-1].padded
    return tuple(placed)


def width(ports: Sequence[Port]) -> int:
    """Return the width of ``tdata`` for `ports`, in bits."""
    return sum(field.padded for field in fields(ports))


def channel_bits(channels: int) -> int:
    """Return the width of a channel's number; 0 for one channel."""
    return (channels - 1).bit_length()


def dest_width(channels: int) -> int:
    """Return the width of ``tdest`` in whole bytes; 0 for one channel, which has none."""
    return -(-channel_bits(channels) // 8) * 8
