"""What a slave tells of an earlier start is not held against it, and a search for slaves is no search for masters."""

from __future__ import annotations

import pytest

from dissectors.findings import Severity
from dissectors.profibus.telegram import SC, telegram, token
from tests.dissectors.profibus.test_slaves import Telegrams, diagnosis, found, judged, parameters

FAULTY = 0x06 | 0x40
"""Not ready; configuration and parameters refused."""

CONFIGURATION = [(1, telegram(5, 1, 0x7D, b"\x71", 62, 62)), (1, bytes((SC,)))]
STATUS = [(30, telegram(9, 1, 0x49))]


@pytest.mark.parametrize("code", ["PB004", "PB005"])
@pytest.mark.parametrize(
    ("telegrams", "grave"),
    [
        ([*diagnosis(first=FAULTY), *parameters(), *CONFIGURATION], Severity.NOTE),
        ([*diagnosis(first=FAULTY), *parameters()], Severity.NOTE),
        ([*parameters(), *CONFIGURATION, *diagnosis(first=FAULTY)], Severity.ERROR),
        ([*diagnosis(first=FAULTY), *parameters(), *CONFIGURATION, *diagnosis(first=FAULTY)], Severity.ERROR),
        ([*diagnosis(first=FAULTY), *diagnosis(first=FAULTY)], Severity.ERROR),  # begun in the middle
    ],
)
def test_a_fault_that_was_told_before_anything_was_given(code: str, telegrams: Telegrams, grave: Severity) -> None:
    fault = found(judged(telegrams), code)
    assert fault is not None
    assert fault.severity is grave
    assert ("earlier start" in fault.seen) is (grave is Severity.NOTE)
    assert "not seen." not in fault.seen


def test_a_master_that_looks_for_its_slave() -> None:
    alone = found(judged(STATUS * 5), "PB016")
    assert alone is not None
    assert alone.severity is Severity.NOTE
    assert "slaves" in alone.means
    answered = found(judged([*STATUS * 5, (1, telegram(1, 9, 0x00))]), "PB016")
    assert answered is not None
    assert answered.severity is Severity.INFO
    ring = found(judged([(1, token(1, 1)), *STATUS] * 5), "PB016")
    assert ring is not None
    assert ring.severity is Severity.INFO
    assert "slaves" not in ring.means
