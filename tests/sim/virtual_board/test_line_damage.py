"""Damage to a line: as much as asked for, of the kinds asked for, the same for the same seed."""

import pytest

from sosmith.model.errors import SpecificationError
from sosmith.sim.virtual_board.line_damage import LineDamage


def test_the_same_seed_does_the_same_however_the_bytes_come() -> None:
    data = bytes(range(256)) * 20
    whole = LineDamage(50, 3)(data)
    pieces = LineDamage(50, 3)
    assert b"".join(pieces(data[n : n + 7]) for n in range(0, len(data), 7)) == whole
    assert whole != LineDamage(50, 4)(data)


def test_about_as_many_as_asked_for() -> None:
    damage = LineDamage(100, 1)
    damage(bytes(100_000))
    assert 800 < damage.count < 1200


@pytest.mark.parametrize(("kind", "change"), [("flip", 0), ("drop", -1), ("insert", 1)])
def test_each_kind(kind: str, change: int) -> None:
    damage = LineDamage(10, 1, (kind,))
    data = b"\x55" * 1000
    damaged = damage(data)
    assert len(damaged) - len(data) == change * damage.count
    assert damage.count > 50
    if kind == "flip":
        assert sum((a ^ b).bit_count() for a, b in zip(data, damaged, strict=True)) == damage.count


def test_bad_numbers_and_kinds() -> None:
    with pytest.raises(SpecificationError, match=r"^a fault must come once in 1 or more bytes, not in 0.5$"):
        LineDamage(0.5, 1)
    with pytest.raises(SpecificationError, match=r"^a fault must be one of flip, drop, insert, not lose$"):
        LineDamage(10, 1, ("lose",))
