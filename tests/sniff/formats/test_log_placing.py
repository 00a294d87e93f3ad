"""Reads that the clock of their log does not tell apart, or says nothing of: in order, between the times it tells."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS, NS_PER_S
from sniff.formats import read

ASKED, ANSWERED = "07 04 00 10 00 02 70 68", "07 04 04 00 EB 01 2C ED FD"


def chunks_of(path: Path, text: str) -> list[Chunk]:
    path.write_text(text)
    return [item for item in read(path).items() if isinstance(item, Chunk)]


def test_an_answer_and_the_next_request_of_one_millisecond(tmp_path: Path) -> None:
    lines = []
    for number in range(6):
        lines += [f"10:00:00.{100 + 8 * number} DEBUG recv: {ANSWERED}", f"10:00:00.{100 + 8 * number} send: {ASKED}"]
    chunks = chunks_of(tmp_path / "x.log", "\n".join(lines) + "\n")
    assert [chunk.octets.hex(" ").upper() for chunk in chunks] == [ANSWERED, ASKED] * 6
    assert all(before.time < after.time for before, after in pairwise(chunks))
    assert [chunk.time - chunks[0].time for chunk in chunks[::2]] == [8 * number * MS for number in range(6)]


def test_three_lines_of_one_millisecond_keep_their_order(tmp_path: Path) -> None:
    frames = [ASKED, ANSWERED, "07 06 00 10 00 02 09 A8"]
    lines = [f"10:00:0{second}.250 RX {frame}" for second in range(3) for frame in frames]
    chunks = chunks_of(tmp_path / "x.log", "\n".join(lines) + "\n")
    assert [chunk.octets.hex(" ").upper() for chunk in chunks] == frames * 3
    assert all(before.time < after.time for before, after in pairwise(chunks))


def test_what_stands_ahead_of_the_first_time_lies_right_before_it(tmp_path: Path) -> None:
    """A log of heads, cut between a head and its octets."""
    heads = "".join(
        f"\n2026/05/11 13:17:34.{792 + 29 * number} adapter {('write 8', 'read 9')[number % 2]}\n\n"
        f"{(ASKED, ANSWERED)[number % 2]}\n"
        for number in range(4)
    )
    chunks = chunks_of(tmp_path / "x.log", f"{ANSWERED}\n{heads}")
    assert len(chunks) == 5
    assert 0 < chunks[1].time - chunks[0].time < 50 * MS
    assert chunks[1].time == 1_778_505_454_792 * MS


def test_lines_without_a_time_among_others_lie_between_them(tmp_path: Path) -> None:
    text = "".join(f"10:00:00.{100 + 9 * number} TX: {ASKED}\nRX: {ANSWERED}\n" for number in range(5))
    chunks = chunks_of(tmp_path / "x.log", text)
    assert [chunk.octets[-1] for chunk in chunks] == [0x68, 0xFD] * 5
    assert all(before.time < after.time for before, after in pairwise(chunks))


def test_octets_of_one_millisecond_stay_together(tmp_path: Path) -> None:
    text = "".join(
        f"[{ms}] byte: {octet}\n" for number in range(4) for ms, octet in zip(
            [f"10:00:0{number}.{100 + at // 3}" for at in range(8)], ASKED.split(), strict=True
        )
    )  # fmt: skip
    chunks = chunks_of(tmp_path / "x.log", text)
    assert b"".join(chunk.octets for chunk in chunks) == bytes.fromhex(ASKED) * 4
    assert all(before.time <= after.time for before, after in pairwise(chunks))
    assert all(after.time - before.time < 3 * MS for before, after in pairwise(chunks[:8]))


@pytest.mark.parametrize("per_second", [1, 20, 90, 400, 1500])
@pytest.mark.parametrize("tick", [NS_PER_S, 10 * MS, MS])
def test_each_read_lies_within_what_its_clock_says(per_second: int, tick: int, tmp_path: Path) -> None:
    """However many come while it counts once: more than a slow line has time for, or than wait for the next time."""
    told = [number * NS_PER_S // per_second // tick * tick for number in range(3 * per_second)]
    text = "".join(f"10:00:{at // NS_PER_S:02}.{at % NS_PER_S:09}"[:15] + f" {ASKED}\n" for at in told)
    if tick == NS_PER_S:
        text = text.replace(".000000", "")
    elif tick == 10 * MS:
        text = re.sub(r"(\.\d\d)0000", r"\1", text)
    chunks = chunks_of(tmp_path / "x.log", text)
    begin = chunks[0].time - told[0]
    assert all(0 <= chunk.time - begin - at <= tick for chunk, at in zip(chunks, told, strict=True))
    assert all(before.time <= after.time for before, after in pairwise(chunks))


def test_lines_around_midnight_that_are_written_late(tmp_path: Path) -> None:
    clocks = ["23:59:59.900", "00:00:00.010", "23:59:59.990", "00:00:00.050", "23:59:58.500", "00:00:00.900"]
    times = [chunk.time for chunk in chunks_of(tmp_path / "x.log", "".join(f"{one} {ASKED}\n" for one in clocks))]
    assert times == sorted(times)
    assert times[5] - times[0] == NS_PER_S
