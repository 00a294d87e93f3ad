"""The octet window: nominal times, proved and possible silence, what is taken out."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Chunk, LineError, Mark
from dissectors.framer import UNKNOWN_SILENCE, OctetWindow
from dissectors.line import LineSettings, Timing

LINE = LineSettings.parse("9600")
CHAR = LINE.char
LATENCY = 17_000_000


def window(latency: int = 0) -> OctetWindow:
    return OctetWindow(Timing(LINE, latency))


def test_octets_of_a_chunk_stand_back_to_back_before_its_time() -> None:
    w = window()
    w.append(Chunk(1_000 * CHAR, b"abc"))
    assert [w.end(i) for i in range(3)] == [998 * CHAR, 999 * CHAR, 1_000 * CHAR]
    assert [w.start(i) for i in range(3)] == [997 * CHAR, 998 * CHAR, 999 * CHAR]
    assert w.last_end == 1_000 * CHAR


def test_nothing_is_known_before_the_first_octet() -> None:
    w = window()
    w.append(Chunk(0, b"a"))
    assert w.silence(0) == (0, UNKNOWN_SILENCE)
    assert w.gap(0) == UNKNOWN_SILENCE


def test_silence_between_chunks_at_exact_times() -> None:
    w = window()
    w.append(Chunk(10 * CHAR, b"a"))
    later = Chunk(15 * CHAR, b"bc")
    assert w.least_silence_before(later) == 3 * CHAR
    w.append(later)
    assert w.silence(1) == (3 * CHAR, 3 * CHAR)
    assert w.silence(2) == (0, 0)
    assert [w.gap(i) for i in (1, 2)] == [3 * CHAR, 0]


def test_latency_takes_from_the_smallest_reading_and_adds_to_the_largest() -> None:
    w = window(LATENCY)
    w.append(Chunk(0, b"a"))
    later = Chunk(40_000_000, b"b")
    gap = 40_000_000 - CHAR
    assert w.least_silence_before(later) == gap - LATENCY
    w.append(later)
    assert w.silence(1) == (gap - LATENCY, gap + LATENCY)


def test_slack_is_no_more_than_the_room_before() -> None:
    w = window(LATENCY)
    w.append(Chunk(0, b"a"))
    w.append(Chunk(CHAR, b"b"))
    assert w.take(1).slack == LATENCY
    assert w.take(1).slack == LATENCY  # the one before may have come as much earlier
    exact = window(0)
    exact.append(Chunk(0, b"a"))
    assert exact.take(1).slack == 0


def test_times_that_run_backwards_mean_no_time_passed() -> None:
    w = window()
    w.append(Chunk(100 * CHAR, b"a"))
    w.append(Chunk(50 * CHAR, b"bc"))
    assert [w.end(i) for i in range(3)] == [100 * CHAR] * 3
    assert w.silence(1) == (0, 0)
    assert w.least_silence_at(0) == 0


def test_what_is_left_of_a_read_never_ends_before_what_was_taken() -> None:
    w = window()
    w.append(Chunk(100 * CHAR, b"a"))
    w.append(Chunk(101 * CHAR, b"bcdefg"))
    assert w.take(5).end == 100 * CHAR
    assert [w.end(i) for i in range(2)] == [100 * CHAR, 101 * CHAR]
    assert w.start(0) == 100 * CHAR


def test_take_gives_times_and_marks_and_keeps_the_rest() -> None:
    w = window()
    w.append(Chunk(10 * CHAR, b"abcd", (Mark(1, LineError.PARITY), Mark(3, LineError.BREAK))))
    w.append(Chunk(20 * CHAR, b"ef", (Mark(0, LineError.FRAMING),)))
    first = w.take(2)
    assert first == (b"ab", 6 * CHAR, 8 * CHAR, 0, (Mark(1, LineError.PARITY),))
    assert w.silence(0) == (0, 0)
    second = w.take(3)
    assert second == (b"cde", 8 * CHAR, 19 * CHAR, 0, (Mark(1, LineError.BREAK), Mark(2, LineError.FRAMING)))
    assert w.take(1) == (b"f", 19 * CHAR, 20 * CHAR, 0, ())
    assert len(w) == 0
    assert w.last_end == 20 * CHAR


def test_the_gap_before_the_window_is_kept_when_all_before_it_was_taken() -> None:
    w = window()
    w.append(Chunk(10 * CHAR, b"ab"))
    w.append(Chunk(20 * CHAR, b"c"))
    w.take(2)
    assert w.silence(0) == (9 * CHAR, 9 * CHAR)
    assert w.start(0) == 19 * CHAR


def test_two_errors_at_one_octet_are_both_kept_and_those_outside_left_out() -> None:
    w = window()
    marks = (Mark(0, LineError.PARITY), Mark(0, LineError.OVERRUN), Mark(5, LineError.BREAK), Mark(-1, LineError.BREAK))
    w.append(Chunk(0, b"a", marks))
    assert w.take(1).marks == (Mark(0, LineError.PARITY | LineError.OVERRUN),)


@pytest.mark.parametrize("latency", [0, 1_000_000, LATENCY])
def test_proves_silence_is_the_first_moment_at_which_it_is_proved(latency: int) -> None:
    w = window(latency)
    assert w.proves_silence(5) is None
    assert w.least_silence_at(5) is None
    w.append(Chunk(10**9, b"a"))
    moment = w.proves_silence(3_000_000)
    assert moment is not None
    assert w.least_silence_at(moment) == 3_000_000
    before = w.least_silence_at(moment - 1)
    assert before is not None
    assert before < 3_000_000


@given(
    latency=st.sampled_from([0, 1_000_000, LATENCY]),
    waited=st.integers(0, 100_000_000),
    lag=st.integers(0, LATENCY),
    count=st.integers(1, 30),
)
def test_what_advance_proves_the_next_honest_chunk_proves(latency: int, waited: int, lag: int, count: int) -> None:
    """Honest: no octet is delivered more than `latency` after its end."""
    lag = min(lag, latency)
    w = window(latency)
    w.append(Chunk(0, b"a"))
    first_end = waited + CHAR
    count = min(count, 1 + (latency - lag) // CHAR)
    chunk = Chunk(first_end + (count - 1) * CHAR + lag, bytes(count))
    proved, told = w.least_silence_before(chunk), w.least_silence_at(chunk.time)
    assert proved is not None
    assert told is not None
    assert told <= proved


@given(
    st.lists(st.tuples(st.integers(-5 * CHAR, 30 * CHAR), st.integers(1, 6)), min_size=1, max_size=6),
    st.sampled_from([0, LATENCY]),
    st.data(),
)
def test_cuts_at_nominal_times_change_nothing(parts: list[tuple[int, int]], latency: int, data: st.DataObject) -> None:
    whole, cut = window(latency), window(latency)
    now = 10**9
    for step, count in parts:
        now += step + count * CHAR
        octets = bytes(range(count))
        whole.append(Chunk(now, octets))
        at = data.draw(st.integers(0, count))
        for begin, end in ((0, at), (at, count)):
            if begin < end:
                cut.append(Chunk(now - (count - end) * CHAR, octets[begin:end]))
    total = len(whole)
    assert len(cut) == total
    taken = data.draw(st.integers(0, total - 1))
    if taken:
        assert whole.take(taken) == cut.take(taken)
    for index in range(total - taken):
        assert whole.silence(index) == cut.silence(index)
        assert whole.gap(index) == cut.gap(index)
        assert whole.end(index) == cut.end(index)
        assert whole.start(index) == cut.start(index)
    assert whole.take(total - taken) == cut.take(total - taken)
