"""Cases about the line itself: wrong settings are named as what they are."""

from __future__ import annotations

from dissectors.findings import Severity
from tests.cases.reading import case, reading


def test_seven_data_bits() -> None:
    read = reading(case("modbus/n1-seven-data-bits.cap.txt"))
    assert read.graves() == {("LN003", "bus")}
    assert "no octet of 115 is above 7F" in read.said("LN003")
    assert "7 data bits" in read.said("LN003")


def test_a_fast_bus_read_slowly() -> None:
    read = reading(case("modbus/j1-fast-bus-read-slow.cap.txt"))
    assert read.graves() == {("LN003", "bus")}
    assert "wrong baud rate: the bus is faster than 9600 Bd" in read.said("LN003")
    assert not read.said("LN203")


def test_another_rate_on_the_same_line() -> None:
    read = reading(case("modbus/b1-other-protocol-at-2400.cap.txt"))
    (told,) = (one for one in read.findings if one.code == "LN204")
    assert "about 2400 Bd" in told.seen
    assert "the same 15 octets" in told.seen
    assert "another baud rate" in f"{told.means} {told.next}" or told.severity < Severity.WARNING


def test_reads_that_a_busy_computer_bunched_accuse_nobody() -> None:
    read = reading(case("mstp/bunched-reads-3ms.cap.txt"))
    assert ("MS501", "MAC 4") not in read.graves()
