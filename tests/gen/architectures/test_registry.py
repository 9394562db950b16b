"""The registry of architectures: one class for each that a specification can name."""

from sosmith.gen.architectures.registry import ARCHITECTURES, SMALLEST_FIRST
from sosmith.gen.specification import choices
from sosmith.gen.specification.combinations import TERMS


def test_the_classes_are_those_that_a_specification_can_name() -> None:
    assert {name: kind.terms for name, kind in ARCHITECTURES.items()} == TERMS
    assert ("auto", *TERMS) == choices.ARCHITECTURES
    assert len(SMALLEST_FIRST) == len(TERMS)


def test_each_class_is_whole() -> None:
    for kind in SMALLEST_FIRST:
        assert not kind.__abstractmethods__
        assert kind.checked
