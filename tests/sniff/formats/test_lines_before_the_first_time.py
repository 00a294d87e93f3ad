"""A log that was copied from the middle of a message on: its first lines tell no time."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.modbus.envelope import seal_rtu
from sniff.formats.bytelog import read

ASKED, TOLD = seal_rtu(bytes.fromhex("0B 03 00 02 00 01")), seal_rtu(bytes.fromhex("0B 03 02 01 F4"))


def chunks(path: Path, text: str) -> list[Chunk]:
    path.write_text(text)
    return [item for item in read(path).items() if isinstance(item, Chunk)]


@pytest.mark.parametrize("clock", ["2026-02-03 04:05:{:06.3f} ", "04:05:{:06.3f} "])
def test_they_stand_directly_before_it(tmp_path: Path, clock: str) -> None:
    rows = [(way, octets) for _ in range(6) for way, octets in (("SEND: ", ASKED), ("RECV: ", TOLD))]
    stamps = ["", *(clock.format(7 + at / 2) for at in range(1, len(rows)))]
    lines = [stamp + way + octets.hex(" ") for stamp, (way, octets) in zip(stamps, rows, strict=True)]
    found = chunks(tmp_path / "x.log", "\n".join(lines) + "\n")
    assert [one.octets for one in found] == [octets for _, octets in rows]
    times = [one.time for one in found]
    assert times == sorted(times)
    assert 0 < times[1] - times[0] < 200_000_000
    assert times[2] - times[1] == 500_000_000


def test_many_lines_without_a_time_wait_for_none(tmp_path: Path) -> None:
    text = "".join(f"TX: {ASKED.hex(' ')}\nRX: {TOLD.hex(' ')}\n" for _ in range(6))
    assert [one.octets for one in chunks(tmp_path / "x.log", text)] == [ASKED, TOLD] * 6


def test_a_date_with_two_digits_of_the_year_is_no_message(tmp_path: Path) -> None:
    text = f"07:08:09 03/21/26 CET\n\nTX: {ASKED.hex(' ')}\nRX: {TOLD.hex(' ')}\n"
    assert [one.octets for one in chunks(tmp_path / "x.log", text)] == [ASKED, TOLD]
