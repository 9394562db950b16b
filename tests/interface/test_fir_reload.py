"""Other taps for a core that runs: what the table says of them, and the number of taps that it cannot take."""

from __future__ import annotations

import re

import pytest

import sosmith
from sosmith.model.errors import ShortfallError


def given(taps: list[float], max_error: float = 0.01) -> sosmith.Specification:
    """Return the specification of taps that can be loaded anew, with an error that other taps keep."""
    return sosmith.Specification.from_taps(taps, sample_rate=1000.0, max_error=max_error).replaced(
        hardware={"reload": True, "start": "zero", "realization": "fir_direct", "architecture": "folded"}
    )


def test_states_that_are_past_inputs_are_called_that() -> None:
    """No set takes them out of their range, so that 0 % of it would be said."""
    table = sosmith.design(given([0.251, 0.503, 0.248])).reload(given([0.301, 0.402, 0.297], 0.5)).table
    assert ("states", "hold past inputs only") in [tuple(row) for row in table.rows]


def test_another_number_of_taps_is_refused() -> None:
    core, other = (given([k / 100 for k in range(1, count)]) for count in (8, 10))
    sentence = (
        "the filter's sections must have the coefficients b0, b1, ..., b6 (7 in all), not b0, b1, ..., b8 (9 in all): "
        "what is loaded are values, and the core stays as it is"
    )
    with pytest.raises(ShortfallError, match=f"{re.escape(sentence)}$"):
        sosmith.design(core).reload(other)
