"""Runs tasks on a Dask cluster that exists; its workers need sosmith and a C compiler."""

from __future__ import annotations

import itertools
from collections.abc import Generator, Iterable, Sequence

from sosmith.model.errors import ToolError
from sosmith.sim.exploration.evaluation import Point, evaluate
from sosmith.sim.exploration.grid import Task

_BATCH = 2_000
"""Designs that the scheduler knows of at a time."""

_MOST = 16
"""Most designs of one Dask task: what comes back together, and is done again if its worker dies."""

_ROUNDS = 4
"""Tasks that each thread of the workers gets of what is left, about: fewer designs in each of them towards the end, so
that no worker has much to do when the others have nothing."""

_CONNECT = 10
"""Seconds until a scheduler must have answered."""


def on_cluster(batches: Iterable[Sequence[Task]], address: str) -> Generator[Point, None, None]:
    """Yield the results of tasks as they come from the workers of the scheduler at `address`.

    Several designs are one task of Dask's, fewer towards the end. If its worker dies, another one does it again; the
    scheduler hands out each result once. When the caller stops, what has not begun is dropped.

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
            threads = sum(client.nthreads().values())
            groups = groups_of(tasks, threads)
            futures = [client.submit(_evaluated, group, key=f"sosmith-{group[0].key}") for group in groups]
            for future in as_completed(futures, loop=client.loop):
                yield from future.result()
                future.release()
    except KilledWorker as error:
        raise ToolError(f"the cluster's workers must live until their designs are done, not: {error}") from None
    finally:
        client.close()


def groups_of(tasks: Sequence[Task], threads: int) -> list[Sequence[Task]]:
    """Return tasks in groups, in their order, the smaller the fewer are left for so many `threads`.

    >>> [len(group) for group in groups_of(range(40), 2)]
    [5, 4, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]
    """
    groups: list[Sequence[Task]] = []
    start = 0
    while start < len(tasks):
        size = max(1, min(_MOST, (len(tasks) - start) // (_ROUNDS * max(threads, 1))))
        groups.append(tasks[start : start + size])
        start += size
    return groups


def _evaluated(tasks: Sequence[Task]) -> list[Point]:
    """Return the results of tasks, which a worker makes one after the other."""
    return [evaluate(task) for task in tasks]


def _parts(tasks: Sequence[Task]) -> Iterable[Sequence[Task]]:
    return (tasks[start : start + _BATCH] for start in range(0, len(tasks), _BATCH))
