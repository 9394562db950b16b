"""FIR filters in integers: the three forms compute the same sum, with as few products as there are magnitudes."""

import random

import pytest

from sosmith.model.dataflow.graph import Op, Range
from sosmith.model.sections.fir import FirSection, Form, TapProduct, grouped


def section(taps: list[int], form: Form) -> FirSection:
    products = tuple(
        TapProduct(f"b{members[0][0]}", round(value), 3, members) for value, members in grouped(taps, tolerance=0.5)
    )
    return FirSection(name="fir", products=products, form=form, x=Range(2, -100, 99))


@pytest.mark.parametrize("form", Form)
@pytest.mark.parametrize("seed", range(6))
def test_each_form_computes_the_sum(form: Form, seed: int) -> None:
    rng = random.Random(seed)
    taps = [rng.randint(-9, 9) for _ in range(rng.randint(2, 12))]
    taps[rng.randrange(len(taps))] = 7
    made = section(taps, form)
    codes = [rng.randint(-100, 99) for _ in range(40)]
    padded = [0] * (len(taps) - 1) + codes
    wanted = [sum(b * padded[n + len(taps) - 1 - k] for k, b in enumerate(taps)) for n in range(len(codes))]
    assert made.graph.run([[code] for code in codes]) == [[value] for value in wanted]
    (output,) = made.graph.output_ranges
    assert output.frac == 5


@pytest.mark.parametrize(
    ("taps", "counts"),
    [
        ([1, 2, 3, 3, 2, 1], {"direct": 6, "symmetric": 3, "transposed": 3}),
        ([1, -2, 0, 2, -1], {"direct": 4, "symmetric": 2, "transposed": 2}),
        ([3, 0, 5, 8, 5, 0, 3], {"direct": 5, "symmetric": 3, "transposed": 3}),
        ([5, 5, 5, 5], {"direct": 4, "symmetric": 1, "transposed": 1}),
    ],
)
def test_equal_taps_share_a_product(taps: list[int], counts: dict[str, int]) -> None:
    found = {form.value: sum(node.op is Op.SCALE for node in section(taps, form).graph.nodes) for form in Form}
    assert found == counts
    assert all(node.op is not Op.FLOOR for form in Form for node in section(taps, form).graph.nodes)


def test_what_is_no_filter_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^coefficient b0 must not be zero$"):
        TapProduct("b0", 0, 3, ((0, 1),))
    with pytest.raises(ValueError, match=r"^taps of b0 must not be empty$"):
        TapProduct("b0", 1, 3, ())
    with pytest.raises(ValueError, match=r"^products must not be empty$"):
        FirSection(name="fir", products=(), form=Form.DIRECT, x=Range(0, -1, 1))
