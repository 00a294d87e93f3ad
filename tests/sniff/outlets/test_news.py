"""What is new, worse, gone; not too often, and nothing uncounted."""

from __future__ import annotations

from dataclasses import replace

from dissectors import registry
from dissectors.findings import Finding, Severity, found
from dissectors.line import LineSettings
from sniff.analysis.judging import Judging
from sniff.engine.session import LineEvent, LineEventKind, Session
from sniff.outlets.news import OVER_AFTER, NewsDesk, NewsKind

S = 1_000_000_000
FOUND = Finding("MB001", Severity.WARNING, "station 3", 0, 10 * S, 4, (), "no answer", "", "")


def test_new_then_silence_then_worse_then_gone_then_new_again() -> None:
    desk = NewsDesk(Severity.WARNING, 0)
    assert [one.what for one in desk.look([FOUND], 11 * S)] == [NewsKind.NEW]
    assert desk.look([FOUND], 12 * S) == []
    grave = replace(FOUND, severity=Severity.ERROR, last=20 * S)
    assert [one.what for one in desk.look([grave], 21 * S)] == [NewsKind.WORSE]
    later = 20 * S + OVER_AFTER + 1
    assert [one.what for one in desk.look([grave], later)] == [NewsKind.GONE]
    assert desk.look([grave], later + S) == []
    again = replace(grave, last=later + 2 * S)
    assert [one.what for one in desk.look([again], later + 3 * S)] == [NewsKind.NEW]


def test_what_comes_back_and_becomes_as_grave_as_it_was_is_worse() -> None:
    desk = NewsDesk(Severity.WARNING, 0)
    grave = replace(FOUND, severity=Severity.ERROR)
    later = 10 * S + OVER_AFTER + 1
    again = replace(FOUND, last=later)
    looks = [
        (grave, 11 * S),
        (grave, later),
        (again, later + S),
        (replace(again, severity=Severity.ERROR), later + 2 * S),
    ]
    told = [[one.what for one in desk.look([found], now)] for found, now in looks]
    assert told == [[NewsKind.NEW], [NewsKind.GONE], [NewsKind.NEW], [NewsKind.WORSE]]


def test_what_lasts_is_not_over_for_that_nothing_new_is_heard_of_it() -> None:
    """An hour without an octet, and without the adapter: until that is back."""
    judging = Judging(Session("x", LineSettings(), "modbus-rtu"), registry.get("modbus-rtu"))
    desk = NewsDesk(Severity.WARNING, 0)
    judging.add_line_event(LineEvent(5 * S, LineEventKind.UNPLUGGED, "gone"))
    assert {one.finding.code for one in desk.look(judging.findings(), 61 * S)} == {"LN002", "LN006"}
    assert desk.look(judging.findings(), 3600 * S) == []
    judging.add_line_event(LineEvent(3600 * S, LineEventKind.REPLUGGED, "back"))
    assert [(one.what, one.finding.code) for one in desk.look(judging.findings(), 3601 * S)] == [
        (NewsKind.GONE, "LN006")
    ]


def test_who_left_the_ring_is_gone_until_it_is_back() -> None:
    desk = NewsDesk(Severity.WARNING, 0)
    left = found(registry.get("mstp").rules["MS106"], "MAC 9", "was passed over", first=0, last=10 * S, count=1)
    assert [one.what for one in desk.look([left], 11 * S)] == [NewsKind.NEW]
    assert desk.look([left], 10 * S + OVER_AFTER + 1) == []
    assert [one.what for one in desk.look([], 700 * S)] == [NewsKind.GONE]


def test_what_explains_what_goes_on_is_not_over() -> None:
    desk = NewsDesk(Severity.WARNING, 0)
    under = replace(FOUND, code="MB104", severity=Severity.NOTE, cause=FOUND.key, last=900 * S)
    assert [one.what for one in desk.look([FOUND], 11 * S)] == [NewsKind.NEW]
    assert desk.look([FOUND, under], 900 * S) == []
    assert [one.what for one in desk.look([FOUND, under], 900 * S + OVER_AFTER + 1)] == [NewsKind.GONE]


def test_notes_and_consequences_are_nobodys_business() -> None:
    desk = NewsDesk(Severity.WARNING, 0)
    assert desk.look([replace(FOUND, severity=Severity.NOTE)], 11 * S) == []
    assert desk.look([replace(FOUND, cause=("LN003", "bus"))], 11 * S) == []


def test_what_is_held_back_is_counted() -> None:
    desk = NewsDesk(Severity.WARNING, 10**15)
    assert len(desk.look([FOUND], 11 * S)) == 1
    over = 10 * S + OVER_AFTER + 1
    assert desk.look([FOUND], over) == []
    back = replace(FOUND, last=over + S)
    assert desk.look([back], over + S) == []
    other = NewsDesk(Severity.WARNING, 700 * S)
    other.look([FOUND], 11 * S)
    other.look([FOUND], over)
    late = replace(FOUND, last=over + 200 * S)
    (news,) = other.look([late], over + 200 * S)
    assert (news.what, news.held_back) == (NewsKind.NEW, 1)


def test_each_finding_has_its_own_ration() -> None:
    desk = NewsDesk(Severity.WARNING, 10**15)
    assert len(desk.look([FOUND, replace(FOUND, subject="station 4")], 11 * S)) == 2


def test_what_becomes_graver_is_told_at_once() -> None:
    """A station that was asked once is a note; a second later it is an error, which nobody may miss."""
    desk = NewsDesk(Severity.INFO, 60 * S)
    desk.look([replace(FOUND, severity=Severity.NOTE)], 11 * S)
    (news,) = desk.look([replace(FOUND, severity=Severity.ERROR, last=12 * S)], 12 * S)
    assert (news.what, news.finding.severity) == (NewsKind.WORSE, Severity.ERROR)


def test_what_is_over_is_told_when_its_time_comes() -> None:
    """Seen once, it is over a moment before the next word about it is allowed."""
    desk = NewsDesk(Severity.INFO, OVER_AFTER)
    desk.look([FOUND], 11 * S)
    over = FOUND.last + OVER_AFTER + 1
    assert desk.look([FOUND], over) == []
    (news,) = desk.look([FOUND], 11 * S + OVER_AFTER)
    assert (news.what, news.held_back) == (NewsKind.GONE, 0)
    assert desk.look([FOUND], 12 * S + 2 * OVER_AFTER) == []


def test_what_is_found_no_more_is_gone() -> None:
    """Withdrawn, no longer worth a word, or another's consequence: nobody may believe that it still stands."""
    for now in ([], [replace(FOUND, severity=Severity.NOTE)], [replace(FOUND, cause=("LN003", "bus"))]):
        desk = NewsDesk(Severity.WARNING, 0)
        desk.look([FOUND], 11 * S)
        (news,) = desk.look(now, 12 * S)
        assert (news.what, news.finding) == (NewsKind.GONE, FOUND)
        assert desk.look(now, 13 * S) == []
        assert [one.what for one in desk.look([FOUND], 14 * S)] == [NewsKind.NEW]


def test_two_of_one_kind_about_one_station_are_one() -> None:
    desk = NewsDesk(Severity.WARNING, 0)
    old = replace(FOUND, first=0, last=S)
    assert [one.what for one in desk.look([old, replace(FOUND, last=OVER_AFTER)], OVER_AFTER + 2 * S)] == [NewsKind.NEW]
    assert desk.look([old, replace(FOUND, last=OVER_AFTER)], OVER_AFTER + 3 * S) == []
