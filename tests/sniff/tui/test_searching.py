"""The terminal UI while settings are searched for, and after they were found."""

from __future__ import annotations

from typing import Any

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.feed import FeedStatus
from sniff.bus.model import BusModel
from sniff.bus.rows import Store
from sniff.engine.engine import Output
from sniff.engine.event_texts import SettingsChange
from sniff.engine.follow_settings import SessionEngine
from sniff.engine.session import UNKNOWABLE, LineEvent, LineEventKind, Session

MS = 1_000_000
FIRST, RIGHT = LineSettings.parse("9600,8N1"), LineSettings.parse("38400,8N1")


def token(destination: int, source: int) -> bytes:
    from dissectors.checksums import crc8_mstp

    head = bytes([0, destination, source, 0, 0])
    return b"\x55\xff" + head + bytes([crc8_mstp(head)])


class Searched:
    """A store fed by an engine, as a live feed does it."""

    def __init__(self) -> None:
        self.engine = SessionEngine(Session("/dev/ttyUSB0", FIRST, "modbus-rtu", unknown=UNKNOWABLE))
        self.store = Store(self.engine.session, self.engine.dissector)
        self.time = 0

    def take(self, item: Chunk | LineEvent) -> None:
        output = self.engine.take(item)
        if self.engine.session is not self.store.session:
            self.store.settle(self.engine.session, self.engine.dissector)
        if isinstance(item, LineEvent):
            self.store.add_line_event(item)
        self.store.add(output)

    def settings(self, **words: Any) -> None:
        self.take(LineEvent(self.time, LineEventKind.SETTINGS, str(SettingsChange(**words))))

    def hear(self, octets: bytes) -> None:
        self.time += 50 * MS
        self.take(Chunk(self.time, octets))

    def search(self) -> None:
        self.settings(line=FIRST, searching=True)
        self.hear(b"\x80\xf8\x00")
        self.settings(line=RIGHT)

    def find(self) -> None:
        for _ in range(3):
            self.hear(token(1, 2))
            self.hear(token(2, 1))
        self.settings(line=RIGHT, protocol="mstp", found=True)
        self.hear(token(1, 2))


def test_the_header_says_so_and_then_what_was_found(look: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr("sniff.tui.screens.ring.PERIOD", 0.0)
    searched = Searched()
    searched.search()

    async def script(looking: Any) -> None:
        assert "searching 38400,8N1 …" in looking.lines()[0]
        assert "modbus-rtu" not in looking.lines()[0], "nobody knows it yet"
        assert "err" in looking.lines()[0]
        assert "3 octets heard while searching" in looking.text()
        await looking.press("7")
        assert "the protocol is not known: there is no ring" in looking.text()
        await looking.press("1")
        looking.app.filter("frame.len == 8")
        searched.find()
        looking.feed.current = FeedStatus("/dev/ttyUSB0", str(RIGHT), "mstp", live=True)
        await looking.poll()
        assert "searching" not in looking.lines()[0]
        assert "38400,8N1 mstp" in looking.lines()[0]
        assert any("found: mstp, 38400,8N1" in notice for notice in looking.notices())
        assert "oken" in looking.text()
        assert "err 0" in looking.lines()[0]
        await looking.press("7")
        await looking.poll()
        assert "there is no ring" not in looking.text(), "the ring of what was found"

    look(searched.store, script, live=True, searching=str(RIGHT))


def test_findings_are_those_of_what_was_found() -> None:
    searched = Searched()
    searched.search()
    searched.store.model.findings()
    searched.find()
    whole = BusModel(searched.engine.session, searched.engine.dissector)
    whole.add(
        Output(
            tuple(searched.store.rows),
            tuple(map(searched.store.closed_by_no, range(1, searched.store.last_closed + 1))),
        )
    )
    assert searched.store.model.findings() == whole.findings()
    assert not searched.store.errors
    assert searched.store.load.total.frames == searched.store.last_no - 1
