"""What words of the hardware are called by the graph: never a constant by the name of a code."""

from pathlib import Path

import pytest
from tests.verify.parallel.cores import small
from tests.verify.small_specifications import PLAIN

import sosmith
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.graph_codes import GraphCodes
from sosmith.verify.program.normal_form import ONE

FLAT = {
    "name": "flat",
    "sample_rate": 48000.0,
    "channels": 3,
    "input": {"x": {"bits": 13, "range": [-2.5, 2.5], "signed": True}},
    "filter": {
        "family": "chebyshev1",
        "kind": "lowpass",
        "order": 6,
        "cutoff": 2.1269429280502186,
        "passband_loss": 0.5,
        "decimate": 4,
    },
    "output": {"bits": 17, "range": [-5.0, 5.0], "signed": True, "max_error": 0.0025},
    "hardware": {"architecture": "parallel", "clock": 48e6},
}
"""Its first section hands on a code that is a multiple of two: it has no product."""


def test_a_constant_keeps_its_value_beside_an_even_code() -> None:
    codes = GraphCodes(small(PLAIN).certificate, Forms())
    even, name = {("a",): 2, ("b",): -4}, {("c",): 1}
    codes._seams = {frozenset(even.items()): name}  # type: ignore[dict-item]
    assert codes.shortened(even, 8, at_inlet=True) == name
    for width in (1, 2):
        assert codes.shortened({}, width, at_inlet=True) == {}
        assert codes.shortened({ONE: 2}, width, at_inlet=True) == {ONE: 2}


@pytest.mark.slow
def test_a_section_without_a_product_is_proven(tmp_path: Path) -> None:
    sosmith.design(FLAT).generate(tmp_path)
    assert sosmith.Certificate.load(tmp_path / "flat.certificate.json").verify(files=tmp_path)
