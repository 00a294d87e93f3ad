"""A recording gives back exactly what was put in: chunks, marks, events, session, in order."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TypeGuard

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.bus.capture_writer import create
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind, Session
from sniff.formats import read
from tests.seeds import examples

BASE = 1_772_359_200_000_000_000
SESSION = Session(
    port="/dev/ttyUSB0",
    line=LineSettings(19200, 8, "E", 1),
    protocol="modbus-rtu",
    started=BASE,
    bus="boiler-room",
    adapter=Adapter("FTDI", "ftdi_sio", 17_000_000, "read from the driver", ("parity", "framing"), "", "A5ä"),
    notes={"profile 3": "teco-e510"},
)
ERRORS = st.integers(1, 15).map(LineError)
TIMES = st.one_of(st.integers(0, 10**9), st.integers(-(10**12), 10**12), st.integers(-(2**62), 2**62))


@st.composite
def chunks(draw: st.DrawFn) -> Chunk:
    octets = draw(st.binary(min_size=1, max_size=40))
    marks = draw(st.dictionaries(st.integers(0, len(octets) - 1), ERRORS, max_size=3))
    time = BASE + draw(TIMES)
    return Chunk(time, octets, tuple(Mark(offset, error) for offset, error in sorted(marks.items())))


EVENTS = st.builds(
    LineEvent,
    TIMES.map(lambda time: BASE + time),
    st.sampled_from(LineEventKind),
    st.text(max_size=20),
    st.integers(-1, 10**9),
)
ITEMS = st.lists(st.one_of(chunks(), EVENTS), max_size=40)


def _is_comment(item: Item) -> TypeGuard[LineEvent]:
    return isinstance(item, LineEvent) and item.kind is LineEventKind.COMMENT


def _without_comments(items: Iterable[Item]) -> list[Item]:
    return [item for item in items if not _is_comment(item)]


@settings(deadline=None, max_examples=examples(60))
@given(ITEMS)
@pytest.mark.parametrize("suffix", [".mcap", ".cap.txt"])
def test_items_come_back(tmp_path_factory: pytest.TempPathFactory, suffix: str, items: list[Item]) -> None:
    path: Path = tmp_path_factory.mktemp("round") / f"a{suffix}"
    with create(path, SESSION) as writer:
        for item in items:
            writer.write(item)
    capture = read(path)
    assert _without_comments(capture.items()) == _without_comments(items)
    told = [item.text for item in capture.items() if _is_comment(item)]
    told += [one.text for one in getattr(capture, "comments", tuple)()]  # those that stand as plain lines in a text
    assert sorted(told) == sorted(item.text for item in items if _is_comment(item))
    assert capture.completeness().whole, capture.completeness().text
    assert capture.session == SESSION
