"""Routers that do not reach a network (MS309), lead to one that another leads to (MS310), number this one otherwise."""

from __future__ import annotations

import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.findings_of_routers import RouterFindings
from dissectors.findings import Severity
from dissectors.frame import Frame
from tests.dissectors.bacnet.ring_script import data, script

_NO_ROUTE = "0180030107d3"


def _said(*octets: str, by: tuple[int, ...] = (6,)) -> list[tuple[Severity, str]]:
    routers = RouterFindings()
    for no, event in enumerate(script([(2, data(mac, 3, one)) for one in octets for mac in by]).events):
        routers.see(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)
    return [(one.severity, one.seen) for one in routers.findings()]


def test_each_network_and_reason_is_counted() -> None:
    busy = "0180030207d4"
    assert _said(_NO_ROUTE, busy, _NO_ROUTE) == [
        (Severity.WARNING, "MAC 6 rejected 2 messages to network 2003: not directly connected to the network"),
        (Severity.NOTE, "MAC 6 rejected 1 message to network 2004: router busy"),
    ]


@pytest.mark.parametrize("octets", ["01800107d3", "018000", "0180030107", "01001008"])
def test_what_rejects_nothing(octets: str) -> None:
    assert not _said(octets)


_LEADS = "01800107d107d2"


def test_two_routers_to_one_network() -> None:
    warned = [(Severity.WARNING, f"MAC 4 and 6 say that they lead to network {network}") for network in (2001, 2002)]
    assert _said(_LEADS, _LEADS, by=(6, 4)) == warned


def test_a_router_that_was_replaced() -> None:
    assert {severity for severity, _ in _said(_LEADS, by=(6, 6, 4, 4))} == {Severity.NOTE}


@pytest.mark.parametrize("octets", [_LEADS, "01800107d1", "0180000 7d1".replace(" ", "")])
def test_one_router_to_a_network(octets: str) -> None:
    assert not _said(octets, octets)


_FROM_THERE = ("010c07d101050203010c0c020004d2194d", "0128ffff0007d10105fe1008")
"""A request of station 5 of network 2001, and its Who-Is to everybody."""


@pytest.mark.parametrize("octets", _FROM_THERE)
def test_two_routers_pass_on_what_comes_from_one_network(octets: str) -> None:
    warned = [(Severity.WARNING, "MAC 4 and 6 pass on messages from network 2001")]
    assert _said(octets, octets, by=(6, 4)) == warned
    assert {severity for severity, _ in _said(octets, by=(6, 6, 4, 4))} == {Severity.NOTE}
    assert not _said(*_FROM_THERE)


@pytest.mark.parametrize("octets", ["010c07d1", "0128ffff0907d1", "012007d101051008"])
def test_what_does_not_say_where_it_is_from(octets: str) -> None:
    assert not _said(octets, octets, by=(6, 4))


def test_what_is_said_and_seen_of_one_network_is_told_once() -> None:
    (said,) = _said("01800107d1", _FROM_THERE[0], "01800107d1", by=(6, 4))
    assert said[1] == "MAC 4 and 6 say that they lead to network 2001; MAC 4 and 6 pass on messages from network 2001"


def test_two_numbers_of_this_network() -> None:
    routers = RouterFindings()
    told = [(2, data(mac, 3, f"018013{number:04x}{how:02x}")) for mac, number, how in ((6, 5, 1), (4, 9, 1), (7, 8, 0))]
    for no, event in enumerate(script(told).events):
        routers.see(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)
    (found,) = routers.findings()
    assert (found.code, found.seen) == (
        "MS314",
        "of the number of this network say MAC 6 that it is 5, MAC 4 that it is 9",
    )
