"""Structures of a decimation chain: each decimates by the factor, none twice, and all sensible ones are there."""

from __future__ import annotations

import pytest

from sosmith.gen.chain.automatic.structures import structures


@pytest.mark.parametrize("factor", [2, 3, 8, 13, 60, 64, 1024, 4032, 4096])
def test_each_structure_decimates_by_the_factor(factor: int) -> None:
    found = list(structures(factor))
    assert found
    assert {each.factor for each in found} == {factor}
    assert len(set(found)) == len(found)
    assert all(step.factor <= 64 for each in found for step in each.steps)
    assert all(len(each.steps) <= 8 for each in found)


def test_the_kinds_that_are_tried() -> None:
    families = {each.family for each in structures(64)}
    assert {
        ("fir",),
        ("halfband",),
        ("halfband", "fir"),
        ("cic", "fir"),
        ("cic", "halfband", "fir"),
        ("fir", "halfband", "fir"),
        ("cic", "fir", "halfband", "fir"),
        ("cic", "halfband", "iir", "every"),
    } <= families


def test_a_structure_is_told_by_kinds_and_factors() -> None:
    texts = {str(each) for each in structures(64)}
    assert {"FIR 64", "2 FIRs 8", "CIC 8, FIR 8", "CIC 16, half-band, FIR 2", "CIC 64, FIR", "CIC 32, IIR 2"} <= texts
