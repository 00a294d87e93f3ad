"""Two senders that tell the time, and tell another one (MS706)."""

from __future__ import annotations

import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.told_times import ToldTimes
from dissectors.findings import Severity
from dissectors.frame import Frame
from dissectors.line import Timing
from tests.dissectors.bacnet.make_ring_captures import clock
from tests.dissectors.bacnet.ring_script import LINE, Step, data, script


def _said(*steps: Step, has_times: bool = True) -> list[tuple[Severity, str]]:
    told = ToldTimes(Timing(LINE, has_times=has_times))
    for no, event in enumerate(script(steps).events):
        told.see(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)
    return [(one.severity, one.seen) for one in told.findings()]


_HALF_PAST, _FIVE_PAST = (2, clock(3, "0c1e0000")), (2, clock(19, "0b050000"))
_APART = "another time than just before; that of MAC 3 is 85.0 min ahead of that of MAC 19"


def test_two_clocks() -> None:
    assert _said(_HALF_PAST, _FIVE_PAST, _HALF_PAST) == [(Severity.WARNING, f"time-synchronization: twice {_APART}")]
    assert _said(_HALF_PAST, _FIVE_PAST) == [(Severity.NOTE, f"time-synchronization: once {_APART}")]
    assert not _said(_HALF_PAST, _FIVE_PAST, _HALF_PAST, has_times=False)


@pytest.mark.parametrize(
    "other",
    [
        (2, clock(19, "0c1e1400")),
        (3_600_000, clock(19, "0d1e1400")),  # an hour later
        (2, clock(19, "0b050000", utc=True)),
        (2, clock(19, "ff050000")),
        (2, data(19, 255, "01001006a47b0c1f07b40b")),
    ],
)
def test_what_is_no_second_clock(other: Step) -> None:
    assert not _said(_HALF_PAST, other)
    assert not _said(_HALF_PAST, (2, clock(3, "0b050000")))  # its own affair
