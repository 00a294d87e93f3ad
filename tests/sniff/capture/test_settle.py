"""A capture whose settings were found while it ran: the recording begins then, with them, on the same opening."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.capture.config import RecordSpec, SourceSpec
from sniff.capture.link import CaptureLink
from sniff.formats import CaptureError, read
from sniff.session import LineEvent, LineEventKind

FIRST, FOUND = LineSettings.parse("9600,8N1"), LineSettings.parse("19200,8E1")


def test_the_recording_begins_with_what_was_found(pty, collect, octets, tmp_path: Path) -> None:
    path = tmp_path / "found.mcap"
    with CaptureLink.start([SourceSpec(pty.path, FIRST)]) as link:
        pid, started = link.pid, link.session(0).started
        pty.feed(b"before")
        collect(link, lambda got: len(octets(got)) >= 6)
        link.reconfigure(0, FOUND)
        messages = collect(
            link,
            lambda got: any(
                isinstance(item := getattr(message, "item", None), LineEvent) and item.kind is LineEventKind.SETTINGS
                for message in got
            ),
        )
        assert not octets(messages)
        link.settle([SourceSpec(pty.path, FOUND, "n2", "boiler")], RecordSpec(str(path)))
        assert (link.session(0).protocol, link.session(0).line, link.session(0).bus) == ("n2", FOUND, "boiler")
        assert (link.pid, link.session(0).started) == (pid, started)
        assert link.paths == [str(path)]
        pty.feed(b"after")
        messages = collect(link, lambda got: len(octets(got)) >= 5)
    assert octets(messages) == b"after"
    capture = read(path)
    assert (capture.session.protocol, capture.session.line) == ("n2", FOUND)
    assert b"".join(item.octets for item in capture.items() if isinstance(item, Chunk)) == b"after"
    assert capture.completeness().whole


def test_a_file_that_cannot_be_made_is_said_and_the_capture_goes_on(pty, collect, octets, tmp_path: Path) -> None:
    with CaptureLink.start([SourceSpec(pty.path, FIRST)]) as link:
        with pytest.raises(CaptureError, match=r"night\.mcap"):
            link.settle([SourceSpec(pty.path, FOUND)], RecordSpec(str(tmp_path / "missing" / "night.mcap")))
        pty.feed(b"still")
        assert octets(collect(link, lambda got: len(octets(got)) >= 5)) == b"still"


def test_a_duration_counts_from_then_on(pty, tmp_path: Path) -> None:
    with CaptureLink.start([SourceSpec(pty.path, FIRST)]) as link:
        link.settle([SourceSpec(pty.path, FOUND)], duration=0.2)
        while link.ended is None:
            link.receive(0.5)
        assert link.ended.clean
