"""`box run`: begins a capture of all buses, follows it, tells how it stands, and begins another where it ends."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dissectors.findings import Finding
from sniff.analysis.sanitizing import sanitized
from sniff.box import notify, words
from sniff.box.notify import Notifier
from sniff.box.page import RunsAlready, StatusPage
from sniff.box.past import CapturePid, Closing, cut_parts, remove_half_written
from sniff.box.progress import Progress
from sniff.box.status import BoxStatus, BusStatus, Recovered
from sniff.box.watch import BusWatch
from sniff.bus.live import LiveBus
from sniff.capture.config import RecordSpec
from sniff.capture.ipc import Status
from sniff.cli import UNREADABLE, USAGE, Failure, box_status, listening, outlets, printing, telling
from sniff.cli.box_plan import Plan
from sniff.cli.box_site import BoxSite
from sniff.cli.interruption import until_interrupted
from sniff.cli.targets import Target
from sniff.engine.session import LineEvent
from sniff.outlet_settings import OutletSettings
from sniff.recording.rotation import FreeSpace, free_octets
from sniff.sources.clock import Clock
from sniff.version import __version__

PAGE_EVERY = 1.0
"""Seconds between looks at how all stands."""

BACKOFF = (0.5, 1, 2, 5, 10, 30)
"""Seconds before a capture that ended is begun anew, the more the more often it failed at once."""

LASTED = 60.0
"""A capture that ran for so many seconds did not fail at once."""


def run(told: Plan, wanted: Sequence[Target]) -> int:
    """Run the box until a signal ends it."""
    try:
        page = StatusPage(told.socket, told.status_port)
    except RunsAlready as error:
        raise Failure(f"{error}; its parts are its own", USAGE) from None
    except OSError as error:
        where = told.socket if told.status_port is None else f"{told.socket}, port {told.status_port}"
        raise Failure(f"status page at {where}: {error.strerror or error}", USAGE) from None
    notifier = Notifier()
    try:
        where = f"{page.path or 'no socket'}" + (f", http://127.0.0.1:{page.port}/" if page.port is not None else "")
        print(f"sniff485: box {told.name}: status at {sanitized(where)}", file=sys.stderr)
        return Box(told, wanted, page, notifier).run()
    finally:
        page.close()
        notifier.close()


class Box:
    """One run of a box. Everything but the closing of old parts is done in one thread."""

    def __init__(self, told: Plan, wanted: Sequence[Target], page: StatusPage, notifier: Notifier) -> None:
        self._told = told
        self._targets = [replace(one, source=replace(one.source, patient=True)) for one in wanted]
        self._page = page
        self._notifier = notifier
        runtime = page.path.parent if page.path is not None else told.path.parent
        self._pid = CapturePid(runtime / f"{told.name}.capture")
        self._wall = Clock.start()  # for what is told while no capture has a clock
        self._since = self._wall.now()
        self._watches = [BusWatch(self._since) for _ in wanted]
        self._recovered: list[Recovered] = []
        self._printers: list[printing.Printer] = []
        self._failures = self._restarts = 0
        self._last_restart = self._trouble = ""
        self._begun: int | None = None
        self._progress = Progress(time.monotonic_ns())
        self._ready = self._stopping = False  # whether it was told, and is to be
        self._next_page = 0.0
        self._next_word = 0.0
        self._site = BoxSite(str(told.path))
        self._telling = outlets.prepare(told.outlets or OutletSettings())
        self._closing: Closing | None = None

    def run(self) -> int:
        """Until a signal comes; the exit code says whether all that was heard is in files."""
        with until_interrupted() as caught:
            self._tell()
            self._clear_up()
            try:
                if not self._begin(caught):
                    return 0
                with telling.alerting(self._printers, self._told.alert), outlets.telling((), self._telling):
                    self._listen(caught)
            finally:
                if self._closing is not None:
                    self._closing.stop()
        listening.say_end(self._printers)
        return UNREADABLE if any(listening.lost_something(printer.live) for printer in self._printers) else 0

    # -- the begin -----------------------------------------------------------------------------------------------------

    def _clear_up(self) -> None:
        """End what the run before left behind, and begin to close its parts."""
        left = self._pid.left_behind()
        if left is not None:
            self._say(self._pid.end(left))
        remove_half_written(self._told.path)
        self._close_cut_parts()

    def _close_cut_parts(self) -> None:
        """Close what no capture writes to any more, beside everything else."""
        if self._closing is None or self._closing.done:
            self._closing = Closing(cut_parts(self._told.path), self._told.keep_free, self._closed)

    def _closed(self, one: Recovered) -> None:
        self._recovered.append(one)
        what = "closed" if one.closed else f"left: {one.why_not}"
        self._say(f"{one.name} was cut where an earlier run ended ({one.text}); {what}")

    def _begin(self, caught: list[int]) -> bool:
        """Begin a capture, again and again until it runs; whether it does: a signal may come before."""
        told = self._told
        record = RecordSpec(str(told.path), told.rotate, told.keep, keep_free=told.keep_free, keep_of_all=True)
        while not caught:
            FreeSpace(told.path, told.keep_free).make(Path())
            try:
                lives = listening.start_all(self._targets, record, watched=False)
            except Failure as error:
                self._fail(str(error))
                self._wait(caught)
                continue
            self._adopt(lives)
            return True
        return False

    def _adopt(self, lives: Sequence[LiveBus]) -> None:
        before, self._trouble = list(self._printers), ""
        self._printers[:] = [printing.Printer(live, quiet=True) for live in lives]
        for old, new in zip(before, self._printers, strict=False):
            new.alerts = old.alerts
        if self._telling is not None:
            self._printers[0].telling = self._telling
            for live in lives:
                self._telling.attach(live)
        link = lives[0].link
        self._pid.remember(link.pid)
        self._begun = link.clock.now()
        self._site.begin()
        self._progress = Progress(time.monotonic_ns())
        for watch in self._watches:
            watch.begin(self._begun)
        self._say(f"recording {len(lives)} bus{'es' if len(lives) > 1 else ''} to {link.paths[0]}")
        self._next_page = 0.0
        self._tell()

    def _fail(self, why: str) -> None:
        """No capture runs, and why."""
        if why != self._trouble:
            self._say(f"not recording: {why}")
        self._trouble = why
        for watch in self._watches:
            watch.over(self._wall.now(), why)
        self._next_page = 0.0

    def _wait(self, caught: list[int]) -> None:
        """Let some time pass before the next try."""
        until = time.monotonic() + BACKOFF[min(self._failures, len(BACKOFF) - 1)]
        self._failures += 1
        while not caught and time.monotonic() < until:
            self._tell()
            time.sleep(0.1)

    # -- while it runs -------------------------------------------------------------------------------------------------

    def _listen(self, caught: list[int]) -> None:
        """Follow captures, one after the other, until a signal ends the last of them."""
        while True:
            began = time.monotonic()
            self._follow(caught)
            self._pid.forget()
            if caught:
                return
            self._count_end()
            self._close_cut_parts()
            if time.monotonic() - began >= LASTED:
                self._failures = 0
            self._wait(caught)
            if not self._begin(caught):
                return

    def _follow(self, caught: list[int]) -> None:
        """Until the capture is over. A signal asks for its end; another does not wait for a slow disk."""
        lives = [printer.live for printer in self._printers]
        heeded = 0
        while any(live.ended is None for live in lives):
            for number, (printer, watch) in enumerate(zip(self._printers, self._watches, strict=True)):
                items = printer.poll(0.0 if number else 0.2)
                if items:
                    self._progress.hear(time.monotonic_ns())
                now = printer.live.link.clock.now()
                for item in items:
                    if isinstance(item, Status):
                        self._progress.see(item, time.monotonic_ns())
                        watch.see(item, printer.live.unseen, now)
                    elif isinstance(item, LineEvent):
                        watch.event(item)
                printer.take(items)
            if len(caught) > heeded:
                self._stopping = not heeded
                self._next_page = 0.0
                heeded = len(caught)
                lives[0].end()
            self._tell()
        now = lives[0].link.clock.now()
        for live, watch in zip(lives, self._watches, strict=True):
            assert live.ended is not None
            watch.see(live.status, live.unseen, watch.heard_at or now)
            watch.end(now, live.ended, live.status)

    def _count_end(self) -> None:
        """A capture has ended that nobody asked to."""
        ended = self._printers[0].live.ended
        self._restarts += 1
        self._last_restart = "" if ended is None else ended.reason
        self._begun = None
        self._fail(f"the capture ended: {self._last_restart}")

    # -- what is told --------------------------------------------------------------------------------------------------

    def _say(self, text: str) -> None:
        print(f"sniff485: {sanitized(text)}", file=sys.stderr, flush=True)

    def _tell(self) -> None:
        """Renew the status page, and tell the service manager what it wants to hear."""
        now = time.monotonic()
        if now < self._next_page:
            return
        self._next_page = now + PAGE_EVERY
        status = self.status()
        self._page.json, self._page.words = box_status.page_json(status), words.text(status)
        if self._begun is not None and self._progress.trouble(time.monotonic_ns()) is None:
            self._ready = self._ready or self._notifier.tell(notify.READY)
            self._notifier.tell(notify.WATCHDOG)
        if self._stopping:
            self._stopping = not self._notifier.tell(notify.STOPPING)
        if now >= self._next_word:
            self._next_word = now + 10 * PAGE_EVERY
            self._notifier.status(words.headline(status))

    def status(self) -> BoxStatus:
        """How everything stands."""
        live = self._printers[0].live if self._printers else None
        running = live is not None and self._begun is not None
        clock = live.link.clock if live is not None and running else self._wall
        drift = clock.drift()
        now = clock.now()
        path = self._told.path
        count, size = box_status.parts_and_size(path)
        stuck = self._progress.trouble(time.monotonic_ns()) if running else None
        newest = live.status if live is not None else None
        site = self._site.look(self._printers, time.monotonic(), now) if running else None
        told = [printer.alerts[0] for printer in self._printers[:1] if printer.alerts is not None]
        return BoxStatus(
            name=self._told.name,
            version=__version__,
            pid=os.getpid(),
            now=now + drift,
            since=self._since + self._wall.drift(),
            recording=running and stuck is None and not (newest is not None and newest.error),
            trouble=self._trouble or stuck or (newest.error if newest is not None and running else ""),
            capture_pid=live.link.pid if live is not None and running else None,
            capture_since=None if self._begun is None else self._begun + drift,
            priority=live.link.priority if live is not None and running else "",
            restarts=self._restarts,
            last_restart=self._last_restart,
            folder=str(path.parent.resolve()),
            current=os.path.basename(newest.path) if newest is not None and running else "",
            parts=count,
            parts_size=size,
            free=free_octets(path.parent),
            keep_free=self._told.keep_free,
            behind=newest.behind if newest is not None and running else 0.0,
            clock_offset=drift if running else 0,
            alerts_failed=sum(one.failed for one in told),
            alerts_dropped=sum(one.dropped for one in told),
            recovered=tuple(self._recovered),
            outlets=() if self._telling is None else self._telling.lines(),
            site=tuple(box_status.finding_line(one, drift) for one in site.findings) if site is not None else (),
            buses=tuple(
                self._bus(number, now, drift, None if site is None else site.buses[number])
                for number in range(len(self._watches))
            ),
        )

    def _bus(self, number: int, now: int, drift: int, findings: tuple[Finding, ...] | None) -> BusStatus:
        status = box_status.bus_status(self._watches[number], self._targets[number].source, now, drift)
        if not self._printers:
            return status
        live = self._printers[number].live
        return box_status.judged_status(status, live, live.findings() if findings is None else findings, drift)
