"""The registry of realizations: what a specification can name is what there is."""

from sosmith.gen.realizations.registry import BEST_KEPT, CASCADES, REALIZATIONS
from sosmith.gen.specification import choices


def test_the_names_are_those_that_a_specification_can_name() -> None:
    assert ("auto", *REALIZATIONS) == choices.REALIZATIONS


def test_what_is_asked_of_the_registry() -> None:
    assert [REALIZATIONS[name].terms.feedback_order for name in choices.ERROR_FEEDBACK] == [0, 1, 2]
    assert set(choices.ERROR_FEEDBACK) < set(CASCADES) < set(REALIZATIONS)
    assert BEST_KEPT in REALIZATIONS
    assert all(REALIZATIONS[name].cascade != bool(REALIZATIONS[name].not_decimated) for name in REALIZATIONS)
