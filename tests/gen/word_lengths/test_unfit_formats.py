"""A search in which no format fits the hardware comes to its end."""

from typing import Any

import pytest

import sosmith
from sosmith.gen.word_lengths.search import Search

SPEC: dict[str, Any] = {
    "name": "unfit",
    "sample_rate": 100.0,
    "input": {"x": {"bits": 16, "signed": False, "range": [2.0, 5.0]}},
    "filter": {"family": "bessel", "kind": "lowpass", "order": 1, "cutoff": 1.804195626385019, "decimate": 4},
    "output": {"bits": 16, "signed": False, "range": [0.0, 8.0], "max_error": 0.0003662109375},
    "hardware": {"clock": 12.0e6, "architecture": "folded", "realization": "df2t"},
}


def test_sizes_that_are_all_infinite_end_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step that leaves a size infinite saves nothing that could be told: the search went in circles."""
    taken = 0
    closer = Search._closer

    def counted(search: Search, *arguments: Any, **named: Any) -> Any:
        nonlocal taken
        taken += 1
        assert taken < 100, "the search must come to its end"
        return closer(search, *arguments, **named)

    monkeypatch.setattr(Search, "_closer", counted)
    with pytest.raises(
        sosmith.SosmithError,
        match=r"^specification: the realization must suit the folded architecture: a product of two values must end "
        r"below its sum's top digit to be folded; parallel takes every realization$",
    ):
        sosmith.design(SPEC)
    assert taken > 0
