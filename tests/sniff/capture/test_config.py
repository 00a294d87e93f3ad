from __future__ import annotations

import json
from pathlib import Path

from dissectors.line import LineSettings
from sniff.capture.config import CaptureConfig, RecordSpec, SourceSpec

ONE = SourceSpec("/dev/ttyUSB0", LineSettings.parse("76800,8E1"), "mstp", "roof")
TWO = SourceSpec("socket://10.0.0.5:4001", LineSettings(), "n2", "boiler room/2")


def test_crosses_as_json() -> None:
    for config in (
        CaptureConfig((ONE, TWO), RecordSpec("night.mcap", "size:64MB", 5), 10),
        CaptureConfig((ONE,)),
    ):
        assert CaptureConfig.from_json(json.loads(json.dumps(config.to_json()))) == config


def test_one_bus_is_recorded_where_asked() -> None:
    assert RecordSpec("logs/night.mcap").path_of(ONE, [ONE]) == Path("logs/night.mcap")


def test_each_of_several_buses_has_its_file() -> None:
    record = RecordSpec("logs/night.mcap")
    assert record.path_of(ONE, [ONE, TWO]) == Path("logs/night.roof.mcap")
    assert record.path_of(TWO, [ONE, TWO]) == Path("logs/night.boiler-room-2.mcap")


def test_buses_of_one_name_do_not_share_a_file() -> None:
    same = [SourceSpec("/dev/ttyUSB0"), SourceSpec("/dev/ttyUSB1")]
    paths = {RecordSpec("night.mcap").path_of(source, same) for source in same}
    assert paths == {Path("night.bus-1.mcap"), Path("night.bus-2.mcap")}
