"""What a person wrote into a text capture stays there through formats that can hold it."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read
from sniff.formats.text import TextCapture, render

TEXT = """#!sniff-capture 1
# line: 19200,8E1
# protocol: modbus-rtu
# this is about pump 3
+0 01 03 00 00 00 02 C4 0B # the poll
# second: thought
+9 01 03 04 00 D7 00 1A CB C0
# end
"""
SAID = ["this is about pump 3", "the poll", "second: thought", "end"]


def comments(path: Path) -> list[str]:
    capture = read(path)
    if isinstance(capture, TextCapture):
        return [event.text for event in capture.comments()]
    return [item.text for item in capture.items() if isinstance(item, LineEvent) and item.kind is LineEventKind.COMMENT]


def test_comments_are_kept(tmp_path: Path) -> None:
    from sniff.cli import main

    places = [tmp_path / name for name in ("a.cap.txt", "b.mcap", "c.cap.txt", "d.cap.txt")]
    places[0].write_text(TEXT)
    for before, after in pairwise(places):
        assert main(["convert", str(before), str(after)]) == 0
        assert comments(after) == SAID
    assert places[2].read_text() == places[3].read_text()


def test_comments_are_kept_beside_packets(tmp_path: Path) -> None:
    from sniff.cli import main

    places = [tmp_path / name for name in ("a.cap.txt", "b.pcapng", "c.mcap", "d.cap.txt")]
    places[0].write_text(TEXT)
    for before, after in pairwise(places):
        assert main(["convert", str(before), str(after)]) == 0
    octets, text = places[1].read_bytes(), places[3].read_text()
    for said in SAID:
        assert said.encode() in octets
        assert said in text


def test_a_comment_is_never_read_as_a_header(tmp_path: Path) -> None:
    path = tmp_path / "a.cap.txt"
    path.write_text(TEXT)
    session = read(path).session
    for text in ("protocol: n2", "!sniff-capture 9", "! +0 dropped", "", " x ", "a\nb", "+0 FF"):
        events = [LineEvent(session.started, LineEventKind.COMMENT, text)]
        again = tmp_path / "b.cap.txt"
        again.write_text(render(session, [*events, *read(path).items()]))
        capture = read(again)
        assert capture.session == session
        assert len([item for item in capture.items() if not isinstance(item, LineEvent)]) == 2


def test_reading_is_the_same_with_and_without(tmp_path: Path) -> None:
    path = tmp_path / "a.cap.txt"
    path.write_text(TEXT)
    assert all(not isinstance(item, LineEvent) for item in read(path).items())
