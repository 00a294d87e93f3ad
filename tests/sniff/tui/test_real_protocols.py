"""The screens over what the real protocols' engines give, from simulated buses with faults."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from dissectors.frame import Frame
from sniff.analysis.packet_tree import Field
from sniff.analysis.row_tree import tree_of
from sniff.bus.offline import outputs
from sniff.bus.rows import Store
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.simulation.scenarios import scenario, simulate
from sniff.tui.times import date_and_clock

START = 1_772_359_200_000_000_000
PROTOCOLS = ("modbus-rtu", "modbus-ascii", "n2", "mstp")


@pytest.fixture(scope="module")
def stores() -> dict[str, Store]:
    made = {}
    for name in PROTOCOLS:
        session, items = simulate(scenario(name, seed=3), 12, started=START)
        store = made[name] = Store(session, dissector_for(session))
        for output in outputs(items, session):
            assert isinstance(output, Output)
            store.add(output)
    return made


def flat(fields: tuple[Field, ...]) -> Iterator[Field]:
    for field in fields:
        yield field
        yield from flat(field.children)


@pytest.mark.parametrize("name", PROTOCOLS)
def test_every_frame_opens_and_its_octets_have_fields(stores: dict[str, Store], name: str) -> None:
    """Good frames: every octet belongs to a field (of ASCII all but the characters around the pairs)."""
    store = stores[name]
    around = {"modbus-ascii": (1, 2)}.get(name, (0, 0))
    good = [row for row in store.rows if isinstance(row.event, Frame) and row.event.ok][:150]
    assert len(good) > 50
    for row in [*store.rows[:50], *good]:
        fields = tuple(flat(tree_of(store.dissector, row, store.transaction(row), date_and_clock)))
        assert all((field.name + field.value).isprintable() for field in fields)
        if row in good:
            leaves = [field for field in fields if not field.children and field.begin is not None]
            owned = {offset for field in leaves for offset in range(field.begin or 0, field.end or 0)}
            assert owned == set(range(around[0], len(row.event.octets) - around[1])), store.text(row)


@pytest.mark.parametrize("name", PROTOCOLS)
def test_all_screens_show_it(look: Any, stores: dict[str, Store], name: str) -> None:
    store = stores[name]

    async def script(see: Any) -> None:
        for key in ("1", "e", "e", "x", "2", "e", "3", "8", "9"):
            await see.press(key)
            text = see.text()
            assert "None" not in text
            assert all(len(line) <= 160 for line in see.lines())
        await see.press("1", "home")
        shown = " ".join(" ".join(line.split()) for line in see.lines())
        for row in store.rows[:5]:
            assert " ".join(store.text(row).split())[:40] in shown
        see.app.filter("!ok || noise")
        await see.settle()
        wanted = [row.no for row in store.rows if not (isinstance(row.event, Frame) and row.event.ok)]
        assert [see.main.index[line] for line in range(len(see.main.index))] == wanted

    look(store, script, (160, 40))


def test_bit_fields_share_their_octet(busy_bus: Any) -> None:
    row = busy_bus.store.by_no(2)
    fields = tree_of(busy_bus.store.dissector, row, None, date_and_clock)
    found = {field.name: (field.begin, field.end) for field in flat(fields)}
    assert found["station"] == (0, 1)
    assert found["high"] == found["low"] == (2, 3)
    assert found["rest"] == (3, 5)
    assert found["[1]"] == (4, 5)
    assert found["sum"] == (5, 6)


@pytest.mark.parametrize("size", [(60, 12), (80, 24), (120, 40), (300, 60)])
def test_times_of_a_ring_have_their_unit(look: Any, stores: dict[str, Store], size: tuple[int, int]) -> None:
    async def script(see: Any) -> None:
        titles = next(line for line in see.lines() if "loop" in line and "next" in line)
        assert ("loop p50 ms" in titles) is (size[0] >= 280)
        assert ("loop, max, use95, repl95: ms" in see.text()) is (size[0] < 280)

    look(stores["mstp"], script, size=size, start="ring")
