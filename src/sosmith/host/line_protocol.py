"""Results in the line protocol of InfluxDB: a measurement with tags, fields and a time for each."""

from __future__ import annotations

from collections.abc import Iterator

from sosmith.host.board import Results
from sosmith.model.link.identity import Identity


def influx_lines(identity: Identity, results: Results, first: int, start: float) -> Iterator[str]:
    """Give a line for each result.

    The measurement is the name of the core, the tag the channel; fields are the value by the name of the output, its
    code, and every flag. Times are in nanoseconds.

    Parameters
    ----------
    identity : Identity
        The board.
    results : Results
        Consecutive results.
    first : int
        Number of their first sample.
    start : float
        Time of sample 0, in seconds since 1970.
    """
    channels, output = identity.channels, identity.output_port.name
    codes, status = results.codes.reshape(-1).tolist(), results.status.reshape(-1).tolist()
    for n, value in enumerate(results.values.reshape(-1).tolist()):
        time = round((start + (first + n // channels) / identity.result_rate) * 1e9)
        flags = "".join(f",{flag}={'true' if status[n] >> bit & 1 else 'false'}" for flag, bit in results.flags.items())
        yield f"{identity.name},channel={n % channels} {output}={value!r},code={codes[n]}i{flags} {time}"
