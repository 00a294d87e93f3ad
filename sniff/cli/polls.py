"""The table `stats FILE polls`: the master's programme."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from dissectors.line import MS
from dissectors.profiles import Devices
from sniff.analysis.poll import Poll
from sniff.analysis.poll_words import asked, changes, told
from sniff.analysis.polls import Polls
from sniff.analysis.wording import station_word
from sniff.bus.offline import survey
from sniff.bus.row_words import iso
from sniff.cli import arguments, tables
from sniff.cli.tables import Cell
from sniff.engine.follow_settings import dissector_for
from sniff.engine.read_source import ReadSource
from sniff.engine.session import Session

HEADINGS = (
    "src",
    "station",
    "request",
    "asks",
    "every ms",
    "jitter ms",
    "asked",
    "answered",
    "exceptions",
    "no answer",
    "late",
    "damaged",
    "repeats",
    "first",
    "last",
    "changed",
)
_SELDOM = ("src", "exceptions", "late", "damaged", "repeats", "changed")
"""Columns that a person need not see when there is nothing in them."""


def show(args: argparse.Namespace, source: ReadSource, session: Session) -> None:
    """Print the programme of a capture."""
    devices = arguments.noted_devices(args, session)
    polls = Polls(dissector_for(session))
    survey(source, session, polls, reference=args.reference)
    write(args, polls, devices, session)


def write(args: argparse.Namespace, polls: Polls, devices: Devices, session: Session) -> None:
    """Print what was seen of it."""
    held = list(polls)
    begin = min((poll.first for poll in held if poll.first is not None), default=0)
    end = max((poll.last for poll in held if poll.last is not None), default=0)
    clock = iso if args.style != "text" else _clock if iso(begin)[:10] == iso(end)[:10] else _day_and_clock
    turned = [told(changes(poll, begin, end, polls.holes), clock) if session.has_times else "" for poll in held]
    rows = [
        _row(poll, asked(poll, devices), words, args.style == "text", session.has_times, clock)
        for poll, words in zip(held, turned, strict=True)
    ]
    if args.style != "text":
        tables.write(HEADINGS, rows, args.style)
        return
    if not rows:
        print(f"no {station_word(session.protocol)} was asked anything")
        return
    kept = [at for at, name in enumerate(HEADINGS) if name not in _SELDOM or any(row[at] for row in rows)]
    tables.write([HEADINGS[at] for at in kept], [[row[at] for at in kept] for row in rows])
    if polls.dropped:
        print(f"and {polls.dropped} requests more, of entries beyond the {len(held)} above")


def _row(
    poll: Poll, asks: str, changed: str, brief: bool, has_times: bool, clock: Callable[[int], str]
) -> tuple[Cell, ...]:
    key = poll.key
    interval, jitter = (poll.interval, poll.jitter) if has_times else (None, None)
    return (
        key.source,
        "all" if key.station is None else key.station,
        key.kind,
        asks,
        None if interval is None else _ms(interval, brief),
        None if jitter is None else _ms(jitter, brief),
        poll.asked + poll.repeats,
        poll.answered,
        poll.exceptions,
        poll.unanswered,
        poll.late,
        poll.damaged,
        poll.repeats,
        clock(poll.first) if has_times and poll.first is not None else None,
        clock(poll.last) if has_times and poll.last is not None else None,
        changed,
    )


def _ms(time: int, brief: bool) -> Cell:
    """Milliseconds; for people with what the stated precision of an interval is worth."""
    return round(time / MS, 3) if not brief else f"{time / MS:.1f}" if time < 10 * MS else f"{time / MS:.0f}"


def _clock(time: int) -> str:
    """The time of day of a long capture's moment, UTC."""
    return iso(time)[11:19]


def _day_and_clock(time: int) -> str:
    """The same where a capture is of several days: "03-02 10:00:00"."""
    return iso(time)[5:19].replace("T", " ")
