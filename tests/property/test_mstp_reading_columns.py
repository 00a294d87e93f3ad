"""Readings of MS/TP exchanges by columns are those of `readings.py`, whatever the frames say."""

from __future__ import annotations

import itertools
import random
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.reading_columns import reading_columns
from dissectors.bacnet.readings import readings
from dissectors.columns import CHECKS, FrameColumns, Masks, Octets
from dissectors.frame import Check, Chunk, FoundBy, Frame
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.profiles.packaged import packaged
from dissectors.reading_columns import HOWS, ReadingColumns
from dissectors.readings import Reading
from sniff.analysis import point_columns
from sniff.analysis.point_columns import add_to
from sniff.analysis.point_reader import PointReader, Sample
from sniff.analysis.points import PointTable
from sniff.analysis.table_points import samples_of
from sniff.analysis.trends import Trends
from sniff.bus.offline import outputs
from sniff.engine.blocks import blocks_of
from sniff.engine.bulk import tables
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, Session
from tests.bench import bulk_mstp
from tests.property import mstp_buses as buses
from tests.seeds import seeds

Exchange = tuple[bytes, bytes | None]

OBJECTS = (0, 1, 2, 3, 4, 8, 10, 13, 14, 17, 19, 20, 40, 62, 128, 1023)
ENUMERATED = (117, 36, 103, 112)
PROPERTIES = (85, 85, *ENUMERATED, 28, 74, 87, 76, 104, 62, 77, 79, 81, 111, 512, 4194, 65535, 11, 134)
SINGLES = (0.0, -0.0, 59.9, 1e-45, -1.5, 3.4e38, float("inf"), float("nan"), 16777217.0)


def _value(dice: random.Random) -> bytes:
    kind = dice.choice((1, 2, 3, 4, 4, 9, dice.randrange(16)))
    if kind == 1:
        return bytes((0x10 | dice.choice((0, 1, 1, dice.randrange(8))),))
    if kind == 4 and dice.random() < 0.7:
        return b"\x44" + struct.pack(">f", dice.choice((*SINGLES, dice.uniform(-1e3, 1e3))))
    size = dice.choice((1, 1, 2, 3, 4, dice.randrange(8)))
    content = bytes(dice.choice((0, 1, 2, 127, 128, 255, dice.randrange(256))) for _ in range(size))
    return bytes((kind << 4 | size,)) + content


def _property(dice: random.Random) -> bytes:
    thing = dice.choice(OBJECTS) << 22 | dice.choice((0, 1, 7, 0x3FFFFF, dice.randrange(1 << 22)))
    which = dice.choice(PROPERTIES)
    made = b"\x0c" + thing.to_bytes(4, "big")
    made += bytes((0x19, which)) if which < 256 and dice.random() < 0.9 else b"\x1a" + which.to_bytes(2, "big")
    made += dice.choice((b"", b"", b"", b"", b"\x29\x00", b"\x29\x03", b"\x2a\x01\x02"))
    values = b"".join(_value(dice) for _ in range(dice.choice((1, 1, 1, 1, 1, 1, 0, 2))))
    if which in ENUMERATED and dice.random() < 0.7:
        values = bytes((0x91, dice.choice((0, 1, 2, 3, 62, 98, 200))))
    return made + b"\x3e" + values + b"\x3f"


def _npdu(dice: random.Random, apdu: bytes) -> bytes:
    if dice.random() < 0.1:
        at = dice.randrange(len(apdu))
        apdu = dice.choice((apdu[:at], apdu[:at] + dice.randbytes(1) + apdu[at + 1 :], apdu + dice.randbytes(1)))
    if dice.random() < 0.05:
        return b"\x01\x08\x00\x05\x01\x09" + apdu
    return bytes((1, dice.choice((0, 4)))) + apdu


def exchange(dice: random.Random) -> Exchange:
    """A property that is read or written, in most cases as it should be; or any other frames."""
    if dice.random() < 0.15:
        asked, answered = buses.data_of_any_form(dice, 2)
        return asked, dice.choice((None, answered))
    master, slave, invoke = dice.randrange(3), dice.randrange(3, 6), dice.randrange(4)
    told = _property(dice)
    if dice.random() < 0.6:
        asking, answer = bytes((0, 5, invoke, 12)) + told[:7], bytes((0x30, invoke, 12)) + told
    else:
        told += dice.choice((b"", b"", b"\x49\x08", b"\x4a\x00\x08"))
        asking, answer = bytes((2, 5, invoke, 15)) + told, bytes((0x20, invoke, 15))
    if dice.random() < 0.1:
        answer = dice.choice((b"\x50\x01\x0c\x91\x01\x91\x1f", b"\x60\x01\x02", b"\x30\x01\x0e", b"\x20\x01\x05"))
    kinds = dice.choice((5, 5, 5, 6)), dice.choice((6, 6, 6, 6, 5, 33))
    asked = frame(kinds[0], slave, master, _npdu(dice, asking))
    return asked, None if dice.random() < 0.1 else frame(kinds[1], master, slave, _npdu(dice, answer))


