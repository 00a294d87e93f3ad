"""Of a long capture `check` says when a finding was seen, as time of day."""

from __future__ import annotations

from array import array

import pytest

from dissectors.findings import Finding, Severity
from dissectors.line import NS_PER_S, LineSettings
from sniff.analysis.health import Health
from sniff.cli.check_output import Checked, when
from sniff.engine.session import NO_TIMES, Adapter, Session

BEGIN = 1_774_717_200 * NS_PER_S  # 2026-03-28 17:00:00
HOUR = 3600 * NS_PER_S


def told(first: int, last: int, *, seconds: float = 46_800, adapter: Adapter | None = None, begin: int = BEGIN) -> str:
    session = Session("x", LineSettings.parse("19200,8E1"), "modbus-rtu", begin, adapter=adapter or Adapter())
    finding = Finding("MB002", Severity.NOTE, "station 3", begin + first, begin + last, 9, (), "", "", "")
    return when(Checked("x", session, "", seconds, 9, (finding,), Health(100, ()), {}, array("q")), finding)


@pytest.mark.parametrize(
    ("first", "last", "words"),
    [
        (HOUR, HOUR, "2026-03-28 18:00:00 UTC"),
        (HOUR, HOUR + 900 * NS_PER_S, "2026-03-28 18:00:00 … 18:15:00 UTC"),
        (HOUR, 8 * HOUR, "2026-03-28 18:00:00 … 2026-03-29 01:00:00 UTC"),
        (0, 13 * HOUR, ""),  # all the time
    ],
)
def test_a_finding_of_a_night_has_its_time_of_day(first: int, last: int, words: str) -> None:
    assert told(first, last) == words


def test_what_is_short_or_has_no_dates_is_told_without() -> None:
    assert not told(HOUR, HOUR, seconds=599)
    assert not told(HOUR, HOUR, begin=0)
    assert not told(HOUR, HOUR, adapter=Adapter(latency_from=NO_TIMES))
