"""Many datapaths of one structure, computed at once."""

import re

import numpy as np
import pytest
from tests.model.datapaths import butterworth, cascade

from sosmith.model.dataflow.stacked import compute_stacked


@pytest.mark.parametrize("feedback", [0, 1, 2])
def test_equals_each_datapath_by_itself(feedback: int) -> None:
    datapaths = [cascade(butterworth(3, cutoff), feedback=feedback) for cutoff in (0.05, 0.06, 0.08)]
    codes = np.random.default_rng(feedback).integers(-32768, 32768, (120, 3, 1))
    codes[60:90] = 32767  # a step at full scale, which the overshoot saturates
    together = compute_stacked(datapaths, codes)
    for k, one in enumerate(datapaths):
        assert together[:, k].tolist() == one.compute_exact(codes[:, k])
    assert not np.array_equal(together[:, 0], together[:, 1])


def test_refuses_what_is_of_another_structure() -> None:
    plain, other = cascade(butterworth(3, 0.05)), cascade(butterworth(2, 0.05))
    with pytest.raises(ValueError, match=re.escape("datapaths must be of one structure")):
        compute_stacked([plain, other], np.zeros((1, 2, 1), dtype=np.int64))


def test_refuses_codes_that_64_bits_may_not_hold() -> None:
    wide = cascade(butterworth(3, 0.05), bits=45)
    with pytest.raises(ValueError, match=r"^codes must be of at most 62 bits, not \d+$"):
        compute_stacked([wide], np.zeros((1, 1, 1), dtype=np.int64))
