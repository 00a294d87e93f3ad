"""Times that cannot be exact are not taken as exact: what reads themselves say of being held back."""

from __future__ import annotations

import random
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import pytest

from dissectors.frame import Chunk, Frame
from dissectors.line import MS, LineSettings, Timing
from dissectors.modbus.envelope import seal_rtu
from sniff.bus.capture_writer import create
from sniff.bus.offline import outputs
from sniff.engine.read_times import HeldBack, ReadTimes, held_back
from sniff.engine.session import INFERRED, Adapter, LineEvent, LineEventKind, Session, with_settings
from sniff.formats import read
from sniff.simulation.scenarios import simulate
from sniff.simulation.tap import EXACT, FTDI, OCTETS, TapModel
from tests.bus_delivery import Wire, ftdi, laid_out, with_noise
from tests.faults.buses import modbus, mstp, n2

LINE = LineSettings.parse("9600,8N1")
TIMING = Timing(LINE)
BUSES = {"RTU": modbus, "ASCII": partial(modbus, is_ascii=True), "N2": n2, "MS/TP": mstp}
ANSWER = bytes.fromhex("010320") + bytes(range(32))


def times_of(chunks: list[Chunk], rounded: int = 1) -> ReadTimes:
    return ReadTimes.of([(chunk.time // rounded * rounded, len(chunk.octets)) for chunk in chunks])


@cache
def heard(bus: str, tap: TapModel) -> tuple[list[Chunk], LineSettings]:
    session, items = simulate(BUSES[bus](seed=1), 10, tap)
    return [item for item in items if isinstance(item, Chunk)], session.line


@pytest.mark.parametrize("bus", BUSES)
@pytest.mark.parametrize("tap", [EXACT, OCTETS, replace(EXACT, cut=0.3)], ids=["exact", "octets", "cut"])
@pytest.mark.parametrize("rounded", [1, 1000, MS])
def test_exact_times_stay_exact(bus: str, tap: TapModel, rounded: int) -> None:
    chunks, line = heard(bus, tap)
    assert held_back(times_of(chunks, rounded), line) == HeldBack(MS if rounded == MS else 0)


@pytest.mark.parametrize("bus", BUSES)
@pytest.mark.parametrize("timer", [16, 8])
@pytest.mark.parametrize("rounded", [1, 1000, MS])
def test_a_latency_timer_shows(bus: str, timer: int, rounded: int) -> None:
    tap = replace(FTDI, timer=timer * MS)
    chunks, line = heard(bus, tap)
    told = held_back(times_of(chunks, rounded), line)
    assert told.period == timer * MS
    assert tap.latency(line) <= told.latency <= tap.latency(line) + 3 * MS // 2


@pytest.mark.parametrize("seed", range(5))
def test_a_latency_timer_shows_on_a_computer_that_takes_its_reads_up_to_a_millisecond_late(seed: int) -> None:
    chunks, line = heard("RTU", FTDI)
    rng = random.Random(seed)
    late = [(chunk.time // (16 * MS) * 16 * MS + rng.randrange(1_100_000), len(chunk.octets)) for chunk in chunks]
    told = held_back(ReadTimes.of(late), line)
    assert (told.period, told.latency > 17 * MS) == (16 * MS, True)


@pytest.mark.parametrize("interval", [2, 4, 8, 16, 20, 100])
def test_a_steady_rhythm_is_no_timer(interval: int) -> None:
    reads = [(number * interval * MS, 8 if number % 2 else 1) for number in range(200)]
    told = held_back(ReadTimes.of(reads), LineSettings.parse("115200,8N1"))
    assert told == HeldBack(MS)  # of its times, which come at whole milliseconds


def test_octets_that_cannot_have_come_were_held_back() -> None:
    reads = [(0, 8), (100 * MS, 8), (103 * MS, 20), (300 * MS, 8)]  # 20 octets take 20.8 ms
    told = held_back(ReadTimes.of(reads), LINE)
    assert told.impossible == 1
    assert 17 * MS < told.proved <= 18 * MS
    assert told.latency >= 18 * MS
    hole = [(0, 8), (100 * MS, 8), (0, 0), (103 * MS, 20)]  # octets were lost: the time before says nothing
    assert held_back(ReadTimes.of(hole), LINE).latency == 0


def test_a_sender_that_is_a_little_fast_holds_nothing_back() -> None:
    quick = int(0.98 * LINE.char)
    reads, now = [], 0
    for number in range(50):
        now += 256 * quick + 4 * quick + number
        reads.append((now, 256))
    assert held_back(ReadTimes.of(reads), LINE).latency == 0


def test_a_known_latency_is_contradicted_by_several_reads_only() -> None:
    times = [(number * 200 * MS, 8) for number in range(100)]
    session = Session("x", LINE, "modbus-rtu", adapter=Adapter("FTDI", latency=2 * MS, latency_from="latency timer"))

    def told(late: int) -> Session:
        reads = sorted([*times, *((number * 200 * MS + MS, 20) for number in range(late))])
        return replace(session, reads=ReadTimes.of(reads)).with_latency_of_reads()

    assert told(1).adapter == session.adapter
    assert told(5).adapter.latency >= 20 * MS
    assert "latency timer" in told(5).adapter.latency_from


def noisy(seed: int) -> tuple[list[bytes], Wire]:
    """Requests and answers of 43 octets with 1 to 3 octets of noise in each gap."""
    dice = random.Random(seed)
    frames = []
    for number in range(44):
        unit = number % 3 + 1
        frames.append(seal_rtu(bytes((unit, 3, 0, number, 0, 16))))
        frames.append(seal_rtu(bytes((unit, 3, 32)) + dice.randbytes(32)))
    wire = laid_out(frames, TIMING, 12 * MS)
    return frames, with_noise(wire, TIMING, dice, 8 * MS)[0]


def saved(path: Path, wire: Wire, **session: object) -> Path:
    with create(path, replace(Session("x", LINE, "modbus-rtu"), **session)) as writer:  # type: ignore[arg-type]
        for chunk in ftdi(wire):
            writer.write(chunk)
    return path


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("suffix", [".cap.txt", ".mcap"])
def test_no_frame_is_lost_behind_an_adapter_that_nobody_named(seed: int, suffix: str, tmp_path: Path) -> None:
    frames, wire = noisy(seed)
    capture = read(saved(tmp_path / f"noisy{suffix}", wire))
    assert capture.session.adapter.latency_from == INFERRED
    found = [
        row.event.octets
        for output in outputs(capture.items(), capture.session)
        if not isinstance(output, LineEvent)
        for row in output.rows
        if isinstance(row.event, Frame) and row.event.ok
    ]
    assert found == frames


def test_other_settings_make_other_evidence(tmp_path: Path) -> None:
    reads = [Chunk(number * 20 * MS + number % 7, bytes(15)) for number in range(100)]  # 15.6 ms at 9600, 31 ms at 4800
    path = tmp_path / "rate.cap.txt"
    with create(path, Session("x", LINE, "modbus-rtu")) as writer:
        for chunk in reads:
            writer.write(chunk)
    session = read(path).session
    assert session.adapter.latency == 0
    slow = with_settings(session, line=LineSettings.parse("4800,8N1"))
    assert slow.adapter.latency > 0
    assert with_settings(slow, line=LINE).adapter == session.adapter


def test_what_was_heard_after_a_change_of_settings_says_nothing(tmp_path: Path) -> None:
    path = tmp_path / "changed.cap.txt"
    with create(path, Session("x", LINE, "modbus-rtu")) as writer:
        writer.write(Chunk(0, bytes(8)))
        writer.write(LineEvent(MS, LineEventKind.SETTINGS, "line=115200,8N1"))
        for number in range(1, 30):
            writer.write(Chunk(number * 20 * MS, bytes(100)))
    assert read(path).session.adapter.latency == 0


def turns(*turn: tuple[int, int]) -> list[tuple[int, int]]:
    """Reads of the same turn again and again: (ms since the read before, octets)."""
    time, reads = 0, []
    for interval, octets in turn * 6:
        time += interval * MS
        reads.append((time, octets))
    return reads


def test_a_timer_shows_that_cuts_frames_at_one_place_where_others_come_whole() -> None:
    """A master by the clock, whose period goes well with the timer's."""
    reads = turns(
        (784, 3), (16, 5), (192, 3), (16, 5), (784, 8), (32, 2), (16, 5), (944, 8), (208, 8), (784, 8), (32, 7)
    )
    assert held_back(ReadTimes.of([(time + 7 * (time % 3), octets) for time, octets in reads]), LINE).period == 16 * MS


def test_answers_a_period_behind_their_requests_are_no_cut_frames() -> None:
    reads = turns((784, 8), (16, 8), (192, 8), (16, 7), (784, 8), (32, 7), (944, 8), (208, 8))
    assert held_back(ReadTimes.of([(time + 7 * (time % 3), octets) for time, octets in reads]), LINE).latency == 0
