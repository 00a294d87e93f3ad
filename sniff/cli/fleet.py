"""A whole archive judged: folders, files and patterns; every bus, every day, the worst first. The site is the first
folder below the one that is named. What was read is kept in an index beside the archive, so that a second run reads
only what is new. Work is spread over the cores of this machine, or over a Dask cluster, by the extra sniff485[fleet].
Exit code 1 when something is wrong with a bus, 3 when a file could not be read.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from dissectors import registry
from dissectors.findings import counted
from sniff.analysis.sanitizing import sanitized
from sniff.cli import UNREADABLE, USAGE, Failure, arguments, json_output, writing
from sniff.engine.capture import CaptureError
from sniff.fleet import running
from sniff.fleet.answer import Answer, answer, marks
from sniff.fleet.archive import FileState, Task, Unreadable, files_below, is_being_written, tasks_of
from sniff.fleet.bus_day import Archive, BusDay
from sniff.fleet.index import NAME, Index
from sniff.fleet.pieces import cut
from sniff.fleet.running import Collecting, Done, Unreachable

WATCHED_EVERY = 60.0
"""Seconds between looks at an archive that is watched."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `fleet`."""
    parser.add_argument("folders", nargs="+", metavar="FOLDER", help="folders, captures, patterns (quoted)")
    parser.add_argument("--since", type=_day, metavar="DAY", help="without what ended before, for instance 2026-01-01")
    parser.add_argument("--workers", type=arguments.positive, metavar="N", help="processes (default: one a core)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler that runs, tcp://HOST:8786")
    parser.add_argument("--index", metavar="FILE", help=f"the index (default: {NAME} in the first folder)")
    parser.add_argument("--no-index", action="store_true", help="read everything again, keep nothing")
    parser.add_argument("--json", action="store_true", help="one JSON object a bus")
    parser.add_argument("--all", action="store_true", help="all buses in the text, whole lines, not one screen")
    parser.add_argument("--parquet", metavar="FILE", help="a row a bus, day and station as a Parquet file")
    parser.add_argument("--html", metavar="FILE", help="one page that stands alone")
    parser.add_argument("-f", "--force", action="store_true", help="overwrite files that are there")
    parser.add_argument(
        "--watch", action="store_true", help="go on: take up new captures as they are closed, once a minute"
    )


def run(args: argparse.Namespace) -> int:
    """Judge an archive."""
    if args.scheduler and args.workers:
        raise Failure("--workers: those of the scheduler do the work; leave one of both out", USAGE)
    for place in (args.parquet, args.html):
        if place:
            writing.refuse_to_overwrite(Path(place), (), args.force or args.watch)
    _find(args)
    index = _index(args)
    code = _once(args, index)
    while args.watch:
        time.sleep(WATCHED_EVERY)
        code = _once(args, index)
    return code


def _once(args: argparse.Namespace, index: Index | None) -> int:
    now = time.time_ns()
    there = _find(args)
    found = [one for one in there if not is_being_written(one[1], now)]
    if len(found) < len(there) and not args.watch:  # else its turn comes
        left = counted(len(there) - len(found), "recording")
        print(
            f"sniff485: {left} without an end changed just now, so somebody writes: not looked at yet", file=sys.stderr
        )
    tasks, unreadable = tasks_of(found, args.since) if index is None else _known_tasks(index, found, args.since)
    archive = Archive(unreadable={one.file.path: one.why for one in unreadable})
    missing = []
    for task, known in index.known(tasks) if index is not None else ((task, None) for task in tasks):
        if known is None:
            missing.append(task)
        for day in known or ():
            _add(args, archive, day)
    _read(args, index, archive, missing, len(tasks))
    before = index.said_before(args.folders) if index is not None else None
    said = answer(archive, before, {name: registry.get(name).noun for name in registry.names()})
    if args.since is not None:  # what was not looked at is not gone, and the next whole run is to know it
        said = replace(said, gone=())
    elif index is not None:
        index.say(args.folders, marks(said))
        index.forget_all_but(tasks)
    _write(args, archive, said)
    if archive.unreadable:
        return UNREADABLE
    return int(any(bus.troubles or bus.is_silent for bus in said.buses))


def _known_tasks(
    index: Index, found: list[tuple[str, FileState]], since: int | None
) -> tuple[list[Task], list[Unreadable]]:
    grouped = tasks_of(found, since, index.look())
    index.keep_looks()
    return grouped


def _add(args: argparse.Namespace, archive: Archive, day: BusDay) -> None:
    """A day that was asked for: a file may hold some that were before."""
    if args.since is None or day.last is None or day.last >= args.since:
        archive.add(day)


