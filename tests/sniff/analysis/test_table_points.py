"""Values taken out of tables: the samples and points of a reading row by row, however the capture is cut."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from dissectors.columns import FrameColumns
from dissectors.frame import Check, FoundBy, Frame
from dissectors.modbus.envelope import make_rtu
from dissectors.modbus.reading_columns import reading_columns
from dissectors.modbus.readings import readings
from dissectors.reading_columns import HOWS
from sniff.analysis import point_reader, table_points
from sniff.analysis.point_columns import TableSamples, add_to
from sniff.analysis.point_reader import PointReader, Sample
from sniff.analysis.points import PointTable
from sniff.analysis.table_points import samples_of
from sniff.bus.model import BusModel
from sniff.bus.offline import outputs
from sniff.engine.blocks import blocks_of
from sniff.engine.bulk import tables
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe, observe_tables
from sniff.engine.session import Item, LineEvent
from sniff.formats import read
from tests.seeds import in_turn

FOLDER = Path(__file__).parents[3] / "captures"
CAPTURES = sorted([*FOLDER.glob("rtu-*.cap.txt"), *FOLDER.glob("mstp-*.cap.txt"), *FOLDER.glob("n2-*.cap.txt")])


def of_tables(path: Path, size: int) -> Iterator[TableSamples]:
    """Samples of a capture whose blocks hold so many items."""
    capture = read(path)
    items: list[Item] = list(capture.items())
    blocks = (block for at in range(0, len(items), size) for block in blocks_of(items[at : at + size]))
    reader = PointReader(dissector_for(capture.session))
    for table in tables(blocks, capture.session):
        if not isinstance(table, LineEvent):
            yield samples_of(reader, table)


@pytest.mark.parametrize("path", CAPTURES, ids=lambda path: path.name)
def test_samples_and_points_of_tables_are_those_of_rows(path: Path) -> None:
    capture = read(path)
    reader = PointReader(dissector_for(capture.session))
    samples: list[Sample] = []
    for output in outputs(capture.items(), capture.session):
        if isinstance(output, Output):
            samples += reader.add(output)
    expected = PointTable()
    expected.add(samples)
    for size in in_turn((1, 5, 100_000), CAPTURES.index(path), 3):
        points, together = PointTable(), list(of_tables(path, size))
        assert [sample for some in together for sample in some.in_order()] == samples, size
        for some in together:
            add_to(points, some)
        assert list(points) == list(expected), size
        assert points.version == expected.version


EXCHANGES = [
    ("01 03 00 6B 00 02", "01 03 04 00 01 FF FF"),
    ("01 03 00 6B 00 02", "01 03 04 00 01 FF"),  # an octet short of what it says
    ("01 03 00 6B 00 02", "02 03 04 00 01 FF FF"),  # of somebody else
    ("01 03 00 6B 00 02", "01 83 02"),
    ("01 04 FF FF 00 02", "01 04 04 00 01 00 02"),  # over the end of the space
    ("01 03 00 00 00 00", "01 03 00"),
    ("01 06 00 01 12 34", "01 06 00 01 12 34"),
    ("00 06 00 01 12 34", None),
    ("00 10 00 05 00 02 04 00 01 00 02", None),
    ("01 10 00 05 00 02 04 00 01 00 02", "01 10 00 05 00 02"),
    ("01 10 00 05 00 02 04 00 01 00", "01 10 00 05 00 02"),
    ("01 01 00 00 00 08", "01 01 01 55"),
    ("01 03 00", "01 03 04 00 01 FF FF"),
]


@pytest.mark.parametrize(("asked", "answered"), EXCHANGES)
def test_registers_by_columns_are_the_readings(asked: str, answered: str | None) -> None:
    words = [bytes.fromhex(one) for one in (asked, answered) if one is not None]
    frames = [make_rtu(one[0], one[1:]) for one in words]
    octets = np.frombuffer(b"".join(frames), np.uint8)
    request, response = (_columns(0, frames[0]), _columns(len(frames[0]), frames[-1]))
    made = reading_columns(request, response, np.array([answered is not None]), octets)
    objects = [Frame("modbus-rtu", one, 0, 1, Check.GOOD, FoundBy.LENGTH) for one in frames]
    expected = readings(objects[0], objects[1] if answered is not None else None)
    columns = zip(made.space.tolist(), made.address.tolist(), made.raw.tolist(), made.how.tolist(), strict=True)
    if made.done[0]:
        assert [(made.spaces[space], address, raw, HOWS[how]) for space, address, raw, how in columns] == [
            (one.space, one.address, one.raw, one.how) for one in expected
        ]
    else:
        assert not len(made.exchange)


def _columns(offset: int, octets: bytes) -> FrameColumns:
    """One frame; nothing of its header is asked for."""
    nothing = np.zeros(1, np.int64)
    number, small, code = nothing.astype(np.int32), nothing.astype(np.int16), nothing.astype(np.uint8)
    names, truth = nothing.astype(np.uint16), np.ones(1, bool)
    place, length = np.array([offset]), np.array([len(octets)], np.int32)
    return FrameColumns(
        place, length, nothing, nothing, code, code, code, number, small, small, code, names, small, number, number,
        truth, names,
    )  # fmt: skip


@pytest.mark.parametrize("most", [2, 512])
def test_tokens_take_no_place_of_requests_that_late_answers_are_for(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (point_reader, table_points):
        monkeypatch.setattr(module, "MOST_ASKED", most)
    path = FOLDER / "findings" / "ms-tp-master-does-not-wait-for-answers.cap.txt"
    session, items = read(path).session, list(read(path).items())
    by_rows, by_tables = BusModel(session, dissector_for(session)), BusModel(session, dissector_for(session))
    observe(outputs(items, session), by_rows)
    observe_tables(tables(blocks_of(items), session), by_tables)
    points = PointTable()
    for some in of_tables(path, 100_000):
        add_to(points, some)
    assert list(points) == list(by_tables.points) == list(by_rows.points)
    assert sum(point.count for point in points) == 11
