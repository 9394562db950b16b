"""Runs tasks in processes of this machine."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import threading
from collections.abc import Generator, Iterable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from tempfile import TemporaryDirectory

from sosmith.model.errors import ToolError
from sosmith.sim.exploration.evaluation import Point, evaluate
from sosmith.sim.exploration.grid import Task


def processors() -> int:
    """Count the processors that this process may use."""
    return len(os.sched_getaffinity(0))


def in_processes(batches: Iterable[Sequence[Task]], jobs: int) -> Generator[Point, None, None]:
    """Yield the results of tasks as they come, from `jobs` processes; one job, or a task alone, runs in this process.

    When the caller stops, whatever the reason, what has not begun is dropped and the processes end.

    Raises
    ------
    ToolError
        If a process dies, or as `evaluate`.
    """
    pool: ProcessPoolExecutor | None = None
    # What a process leaves behind that is ended in the middle of a design is deleted with this folder.
    with TemporaryDirectory(prefix="sosmith-", ignore_cleanup_errors=True) as scratch:
        try:
            for tasks in batches:
                if jobs == 1 or len(tasks) < 2:
                    yield from map(evaluate, tasks)
                    continue
                pool = pool or _started(min(jobs, len(tasks)), scratch)
                waiting: list[Future[Point]] = [pool.submit(evaluate, task) for task in tasks]
                for future in as_completed(waiting):
                    yield future.result()
        except BrokenProcessPool:
            raise ToolError(
                "every process must live until its designs are done, and one ended before; "
                "the same command goes on from what is done"
            ) from None
        finally:
            if pool is not None:
                workers = list((pool._processes or {}).values())
                pool.shutdown(wait=False, cancel_futures=True)
                for worker in workers:
                    worker.terminate()  # in the middle of a design that nobody waits for, or idle
                for worker in workers:
                    worker.join()


def _started(jobs: int, scratch: str) -> ProcessPoolExecutor:
    """Start processes; those that are forked would inherit locks of the threads that draw the progress."""
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(jobs, mp_context=context, initializer=_prepare, initargs=(scratch,))


def _prepare(scratch: str) -> None:
    """Leave Ctrl-C to the parent, which ends its workers, end if it has died, and make temporary files there.

    A design makes and drops many small objects, and next to no circles of them: looking for these among all that was
    imported took a tenth of the time.
    """
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
    os.environ["TMPDIR"] = scratch  # also for compilers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: multiprocessing.process.BaseProcess) -> None:
    parent.join()
    os._exit(1)
