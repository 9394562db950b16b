"""Columns of results: their names differ, whatever a board calls its output."""

import pytest
from tests.host.lines import plain_device

from sosmith.host.rows import TAKEN, columns
from sosmith.model.link.identity import Identity


@pytest.mark.parametrize(
    ("name", "unit", "column"),
    [
        ("clearance", "mm", "clearance_mm"),
        *((name, "", f"{name}_value") for name in sorted(TAKEN)),
        ("time", "s", "time_s_value"),
        ("x", "code", "x_code_value"),
    ],
)
def test_no_two_columns_have_one_name(name: str, unit: str, column: str) -> None:
    about = plain_device()._identity.model_dump()
    output = (name, *about["output"][1:5], unit)
    found = columns(Identity.model_validate(about | {"output": output, "channels": 2}))
    assert column in found
    assert len({*found, "utc", "run", "session", "board"}) == len(found) + 4
