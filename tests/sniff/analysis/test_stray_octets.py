"""Stray octets: which ones they are mostly is said only where there is a majority."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

import pytest

from dissectors.findings import Severity
from dissectors.frame import Check, Damage, FoundBy, Frame, Noise, Place, Reason
from dissectors.line import LineSettings
from sniff.analysis.line_findings import LineFindings
from sniff.analysis.remains import Remains
from sniff.engine.engine import Row
from sniff.engine.session import Session


@pytest.mark.parametrize(
    ("octets", "said"),
    [
        ((0x00, 0xC0, 0xF8), " (00, C0, F8)"),
        ((0x00,) * 9 + (0xC0, 0xF8, 0xE0, 0xFF, 0x01), " (mostly 00, C0, F8, E0)"),
        (tuple(range(20)), ""),
    ],
)
def test_mostly_needs_a_majority(octets: Sequence[int], said: str) -> None:
    line = LineFindings(Session(port="test", line=LineSettings(), protocol="modbus-rtu"))
    for no, octet in enumerate((0x55, *octets)):  # the first row is the begin of the capture
        time = no * 1_000_000_000
        noise = Noise(bytes((octet,)), time, time, Place.BETWEEN, Reason.NO_FRAME)
        line.see(Row(no, noise, None, None))
    (finding,) = (finding for finding in line.findings() if finding.code == "LN203")
    assert finding.seen == f"stray octets {len(octets)} times in the silence between 0 frames{said}"


@pytest.mark.parametrize(
    ("lengths", "of_all", "said"),
    [
        ((1,), 1000, "1 octet in 1 stretch is no frame, 0.1% of all"),
        ((4, 5), 100_000, "9 octets in 2 stretches are no frame, under 0.1% of all"),
    ],
)
def test_how_much_is_no_frame(lengths: Sequence[int], of_all: int, said: str) -> None:
    remains = Remains(Session(port="test", line=LineSettings(), protocol="modbus-rtu"))
    for no, length in enumerate(lengths):
        remains.add(no, Noise(bytes(length), 0, 0, Place.BETWEEN, Reason.NO_FRAME))
    found = remains.found(of_all)
    assert found is not None
    assert found.seen == said


@pytest.mark.parametrize(
    ("many", "said"), [(6, "the same 5 octets 6 times"), (40, "the same 5 octets in 16 of 16 compared")]
)
def test_how_often_stretches_are_the_same_is_said_of_those_that_are_kept(many: int, said: str) -> None:
    remains = Remains(Session(port="test", line=LineSettings(), protocol="modbus-rtu"))
    for no in range(many):
        remains.add(no, Noise(b"\x41\x42\x43\x44\x45", no, no, Place.BETWEEN, Reason.NO_FRAME))
    found = remains.found(10_000)
    assert found is not None
    assert said in found.seen


@pytest.mark.parametrize(
    ("many", "gap", "of_all", "is_told"),
    [(9, 0, 10_000, True), (7, 0, 10_000, False), (9, 4, 10_000, False), (9, 0, 4_000, False)],
)
def test_somebody_who_does_not_stop_is_told(many: int, gap: int, of_all: int, is_told: bool) -> None:
    session, dice = Session(port="test", line=LineSettings(), protocol="modbus-rtu"), Random(1)
    remains, char = Remains(session), session.line.char
    for no in range(many):
        start = no * (256 + gap) * char
        remains.add(no, Noise(dice.randbytes(256), start, start + 256 * char, Place.BETWEEN, Reason.NO_FRAME))
    found = remains.found(of_all)
    assert found is not None
    assert ("longer than any frame" in found.seen) is is_told


def _hear(line: LineFindings, *, slack: int = 0, damage: Damage | None = None, rounds: int = 30) -> Severity | None:
    """Octets between frames, again and again; how grave what is said of them is."""
    second = 1_000_000_000
    octets = bytes.fromhex("01 03 00 00 00 01 84 0A")
    for no in range(2, 4 * rounds, 4):
        time = no * second
        before = Frame("modbus-rtu", octets, time, time, Check.GOOD, FoundBy.GAP, damage)
        line.see(Row(no, before, None, None))
        place = Place.BEFORE if damage else Place.AFTER
        line.see(Row(no + 1, Noise(b"\x01", time + second, time + second, place, Reason.NO_FRAME), None, None))
        late = Frame("modbus-rtu", octets, time + 2 * second, time + 2 * second, Check.GOOD, FoundBy.GAP, slack=slack)
        line.see(Row(no + 2, late, None, None))
    return next((one.severity for one in line.findings() if one.code in ("LN201", "LN202", "LN203")), None)


def _line() -> LineFindings:
    return LineFindings(Session(port="test", line=LineSettings(), protocol="modbus-rtu"))


def test_octets_before_a_frame_that_was_read_late_may_be_its_begin() -> None:
    assert _hear(_line(), slack=90_000_000) is None
    assert _hear(_line()) is Severity.WARNING


def test_octets_behind_a_damaged_frame_may_be_its_end() -> None:
    assert _hear(_line(), damage=Damage.CHECK) is None


def test_only_what_is_directly_before_a_late_frame_is_taken_back() -> None:
    kept, late = _line(), _line()
    assert _hear(kept) is not None
    assert _hear(late) is not None
    _hear(late, slack=90_000_000, rounds=3)
    said = [{one.code: one.count for one in line.findings() if one.code.startswith("LN20")} for line in (kept, late)]
    assert said[0] == said[1]


@pytest.mark.parametrize("cut", [2, 3, 6, 7])
def test_pieces_that_together_are_a_good_frame_are_no_stray_octets(cut: int) -> None:
    frame, second = bytes.fromhex("01 03 00 00 00 01 84 0A"), 1_000_000_000

    def heard(end: bytes) -> LineFindings:
        line = _line()
        for no in range(0, 60, 3):
            time = no * second
            line.see(Row(no, Frame("modbus-rtu", frame, time, time, Check.GOOD, FoundBy.GAP), None, None))
            for place, piece in enumerate((frame[:cut], end), 1):
                at = time + place * second
                line.see(Row(no + place, Noise(piece, at, at, Place.BETWEEN, Reason.NO_FRAME), None, None))
        return line

    strays = "LN203"
    assert strays not in {one.code for one in heard(frame[cut:]).findings()}
    assert strays in {one.code for one in heard(bytes(len(frame) - cut)).findings()}
