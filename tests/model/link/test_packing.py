"""Packed results: what is packed comes out again, and the bits lie where docs/protocol.md says."""

from fractions import Fraction

import numpy as np
import pytest

from sosmith.model.link.packing import Packing, bytes_of
from sosmith.model.port import Port


def packing(bits: int, flags: tuple[int, ...], *, signed: bool = True) -> Packing:
    return Packing(Port(name="y", bits=bits, signed=signed, lsb=Fraction(1), zero=Fraction(0), unit=""), flags)


def test_the_bits_of_two_results() -> None:
    """Code 0x8001 with flag 6, then code 0x7FFE with flags 0 and 2: 19 bits each, the lowest first."""
    form = packing(16, (0, 2, 6))
    packed = form.packed(bytes.fromhex("01 80 40 FE 7F 05"))
    assert int.from_bytes(packed, "little") == 0b100 << 16 | 0x8001 | (0b011 << 16 | 0x7FFE) << 19
    assert form.plain(packed) == bytes.fromhex("01 80 40 FE 7F 05")


@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize(
    ("bits", "flags"), [(2, ()), (3, (5,)), (8, (0, 1)), (16, (0, 2, 6)), (25, (6,)), (32, (0, 7))]
)
def test_what_is_packed_comes_out_again(bits: int, flags: tuple[int, ...], signed: bool) -> None:
    form = packing(bits, flags, signed=signed)
    chance = np.random.default_rng(1)
    for count in (0, 1, 2, 7, form.per_message()):
        codes = chance.integers(form.port.lowest, form.port.highest, count, endpoint=True)
        status = chance.integers(0, 256, count) & sum(1 << flag for flag in flags)
        plain = bytes_of(np.stack([codes, status], axis=1), [form.port.bytes, 1])
        packed = form.packed(plain)
        assert len(packed) == -(-count * max(bits + len(flags), 8) // 8) <= 240
        assert form.plain(packed) == plain


def test_samples_of_many_bytes_leave_room_for_fewer() -> None:
    assert packing(16, (0, 2, 6)).per_message() == packing(16, (0, 2, 6)).per_message(2) == 101
    assert packing(16, (0, 2, 6)).per_message(3) == 80
