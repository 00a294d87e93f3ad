"""Times as programs of many countries write them, over noon and midnight: all octets, in order, at their times."""

from __future__ import annotations

import datetime as dates
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from sniff.formats import read

POLL = [bytes.fromhex("0103252000044ECF"), bytes.fromhex("0103080024000000000000F1D5")]
"""A master asks the same for ever."""
BEGINS = [dates.datetime(2026, 3, 4, 23, 59, 59, 512000), dates.datetime(2026, 10, 11, 11, 59, 59, 512000)]


def parts(when: dates.datetime) -> str:
    return f"{when.microsecond // 1000:03d}"


def half(when: dates.datetime) -> str:
    return f"{when.hour % 12 or 12}:{when:%M:%S}.{parts(when)}"


def of_zone(when: dates.datetime, hours: float) -> str:
    return f"{when + dates.timedelta(hours=hours):%Y-%m-%d %H:%M:%S}.{parts(when)}"


def epoch(when: dates.datetime) -> int:
    return round(when.replace(tzinfo=dates.UTC).timestamp() * 1000)


DATED: dict[str, Callable[[dates.datetime], str]] = {
    "weekday ahead": lambda when: f"{when:%a %b %d %H:%M:%S}.{parts(when)} {when.year}",
    "letter": lambda when: f"{when:%a, %d %b %Y %H:%M:%S}.{parts(when)} +0000",
    "half of the day with points": lambda when: f"2026/{when:%m/%d} {half(when)} {'ap'[when.hour >= 12]}.m.",
    "half of the day ahead": lambda when: f"2026/{when:%m/%d} {when:%p} {half(when)}",
    "half of the day in Chinese": lambda when: f"2026/{when:%m/%d} {'上下'[when.hour >= 12]}午 {half(when)}",
    "narrow space": lambda when: f"2026-{when:%m-%d} {half(when)}\u202f{when:%p}",
    "zone behind a space": lambda when: f"{of_zone(when, 5.5)} +0530",
    "minus between": lambda when: f"{when:%Y/%m/%d-%H:%M:%S}.{parts(when)}",
    "server of the web": lambda when: f"{when:%d/%b/%Y:%H:%M:%S}.{parts(when)} +0000",
    "small letters": lambda when: f"{when:%Y-%m-%dt%H:%M:%S}.{parts(when)}z",
    "Chinese": lambda when: f"{when.year}年{when.month}月{when.day}日 {when:%H:%M:%S}.{parts(when)}",
    "without signs": lambda when: f"{when:%Y%m%d%H%M%S}{parts(when)}",
}
BARE: dict[str, Callable[[dates.datetime], str]] = {
    "half of the day": lambda when: f"{half(when)} {when:%p}",
    "time of day": lambda when: f"{when:%H:%M:%S}.{parts(when)}",
    "no year": lambda when: f"{when:%m-%d %H:%M:%S}.{parts(when)}",
}
ALONE: dict[str, Callable[[dates.datetime], str]] = {
    "s since the epoch": lambda when: f"{epoch(when) / 1000:.3f}",
    "ms since the epoch": lambda when: f"{epoch(when)}",
    "µs since the epoch": lambda when: f"{epoch(when)}000",
}


def hx(octets: bytes) -> str:
    return " ".join(f"{octet:02X}" for octet in octets)


LAYOUTS: dict[str, Callable[[str, bytes], str]] = {
    "line": lambda time, octets: f"{time} RX: {hx(octets)}\n",
    "head": lambda time, octets: f"{time}\n{hx(octets)}\n\n",
    "table": lambda time, octets: f'"{time}";RX;{hx(octets)}\n',
}


def read_at(begin: dates.datetime, layout: str, clock: Callable[[dates.datetime], str], path: Path) -> list[Chunk]:
    text = "Time;Way;Data\n" if layout == "table" else ""
    for number in range(40):
        text += LAYOUTS[layout](clock(begin + dates.timedelta(milliseconds=41 * number)), POLL[number % 2])
    path.write_text(text)
    log = read(path)
    chunks = [item for item in log.items() if isinstance(item, Chunk)]
    assert b"".join(chunk.octets for chunk in chunks) == b"".join(POLL * 20), log.completeness().text
    assert log.completeness().whole
    assert [chunk.time - chunks[0].time for chunk in chunks] == [41_000_000 * number for number in range(40)]
    return chunks


@pytest.mark.parametrize("begin", BEGINS, ids=["midnight", "noon"])
@pytest.mark.parametrize(("name", "layout"), [(name, one) for name in DATED for one in LAYOUTS] + [
    (name, "head") for name in ALONE
])  # fmt: skip
def test_dated(name: str, layout: str, begin: dates.datetime, tmp_path: Path) -> None:
    chunks = read_at(begin, layout, (DATED | ALONE)[name], tmp_path / "x.log")
    assert chunks[0].time == epoch(begin) * 1_000_000


@pytest.mark.parametrize("begin", BEGINS, ids=["midnight", "noon"])
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("name", BARE)
def test_of_a_day(name: str, layout: str, begin: dates.datetime, tmp_path: Path) -> None:
    chunks = read_at(begin, layout, BARE[name], tmp_path / "x.log")
    assert chunks[0].time % 86_400_000_000_000 == epoch(begin) * 1_000_000 % 86_400_000_000_000


def test_eight_octets_in_decimal_digits_are_no_time(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("1703000100101730\n170304000100025DF3\n" * 3)
    octets = b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))
    assert octets == bytes.fromhex("1703000100101730170304000100025DF3") * 3


def test_steps_of_which_many_are_alike(tmp_path: Path) -> None:
    """As `strace -r` writes them, of a bus that polls evenly: the same step twice is no time twice."""
    path = tmp_path / "x.log"
    steps = [0.0, 0.003125, 0.003125, 0.007031, *[0.036084] * 16, 0.003125, *[0.036084] * 8, 0.012, 0.012]
    path.write_text("".join(f"{step:13.6f} RX {hx(POLL[number % 2])}\n" for number, step in enumerate(steps)))
    times = [item.time for item in read(path).items() if isinstance(item, Chunk)]
    assert [round((after - before) / 1000) for before, after in pairwise(times)] == [
        round(step * 1e6) for step in steps[1:]
    ]
