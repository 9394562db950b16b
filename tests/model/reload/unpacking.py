"""Reads the words of a bank as the hardware does."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.model.reload.constants import Constant

WORD_BITS = 32


def unpacked(words: Sequence[int], loadable: Sequence[Constant]) -> list[int]:
    """Return the constants in the words of a bank as the hardware sees them, without the bits beyond their widths."""
    values, start = [], 0
    for constant in loadable:
        whole = sum(word << WORD_BITS * k for k, word in enumerate(words[start : start + constant.words]))
        code = whole & ((1 << constant.bits) - 1)
        values.append(code - (code >> (constant.bits - 1) << constant.bits))
        start += constant.words
    assert start == len(words)
    return values
