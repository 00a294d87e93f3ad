"""Frames in a read that came late have no times of their own; all others keep theirs."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors import registry
from dissectors.bacnet.envelope import frame as mstp_frame
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from dissectors.modbus.envelope import seal_rtu
from sniff.engine.engine import Engine, Output

MS = 1_000_000
LINE = LineSettings.parse("19200,8N1")
ASK = seal_rtu(bytes.fromhex("010300000002"))
ANSWER = seal_rtu(bytes.fromhex("0103041122 3344".replace(" ", "")))
OTHER = seal_rtu(bytes.fromhex("020300000002"))


def read(chunks: Iterable[tuple[float, bytes]], latency: int = 0) -> tuple[list[Frame], Output]:
    engine = Engine(registry.get("modbus-rtu"), Timing(LINE, latency))
    rows, closed = [], []
    for time, octets in chunks:
        output = engine.feed(Chunk(int(time * MS), octets))
        rows += output.rows
        closed += output.transactions
    output = engine.close()
    rows, closed = [*rows, *output.rows], [*closed, *output.transactions]
    return [row.event for row in rows if isinstance(row.event, Frame)], Output(tuple(rows), tuple(closed))


def test_reads_in_time_leave_no_slack() -> None:
    frames, _ = read([(10, ASK), (30, ANSWER), (60, OTHER)])
    assert [frame.octets for frame in frames] == [ASK, ANSWER, OTHER]
    assert [frame.slack for frame in frames] == [0, 0, 0]


def test_frames_of_a_late_read_came_at_any_time_since_the_read_before() -> None:
    frames, output = read([(10, ASK), (130, ANSWER + OTHER), (160, ASK)])
    assert [frame.octets for frame in frames] == [ASK, ANSWER, OTHER, ASK]
    pause = 120 * MS - len(ANSWER + OTHER) * LINE.char
    assert [frame.slack for frame in frames] == [0, pause, pause, 0]
    answered = output.transactions[0].latency
    assert answered is not None
    assert answered.low <= LINE.char  # it may have come at once


def test_what_the_adapter_holds_back_is_no_late_read() -> None:
    frames, _ = read([(10, ASK), (130, ANSWER + OTHER)], latency=17 * MS)
    assert all(frame.slack <= 17 * MS for frame in frames)


def test_a_few_stray_octets_behind_a_frame_are_no_second_frame() -> None:
    frames, _ = read([(10, ASK), (130, ANSWER + b"\xff\xff"), (160, ASK)])
    assert [frame.slack for frame in frames] == [0, 0, 0]


def test_what_a_computer_missed_may_come_in_several_reads() -> None:
    frames, _ = read([(10, ASK), (130, ANSWER[:3]), (139, ANSWER[3:] + OTHER + ANSWER), (500, ASK)])
    assert frames[1].slack > 100 * MS
    assert frames[-1].slack == 0


def test_an_adapter_that_is_slower_than_it_says_gives_every_frame_slack() -> None:
    late = [(number * 100.0 + part, ASK) for number in range(1, 9) for part in (0, 1)]  # 8 octets take 4.2 ms
    frames, _ = read(late)
    assert frames[0].slack == 0
    assert frames[-1].slack > 2 * MS


def test_a_computer_that_is_busy_now_and_then_does_not() -> None:
    times = [(number * 100.0, ASK) for number in range(1, 2500)]
    busy = sorted([*times, (50_001.0, ASK), (100_001.0, ASK), (150_001.0, ASK)])
    frames, _ = read(busy)
    assert frames[-1].slack == 0


def test_a_frame_that_is_given_many_reads_later_knows_its_late_read() -> None:
    """The header of a long frame that was cut: what follows it is looked at again when all of its length has come."""
    token = mstp_frame(0, 1, 2)
    cut = mstp_frame(6, 255, 1, bytes(400))[:8]
    line = LineSettings.parse("38400,8N1")
    engine, rows = Engine(registry.get("mstp"), Timing(line)), []
    now = 10 * MS
    came = [(now, token), (now + 300 * MS, cut + token)]
    for at, octet in enumerate(token * 60, 1):
        came.append((now + 300 * MS + at * line.char, bytes([octet])))
    for time, octets in came:
        rows += engine.feed(Chunk(time, octets)).rows
    rows += engine.close().rows
    frames = [row.event for row in rows if isinstance(row.event, Frame) and row.event.octets == token]
    assert len(frames) == 62
    assert [frame.slack > 100 * MS for frame in frames] == [False, True] + [False] * 60
