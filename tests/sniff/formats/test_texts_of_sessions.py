"""What a file says of its session may be anything: numbers without end, half characters, texts longer than a format has
room for. It is read and written all the same."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from sniff import formats
from sniff.bus.capture_writer import create
from sniff.engine.session import LATEST, MOST_LATENCY, LineEvent, LineEventKind, Session
from sniff.formats import pcapng, text
from sniff.formats.mark_file import add_mark, marks_beside

FRAME = bytes.fromhex("010300000002C40B")
HALF = "half \ud800"


def written(session: Session, path: Path) -> Session:
    with create(path, session) as file:
        file.write(Chunk(10**18, FRAME))
        file.write(LineEvent(10**18 + 5, LineEventKind.MARK, HALF))
    return formats.read(path).session


@pytest.mark.parametrize("suffix", [".cap.txt", ".pcapng", ".mcap"])
def test_half_characters_are_written_as_their_numbers(suffix: str, tmp_path: Path) -> None:
    given = text.parse(f"#!sniff-capture 1\n# bus: {json.dumps(HALF)}\n# note a: {json.dumps(HALF)}\n+0 01").session
    assert (given.bus, given.notes["a"]) == (r"half \ud800", r"half \ud800")
    assert written(given, tmp_path / f"x{suffix}").bus == r"half \ud800"


@pytest.mark.parametrize("number", ["9" * 30, "-" + "9" * 4000, "9" * 5000, "x"])
def test_numbers_that_no_clock_and_no_adapter_has(number: str) -> None:
    session = Session.from_metadata({"started_ns": number, "adapter_latency_ns": number})
    assert abs(session.started) <= LATEST
    assert 0 <= session.adapter.latency <= MOST_LATENCY


def test_notes_longer_than_pcapng_holds_are_left_out_and_said(tmp_path: Path) -> None:
    session = replace(Session.from_metadata({"port": "p" * 70_000, "line": "9600,7E1"}), notes={"a": "x" * 70_000})
    file = pcapng.create(tmp_path / "x.pcapng", session, 147)
    file.close()
    assert any("notes" in loss for loss in file.losses)
    found = formats.read(tmp_path / "x.pcapng").session
    assert (found.line, found.port, dict(found.notes).get("a")) == (session.line, "p" * 200, None)


def test_a_mark_of_half_a_character(tmp_path: Path) -> None:
    add_mark(tmp_path / "x", 5, HALF)
    (tmp_path / "x.marks.jsonl").open("a").write(json.dumps({"time": 9, "text": HALF}) + "\n")
    assert [one.text for one in marks_beside(tmp_path / "x")] == [r"half \ud800"] * 2
