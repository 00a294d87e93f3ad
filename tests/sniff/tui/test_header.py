"""The first line of the header: everything in 80 columns, the port gives way."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from rich.cells import cell_len

from sniff.bus.feed import FeedStatus
from sniff.engine.session import LineEvent, LineEventKind
from sniff.tui.header import state_words, status_line, why_ended
from sniff.tui.view_state import Viewing

LIVE = FeedStatus("/dev/ttyUSB0", "19200,8E1", "modbus-rtu", "/tmp/x.mcap", 12_345_678, live=True)


def line(status: FeedStatus, viewing: Viewing, width: int = 80) -> str:
    return "".join(text for text, _ in status_line(status, viewing.store, viewing, width))


def test_everything_is_there(busy_bus: Any) -> None:
    text = line(LIVE, Viewing(busy_bus.store, follow=True))
    assert text == "/dev/ttyUSB0 19200,8E1 modbus-rtu load 16% err 5 REC 12.3 MB FOLLOW"
    roomy = line(LIVE, Viewing(busy_bus.store, follow=True), 100)
    assert roomy == "/dev/ttyUSB0  19200,8E1  modbus-rtu  load 16%  err 5  REC  12.3 MB  FOLLOW"


def test_a_search_stands_in_the_place_of_what_is_searched_for(busy_bus: Any) -> None:
    status = replace(LIVE, searching="9600,8N1")
    text = line(status, Viewing(busy_bus.store, follow=True))
    assert text == "/dev/ttyUSB0 searching 9600,8N1 … load 16% err 5 REC 12.3 MB FOLLOW"


def test_a_port_that_is_looked_for_has_no_load(busy_bus: Any) -> None:
    viewing = Viewing(busy_bus.store, follow=True)
    pieces = status_line(LIVE, busy_bus.store, viewing, 80, is_down=True)
    assert "".join(text for text, _ in pieces) == "/dev/ttyUSB0 19200,8E1 modbus-rtu DOWN err 5 REC 12.3 MB FOLLOW"
    assert ("DOWN", "bad") in pieces


def test_frozen_says_how_many_rows_came(busy_bus: Any) -> None:
    viewing = Viewing(busy_bus.store, follow=True)
    viewing.freeze(True)
    busy_bus.ask(1)
    assert line(LIVE, viewing).endswith("FROZEN +2")
    assert "FOLLOW" not in line(LIVE, viewing)


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (LIVE, "REC"),
        (FeedStatus("p", "l", "n2", live=True), "NOT REC"),
        (FeedStatus("follow:x.mcap", "l", "n2", live=True, follows="x.mcap"), "FILE"),
        (FeedStatus("p", "l", "n2", "/x", live=True, trouble="/x: no space left"), "REC FAILS"),
        (FeedStatus("p", "l", "n2", "/x", live=True, behind=12.4), "REC 12 s BEHIND"),
        (FeedStatus("p", "l", "n2", live=True, behind=12.4), "NOT REC"),
        (FeedStatus("f.mcap", "l", "n2"), "FILE"),
        (FeedStatus("p", "l", "n2", "/x", live=True, ended="unplugged"), "ENDED"),
    ],
)
def test_what_happens_to_what_comes_in(status: FeedStatus, words: str) -> None:
    assert state_words(status) == words


@pytest.mark.parametrize("width", [40, 60, 80, 120])
@pytest.mark.parametrize(
    "port",
    ["/dev/ttyUSB0", "socket://192.168.100.200:4001", "/home/somebody/captures/2026/boiler.mcap", "", "\x1b[2J日本"],
)
def test_the_port_gives_way(busy_bus: Any, width: int, port: str) -> None:
    viewing = Viewing(busy_bus.store)
    viewing.freeze(True)
    busy_bus.store.error_total = 123_456
    status = FeedStatus(port, "115200,8N1", "modbus-ascii", "/x", 999_000_000, 17, live=True)
    text = line(status, viewing, width)
    assert text.isprintable()
    for piece in ("115200,8N1", "modbus-ascii", "load ", "err 123456", "REC", "999 MB", "LOST 17", "FROZEN +0"):
        assert piece in text
    if width >= 80:
        assert cell_len(text) <= width


@pytest.mark.parametrize(
    ("width", "tabs"),
    [
        (120, " 1 Frames  2 Transactions  3 Nodes  4 Points  5 Findings  6 Timeline  7 Ring  8 Polls [9 Line]"),
        (80, "1 Frames 2 Trans. 3 Nodes 4 Points 5 Findings 6 Timeline 7 Ring 8 Polls [9 Line]"),
        (40, "1 2 3 4 5 6 7 8 [9 Line]"),
    ],
)
def test_nine_screens_fit(look: Any, busy_bus: Any, width: int, tabs: str) -> None:
    names = ("Frames", "Transactions", "Nodes", "Points", "Findings", "Timeline", "Ring", "Polls", "Line")

    async def script(see: Any) -> None:
        see.app.tabs = tuple((str(key), name) for key, name in enumerate(names, 1))
        await see.press("9")
        assert see.lines()[1] == tabs

    look(busy_bus.store, script, (width, 24))


def test_neither_following_nor_frozen_is_said_while_rows_come(busy_bus: Any) -> None:
    viewing = Viewing(busy_bus.store)
    assert line(LIVE, viewing).endswith(" FOLLOW OFF")
    assert "FOLLOW" not in line(replace(LIVE, ended="asked to"), viewing)
    assert "FOLLOW" not in line(FeedStatus("f.mcap", "l", "n2"), viewing)


def test_no_size_where_nothing_is_recorded(busy_bus: Any) -> None:
    viewing = Viewing(busy_bus.store, follow=True)
    assert line(FeedStatus("p", "l", "n2", live=True), viewing).endswith("NOT REC FOLLOW")
    assert line(FeedStatus("f", "l", "n2", file_size=2000), viewing).endswith("FILE 2.0 kB FOLLOW")


def test_the_end_says_why(busy_bus: Any) -> None:
    store = busy_bus.store
    ended = replace(LIVE, recording=None, ended="nothing more to read")
    assert line(ended, Viewing(store)).endswith("ENDED: nothing more to read")
    store.add_line_event(LineEvent(busy_bus.now, LineEventKind.UNPLUGGED, "/dev/ttyUSB0 is gone (hung up)"))
    assert line(ended, Viewing(store)).endswith(" ENDED: hung up")
    assert why_ended(ended, store)[1] == "/dev/ttyUSB0 is gone (hung up); nothing more to read"
    store.add_line_event(LineEvent(busy_bus.now, LineEventKind.REPLUGGED, "/dev/ttyUSB0 is back"))
    assert why_ended(ended, store)[1] == "nothing more to read"
    assert why_ended(LIVE, store) == ("", "")