def columns_of(frames: Sequence[bytes], first: int) -> FrameColumns:
    """Good frames whose octets follow one another from `first` on; of their headers nothing is asked for."""
    count = len(frames)
    lengths = np.array([len(one) for one in frames], np.int64)
    nothing, code = np.zeros(count, np.int64), np.zeros(count, np.uint8)
    number, small, names = nothing.astype(np.int32), nothing.astype(np.int16), nothing.astype(np.uint16)
    check = np.full(count, CHECKS.index(Check.GOOD), np.uint8)
    return FrameColumns(
        np.cumsum(lengths) - lengths + first, lengths.astype(np.int32), nothing, nothing, check, code, code, number,
        small, small, code, names, small, number, number, np.ones(count, bool), names,
    )  # fmt: skip


def by_columns(exchanges: Sequence[Exchange]) -> ReadingColumns:
    asked, answered = [one for one, _ in exchanges], [other or b"" for _, other in exchanges]
    octets = np.frombuffer(b"".join([*asked, *answered]), np.uint8)
    has_answer = np.array([other is not None for _, other in exchanges], bool)
    begin = sum(map(len, asked))
    return reading_columns(columns_of(asked, 0), columns_of(answered, begin), has_answer, octets)


def _everything(reading: Reading) -> tuple[object, ...]:
    """With what its equality leaves out."""
    return reading, type(reading.value), repr(reading.value), reading.words, reading.beside, reading.unit


def assert_alike(exchanges: Sequence[Exchange]) -> ReadingColumns:
    made = by_columns(exchanges)
    told = made.told
    found: list[list[Reading]] = [[] for _ in exchanges]
    if told is not None:
        values = list(told.numbers())
        for at, place in enumerate(made.exchange.tolist()):
            found[place].append(
                Reading(
                    made.spaces[made.space[at]],
                    int(made.address[at]),
                    int(made.raw[at]),
                    values[at],
                    HOWS[made.how[at]],
                    told.parts[told.part[at]],
                    station=int(told.station[at]),
                    words=told.phrases[told.words[at]],
                    unit=told.units[told.words[at]],
                )
            )
    for (asked, answered), mine, done in zip(exchanges, found, made.done.tolist(), strict=True):
        expected = readings(_object(asked), None if answered is None else _object(answered)) if done else ()
        assert list(map(_everything, mine)) == list(map(_everything, expected)), (asked.hex(), answered)
    return made


def _object(octets: bytes) -> Frame:
    return Frame("mstp", octets, 0, 1, Check.GOOD, FoundBy.LENGTH)


@pytest.mark.parametrize("seed", seeds(60, 3))
def test_any_exchanges(seed: int) -> None:
    dice = random.Random(seed)
    made = assert_alike([exchange(dice) for _ in range(1500)])
    assert len(made.exchange) > 200
    assert made.told is not None
    assert len(made.told.parts) > 10
    assert len(made.told.phrases) > 10
    assert {"ms", "× 10 ms"} <= set(made.told.units)


def _pairs(frames: Iterable[bytes]) -> Iterator[Exchange]:
    """Each with that which follows, as question and answer, and by itself; none twice."""
    pairs = itertools.pairwise(frames)
    return iter(dict.fromkeys(one for asked, answered in pairs for one in ((asked, answered), (asked, None))))


def _good_frames(path: Path) -> Iterator[bytes]:
    chunks, timing = buses.chunks_of(path, most=6000)
    session = Session("port", timing.line, "mstp")
    for output in outputs(chunks, session):
        for row in output.rows if isinstance(output, Output) else ():
            event = row.event
            if isinstance(event, Frame) and event.check is Check.GOOD and event.ok and len(event.octets) > 8:
                yield event.octets


@pytest.mark.parametrize("name", buses.THEIRS)
def test_captures_of_others(name: str) -> None:
    assert_alike(list(itertools.islice(_pairs(_good_frames(buses.others(name))), 1000)))


def test_our_captures() -> None:
    found = (one for path in buses.OURS[::4] for one in itertools.islice(_pairs(_good_frames(path)), 100))
    assert_alike(list(dict.fromkeys(found)))


ASKED = frame(5, 9, 1, bytes.fromhex("0104 0275 01 0c 0c00000007 1955"))


def _answered(value: bytes, which: int = 85) -> bytes:
    told = bytes.fromhex("0100 30 01 0c 0c00000007 19") + bytes((which, 0x3E)) + value
    return frame(6, 1, 9, told + b"\x3f")


