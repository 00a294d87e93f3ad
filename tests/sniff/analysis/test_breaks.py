"""Breaks and error flags: disturbances are counted, and octets that are no frame accuse nobody."""

from __future__ import annotations

import pytest

from dissectors.findings import Finding, Severity
from dissectors.frame import Check, Damage, Event, FoundBy, Frame, LineError, Mark, Noise, Place, Reason
from dissectors.line import MS, LineSettings, Timing
from sniff.analysis.breaks import breaks_in
from sniff.analysis.sender_findings import Senders

LINE = LineSettings.parse("9600,8N1")
FRAMING = LineError.FRAMING
LOW = FRAMING | LineError.BREAK
CYCLE = 300 * MS
STATIONS = ("station 1", "station 2", "station 3")


def frame(start: int, marked: LineError | None = None, damage: Damage | None = None, octets: bytes = b"") -> Frame:
    octets = octets or bytes(range(1, 9))
    marks = tuple(Mark(offset, marked) for offset in range(len(octets))) if marked else ()
    check = Check.BAD if damage else Check.GOOD
    end = start + len(octets) * LINE.char
    return Frame("x", octets, start, end, check, FoundBy.GAP, marks=marks, damage=damage)


def noise(start: int, octets: bytes, error: LineError = LOW, reason: Reason = Reason.NO_FRAME) -> Noise:
    marks = tuple(Mark(offset, error) for offset in range(len(octets)))
    return Noise(octets, start, start + len(octets) * LINE.char, Place.AFTER, reason, marks)


class Bus:
    """Stations that are asked in turn; what is put behind some of their frames."""

    def __init__(self, packets: bool = False) -> None:
        self.senders, self.now, self.no = Senders(Timing(LINE), packets), 0, 0

    def see(self, event: Event, name: str = "") -> None:
        self.no += 1
        self.senders.see_marks(event)
        if event.marks:
            self.senders.see_breaks(self.no, event)
        if isinstance(event, Frame):
            self.senders.see(name, self.no, event)

    def cycle(self, behind: dict[str, list[bytes]] | None = None, marked: dict[str, LineError] | None = None) -> None:
        for name in STATIONS:
            one = frame(self.now, (marked or {}).get(name))
            self.see(one, name)
            start = one.end + 4 * MS
            for octets in (behind or {}).get(name, []):
                self.see(noise(start, octets))
                start += 5 * MS
            self.now += CYCLE // len(STATIONS)

    def breaks(self) -> list[Finding]:
        return list(self.senders.breaks_found(lambda count, of: Severity.NOTE if count == 1 else None))


BURST = [b"\0"] * 8


def test_one_burst_behind_a_frame_is_one_disturbance_of_nobody() -> None:
    bus = Bus()
    for turn in range(60):
        bus.cycle({"station 3": BURST} if turn == 30 else None)
    (found,) = bus.breaks()
    assert (found.subject, found.severity, found.count) == ("bus", Severity.NOTE, 1)
    assert "low 8 times, in 1 disturbance" in found.seen


def test_two_bursts_behind_the_same_station_name_nobody() -> None:
    bus = Bus()
    for turn in range(60):
        bus.cycle({"station 3": BURST} if turn in (20, 40) else None)
    (found,) = bus.breaks()
    assert (found.subject, found.count) == ("bus", 2)


def test_a_station_that_holds_the_line_again_and_again_is_named() -> None:
    bus = Bus()
    for turn in range(60):
        bus.cycle({"station 3": BURST[:2]} if turn % 6 == 0 else None)
    (found,) = bus.breaks()
    assert (found.subject, found.severity, found.count) == ("station 3", Severity.WARNING, 10)


@pytest.mark.parametrize("burst", [BURST, [b"\0" * 5], [b"\0\x80\0\0\x80\0"]])
def test_who_speaks_otherwise_behind_one_station_is_not_that_station(burst: list[bytes]) -> None:
    """The same place behind its frames, but low far too often for a driver that is let go late."""
    bus = Bus()
    for turn in range(60):
        bus.cycle({"station 3": burst} if turn % 6 == 0 else None)
    (found,) = bus.breaks()
    assert (found.subject, found.severity, found.count) == ("bus", Severity.WARNING, 10)


@pytest.mark.parametrize(
    ("event", "breaks"),
    [
        (noise(0, b"\0"), 1),
        (noise(0, b"\xff\0"), 1),
        (noise(0, b"\x30\x40\x00\x84"), 0),  # another baud rate
        (noise(0, b"\0", FRAMING), 0),
        (noise(0, b"\0\xaa", reason=Reason.BREAK), 1),
        (noise(0, b"\x78\x78\x78\0\xf8\0", reason=Reason.BREAK), 0),  # whatever its framer calls it
        (noise(0, b"\x78\0\0\0\0\x80\0\x78\0\0"), 0),
        (noise(0, b"\0\0\x80\0\0\xf8"), 4),  # nothing but levels that change once
        (frame(0, LOW, octets=b"\1\0\2"), 0),  # another parity: no break leaves a frame good
        (frame(0, LOW, Damage.SHORT, octets=b"\1\0\2"), 1),
        (Noise(b"\0", 0, 1, Place.AFTER, Reason.BREAK, (Mark(3, LOW),)), 0),
    ],
)
def test_what_is_a_break(event: Event, breaks: int) -> None:
    assert breaks_in(event) == breaks


def test_a_wrong_parity_marks_good_frames_and_not_what_somebody_else_sends() -> None:
    wrong, foreign = Bus(), Bus()
    for _ in range(20):
        wrong.cycle(marked=dict.fromkeys(STATIONS, LineError.PARITY))
        foreign.cycle({"station 1": [b"\x30\x40\x11\x84" * 5]})
    assert wrong.senders.are_all_struck()
    assert not foreign.senders.are_all_struck()


def test_a_station_of_another_format_is_told_so() -> None:
    bus = Bus()
    for _ in range(20):
        bus.cycle(marked={"station 2": FRAMING})
    (found,) = bus.senders.wrong_octets(lambda _count, _of: None)
    assert found.subject == "station 2"
    assert "another parity" in found.means
    assert not bus.senders.are_all_struck()


def test_packets_are_counted_however_many_kinds_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sniff.analysis.sender_findings.MOST_SENDERS", 3)
    bus = Bus(packets=True)
    for _ in range(10):
        for name in STATIONS:
            bus.cycle(marked={name: FRAMING})
    (found,) = [one for one in bus.senders.wrong_octets(lambda _count, _of: None) if "packets" in one.seen]
    assert "line errors are flagged on 21 packets" in found.seen  # one goes on from station 3 to station 1


@pytest.mark.parametrize(("octets", "named"), [([], {"station 2"}), ([b"\xa4\x08\x2c\x94"], set())])
def test_a_flag_over_octets_that_are_no_frame_is_not_the_frames(octets: list[bytes], named: set[str]) -> None:
    bus = Bus(packets=True)
    for turn in range(40):
        struck = turn % 5 == 0
        bus.cycle({"station 2": octets} if struck else None, {"station 2": FRAMING} if struck else None)
        asked = [one.subject for one in bus.senders.wrong_octets(lambda _count, _of: None)]
    assert set(asked) == named
