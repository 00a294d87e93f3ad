from __future__ import annotations

import json

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
