"""Text captures: any values come back exactly; any text is a capture or an error with its place."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.engine.capture import CaptureError
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind, Session
from sniff.formats import text
from sniff.formats.text import parse, render
from tests.seeds import examples

TIMES = st.integers(-(2**61), 2**61)
PLAIN = st.text(st.characters(exclude_categories=("Cs",)), max_size=12)
WORDS = st.sampled_from(["parity", "framing", "break", "overrun"])


@st.composite
def chunks(draw: st.DrawFn) -> Chunk:
    octets = draw(st.binary(min_size=1, max_size=30))
    marks = draw(st.dictionaries(st.integers(0, len(octets) - 1), st.integers(1, 15).map(LineError), max_size=3))
    return Chunk(draw(TIMES), octets, tuple(Mark(*mark) for mark in sorted(marks.items())))


EVENTS = st.builds(LineEvent, TIMES, st.sampled_from(LineEventKind), PLAIN, st.integers(-(10**18), 10**18))
DEVICES = st.lists(st.from_regex(r"\A([0-9]|\*|0x1F)=[a-z0-9][a-z0-9-]*\Z"), max_size=3).map(",".join)
SESSIONS = st.builds(
    Session,
    port=PLAIN,
    line=st.builds(
        LineSettings, st.integers(50, 10**7), st.integers(5, 8), st.sampled_from("NEOMS"), st.sampled_from([1, 1.5, 2])
    ),
    protocol=PLAIN,
    started=TIMES,
    bus=PLAIN,
    adapter=st.builds(
        Adapter,
        name=PLAIN,
        driver=PLAIN,
        latency=st.integers(0, 10**12),
        latency_from=PLAIN,
        reports=st.one_of(st.none(), st.lists(WORDS, unique=True).map(tuple)),
        detail=PLAIN,
        serial_number=PLAIN,
    ),
    program=PLAIN,
    notes=st.dictionaries(st.one_of(PLAIN, st.just("devices")), st.one_of(PLAIN, DEVICES), max_size=3),
    unknown=st.sampled_from([(), ("line",), ("protocol",), ("line", "protocol")]),
    given=st.booleans(),
)
ITEMS = st.lists(st.one_of(chunks(), EVENTS), max_size=20)


@given(SESSIONS, ITEMS)
@settings(deadline=None)
def test_values_come_back(session: Session, items: list[Item]) -> None:
    text = render(session, items)
    capture = parse(text)
    assert capture.session == session
    assert list(capture.items()) == items
    assert render(capture.session, capture.items()) == text


TOKENS = """#!sniff-capture␣1 ⏎ ␍ #␣
line:␣ 19200,8E1 start:␣ note␣ :␣ 2026-03-01T10:00:00 Z + ~ - 1.5 ␣ 01 ! P " \\x0 #!␣
settings␣ count= note \ufeff ９""".replace("␍", "\r")
TABLE = [token.replace("␣", " ").replace("⏎", "\n") for token in re.split(r"[ \n]", TOKENS)]
FRAGMENTS = st.lists(st.one_of(st.sampled_from(TABLE), st.text(max_size=5), st.integers().map(str)), max_size=30).map(
    "".join
)
COMPLAINT = re.compile(r"<text>:\d+:\d+: expected .*, found .*")


@given(st.one_of(FRAGMENTS, st.text(max_size=200)))
@settings(deadline=None, max_examples=examples(300))
def test_any_text(text: str) -> None:
    try:
        capture = parse(text)
        items = list(capture.items())
    except CaptureError as error:
        complaint = str(error)
    else:
        assert list(parse(render(capture.session, items)).items()) == items
        return
    assert COMPLAINT.fullmatch(complaint), complaint


@given(st.one_of(st.binary(max_size=200), FRAGMENTS.map(lambda written: written.encode("utf-8", "replace"))))
@settings(deadline=None)
def test_any_file(tmp_path_factory: pytest.TempPathFactory, octets: bytes) -> None:
    path = Path(tmp_path_factory.getbasetemp()) / "any.cap.txt"
    path.write_bytes(octets)
    try:
        items = list(text.read(path).items())  # what is no text capture, its name alone does not make one
    except CaptureError as error:
        complaint = str(error)
    else:
        assert items == list(parse(octets.decode("utf-8-sig", "replace")).items())
        return
    assert complaint.startswith(str(path))
    assert complaint.isprintable()


ANY = st.integers(-(2**80), 2**80)
ENDS = st.sampled_from([-(2**63), 2**63 - 1, 2**63, 2**64 - 1, 253402300800 * 10**9])
FAR = st.one_of(ANY, ENDS)


@given(
    SESSIONS,
    FAR,
    st.integers(0, 2**90),
    st.lists(
        st.one_of(
            st.builds(Chunk, FAR, st.binary(min_size=1, max_size=4)),
            st.builds(LineEvent, FAR, st.sampled_from(LineEventKind), PLAIN, FAR),
        ),
        max_size=6,
    ),
)
@settings(deadline=None)
def test_what_is_written_can_be_read(session: Session, started: int, latency: int, items: list[Item]) -> None:
    """A damaged or hostile file may have any times; octets and events are kept, at the nearest time there is."""
    session = replace(session, started=started, adapter=replace(session.adapter, latency=latency))
    found = parse(render(session, items), "x")
    there = list(found.items())
    assert [getattr(item, "octets", None) for item in there] == [getattr(item, "octets", None) for item in items]
    assert [item.time for item in there] == [min(max(item.time, 1 - 2**63), 2**63 - 1) for item in items]