def test_one_number_is_done() -> None:
    """What most buses say is never left to the slow way."""
    answers = [
        _answered(value)
        for value in (
            b"\x44\x42\x6f\x99\x9a",
            b"\x21\x07",
            b"\x31\xff",
            b"\x91\x01",
            b"\x11",
            b"\x10",
            b"\x24\xff\0\0\0",
        )
    ]
    made = assert_alike([(ASKED, answer) for answer in answers])
    assert made.done.all()
    assert made.told is not None
    assert list(made.told.numbers()) == [59.9, 7, -1, 1, 1, 0, 0xFF000000]


def test_each_octet_counts() -> None:
    """An answer and one that differs from it in one octet are read apart."""
    good = _answered(b"\x44\x42\x6f\x99\x9a")[8:-2]
    others = {bytes((*good[:at], octet, *good[at + 1 :])) for at in range(len(good)) for octet in (0, 9, 62, 128, 255)}
    assert_alike([(ASKED, frame(6, 1, 9, one)) for one in (good, *sorted(others))])


@pytest.mark.parametrize("real", [b"\x80\0\0\0", b"\x7f\x80\0\0", b"\xff\xc0\0\0"])
def test_negative_zero_and_what_is_no_number_are_left_alone(real: bytes) -> None:
    """Least and most of many are not what they are of one after the other."""
    assert not by_columns([(ASKED, _answered(b"\x44" + real))]).done.any()


def test_frames_without_a_check_are_left_alone() -> None:
    answer = _answered(b"\x21\x07")
    asked, answered = columns_of([ASKED], 0), columns_of([answer], len(ASKED))
    answered = replace(answered, check=np.full(1, CHECKS.index(Check.ABSENT), np.uint8))
    octets = np.frombuffer(ASKED + answer, np.uint8)
    assert not len(reading_columns(asked, answered, np.ones(1, bool), octets).exchange)


def test_nothing_at_all() -> None:
    assert len(by_columns([]).done) == 0


def _bus(seed: int, frames: int, damaged: float) -> tuple[list[Chunk], Session]:
    chunks = buses.chunks_of_reads(bulk_mstp.reads(frames, seed=seed, damaged=damaged, answered=0.9))
    dice = random.Random(seed)
    steady = [(ASKED, _answered(b"\x44" + struct.pack(">f", step * 0.1))) for step in range(40)]
    steady += [(ASKED, _answered(bytes((0x91, step % 3)), 36)) for step in range(40)]
    steady += [(ASKED, _answered(bytes((0x91, 98 + step % 3)), 117)) for step in range(40)]
    for asked, answered in (*steady, *(exchange(dice) for _ in range(frames // 20))):
        for octets in (asked, answered) if answered is not None else (asked,):
            chunks.append(Chunk(chunks[-1].time + 20 * buses.MS, octets))
    return chunks, Session("port", bulk_mstp.LINE, "mstp")


def _elsewhere(request: Frame | None, response: Frame | None) -> tuple[Reading, ...]:
    return tuple(replace(one, station=(one.station or 0) + 40) for one in readings(request, response))


def _columns_elsewhere(
    asked: FrameColumns, answered: FrameColumns, has_answer: Masks, octets: Octets
) -> ReadingColumns:
    made = reading_columns(asked, answered, has_answer, octets)
    return made if made.told is None else replace(made, told=replace(made.told, station=made.told.station + 40))


ELSEWHERE = replace(MSTP, readings=_elsewhere, reading_columns=_columns_elsewhere)
"""Whose values are of other stations than those that the exchanges are with."""

DRIVE = packaged("teco-f510")


@pytest.mark.parametrize(
    ("dissector", "devices", "many"),
    [
        (MSTP, Devices(), 1),
        (MSTP, Devices({4: DRIVE, 9: DRIVE}), 12),
        (ELSEWHERE, Devices({44: DRIVE, 49: DRIVE}), 12),
    ],
    ids=["plain", "described", "elsewhere"],
)
def test_samples_points_and_trends_of_a_bus(
    dissector: Dissector, devices: Devices, many: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(point_columns, "MANY", many)
    chunks, session = _bus(3, 2000, 0.01)
    reader, table_reader = PointReader(dissector, devices), PointReader(dissector, devices)
    points, expected = PointTable(), PointTable()
    trends, expected_trends = Trends(dissector, devices), Trends(dissector, devices)
    samples: list[Sample] = []
    for output in outputs(chunks, session):
        if isinstance(output, Output):
            samples += reader.add(output)
            expected_trends.add(output)
    expected.add(samples)
    found: list[Sample] = []
    plain = 0
    blocks = (block for at in range(0, len(chunks), 1500) for block in blocks_of(chunks[at : at + 1500]))
    for table in tables(blocks, session):
        assert not isinstance(table, LineEvent)
        some = samples_of(table_reader, table)
        plain += len(some.plain)
        found += some.in_order()
        add_to(points, some)
        trends.add_table(table)
    assert list(map(repr, found)) == list(map(repr, samples))  # NaN is no other value
    assert plain > len(samples) / 3
    assert list(map(repr, points)) == list(map(repr, expected))
    assert trends.moved(99) == expected_trends.moved(99)
