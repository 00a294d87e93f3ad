"""The search on a running capture, fed by hand: what makes it give up a setting."""

from __future__ import annotations

from typing import Any

import pytest

from dissectors.line import LineSettings
from sniff.analysis.autodetect import Detecting
from sniff.bus.autodetect import Search
from sniff.capture.ipc import ReceivedMessage
from sniff.engine.session import LineEvent, LineEventKind, Session, refusal, refused_line

FIRST, OTHER = LineSettings.parse("9600,8N1"), LineSettings.parse("4800,7E1")


class Link:
    """A capture that is asked for settings."""

    def __init__(self) -> None:
        self.asked: list[LineSettings] = []

    def session(self, bus: int) -> Session:
        return Session("p", FIRST, "modbus-rtu", unknown=("line", "protocol"))

    def reconfigure(self, bus: int, line: LineSettings) -> None:
        self.asked.append(line)


def searching() -> Search:
    link: Any = Link()
    return Search(link, Detecting((FIRST, OTHER), ("modbus-rtu",)))


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
