"""Results of a board as rows of a table, one for each result."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sosmith.host.board import Results
from sosmith.model.link.identity import Identity
from sosmith.model.port import Port

Row = tuple[float, *tuple[float, ...]]
"""Time, channel if there are several, value, code, status."""


TAKEN = frozenset({"utc", "time_s", "run", "session", "channel", "status", "board"})
"""Names of columns that a value's must differ from."""


def columns(identity: Identity) -> tuple[str, ...]:
    """Return the names of the columns: time_s, channel if there are several, the value with its unit, code, status."""
    output = identity.output_port
    channel = ("channel",) if identity.channels > 1 else ()
    return ("time_s", *channel, value_column(output), f"{output.name}_code", "status")


def value_column(output: Port) -> str:
    """Return the name of the column of an output's values, such as clearance_mm; status_value if it is `TAKEN`."""
    unit = "".join(c if c.isalnum() else "_" for c in output.unit)
    name = f"{output.name}_{unit}" if unit else output.name
    return f"{name}_value" if name in TAKEN or name == f"{output.name}_code" else name


def rows(identity: Identity, results: Results, first: int = 0) -> Iterator[Row]:
    """Give a row for each result, the first of number `first`; all channels are there for each."""
    channels = identity.channels
    table = np.stack([np.arange(results.codes.size), results.codes.reshape(-1), results.status.reshape(-1)], axis=1)
    for (n, code, status), value in zip(table.tolist(), results.values.reshape(-1).tolist(), strict=True):
        time = (first + n // channels) / identity.result_rate
        yield (time, *([n % channels] if channels > 1 else []), value, code, status)
