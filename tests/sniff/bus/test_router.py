"""Several models on one capture: each gets its rows, whoever asks first."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from dissectors.frame import Chunk
from sniff.bus import router as router_module
from sniff.bus.live import LiveBus
from sniff.bus.router import Router
from sniff.capture.ipc import Ended, Message, ReceivedMessage, Status, Tick
from sniff.engine.engine import Output
from tests.property.modbus_adus import rtu
from tests.sniff.bus.given_link import GivenLink

MS = 1_000_000
REQUEST, ANSWER = rtu(bytes.fromhex("010300000001")), rtu(bytes.fromhex("0103020007"))


def said(bus: int, at: int) -> list[Message]:
    return [
        ReceivedMessage(bus, Chunk(at * MS, REQUEST)),
        ReceivedMessage(bus, Chunk((at + 20) * MS, ANSWER)),
        Tick(bus, (at + 100) * MS),
    ]


def rows(live: LiveBus) -> int:
    return sum(len(item.rows) for item in live.poll() if isinstance(item, Output))


def test_two_models_on_one_link_each_get_their_rows() -> None:
    link: Any = GivenLink([*said(0, 100), *said(1, 100), *said(0, 300), Ended("stopped")])
    router = Router(link)
    lives = [LiveBus(link, bus, router=router) for bus in (0, 1)]
    assert [rows(live) for live in lives] == [4, 2]
    assert [live.model.summary.frames for live in lives] == [4, 2]
    assert all(live.ended is not None for live in lives)


def test_a_bus_that_nobody_asks_for_costs_no_more_than_its_share(monkeypatch: Any) -> None:
    monkeypatch.setattr(router_module, "HELD", 100)
    link: Any = GivenLink([*(message for at in range(0, 3000, 300) for message in said(1, at)), *said(0, 5000)])
    router = Router(link)
    alone, late = LiveBus(link, 0, router=router), LiveBus(link, 1, router=router)
    assert rows(alone) == 2
    assert late.unseen == 10 * (len(REQUEST) + len(ANSWER)) - 98
    assert late.poll()


def test_buses_that_are_shown_by_nobody_are_left_alone() -> None:
    link: Any = GivenLink([*said(0, 100), *said(7, 100), Status(7)])
    assert rows(LiveBus(link, 0)) == 2


def test_a_capture_that_somebody_else_ended_has_ended_for_all() -> None:
    """Its last word was received beside the router: no model waits for it for ever."""
    link: Any = GivenLink(said(0, 100))
    router = Router(link)
    lives = [LiveBus(link, bus, router=router) for bus in (0, 1)]
    assert rows(lives[0]) == 2
    link.ended = Ended("stopped")
    for live in lives:
        live.stop()
        assert live.ended is link.ended


def test_the_newest_tick_says_it_all() -> None:
    link: Any = SimpleNamespace(receive_batches=lambda timeout: [Tick(0, 1), Tick(0, 2), Tick(0, 3)])
    router = Router(link)
    router.open(0)
    assert router.receive(0) == [Tick(0, 3)]
