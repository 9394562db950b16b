"""What the bound on a polynomial rests on: variables of magnitude at most one."""

import json

import pytest
from tests.gen.word_lengths.filters import OUT, butterworth, plain

from sosmith.gen.output.certificate import certificate
from sosmith.verify.bounds.polynomial import polynomial_error
from sosmith.verify.certificate_file import Certificate, NodeEntry, Operation, StageEntry, certificate_text
from sosmith.verify.graph import RejectedError


@pytest.mark.parametrize(("frac", "low", "high"), [(6, -128, 127), (7, 0, 255), (7, -129, 0), (7, 0, 129)])
def test_an_input_larger_than_one_is_rejected(frac: int, low: int, high: int) -> None:
    read = Certificate.model_validate(json.loads(certificate_text(certificate(plain(butterworth(1, 0.1)), OUT.lsb))))
    entry = NodeEntry(op=Operation.INPUT, operands=(), frac=frac, low=low, high=high, name="x")
    stage = StageEntry(name="scaling", role="polynomial", nodes=(entry,), outputs=(0,))
    sentence = f"^input x must be at most one in size, not with {frac} fraction bits$"
    with pytest.raises(RejectedError, match=sentence):
        polynomial_error(read, [stage])
    most = entry.model_copy(update={"low": max(low, -(1 << frac)), "high": min(high, 1 << frac)})
    assert polynomial_error(read, [stage.model_copy(update={"nodes": (most,)})]) >= 0
