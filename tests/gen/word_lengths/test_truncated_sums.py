"""What a proof leaves of the error allowed, spent on sums that drop bits."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest
from tests.gen.word_lengths.filters import OUT, SIGNED, butterworth

from sosmith.gen.realizations.kept_formats import Choice
from sosmith.gen.word_lengths import quantize
from sosmith.gen.word_lengths.objective import FEW_ADDERS, SMALL_AREA, Objective
from sosmith.gen.word_lengths.other_realization import with_realization
from sosmith.gen.word_lengths.quantize import Plan, plan, prove
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.gen.word_lengths.truncated_sums import with_truncated_sums
from sosmith.model.sections.direct_form import DirectForm1, Product

AUDIO = 1000.0 / 48000.0


@cache
def trimmed(objective: Objective = FEW_ADDERS) -> Plan:
    planned = plan(
        name="test",
        inputs=(SIGNED,),
        output=OUT,
        max_error=OUT.lsb,
        ideal=butterworth(5, AUDIO),
        polynomial=None,
        realization="df1_ef2",
    )
    return planned.under(objective).trimmed()


def products(quantized: Quantized) -> list[Product]:
    """Return the products of all sections."""
    sections = [section for section in quantized.sections if isinstance(section, DirectForm1)]
    return [product for section in sections for product in section.products]


def whole(monkeypatch: pytest.MonkeyPatch) -> Quantized:
    """Prove the design with whole products."""
    with monkeypatch.context() as patch:
        patch.setattr(quantize, "with_truncated_sums", lambda *_: None)
        return prove(trimmed())


def test_sums_drop_bits_within_the_error_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    before, after = whole(monkeypatch), prove(trimmed())
    assert all(product.sums is None for product in products(before))
    cut = [product for product in products(after) if product.sums is not None]
    assert cut
    for product in cut:
        assert product.floored is not None
        assert product.sums is not None
        assert product.sums >= product.floored
    assert after.bound <= 1
    assert FEW_ADDERS.of_datapath(after.datapath) < FEW_ADDERS.of_datapath(before.datapath)
    assert [replace(p, sums=None, range=None) for p in products(after)] == [
        replace(p, range=None) for p in products(before)
    ]


def test_sums_that_drop_too_much_are_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each floor is a quantizer of the proof."""

    def far_too_much(_: object, choice: Choice, sections: object, left: float) -> Choice:
        del sections, left
        last = len(choice.formats) - 1
        form = choice.formats[last]
        return choice.with_format(last, form.with_frac("product_A2_sums", form.fracs["product_A2"] - 6))

    before = whole(monkeypatch)
    monkeypatch.setattr(quantize, "with_truncated_sums", far_too_much)
    assert products(prove(trimmed())) == products(before)


def test_products_of_blocks_stay_whole() -> None:
    assert all(product.sums is None for product in products(prove(trimmed(SMALL_AREA))))


def test_nothing_is_spent_where_nothing_is_left() -> None:
    planned = trimmed()
    assert planned.search is not None
    assert planned.start is not None
    sections = prove(planned).sections
    assert with_truncated_sums(planned.search, planned.start, sections, 0.0) is None
    assert with_truncated_sums(planned.search, planned.start, sections, 1e-9) is None
    assert with_truncated_sums(planned.search, planned.start, sections, 0.1) is not None


def test_the_same_widths_are_those_of_the_sums_too() -> None:
    proven = prove(trimmed())
    again = with_realization(proven, "df1_ef2")
    assert again.bound == proven.bound
    assert products(again) == products(proven)
    assert with_realization(proven, "df1_ef1").bound > proven.bound
