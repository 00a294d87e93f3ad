"""Stray octets: which ones they are mostly is said only where there is a majority."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from dissectors.frame import Noise, Place, Reason
from dissectors.line import LineSettings
from sniff.analysis.line_findings import LineFindings
from sniff.engine.engine import Row
from sniff.engine.session import Session


@pytest.mark.parametrize(
    ("octets", "said"),
    [
        ((0x00, 0xC0, 0xF8), " (00, C0, F8)"),
        ((0x00,) * 9 + (0xC0, 0xF8, 0xE0, 0xFF, 0x01), " (mostly 00, C0, F8, E0)"),
        (tuple(range(20)), ""),
    ],
)
def test_mostly_needs_a_majority(octets: Sequence[int], said: str) -> None:
    line = LineFindings(Session(port="test", line=LineSettings(), protocol="modbus-rtu"))
    for no, octet in enumerate((0x55, *octets)):  # the first row is the begin of the capture
        time = no * 1_000_000_000
        noise = Noise(bytes((octet,)), time, time, Place.BETWEEN, Reason.NO_FRAME)
        line.see(Row(no, noise, None, None))
    (finding,) = (finding for finding in line.findings() if finding.code == "LN203")
    assert finding.seen == f"stray octets {len(octets)} times in the silence between 0 frames{said}"
