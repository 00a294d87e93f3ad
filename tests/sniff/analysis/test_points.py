"""Points: when a value counts, what is kept of it, what rows say in words."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dissectors.profiles import Devices
from dissectors.profiles.decoding import Quality, decode
from dissectors.profiles.packaged import packaged
from dissectors.readings import Origin, Reading
from sniff.analysis.point_columns import PlainSamples, TableSamples, add_to
from sniff.analysis.point_reader import PointReader, Sample
from sniff.analysis.points import Point, PointTable
from sniff.bus.offline import settled
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session

E510 = packaged("teco-e510")
ACN = packaged("automationdirect-acn")


def load(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


bus = load("points_bus")


def samples(*exchanges: tuple[str, str | None], devices: Devices | None = None) -> list[Sample]:
    reader = PointReader(dissector_for(bus.SESSION), devices)
    return [sample for output in bus.run(bus.chunks(*exchanges)) for sample in reader.add(output)]


def words(*exchanges: tuple[str, str | None], devices: Devices) -> list[str]:
    meanings = [row.meaning for row in settled(bus.chunks(*exchanges), bus.SESSION, devices)]
    return ["" if one is None or not one.words else f"{one.who}: {one.words}" for one in meanings]


READ = ("012300000001".replace("0123", "0103"), "0103021770")
ALL_E510 = Devices(default=E510)


def test_names_without_a_profile() -> None:
    (sample,) = samples(("0503006b0001", "0503020007"))
    assert (sample.station, sample.name, sample.value.value, sample.value.raw) == ("5", "holding/40108", 7, 7)
    assert sample.frame == 2


def test_a_value_is_of_the_end_of_the_frame_that_carried_it() -> None:
    items = list(bus.chunks(("010325240001", "0103021770")))
    (sample,) = samples(("010325240001", "0103021770"), devices=ALL_E510)
    assert (sample.name, sample.value.value, sample.value.unit) == ("output-frequency", 60.0, "Hz")
    assert sample.time == items[1].time
    assert sample.value.how is Origin.READ


@pytest.mark.parametrize(
    "exchange",
    [
        ("010625021770", None),  # nobody confirms it
        ("010625021770", "018604"),
        ("010325240001", "018302"),
        ("010325240001", "0103021770ff"),
        ("010325240001", None),
    ],
)
def test_what_is_not_confirmed_is_no_value(exchange: tuple[str, str | None]) -> None:
    assert samples(exchange, ("020325240001", "0203020000"), devices=Devices({1: E510})) != []
    assert not [s for s in samples(exchange, ("020325240001", "0203020000"), devices=ALL_E510) if s.device == 1]


def test_a_confirmed_write_is_a_value_of_the_request() -> None:
    (sample,) = samples(("010625021770", "010625021770"), devices=ALL_E510)
    assert (sample.name, sample.value.value, sample.value.how, sample.frame) == ("set-frequency", 60.0, Origin.WRITE, 1)


def test_a_broadcast_is_for_all() -> None:
    found = samples(("000625010000", None), ("010325240001", "0103020000"), devices=ALL_E510)
    assert [(s.station, s.name) for s in found[:2]] == [("all", "command"), ("all", "command.run")]


# -- the manuals' examples, in words -----------------------------------------------------------------------------------


def test_write_60_hertz_and_forward_run() -> None:
    """The registers that the E510's tables give, and those of its worked examples, which its tables call otherwise."""
    by_tables = words(("010625021770", "010625021770"), ("011025010002040001 1770", "011025010002"), devices=ALL_E510)
    assert by_tables[0] == "drive 1: frequency command 60.00 Hz"
    assert by_tables[2] == "drive 1: run, forward; frequency command 60.00 Hz"
    as_printed = words(("010601021770", "010601021770"), ("011001010002040001 1770", "011001010002"), devices=ALL_E510)
    assert "frequency command in the manual's examples 60.00 Hz (?)" in as_printed[0]
    assert "run command in the manual's examples run, forward (?)" in as_printed[2]
    assert "60.00 Hz (?)" in as_printed[2]


def test_acn_acceleration_and_deceleration() -> None:
    said = words(("011011020002 04 0032 0064", "011011020002"), devices=Devices({1: ACN}))
    assert said[0] == "drive 1: dr.03 acceleration time 5.0 s; dr.04 deceleration time 10.0 s"


def test_words_of_rows() -> None:
    said = words(
        ("010625010003", "010625010003"),
        ("000625010000", None),
        ("010325200002", "01030400080011"),
        ("010300640001", "018352"),
        ("070325240001", "0703020000"),
        devices=Devices({1: E510}, None),
    )
    assert said[0] == "drive 1: run, reverse"
    assert said[1] == "drive 1: operation command acknowledged"
    assert "drive 1: status stopped, forward, not ready, fault; fault external fault 01" in said
    assert "drive 1: request refused (code of the manual's example, not in its table)" in said
    assert said[-1] == ""  # no profile for station 7
    assert words(("000625010000", None), ("010325240001", "0103020000"), devices=ALL_E510)[0] == (
        "all drives: stop, forward"
    )


