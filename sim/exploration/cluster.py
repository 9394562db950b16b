"""Runs tasks on a Dask cluster that exists; its workers need sosmith and a C compiler."""

from __future__ import annotations

import itertools
from collections.abc import Generator, Iterable, Sequence

from sosmith.model.errors import ToolError
from sosmith.sim.exploration.evaluation import Point, evaluate
from sosmith.sim.exploration.grid import Task

_BATCH = 2_000
"""Tasks that the scheduler knows of at a time; each takes it well under a millisecond."""

_CONNECT = 10
"""Seconds until a scheduler must have answered."""


def on_cluster(batches: Iterable[Sequence[Task]], address: str) -> Generator[Point, None, None]:
    """Yield the results of tasks as they come from the workers of the scheduler at `address`.

    A task whose worker dies is done again by another one; the scheduler hands out each result once. When the caller
    stops, what has not begun is dropped.

    Raises
    ------
    ToolError
        If the package distributed is missing, the scheduler does not answer, a task has killed several workers, or as
        `evaluate`.
    """
    try:
        from distributed import Client, as_completed
        from distributed.comm import resolve_address
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise ToolError(
            "the package distributed is needed for --scheduler, and was not found: pip install 'sosmith[cluster]'"
        ) from None
    try:
        resolve_address(address)  # a client that cannot read its address would wait for an answer when it is collected
        client = Client(address, timeout=_CONNECT, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:  # the last for TLS without a configuration
        raise ToolError(f"a Dask scheduler must answer at {address or 'an address'}, not: {error}") from None
    try:
        for tasks in itertools.chain.from_iterable(map(_parts, batches)):
            futures = [client.submit(evaluate, task, key=f"sosmith-{task.key}") for task in tasks]
            for future in as_completed(futures, loop=client.loop):
                yield future.result()
                future.release()
    except KilledWorker as error:
        raise ToolError(f"the cluster's workers must live until their designs are done, not: {error}") from None
    finally:
        client.close()


def _parts(tasks: Sequence[Task]) -> Iterable[Sequence[Task]]:
    return (tasks[start : start + _BATCH] for start in range(0, len(tasks), _BATCH))
