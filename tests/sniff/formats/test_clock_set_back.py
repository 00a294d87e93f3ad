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
