"""The protocol of a capture from its octets: never wrong with "sure"."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.analysis.told_protocol import Sureness, detected, told_by
from sniff.engine.capture import CaptureError
from sniff.engine.session import ASSUMED, LINE_NOTE, PROTOCOL_NOTE, Adapter, Session
from sniff.formats import read, with_first_reads
from sniff.formats.table import suffixes
from tests.seeds import in_turn, some

HERE = Path(__file__).parents[3]
FOLDERS = [HERE / "captures", *(HERE.parent / "shared" / name for name in ("captures", "cases"))]
NOTES = {PROTOCOL_NOTE: ASSUMED, LINE_NOTE: ASSUMED}


def _files() -> list[Path]:
    return sorted(
        path
        for folder in FOLDERS
        for path in folder.rglob("*")
        if "-read-as-" not in path.name  # of those the header is what is wrong
        and "-of-a-network" not in path.name  # which carries frames of another protocol on a line of serial ones
        and path.name.endswith((".cap.txt", ".pcap", ".cap", ".mcap", ".pcapng"))
        and path.name.endswith(suffixes())
    )


FILES = some(_files(), 4)


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}-{path.name}")
def test_sure_is_right(path: Path) -> None:
    try:
        session = read(path).session
    except CaptureError:
        pytest.skip("no capture that is read")
    if session.unknown or PROTOCOL_NOTE in session.notes:
        pytest.skip("its protocol is not known")
    for notes in in_turn((NOTES, {PROTOCOL_NOTE: ASSUMED}), FILES.index(path), 2):
        told = told_by(replace(session, notes=notes))
        if told.sureness is Sureness.SURE:
            assert told.reading is not None
            assert told.reading.protocol == session.protocol, told.words


def session_of(*octets: bytes, gap: int = 20_000_000, adapter: Adapter | None = None) -> Session:
    """A capture that says nothing of its bus."""
    session = Session("x", LineSettings.parse("19200,8E1"), "modbus-rtu", notes=NOTES, adapter=adapter or Adapter())
    reads = [Chunk(gap * number, each) for number, each in enumerate(octets, 1)]
    return with_first_reads(session, reads)


RTU = bytes.fromhex("010300000002C40B"), bytes.fromhex("01030400D7001ACBC0")
ASCII = b":010300000002FA\r\n", b":01030400D7001A07\r\n"


def test_all_that_makes_good_frames_is_named() -> None:
    for octets, name in ((RTU, "modbus-rtu"), (ASCII, "modbus-ascii")):
        session = detected(session_of(*octets * 4))
        assert session.protocol == name
        assert session.notes[PROTOCOL_NOTE].startswith("sure: 8 good frames hold 100%")


def test_few_frames_are_no_proof() -> None:
    assert told_by(session_of(*RTU)).sureness is Sureness.LIKELY
    assert told_by(session_of(RTU[0])).sureness is Sureness.GUESS
    assert told_by(session_of(b"")).sureness is Sureness.NO


def test_random_octets_are_nothing() -> None:
    dice = random.Random(485)
    for _ in range(30):
        told = told_by(session_of(*(dice.randbytes(dice.randrange(1, 40)) for _ in range(60))))
        assert told.sureness is Sureness.NO, told.words


def test_the_second_protocol_is_named() -> None:
    told = told_by(session_of(*(RTU * 5 + ASCII * 2) * 2))
    assert told.reading is not None
    assert told.reading.protocol == "modbus-ascii" or told.reading.protocol == "modbus-rtu"
    assert told.second is not None
    assert {told.reading.protocol, told.second[0]} == {"modbus-rtu", "modbus-ascii"}
    assert "foreign frames that read as" in told.words


def test_a_relative_on_networks_is_no_second_protocol_of_a_line() -> None:
    tcp = bytes.fromhex("0001 0000 0006 01 03 0000 0002"), bytes.fromhex("0001 0000 0007 01 03 04 00D7 001A")
    noise = random.Random(1).randbytes(400)
    told = told_by(session_of(*(*RTU * 4, noise, *tcp) * 2))
    assert told.reading is not None
    assert told.reading.protocol == "modbus-rtu"
    assert told.second is None, "all rows were held back for it, and none was shown"


@pytest.mark.parametrize(("char", "line"), [(1_041_667, "9600,8N1"), (572_917, "19200,8E1"), (86_806, "115200,8N1")])
def test_exact_times_tell_the_line(char: int, line: str) -> None:
    exact = Adapter("logic analyser", latency_from="exact times")
    session = session_of(*(bytes((octet,)) for octet in RTU[0] + RTU[1]), gap=char, adapter=exact)
    assert str(detected(session).line) == line
