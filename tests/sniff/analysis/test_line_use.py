"""How near a bus is to its limit, and what broadcasts take of it."""

from __future__ import annotations

import pytest

from dissectors.findings import Finding, Severity
from dissectors.frame import Check, FoundBy, Frame, Role
from dissectors.line import LineSettings
from sniff.analysis.line_use import LineUse
from sniff.simulation.tap import EXACT, FTDI
from tests.faults.buses import modbus, mstp, n2
from tests.faults.case import Case
from tests.faults.matrix import run

LINE = LineSettings.parse("9600,8N1")
S = 1_000_000_000
OCTETS = 96  # 100 ms


def used(
    shares: list[float], broadcast: float = 0.0, line: LineSettings = LINE, *, is_assumed: bool = False
) -> dict[str, Finding]:
    """Ten frames a second, of which so large a share is sent; every so many of them a broadcast."""
    use, no = LineUse(line, is_assumed=is_assumed), 0
    for second, share in enumerate(shares):
        for tenth in range(10):
            if tenth < round(10 * share):
                no += 1
                end = 7 * S + second * S + (tenth + 1) * S // 10
                frame = Frame("x", bytes(OCTETS), end - OCTETS * LINE.char, end, Check.GOOD, FoundBy.GAP)
                use.see(no, frame, Role.BROADCAST if (no % 10) / 10 < broadcast else Role.REQUEST)
    return {one.code: one for one in use.findings()}


def test_a_bus_with_room_is_not_spoken_of() -> None:
    assert used([0.7] * 60) == {}
    assert used([1.0] * 7 + [0.1] * 20) == {}


def test_a_busy_bus_is_noted_a_full_one_warned_of() -> None:
    noted = used([0.3] * 20 + [0.9] * 12 + [0.3] * 20)["LN401"]
    assert (noted.severity, noted.first) == (Severity.NOTE, (7 + 20) * S)
    assert "90% of 10 s" in noted.seen
    full = used([0.3] * 5 + [1.0] * 35)["LN401"]
    assert full.severity is Severity.WARNING
    assert "of 30 s" in full.seen


def test_a_pause_begins_anew() -> None:
    assert used([1.0] * 9 + [0.0] * 200 + [1.0] * 9) == {}


@pytest.mark.parametrize(
    ("share", "severity"), [(0.1, None), (0.3, Severity.NOTE), (0.6, Severity.WARNING), (0.0, None)]
)
def test_broadcasts(share: float, severity: Severity | None) -> None:
    found = used([0.4] * 60, share).get("LN402")
    assert (found.severity if found is not None else None) is severity


def test_what_a_rate_that_nobody_said_tells_is_a_guess() -> None:
    told = used([0.3] * 5 + [1.0] * 35, is_assumed=True)["LN401"]
    assert told.severity is Severity.NOTE
    assert told.seen.endswith(", at 9600 Bd, which nobody said")
    broadcasts = used([0.4] * 60, 0.6, is_assumed=True)["LN402"]
    assert broadcasts.severity is Severity.NOTE
    assert "of all time" not in broadcasts.seen


def test_more_octets_than_the_line_carries_are_no_load_of_it() -> None:
    told = used([1.0] * 40, line=LineSettings.parse("4800,8N1"))["LN401"]
    assert told.severity is Severity.NOTE
    assert told.seen.startswith("more octets than 4800 Bd carry: ")
    assert "baud rate" in told.means


@pytest.mark.parametrize("tenths", [15, 19, 25])
def test_broadcasts_a_second_are_told_of_the_time_that_passed(tenths: int) -> None:
    use = LineUse(LINE)
    for no in range(10 * tenths):
        end = 7 * S + (no + 1) * S // 100
        frame = Frame("x", b"123", end - 3 * LINE.char, end, Check.GOOD, FoundBy.GAP)
        use.see(no, frame, Role.BROADCAST)
    (told,) = use.findings()
    assert float(told.seen.rsplit(", ", 1)[1].split()[0]) == pytest.approx(100, rel=0.02)


def test_broadcasts_that_leave_the_line_free_are_nobodys_trouble() -> None:
    assert used([0.1] * 60, 0.2) == {}
    (made_for_them,) = used([0.4] * 60, 1.0).values()
    assert made_for_them.severity is Severity.NOTE


@pytest.mark.parametrize("tap", [EXACT, FTDI], ids=lambda tap: tap.name)
def test_of_usual_buses_nothing_is_said(tap) -> None:  # type: ignore[no-untyped-def]
    for make in (modbus, n2, mstp):
        found = run(Case("", make, (), tap, 40 if make is not mstp else 15)).findings
        assert not {one.code for one in found if one.code.startswith("LN4")}


def test_nearly_all_is_not_told_as_all() -> None:
    use = LineUse(LINE)
    for tenth in range(200):
        size, end = OCTETS - 3 * (tenth % 10 == 0), 7 * S + (tenth + 1) * S // 10
        use.see(tenth, Frame("x", bytes(size), end - size * LINE.char, end, Check.GOOD, FoundBy.GAP), Role.REQUEST)
    (full,) = use.findings()
    assert full.seen.endswith("over 99% of all time")
