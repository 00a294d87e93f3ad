"""A real Dask scheduler with real workers on the loopback; one of them is killed in the middle."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from sniff.fleet import running
from sniff.fleet.answer import answer
from sniff.fleet.archive import Task, files_below, tasks_of
from sniff.fleet.bus_day import Archive
from sniff.fleet.running import Done
from sniff.fleet.values import as_values
from tests.sniff.fleet.made_archive import plans, write

pytestmark = pytest.mark.skipif(not running.available(), reason="Dask is not installed")


@pytest.fixture(scope="module")
def tasks(tmp_path_factory: pytest.TempPathFactory) -> list[Task]:
    folder = tmp_path_factory.mktemp("archive")
    for plan in plans(6, ("RTU station absent", "ASCII station absent"), 2, 10):
        for day in range(3):
            write(folder, plan, day, 10)
    return tasks_of(files_below([str(folder)]))[0]


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of a scheduler, and its two workers."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    common = ["--no-dashboard"]
    words = [
        ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), *common],
        *([["distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", *common]] * 2),
    ]
    with (tmp_path / "said").open("wb") as said:
        started = [
            subprocess.Popen([sys.executable, "-m", *each], cwd=tmp_path, env=environment, stdout=said, stderr=said)
            for each in words
        ]
    try:
        yield address, started[1:]
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def wait_for_workers(address: str, count: int) -> None:
    from distributed import Client

    deadline = time.monotonic() + 120
    while True:
        try:
            with Client(address, timeout=5) as client:
                client.wait_for_workers(count, timeout=60)
                return
        except (OSError, TimeoutError):
            assert time.monotonic() < deadline, "no scheduler"


def said(done: list[Done]) -> str:
    archive = Archive()
    for one in done:
        assert one.failed is None
        for day in one.days:
            archive.add(day)
    return json.dumps(list(as_values(answer(archive))), sort_keys=True)


def test_a_killed_worker_changes_nothing_in_the_answer(
    tasks: list[Task], cluster: tuple[str, list[subprocess.Popen[bytes]]]
) -> None:
    address, workers = cluster
    expected = said(list(running.here(tasks)))
    wait_for_workers(address, 2)
    done = []
    for one in running.by_cluster(tasks, address):
        done.append(one)
        if len(done) == 2:
            os.kill(workers[0].pid, signal.SIGKILL)
    assert len(done) == len(tasks)
    assert said(done) == expected


def test_no_scheduler_is_said(tasks: list[Task], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "ANSWER_WITHIN", 1)  # nobody ever will
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(running.Unreachable, match="no scheduler answers"):
        list(running.by_cluster(tasks, f"tcp://127.0.0.1:{port}"))
