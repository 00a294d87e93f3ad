"""The clock of a log that was set back: times go on, and that is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS, NS_PER_S
from dissectors.modbus.envelope import seal_rtu
from sniff.bus.offline import settled
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read

ASKED, ANSWERED = seal_rtu(b"\1\3\0\0\0\2").hex(" "), seal_rtu(b"\1\3\4\0\1\0\2").hex(" ")


def _polls(clock: str, seconds: range) -> str:
    return "".join(f"{clock}:{at:02}.100 {ASKED}\n{clock}:{at:02}.120 {ANSWERED}\n" for at in seconds)


@pytest.mark.parametrize("day", ["2026-10-25 ", ""])
def test_summer_ends(day: str, tmp_path: Path) -> None:
    path = tmp_path / "night.log"
    path.write_text(_polls(f"{day}02:59", range(40, 60)) + _polls(f"{day}02:00", range(20)))
    capture = read(path)
    items = list(capture.items())
    times = [item.time for item in items if isinstance(item, Chunk)]
    assert times == sorted(times)
    assert len(times) == 80
    assert times[-1] - times[40] == 19 * NS_PER_S + 20 * MS
    (event,) = [item for item in items if isinstance(item, LineEvent)]
    assert (event.kind, event.text) == (LineEventKind.CLOCK, "the log's clock goes back by 60.0 min")
    closed = [one.transaction for one in settled(capture.items(), capture.session) if one.transaction is not None]
    assert {round(one.latency.nominal / MS) for one in closed if one.latency is not None} == {15}


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("2026-03-29 01:59", "2026-03-29 03:00"),
        ("29-Mar-2026 01:59", "29-Mar-2026 03:00"),
        ("10/04/2026 01:59", "10/04/2026 03:00"),
    ],
)
def test_summer_begins(before: str, after: str, tmp_path: Path) -> None:
    path = tmp_path / "night.log"
    path.write_text(_polls(before, range(40, 60)) + _polls(after, range(20)))
    items = list(read(path).items())
    times = [item.time for item in items if isinstance(item, Chunk)]
    assert times[-1] - times[0] == 39 * NS_PER_S + 20 * MS
    (event,) = [item for item in items if isinstance(item, LineEvent)]
    assert (event.kind, event.text) == (LineEventKind.CLOCK, "the log's clock goes ahead by an hour")


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("2026-03-30 01:59", "2026-03-30 03:00"),  # a Monday
        ("2026-03-29 12:59", "2026-03-29 14:00"),
        ("2026-03-29 01:59", "2026-03-29 03:30"),  # it was silent as well
        ("2026-03-29T01:59", "2026-03-29T03:00"),
    ],
)
def test_an_hour_of_silence_is_one(before: str, after: str, tmp_path: Path) -> None:
    path = tmp_path / "night.log"
    log = _polls(before, range(40, 60)) + _polls(after, range(20))
    path.write_text(log.replace(".100 ", ".100Z ").replace(".120 ", ".120Z ") if "T" in before else log)
    items = list(read(path).items())
    times = [item.time for item in items if isinstance(item, Chunk)]
    assert len(times) == len(items)
    assert times[-1] - times[0] > 3600 * NS_PER_S


@pytest.mark.parametrize(
    ("before", "after"),
    [("Dec 31", "Jan  1"), ("Feb 28", "Feb 29"), ("Feb 29", "Mar  1"), ("Feb 28", "Mar  1"), ("Jan 31", "Feb  1")],
)
def test_days_without_a_year_follow_one_another(before: str, after: str, tmp_path: Path) -> None:
    path = tmp_path / "syslog.log"
    path.write_text(_polls(f"{before} 23:59", range(40, 60)) + _polls(f"{after} 00:00", range(20)))
    items = list(read(path).items())
    times = [item.time for item in items if isinstance(item, Chunk)]
    assert len(times) == len(items)
    assert times[-1] - times[0] == 39 * NS_PER_S + 20 * MS


def test_a_log_of_several_years_goes_on(tmp_path: Path) -> None:
    days = ["Feb 28", "Feb 29", "Mar 1", "Dec 31", "Jan 1", "Feb 28", "Mar 1", "Dec 31", "Jan 1"]
    path = tmp_path / "syslog.log"
    path.write_text("".join(_polls(f"{day} 12:00", range(3)) for day in days))
    times = [item.time for item in read(path).items() if isinstance(item, Chunk)]
    steps = [(later - earlier) // (86_400 * NS_PER_S) for earlier, later in zip(times[::6], times[6::6], strict=False)]
    assert steps == [1, 1, 305, 1, 58, 1, 305, 1]


def test_a_single_line_with_a_wrong_time(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    wrong = f"2026-10-25 01:00:00.000 {ASKED}\n"
    path.write_text(_polls("2026-10-25 02:59", range(10)) + wrong + _polls("2026-10-25 02:59", range(10, 20)))
    chunks = [item for item in read(path).items() if isinstance(item, Chunk)]
    assert len(chunks) == 41
    assert chunks[-1].time - chunks[0].time == 19 * NS_PER_S + 20 * MS
    assert [one.time for one in chunks] == sorted(one.time for one in chunks)


def test_lines_of_two_writers_are_no_clock_that_was_set(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text(f"10:00:05.000 {ASKED}\n10:00:04.990 {ASKED}\n10:00:05.100 {ASKED}\n" * 1)
    assert all(isinstance(item, Chunk) for item in read(path).items())


# --- tables ---


def _rows(clock: str, seconds: range) -> str:
    return "".join(f"{clock}:{at:02}.100,{ASKED}\n{clock}:{at:02}.120,{ANSWERED}\n" for at in seconds)


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("23:59", "00:00", []),
        ("2026-10-25 02:59", "2026-10-25 02:00", ["the log's clock goes back by 60.0 min"]),
        ("2026-03-29 01:59", "2026-03-29 03:00", ["the log's clock goes ahead by an hour"]),
        ("2026-03-28 23:59", "2026-03-29 00:00", []),
    ],
)
@pytest.mark.parametrize("newest_first", [False, True])
def test_rows_go_on(before: str, after: str, told: list[str], newest_first: bool, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    rows = (_rows(before, range(40, 60)) + _rows(after, range(20))).splitlines()
    path.write_text("\n".join(["time,data", *(rows[::-1] if newest_first else rows)]))
    items = list(read(path).items())
    chunks = [item for item in items if isinstance(item, Chunk)]
    assert [chunk.octets[2] for chunk in chunks[:4]] == [0, 4, 0, 4]
    assert chunks[-1].time - chunks[0].time == 39 * NS_PER_S + 20 * MS
    assert [item.text for item in items if isinstance(item, LineEvent)] == told
    assert [item.time for item in items] == sorted(item.time for item in items)


def test_two_lists_of_one_time_are_put_together(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    both = [f"2026-10-26 02:{at:02}:00.000,{ASKED}" for at in range(60)]
    both += [f"2026-10-26 02:{at:02}:00.020,{ANSWERED}" for at in range(60)]
    path.write_text("\n".join(["time,data", *both]))
    chunks = [item for item in read(path).items() if isinstance(item, Chunk)]
    assert [chunk.octets[2] for chunk in chunks[:4]] == [0, 4, 0, 4]
