"""Routers that say that they do not reach a network (MS309)."""

from __future__ import annotations

import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.findings_of_routers import NetworkRejections
from dissectors.findings import Severity
from dissectors.frame import Frame
from tests.dissectors.bacnet.ring_script import data, script

_NO_ROUTE = "0180030107d3"


def _said(*octets: str) -> list[tuple[Severity, str]]:
    rejections = NetworkRejections()
    for no, event in enumerate(script([(2, data(6, 3, one)) for one in octets]).events):
        rejections.see(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)
    return [(one.severity, one.seen) for one in rejections.findings()]


def test_each_network_and_reason_is_counted() -> None:
    busy = "0180030207d4"
    assert _said(_NO_ROUTE, busy, _NO_ROUTE) == [
        (Severity.WARNING, "MAC 6 rejected 2 messages to network 2003: not directly connected to the network"),
        (Severity.NOTE, "MAC 6 rejected 1 message to network 2004: router busy"),
    ]


@pytest.mark.parametrize("octets", ["01800107d3", "018000", "0180030107", "01001008"])
def test_what_rejects_nothing(octets: str) -> None:
    assert not _said(octets)
