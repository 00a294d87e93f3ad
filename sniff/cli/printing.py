"""Frames as lines (or JSON) as they come, and what is said about a bus meanwhile."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from sniff.analysis.sanitizing import sanitized
from sniff.analysis.summary import Summary
from sniff.bus import row_words as rows
from sniff.bus.live import LiveBus, LiveItem, LiveTables
from sniff.bus.triggers import Fired, Triggers
from sniff.capture.ipc import Ended, Status
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, LineEventKind
from sniff.engine.table import Table
from sniff.engine.verdict_join import JudgedRow, VerdictJoin

if TYPE_CHECKING:
    from sniff.cli.outlets import Telling
    from sniff.outlets.alerts import Alerts
    from sniff.outlets.news import NewsDesk


JUDGED_EVERY = 1.0
"""Seconds between looks at findings, for triggers and alerts."""


class Printer:
    """Frames as lines (or JSON), each with its verdict, as they come; counts them all. `before_saying`: called before
    anything is said on standard error."""

    def __init__(self, live: LiveBus, as_json: bool = False, quiet: bool = False, colour: bool = False) -> None:
        self.live = live
        self.as_json = as_json
        self.quiet = quiet
        self.colour = colour
        self.before_saying: Callable[[], None] = lambda: None
        self.triggers: Triggers | None = None
        self.alerts: tuple[Alerts, NewsDesk] | None = None
        self.every_second: Callable[[], None] | None = None
        self.names_bus = False  # whether each frame says of which bus it is
        self.telling: Telling | None = None
        self._judge_at = 0.0
        self._session = live.session
        self._trouble = ""
        self._waited = False
        self._settling = VerdictJoin(live.points)

    @property
    def summary(self) -> Summary:
        """What was counted."""
        return self.live.model.summary

    def poll(self, timeout: float) -> list[LiveItem] | list[LiveTables]:
        """What has come; waits up to `timeout` seconds."""
        return self.live.poll_tables(timeout) if self.quiet else self.live.poll(timeout)

    def take(self, items: list[LiveItem] | list[LiveTables]) -> None:
        """Print what has come."""
        if self.live.session is not self._session:
            self._settle()
        for item in items:
            if self.triggers is not None and isinstance(item, Table | Output):
                self._fire(self.triggers.see(item))
            if isinstance(item, Output):
                self._take_output(item)
            elif isinstance(item, LineEvent):
                self._say_event(item)
            elif isinstance(item, Status):
                self._say_status(item)
            elif isinstance(item, Ended) and not item.clean:
                self._say(item.reason)
        asked = self.triggers is not None or self.alerts is not None or self.every_second is not None
        if asked and time.monotonic() >= self._judge_at:
            self._judge_at = time.monotonic() + JUDGED_EVERY
            self._judge()
        for text in self.telling.take_said() if self.telling is not None else ():
            self.before_saying()
            print(f"sniff485: {sanitized(text)}", file=sys.stderr)
        if not self.quiet:
            sys.stdout.flush()

    def _judge(self) -> None:
        """Look at what the rules have found, and tell others how the bus is."""
        if self.every_second is not None:
            self.every_second()
        if self.triggers is None and self.alerts is None:
            return
        findings = self.live.findings()
        if self.triggers is not None:
            self._fire(self.triggers.judge(findings))
        if self.alerts is not None:
            alerts, desk = self.alerts
            for news in desk.look(findings, self.live.link.clock.now()):
                alerts.tell(self.live.session.bus, self.live.session.port, news)

    def _fire(self, fired: Iterable[Fired]) -> None:
        for one in fired:
            self.live.link.trigger(self.live.bus, one.time, one.text)

    def _say_status(self, status: Status) -> None:
        if status.error != self._trouble:
            self._trouble = status.error
            self._say(f"recording: {status.error or 'goes on'}")
        if status.closing and status.unwritten and not self._waited:
            self._waited = True
            self._say(waiting_words(status))

    def _say_event(self, event: LineEvent) -> None:
        if event.kind in (LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED):
            self.before_saying()
            print(f"sniff485: {sanitized(event.text)}", file=sys.stderr)  # names the port
        elif event.kind in (LineEventKind.NOTE, LineEventKind.REFUSED, LineEventKind.CLOCK):
            self._say(event.text)
        elif event.kind is LineEventKind.TRIGGER:
            self._say(f"triggered by {event.text}")
        elif event.kind is not LineEventKind.SETTINGS:  # those of a search are said where it is shown
            self._say(f"{event.kind.value} {event.text}".strip())

    def _settle(self) -> None:
        """A search has ended: go on with what it found."""
        self._session = self.live.session
        self._settling = VerdictJoin(self.live.points)  # what came before belongs to no transaction

    def finish(self) -> None:
        """Print what still waits for a verdict."""
        for settled in self._settling.flush():
            self._print(settled)
        sys.stdout.flush()

    def _take_output(self, output: Output) -> None:
        for settled in self._settling.add(output):
            self._print(settled)

    def _print(self, settled: JudgedRow) -> None:
        if self.quiet:
            return
        session = self.live.session
        if self.as_json:
            line = rows.json_line(settled, self.live.dissector, session)
            print(f'{{"bus": {json.dumps(session.bus)}, {line[1:]}' if self.names_bus else line)
        else:
            line = rows.text_line(settled, self.live.dissector, session, self.colour)
            print(f"{sanitized(session.bus)}  {line}" if self.names_bus else line)

    def _say(self, text: str) -> None:
        self.before_saying()
        print(f"sniff485: {sanitized(self.live.session.port)}: {sanitized(text)}", file=sys.stderr)


def waiting_words(status: Status) -> str:
    """What is said while a slow disk gets time for what it did not take yet."""
    return (
        f"the disk is slow: waiting for the last {status.unwritten} octets to be written; "
        "end that, and lose them, with Ctrl-C"
    )
