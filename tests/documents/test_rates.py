"""The tables of docs/rates.md are those that its command prints."""

import pytest
from benchmarks import rates


def test_the_choices_are_those_that_are_made() -> None:
    text = rates.DOCUMENT.read_text(encoding="utf-8")
    assert rates.with_choices(text) == text
    assert "| 1/400 |" in text


@pytest.mark.slow
def test_the_figures_are_those_of_the_designs() -> None:
    assert rates.document() == rates.DOCUMENT.read_text(encoding="utf-8")
