"""Tasks, done: here, by processes of this machine, or by a Dask cluster; each result as it comes, in any order.

A task whose worker dies is tried again by another; one that fails is reported with its reason. Without Dask (the extra
`fleet`) tasks are done one after the other in this process.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

from sniff.engine.capture import CaptureError
from sniff.fleet.archive import Task
from sniff.fleet.bus_day import BusDay
from sniff.fleet.pieces import together
from sniff.fleet.reading import read_task

RETRIES = 3
"""How often a task may be tried again when its worker dies."""

MEMORY = "2GB"
"""Of a worker of this machine; it is begun anew when it takes more."""

ALLOCATOR = {"MALLOC_TRIM_THRESHOLD_": 256 << 20, "MALLOC_MMAP_THRESHOLD_": 32 << 20}
"""Of a worker of this machine (mallopt(3)): what is freed is kept, as in any other process. Dask tells workers to give
back all but 64 KiB after every array, and a set threshold ends glibc's own learning of the other one: with captures in
columns every array was mapped anew, and page faults took a quarter of a worker's time."""

ANSWER_WITHIN = 10
"""Seconds in which a scheduler has to answer."""


class Unreachable(Exception):
    """No scheduler there, or no Dask here; the message says what to do."""


@dataclass(frozen=True, slots=True)
class Done:
    """A task that is over: what it gave, or why it failed."""

    task: Task
    days: tuple[BusDay, ...] = ()
    failed: str | None = None


class Collecting:
    """Pieces of tasks as they are done, in any order; a task is done when all its pieces are."""

    def __init__(self, pieces: Iterable[Task]) -> None:
        self._wanted = Counter(piece.whole for piece in pieces)
        self._got: dict[Task, list[Done]] = {}

    def add(self, done: Done) -> Done | None:
        """Take a piece that is over; give the whole task where it was the last of it."""
        whole = done.task.whole
        got = self._got.setdefault(whole, [])
        got.append(done)
        if len(got) < self._wanted[whole]:
            return None
        del self._got[whole]
        if len(got) == 1:
            return replace(done, task=whole)
        failed = next((one.failed for one in got if one.failed is not None), None)
        days = () if failed is not None else together(day for one in got for day in one.days)
        return Done(whole, tuple(days), failed)


def available() -> bool:
    """Whether Dask is installed."""
    return importlib.util.find_spec("distributed") is not None


def _dask() -> Any:
    return import_module("distributed")


def here(tasks: Sequence[Task]) -> Iterator[Done]:
    """One after the other, in this process."""
    for task in tasks:
        yield do(task)


def do(task: Task) -> Done:
    """One task; never raises."""
    try:
        return Done(task, tuple(read_task(task)))
    except CaptureError as error:
        return Done(task, failed=str(error))
    except Exception as error:  # one capture must not end the report of an archive
        return Done(task, failed=f"{type(error).__name__}: {error}")


def by_processes(tasks: Sequence[Task], workers: int | None = None) -> Iterator[Done]:
    """By `workers` processes of this machine (default: one a core)."""
    distributed = _dask()
    count = min(workers or os.cpu_count() or 1, max(1, len(tasks)))
    with (
        _quietly(),
        import_module("dask").config.set({f"distributed.nanny.pre-spawn-environ.{k}": v for k, v in ALLOCATOR.items()}),
        distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            memory_limit=MEMORY,
            dashboard_address="127.0.0.1:0",  # any free port; None takes a known one, or complains
            host="127.0.0.1",
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield from _done(client, tasks)


def by_cluster(tasks: Sequence[Task], address: str) -> Iterator[Done]:
    """By the workers of a scheduler that runs already. They need this program, and the archive under the same paths.

    Raises Unreachable.
    """
    distributed = _dask()
    with _quietly():
        try:
            client = distributed.Client(address, timeout=ANSWER_WITHIN)
        except (OSError, ValueError) as error:
            raise Unreachable(f"{address}: no scheduler answers ({error}); start one with `dask scheduler`") from None
        with client:
            if not client.scheduler_info()["workers"]:
                raise Unreachable(f"{address}: the scheduler has no worker; start some with `dask worker {address}`")
            yield from _done(client, tasks)


def _done(client: Any, tasks: Sequence[Task]) -> Iterator[Done]:
    waiting = iter(tasks)
    futures: dict[Any, Task] = {}
    pending = _dask().as_completed([])

    def submit_some() -> None:
        """A few for each worker: thousands at once would all be held by the scheduler."""
        most = 4 * max(1, sum(client.nthreads().values()))
        while len(futures) < most and (task := next(waiting, None)) is not None:
            future = client.submit(do, task, pure=False, retries=RETRIES)
            futures[future] = task
            pending.add(future)

    submit_some()
    for future in pending:
        task = futures.pop(future)
        try:
            done = future.result()
        except Exception as error:  # the workers that tried it died
            done = Done(task, failed=f"no worker survived it: {type(error).__name__}")
        future.release()
        submit_some()
        yield done


@contextlib.contextmanager
def _quietly() -> Iterator[None]:
    """Without what Dask writes to standard error about workers that come and go."""
    import logging

    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.worker", "distributed.nanny")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
