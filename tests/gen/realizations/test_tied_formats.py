"""Formats of sections that share hardware: the same in all of one structure, and what their steps change."""

from __future__ import annotations

from fractions import Fraction

import pytest

import sosmith
from sosmith.gen.realizations.direct_form import best_feedback, common_feedback
from sosmith.gen.realizations.tied_formats import (
    check_that_some_share,
    groups_of,
    standing_together,
    with_the_most,
)
from sosmith.gen.realizations.tied_row import TiedRow
from sosmith.gen.realizations.transposed import common_exponent
from sosmith.model.dataflow.graph import Op
from sosmith.model.errors import ShortfallError

LOW = (0.01, 0.02, 0.01, 1.0, -1.8, 0.84)
"""Poles next to z = 1."""

MIDDLE = (0.2, 0.4, 0.2, 1.0, -0.5, 0.3)
FIRST = (0.1, 0.1, 0.0, 1.0, -0.8, 0.0)


def test_sections_of_one_order_and_numerator_are_a_group() -> None:
    assert groups_of((LOW, FIRST, LOW), "df1") == ((0, 2), (1,))


def test_sections_alike_stand_together_in_the_order_of_the_first() -> None:
    assert standing_together((LOW, FIRST, MIDDLE), "df1") == (LOW, MIDDLE, FIRST)
    assert standing_together((FIRST, LOW, MIDDLE), "df2t") == (FIRST, LOW, MIDDLE)


def test_sections_of_which_none_share_are_refused_before_their_formats_are_chosen() -> None:
    check_that_some_share((LOW, FIRST, MIDDLE), "df1")
    sentence = (
        r"^the multiplexed architecture must have two sections with the same operations, one behind the other, and has "
        r"none: another realization may have some, and parallel takes every one$"
    )
    with pytest.raises(ShortfallError, match=sentence):
        check_that_some_share((LOW, FIRST), "df1")


def own_feedback(row: tuple[float, ...]) -> tuple[int, int]:
    """Return the error feedback that is best for a section by itself."""
    return best_feedback((Fraction(row[4]), Fraction(row[5])), (-2, 1), 2)


def test_sections_that_stand_together_have_one_error_feedback() -> None:
    low, middle = (own_feedback(row) for row in (LOW, MIDDLE))
    assert low != middle
    rows = standing_together((LOW, MIDDLE), "df1_ef2")
    assert all(isinstance(row, TiedRow) for row in rows)
    assert {row.feedback for row in rows if isinstance(row, TiedRow)} == {common_feedback((LOW, MIDDLE), 2)}
    assert len(groups_of((LOW, MIDDLE), "df1_ef2")) == 2
    assert len(groups_of(rows, "df1_ef2")) == 1


def test_the_common_feedback_is_the_best_of_one() -> None:
    assert common_feedback((LOW,), 2) == own_feedback(LOW)
    assert common_feedback((LOW, LOW), 2) == common_feedback((LOW,), 2)


def test_all_of_a_group_have_the_most_fraction_bits_of_one() -> None:
    fracs = [{"v": 3, "a": 1}, {"v": 5}, {"v": 4, "a": 7}]
    assert with_the_most(fracs, ((0, 2),)) == [{"v": 4, "a": 7}, {"v": 5}, {"v": 4, "a": 7}]


@pytest.mark.parametrize("realization", ["df1", "df1_ef2", "df2t", "delta"])
@pytest.mark.parametrize("most", [0.02, 0.004])
def test_trimmed_formats_are_the_same(realization: str, most: float) -> None:
    spec = {
        "name": "tied",
        "sample_rate": 1000.0,
        "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"family": "butterworth", "kind": "lowpass", "order": 6, "cutoff": 40.0},
        "output": {"bits": 9, "range": [-1.0, 1.0], "signed": True, "max_error": most},
        "hardware": {"architecture": "multiplexed", "realization": realization, "clock": 1e6},
    }
    design = sosmith.design(spec)
    (unit,) = design.core.architecture.plan.shared
    assert len(unit.stages) == 3
    formats = [{node.name: node.frac for node in stage.graph.nodes if node.op is Op.DELAY} for stage in unit.stages]
    assert len({(each["v1" if "v1" in each else "s1"]) for each in formats}) == 1
    assert float(design.bound) <= most


def test_sections_that_stand_together_have_one_exponent() -> None:
    rows = standing_together((LOW, MIDDLE), "delta")
    assert {row.delta_exponent for row in rows if isinstance(row, TiedRow)} == {common_exponent((LOW, MIDDLE))}
    assert len(groups_of((LOW, MIDDLE), "delta")) == 2
    assert len(groups_of(rows, "delta")) == 1


def test_sections_that_take_turns_add_up_states_when_they_are_needed() -> None:
    """Such a sum is there before the input is, and a word that is remembered for it would be one of each section."""
    spec = {
        "name": "tied",
        "sample_rate": 48000.0,
        "input": {"x": {"bits": 16, "range": [-1.0, 1.0], "signed": True}},
        "filter": {"family": "butterworth", "kind": "lowpass", "order": 4, "cutoff": 1000.0},
        "output": {"bits": 16, "range": [-1.0, 1.0], "signed": True, "max_error": "faithful"},
    }

    def remembered(architecture: str) -> set[str]:
        design = sosmith.design({**spec, "hardware": {"architecture": architecture, "realization": "df1_ef2"}})
        nodes = [node for stage in design.core.datapath.stages for node in stage.graph.nodes]
        return {node.name for node in nodes if node.op is Op.DELAY and node.name.startswith("taps_")}

    assert remembered("parallel") == {"taps_A1_1"}
    assert remembered("multiplexed") == set()
