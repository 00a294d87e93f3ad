"""The search on a running capture, fed by hand: what makes it give up a setting."""

from __future__ import annotations

from typing import Any

import pytest

from dissectors.line import LineSettings
from sniff.analysis.autodetect import Detecting
from sniff.bus.autodetect import Search
from sniff.capture.ipc import ReceivedMessage, Tick
from sniff.engine.event_texts import refusal, refused_line
from sniff.engine.session import LineEvent, LineEventKind, Session

FIRST, OTHER = LineSettings.parse("9600,8N1"), LineSettings.parse("4800,7E1")


class Link:
    """A capture that is asked for settings."""

    def __init__(self) -> None:
        self.asked: list[LineSettings] = []

    def session(self, bus: int) -> Session:
        return Session("p", FIRST, "modbus-rtu", unknown=("line", "protocol"))

    def reconfigure(self, bus: int, line: LineSettings) -> None:
        self.asked.append(line)


def searching(*more: LineSettings) -> Search:
    link: Any = Link()
    return Search(link, Detecting((FIRST, OTHER, *more), ("modbus-rtu",)))


def test_settings_that_are_refused_are_tried_no_more() -> None:
    search = searching()
    wanted = search.detecting.wanted
    search.take(
        ReceivedMessage(0, LineEvent(5, LineEventKind.REFUSED, refusal(wanted, "cannot be set: no such speed")))
    )
    assert search.detecting.wanted != wanted


@pytest.mark.parametrize("kind", [LineEventKind.NOTE, LineEventKind.REFUSED])
def test_words_that_name_the_settings_refuse_nothing(kind: LineEventKind) -> None:
    search = searching()
    wanted = search.detecting.wanted
    search.take(ReceivedMessage(0, LineEvent(5, kind, f"disk is slow; {wanted} is in force")))
    assert search.detecting.wanted == wanted


def test_a_refusal_says_which_settings() -> None:
    assert refused_line(LineEvent(1, LineEventKind.REFUSED, refusal(OTHER, "/dev/x: busy"))) == OTHER
    assert refused_line(LineEvent(1, LineEventKind.REFUSED, "no settings")) is None
    assert refused_line(LineEvent(1, LineEventKind.NOTE, refusal(OTHER, "/dev/x: busy"))) is None


def refused(search: Search, time: int) -> None:
    words = refusal(search.detecting.wanted, "cannot be set: I/O error")
    search.take(ReceivedMessage(0, LineEvent(time, LineEventKind.REFUSED, words)))


def test_a_port_that_refuses_everything_is_asked_now_and_then() -> None:
    """Each refusal is an event of the recording."""
    search = searching(LineSettings.parse("2400,8E1"))
    for turn in range(300):
        refused(search, turn * 1_000_000)
    assert 1 <= len(search.link.asked) <= 3  # type: ignore[attr-defined]
    search.take(Tick(0, 60_000_000_000))
    assert len(search.link.asked) <= 4  # type: ignore[attr-defined]


def test_what_was_refused_while_the_port_went_is_tried_again_when_it_is_back() -> None:
    search = searching()
    refused(search, 5)
    assert search.detecting.wanted == OTHER
    search.take(ReceivedMessage(0, LineEvent(6, LineEventKind.REPLUGGED, "p is back")))
    refused(search, 7)
    assert search.detecting.wanted == FIRST
    assert not search.detecting.is_refused
