"""Targets of `go to`: a row number or a time, as people type it. Pure."""

from __future__ import annotations

import re
from datetime import datetime, timedelta

from dissectors.line import NS_PER_S
from sniff.bus.rows import Store

EXPECTED = "expected a row number (1200), a time of day (10:32:05.5) or seconds from the start (+12.5)"
_CLOCK = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2})(?:\.(\d{1,9}))?)?")
_SECONDS = re.compile(r"\+(\d+)(?:\.(\d{1,9}))?")


def find(store: Store, text: str, last: int) -> int | None:
    """The number of the row meant, at most `last`; None in an empty store. Raises ValueError with what was expected."""
    text = text.strip()
    if text.isascii() and text.isdigit():
        return min(max(int(text[:18]), store.first_no), last) if len(store) else None
    time = _time(store, text)
    if time is None:
        return None
    return min(store.row_at(time), last)


def _time(store: Store, text: str) -> int | None:
    """ns on the capture's clock; a time of day means its first one after the first row."""
    after = _SECONDS.fullmatch(text)
    clock = _CLOCK.fullmatch(text)
    if after is None and (clock is None or int(clock[1]) > 23 or int(clock[2]) > 59 or int(clock[3] or 0) > 59):
        raise ValueError(EXPECTED)
    if not len(store):
        return None
    if after is not None:
        return store.session.started + int(after[1][:9]) * NS_PER_S + _fraction(after[2])
    assert clock is not None
    first = store.rows[0].event.start
    day = datetime.fromtimestamp(first // NS_PER_S)
    wanted = day.replace(hour=int(clock[1]), minute=int(clock[2]), second=int(clock[3] or 0))
    if wanted < day:
        wanted += timedelta(days=1)
    return int(wanted.timestamp()) * NS_PER_S + _fraction(clock[4])


def _fraction(digits: str | None) -> int:
    return int((digits or "0").ljust(9, "0"))
