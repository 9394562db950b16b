"""Changes to a specification's text: comments stay, and the filter is always complete."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest
from tests.interface.small import FILTER
from tests.studio.sessions import TEXT

import sosmith
from sosmith.studio.edits import changed

MASK: dict[str, Any] = {
    "family": "elliptic",
    "kind": "lowpass",
    "passband_edge": 100.0,
    "stopband_edge": 150.0,
    "passband_loss": 0.5,
    "stopband_loss": 50.0,
}


def filter_after(table: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """Return the table of a filter after changes; the specification with it must be accepted."""
    text = sosmith.Specification.load(FILTER | {"filter": table}).toml()
    made = changed(text, {f"filter.{key}": value for key, value in changes.items()})
    sosmith.Specification.from_toml(made)
    found: dict[str, Any] = tomllib.loads(made)["filter"]
    return found


def test_all_else_stays_as_it_was_written() -> None:
    made = changed(TEXT, {"filter.cutoff": 123.5, "output.max_error": "faithful"})
    assert "cutoff = 123.5  # of the sensor" in made
    assert made.replace("123.5", "100.0").replace('max_error = "faithful"\n', "") == TEXT.replace(
        'max_error = "faithful"\n', ""
    )
    assert changed(TEXT, {"filter.cutoff": 100.0}) == TEXT


def test_a_table_that_is_missing_is_made() -> None:
    made = changed(TEXT, {"wear.limit": 2.0, "hardware.start": "zero"})
    assert tomllib.loads(made)["wear"] == {"limit": 2.0}
    assert tomllib.loads(changed(made, {"wear.limit": None}))["wear"] == {}


@pytest.mark.parametrize(
    ("family", "losses"),
    [
        ("chebyshev1", {"passband_loss": 1.0}),
        ("chebyshev2", {"stopband_loss": 40.0}),
        ("elliptic", {"passband_loss": 1.0, "stopband_loss": 40.0}),
        ("bessel", {}),
    ],
)
def test_a_family_comes_with_the_losses_that_it_needs(family: str, losses: dict[str, float]) -> None:
    made = filter_after(FILTER["filter"], family=family)
    assert made == FILTER["filter"] | {"family": family} | losses
    assert filter_after(made, family="butterworth") == FILTER["filter"]


@pytest.mark.parametrize(
    ("kind", "passband", "stopband"),
    [
        ("highpass", 100.0, 50.0),
        ("bandpass", [100.0, 200.0], [50.0, 350.0]),
        ("bandstop", [100.0, 200.0], [125.0, 175.0]),
    ],
)
def test_a_kind_comes_with_as_many_edges_as_it_has(kind: str, passband: Any, stopband: Any) -> None:
    made = filter_after(MASK, kind=kind)
    assert (made["passband_edge"], made["stopband_edge"]) == (passband, stopband)
    back = filter_after(made, kind="lowpass")
    assert (back["passband_edge"], back["stopband_edge"]) == (100.0, 125.0 if kind == "bandstop" else 200.0)
    assert filter_after(FILTER["filter"], kind=kind)["cutoff"] == passband


def test_one_form_takes_the_place_of_the_other() -> None:
    masked = filter_after(FILTER["filter"], passband_edge=80.0, stopband_edge=200.0)
    losses = {"passband_loss": 1.0, "stopband_loss": 40.0}
    edges = {"passband_edge": 80.0, "stopband_edge": 200.0}
    assert masked == {"family": "butterworth", "kind": "lowpass"} | edges | losses
    assert filter_after(masked, order=3, cutoff=90.0) == FILTER["filter"] | {"order": 3, "cutoff": 90.0}
    free = filter_after(masked, freedom="mask")
    assert free == masked | {"freedom": "mask"}
    assert filter_after(free, order=3, cutoff=90.0) == FILTER["filter"] | {"order": 3, "cutoff": 90.0}
    # one that came with an edge beyond half the sample rate goes with it
    text = sosmith.Specification.load(FILTER | {"filter": masked}).toml()
    beyond = changed(text, {"filter.passband_edge": 600.0})
    assert tomllib.loads(beyond)["filter"]["stopband_edge"] == 550.0
    assert tomllib.loads(changed(beyond, {"filter.passband_edge": 80.0}))["filter"]["stopband_edge"] == 160.0
    assert tomllib.loads(changed(text, {"filter.stopband_edge": 600.0}))["filter"]["stopband_edge"] == 600.0
    # an edge of the passband that passes that of the stopband takes it along
    assert filter_after(masked, passband_edge=220.0)["stopband_edge"] == 360.0


def test_what_is_wrong_stays_for_the_specification_to_say() -> None:
    sections = "sos = [[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]]"
    for given in (sections, 'kind = "narrow"\ncutoff = 1.0'):
        text = f"sample_rate = 10\n[filter]\n{given}"
        assert changed(text, {"filter.family": "bessel"}).strip() == f'{text}\nfamily = "bessel"'
    text = 'sample_rate = 10\n[filter]\nkind = "lowpass"\npassband_edge = "a"\nstopband_edge = 2.0\n'
    assert tomllib.loads(changed(text, {"filter.stopband_edge": 3.0}))["filter"]["passband_edge"] == "a"
