"""Over every capture there is: no second protocol is invented where a bus has one."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest

from sniff.analysis.told_protocol import detected
from sniff.bus.offline import survey
from sniff.bus.second_protocol import ForeignFrames, proven
from sniff.engine.capture import CaptureError
from sniff.formats import read
from sniff.formats.several_buses import buses_in

CAPTURES = Path(__file__).parents[2] / "captures"
SHARED = Path(__file__).parents[3] / "shared"
MIXED = {
    "line-a-drive-still-speaks-bacnet.cap.txt": "mstp",
    "line-read-as-another-protocol.cap.txt": "modbus-rtu",
    "line-read-as-rtu.cap.txt": "n2",
}
"""By name those that have two, or are said to be what they are not."""

BOTH = "vectors-modbus-suites"
"""RTU and ASCII, one after the other."""

NO_CAPTURES = (".md", ".frames", ".png", ".gz", ".tsv")
MOST = 3_000_000


@pytest.mark.parametrize("folder", [CAPTURES, SHARED / "captures", SHARED / "cases"], ids=lambda one: one.name)
def test_none_is_invented(folder: Path) -> None:
    for path in sorted(folder.rglob("*")):
        if not path.is_file() or path.suffix in NO_CAPTURES or path.stat().st_size > MOST:
            continue
        if path.name.endswith(".expect.txt") or path.parent.name == BOTH:
            continue
        try:
            buses = buses_in(read(path))
        except CaptureError:
            continue
        for bus in buses:
            session = detected(bus.session)
            counting = ForeignFrames(session)
            with suppress(CaptureError):
                survey(bus, session, counting)
            told = counting.told()
            assert (told and told[0].name) == MIXED.get(path.name), path
            assert (proven(bus, session).name or None) == MIXED.get(path.name), path
