"""Other coefficients for a stage of a running chain: the bound holds with them, and what does not fit is refused."""

from __future__ import annotations

import copy
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from tests.gen.chain.chains import exact, stimulus

import sosmith
from sosmith.model.errors import ShortfallError, SpecificationError

TREE: dict[str, Any] = {
    "name": "rx",
    "sample_rate": 8000.0,
    "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    "stage": [
        {"name": "slow", "kind": "cic", "order": 2, "decimate": 2},
        {"name": "low", "kind": "iir", "family": "butterworth", "order": 2, "cutoff": 400.0, "reload": True},
        {"name": "mix", "kind": "fir", "taps": [0.25, 0.5, 0.75], "reload": True},
        {"name": "out", "kind": "fir", "taps": [0.25, 0.5, 0.25], "decimate": 2},
    ],
    "output": {"bits": 10, "range": [-2.0, 2.0], "signed": True, "max_error": 0.01},
}


@pytest.fixture(scope="module")
def chain() -> sosmith.Chain:
    return sosmith.design_chain(TREE)


def other(change: Callable[[Any], object]) -> dict[str, Any]:
    tree = copy.deepcopy(TREE)
    change(tree)
    return tree


def stage(k: int, **keys: Any) -> Callable[[Any], object]:
    return lambda tree: tree["stage"][k].update(keys)


@pytest.mark.slow
@pytest.mark.parametrize("cutoff", [350.0, 390.0])
def test_the_bound_holds_with_other_coefficients(cutoff: float, chain: sosmith.Chain) -> None:
    tree = other(stage(1, cutoff=cutoff))
    loaded = chain.reload(tree, reset=True, version=3)
    assert (loaded.stage, loaded.writes["version"], loaded.writes["name"]) == ("low", 3, "rx_low")
    assert loaded.writes["chain"] == {"name": "rx", "stage": "low", "error_bound": float(loaded.bound)}
    assert chain.core.stages[1].design.quantized.bound != loaded._swap.swaps[0].new_set.quantized.bound

    codes = stimulus(chain, 600, 1)
    values: np.ndarray[Any, Any] = codes[:, :, None]
    for k, each in enumerate(chain.core.stages):
        datapath = each.design.datapath if k != 1 else loaded._swap.swaps[0].new_set.quantized.datapath
        values = datapath.compute(values)[:, :, None]
    base = chain.core.spec.base
    (port,), output = base.inputs, base.output
    wanted = exact(sosmith.design_chain(tree), [port.zero + port.lsb * int(code) for code in codes[:, 0]])
    errors = [abs(output.lsb * code - value) for code, value in zip(values[:, 0, 0].tolist(), wanted, strict=True)]
    assert max(errors) <= loaded._swap.bound
    assert max(errors) > loaded._swap.bound / 4
    assert loaded._swap.bound <= Fraction(1, 100)


@pytest.mark.slow
def test_a_swap_without_a_reset_fades(chain: sosmith.Chain) -> None:
    loaded = chain.reload(other(stage(1, cutoff=390.0)))
    assert loaded.writes["transient_samples"] > 0
    (table,) = loaded.tables()
    assert ("registers", "s_axil_low") in [tuple(row) for row in table.rows]


@pytest.mark.parametrize(
    ("change", "error", "sentence"),
    [
        (
            lambda tree: None,
            SpecificationError,
            "specification: one stage must differ from specification, as each has registers of its own, not none",
        ),
        (
            lambda tree: (stage(1, cutoff=390.0)(tree), stage(2, taps=[0.25, 0.5, 0.5])(tree)),
            SpecificationError,
            r"one stage must differ from specification, as each has registers of its own, not low and mix$",
        ),
        (
            stage(3, taps=[0.25, 0.25, 0.25]),
            SpecificationError,
            "specification: stage out: hardware.reload must be true for a set to be loaded, not false",
        ),
        (
            stage(2, name="other"),
            SpecificationError,
            "specification: stage must be as in specification for a set to be loaded there",
        ),
        (
            lambda tree: (stage(1, cutoff=390.0)(tree), tree["output"].update(max_error=0.0043)),
            ShortfallError,
            r"specification: the chain must keep its error within .* with the set, and is proven to .* only: nothing",
        ),
        (
            stage(2, taps=[0.25, 0.5, 0.5, 0.5]),
            ShortfallError,
            r"^specification: stage mix: the filter's sections must have the coefficients ",
        ),
        (
            stage(2, taps=[0.25, 0.5, 1.25]),
            ShortfallError,
            r"the set must keep results behind stage mix below 1\.99805, where its port ends, not reach 2\.19",
        ),
    ],
)
def test_what_cannot_be_loaded_is_refused(
    change: Callable[[Any], object], error: type[Exception], sentence: str, chain: sosmith.Chain
) -> None:
    with pytest.raises(error, match=sentence):
        chain.reload(other(change))
