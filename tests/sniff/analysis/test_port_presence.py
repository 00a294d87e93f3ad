"""What is said of a port that goes, and of one that never was there."""

from __future__ import annotations

import pytest

from dissectors.line import NS_PER_S
from sniff.analysis.port_presence import PortPresence
from sniff.engine.event_texts import gone
from sniff.engine.session import LineEvent, LineEventKind

GONE, BACK = LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED
STARTED = 1_773_000_000 * NS_PER_S


@pytest.mark.parametrize(
    ("events", "heard", "said", "severity"),
    [
        ([(0, GONE)], False, "not there when the capture began; it did not come", "error"),
        ([(0, GONE), (5, BACK)], False, "not there when the capture began, away for 5.0 s in all", "warning"),
        (
            [(0, GONE), (5, BACK), (9, GONE)],
            False,
            "not there when the capture began, unplugged once, away for 5.0 s in all; it did not come back",
            "error",
        ),
        ([(7, GONE)], False, "unplugged once; it did not come back", "error"),
        ([(0, GONE), (2, BACK)], True, "unplugged once, away for 2.0 s in all", "warning"),
        ([(7, GONE), (8, BACK), (9, GONE), (11, BACK)], True, "unplugged twice, away for 3.0 s in all", "warning"),
    ],
)
def test_words(events: list[tuple[int, LineEventKind]], heard: bool, said: str, severity: str) -> None:
    port = PortPresence(STARTED)
    for seconds, kind in events:
        port.add(LineEvent(STARTED + seconds * NS_PER_S, kind, gone("/dev/ttyUSB0", "no such port")), heard)
    (finding,) = port.findings()
    assert (finding.seen, finding.severity.name.lower()) == (said, severity)
    assert finding.lasts is said.endswith(("come", "back"))