# -- the table ---------------------------------------------------------------------------------------------------------


def test_the_table_holds_the_latest_and_when_it_changed() -> None:
    reads = [("010325240001", f"010302{value:04x}") for value in (100, 100, 300, 300)]
    found = samples(*reads, devices=ALL_E510)
    table = PointTable()
    table.add(found)
    point = table.get("1", "output-frequency")
    assert point is not None
    assert (point.count, point.sample, point.changed) == (4, found[3], found[2].time)
    assert [value for _, value in point.history] == [1.0, 1.0, 3.0, 3.0]
    assert (point.quality, point.is_command, len(table)) == (Quality.GOOD, False, 1)


def test_tables_add_up() -> None:
    reads = [("010325240001", f"010302{value:04x}") for value in (100, 200, 300, 300, 100)]
    found = samples(*reads, ("020325240001", "0203020001"), devices=ALL_E510)
    for cut in range(len(found) + 1):
        whole, first, second = PointTable(), PointTable(), PointTable()
        whole.add(found)
        first.add(found[:cut])
        second.add(found[cut:])
        before = [_facts(point) for point in first]
        both = first.merge(second)
        assert [_facts(point) for point in both] == [_facts(point) for point in whole]
        assert (both.version, both.dropped) == (whole.version, whole.dropped)
        assert [_facts(point) for point in first] == before


def _facts(point: Point) -> tuple[object, ...]:
    return point.sample, point.first, point.count, point.changed, tuple(point.history)


def test_memory_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sniff.analysis.points.MOST_POINTS", 2)
    table = PointTable()
    table.add(samples(("010300000004", "0103080001000200030004")))
    assert (len(table), table.dropped) == (2, 2)


def test_a_protocol_without_readings_has_no_points() -> None:
    from dataclasses import replace

    dissector = replace(dissector_for(Session("x", bus.LINE, "modbus-rtu")), readings=None)
    reader = PointReader(dissector, ALL_E510)
    assert [s for output in bus.run(bus.chunks(READ)) for s in reader.add(output)] == []


def test_what_is_no_number_and_stays_so_did_not_change() -> None:
    def sample(time: int, value: float) -> Sample:
        return Sample(time, 1, decode(None, [Reading("AI", 1, 0, value, Origin.READ)])[0], time)

    table = PointTable()
    table.add(sample(time, value) for time, value in enumerate((5.0, nan, float("nan"), nan), 1))
    (point,) = table
    assert point.changed == 2
    later = PointTable()
    later.add([sample(9, float("nan"))])
    (point,) = table.merge(later)
    assert point.changed == 2


def test_reads_and_writes_of_a_point_are_counted_apart() -> None:
    read, write = ("010325020001", "0103021770"), ("010625021388", "010625021388")
    point: Point | None = None
    for sample in samples(read, write, read, read, write, devices=ALL_E510):
        point = Point(sample) if point is None else point
        point.add(sample)
    assert point is not None
    assert (point.count, point.written) == (5, 2)
    assert (point.low, point.high) == (50.0, 60.0)


@pytest.mark.parametrize("how", ["one by one", "many", "merged"])
def test_over_a_hole_there_is_no_interval_and_no_rate(how: str) -> None:
    second, held = 1_000_000_000, Reading("holding", 0, 0, 0, Origin.READ)
    starts = [*range(20), *range(1000, 1020)]
    values = [
        Sample(time * second, 1, decode(None, [replace(held, raw=value, value=value)])[0], time)
        for value, time in enumerate(starts)
    ]
    table, hole = PointTable(), 500 * second
    if how == "merged":
        later = PointTable()
        table.add(values[:20])
        later.miss(hole)
        later.add(values[20:])
        table = table.merge(later)
    elif how == "many":
        table.miss(hole)
        columns = {name: np.array([0 for _ in values], np.int64) for name in ("space", "address", "how")}
        numbers = np.arange(len(values), dtype=np.int64)
        device = np.ones(len(values), np.int64)
        times = np.array(starts, np.int64) * second
        plain = PlainSamples(numbers, times, device, numbers, raw=numbers, spaces=("holding",), **columns)
        add_to(table, TableSamples(plain, []))
    else:
        table.add(values[:20])
        table.miss(hole)
        table.add(values[20:])
    (point,) = table
    assert (point.every.most, point.every.count, point.since) == (second, 38, 1000 * second)
    assert point.rate == 1