def _find(args: argparse.Namespace) -> list[tuple[str, FileState]]:
    try:
        return files_below(args.folders)
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None


def _read(args: argparse.Namespace, index: Index | None, archive: Archive, missing: list[Task], whole: int) -> None:
    pieces = [piece for task in missing for piece in cut(task)]
    progress, collecting = _Progress(len(pieces), whole - len(missing)), Collecting(pieces)
    for piece in _run(args, pieces):
        progress.tell(piece)
        done = collecting.add(piece)
        if done is None:
            continue
        if done.failed is not None:
            for file in done.task.files:
                archive.unreadable[file.path] = done.failed
        else:
            if index is not None:
                index.put(done.task, list(done.days))
            for day in done.days:
                _add(args, archive, day)
    if index is not None:
        index.flush()
    progress.clear()


def _run(args: argparse.Namespace, tasks: list[Task]) -> Iterator[Done]:
    if args.scheduler:
        if not running.available():
            raise Failure("--scheduler needs Dask: pip install 'sniff485[fleet]'", USAGE)
        try:
            yield from running.by_cluster(tasks, args.scheduler)
        except Unreachable as error:
            raise Failure(str(error), UNREADABLE) from None
    elif args.workers == 1 or len(tasks) < 2 or not running.available():
        if len(tasks) > 1 and args.workers != 1:
            print("sniff485: one core only; for all of them: pip install 'sniff485[fleet]'", file=sys.stderr)
        yield from running.here(tasks)
    else:
        yield from running.by_processes(tasks, args.workers)


def _index(args: argparse.Namespace) -> Index | None:
    if args.no_index:
        return None
    first = Path(args.folders[0])
    path = Path(args.index) if args.index else (first if first.is_dir() else Path()) / NAME
    try:
        return Index(path)
    except CaptureError as error:
        if args.index:
            raise Failure(str(error), UNREADABLE) from None
        print(f"sniff485: {sanitized(str(error))}; everything is read, nothing is kept (--index names another place)",
              file=sys.stderr)  # fmt: skip
        return None


def _write(args: argparse.Namespace, archive: Archive, said: Answer) -> None:
    from sniff.fleet import values

    if args.parquet:
        _write_parquet(args.parquet, archive)
    if args.html:
        from sniff.fleet import html

        try:
            Path(args.html).write_text(html.page(said), "utf-8", "backslashreplace")
        except OSError as error:
            raise Failure(f"{args.html}: {error.strerror}", UNREADABLE) from None
    if args.json:
        for value in values.as_values(said):
            print(json_output.dumps(value))
    else:
        for line in _page(said, args.all):
            print(line)


def _page(said: Answer, whole: bool) -> Iterator[str]:
    """On a terminal one screen, unless all is asked for."""
    from sniff.fleet import text

    if whole:
        return text.page(said, len(said.buses))
    if not sys.stdout.isatty():
        return text.page(said)
    size = shutil.get_terminal_size()
    return text.page(said, len(said.buses), size.columns, size.lines - 1)


def _write_parquet(place: str, archive: Archive) -> None:
    from sniff.fleet import values
    from sniff.formats import parquet

    if not parquet.available():
        raise Failure("--parquet needs polars: pip install 'sniff485[parquet]'", USAGE)
    try:
        with parquet.ParquetWriter(Path(place), values.COLUMNS) as writer:
            for row in values.rows(archive):
                writer.add(row)
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None


def _day(word: str) -> int:
    """argparse type: the begin of a day of UTC, ns."""
    try:
        moment = datetime.fromisoformat(word)
        told = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
        return int(told.timestamp()) * 1_000_000_000
    except (ValueError, OverflowError):
        raise argparse.ArgumentTypeError(f"{word!r}: a day like 2026-01-31") from None


class _Progress:
    """How far it is, on a terminal."""

    def __init__(self, missing: int, known: int) -> None:
        self._missing, self._known = missing, known
        self._done = self._failed = 0
        self._began = time.monotonic()

    def tell(self, done: Done) -> None:
        self._done += 1
        self._failed += done.failed is not None
        if sys.stderr.isatty() and time.monotonic() - self._began > 0.5:
            failed = f", {self._failed} failed" if self._failed else ""
            print(
                f"\r\x1b[Kread {self._done} of {self._missing}{failed}; {self._known} known from the index; "
                f"{sanitized(done.task.name)[-60:]}",
                end="", file=sys.stderr, flush=True,
            )  # fmt: skip

    def clear(self) -> None:
        if sys.stderr.isatty():
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
