"""The tables of docs/rates.md are those that its command prints."""

import json

import pytest
from benchmarks import rates


@pytest.mark.slow
def test_the_choices_are_those_that_are_made() -> None:
    text = rates.DOCUMENT.read_text(encoding="utf-8")
    assert rates.with_choices(text) == text
    assert "| 1/400 |" in text


def test_the_picture_shows_every_architecture_as_it_was_measured() -> None:
    record = json.loads(rates.RECORD.read_text(encoding="utf-8"))
    assert rates.picture(record) == rates.PICTURE.read_text(encoding="utf-8")
    assert list(rates.curves(record, "ecp5")) == list(rates.CURVES)
    for key in ("hx8k", "ecp5"):
        marks = [point.mark for point in rates.curves(record, key)["online"]]
        assert marks == ["16 bits", "24 bits"]


@pytest.mark.slow
def test_the_figures_are_those_of_the_designs() -> None:
    assert rates.document() == rates.DOCUMENT.read_text(encoding="utf-8")
