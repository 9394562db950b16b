"""What a specification may ask of an FIR filter that decimates, and what it is told otherwise."""

from __future__ import annotations

import re
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest

from sosmith.gen.core import design_core
from sosmith.gen.specification.specification import from_tree
from sosmith.model.errors import ShortfallError, SpecificationError

LATER = "not yet available: "
WRONG: list[tuple[str, str, Any, str]] = [
    ("filter", "decimate", 1, "filter.decimate must be a whole number from 2 to 64, not 1"),
    ("filter", "decimate", 65, "filter.decimate must be a whole number from 2 to 64, not 65"),
    ("filter", "decimate", "auto", "filter.decimate must be a whole number from 2 to 64, not 'auto'"),
    (
        "output",
        "range",
        [Decimal("-1.5"), Decimal("1.5")],
        f"{LATER}output.range must be such with filter.decimate that one LSB of x is a power of two of those of the "
        "output, not [-1.5, 1.5]",
    ),
    (
        "input",
        "x",
        {"bits": 8, "range": [Decimal(1), Decimal(2)]},
        f"{LATER}input.x.range must be from 0 on with filter.decimate, not [1, 2]",
    ),
    (
        "hardware",
        "architecture",
        "serial",
        f"{LATER}hardware.architecture must be one of 'auto', 'parallel', 'folded' with an FIR filter that decimates, "
        "not 'serial'",
    ),
]


def tree(table: str = "", key: str = "", value: Any = None) -> dict[str, Any]:
    whole: dict[str, Any] = {
        "name": "down",
        "sample_rate": Decimal(1000),
        "input": {"x": {"bits": 8, "range": [Decimal(-1), Decimal(1)], "signed": True}},
        "filter": {"taps": [Decimal("0.25"), Decimal("0.5")], "decimate": 6},
        "output": {"bits": 8, "range": [Decimal(-1), Decimal(1)], "signed": True, "max_error": Decimal("0.02")},
        "hardware": {"clock": Decimal(10**6)},
    }
    if table:
        whole[table][key] = value
    return whole


@pytest.mark.parametrize(("table", "key", "value", "sentence"), WRONG)
def test_what_is_refused(table: str, key: str, value: Any, sentence: str) -> None:
    with pytest.raises(SpecificationError, match=f"^down.toml: {re.escape(sentence)}$"):
        from_tree(tree(table, key, value), Path("down.toml"))


def test_a_factor_that_is_no_power_of_two() -> None:
    made = design_core(from_tree(tree(), Path("down.toml")))
    down = made.datapath.downsampler
    assert down is not None
    assert (down.factor, down.filled) == (6, 1)
    assert made.architecture.name == "folded"
    assert made.architecture.copies_per_result == 1
    assert made.datapath.samples_per_result == 6


def test_a_realization_that_keeps_no_samples() -> None:
    sentence = (
        "the realization must be one that keeps samples where an FIR filter decimates; hardware.realization = "
        '"fir_direct" meets the specification as it is'
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(sentence)}$"):
        design_core(from_tree(tree("hardware", "realization", "fir_transposed"), Path("down.toml")))
