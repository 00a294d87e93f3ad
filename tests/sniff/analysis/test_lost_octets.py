"""What is said of octets that the computer lost: their number, as far as somebody counted."""

from __future__ import annotations

import pytest

from dissectors import registry
from dissectors.line import LineSettings
from sniff.analysis.judging import LineJudging
from sniff.engine.session import LineEvent, LineEventKind, Session


@pytest.mark.parametrize(
    ("counts", "said"),
    [
        ([3, 4], "7 octets lost twice"),
        ([-1], "an unknown number of octets lost once"),
        ([3, -1], "at least 3 octets lost twice"),
        ([-1, 3], "at least 3 octets lost twice"),
    ],
)
def test_a_number_is_a_number_only_where_all_were_counted(counts: list[int], said: str) -> None:
    session = Session("x", LineSettings(), "modbus-rtu")
    judging = LineJudging(session, registry.get("modbus-rtu"))
    for number, count in enumerate(counts):
        judging.add_line_event(LineEvent(number, LineEventKind.DROPPED, "", count))
    (found,) = [one for one in judging.findings.judgement().findings({}) if one.code == "LN005"]
    assert said in found.seen
