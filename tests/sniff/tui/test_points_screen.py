"""Screen 4: points of a simulated bus."""

from __future__ import annotations

import random
import struct
from functools import cache
from typing import Any

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_rtu
from dissectors.profiles import Devices
from dissectors.profiles.decoding import decode
from dissectors.profiles.packaged import packaged
from dissectors.readings import Origin, Reading
from sniff.analysis.guessed_points import GuessedPoint
from sniff.analysis.point_reader import Sample
from sniff.analysis.points import Point
from sniff.bus.offline import outputs
from sniff.bus.rows import Store
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.simulation.scenarios import scenario, simulate
from sniff.tui.screens import points
from sniff.tui.screens.points import age, trend

STARTED = 1_772_359_200 * 1_000_000_000
SIZES = {"80x24": (80, 24), "160x50": (160, 50)}


@cache
def store_of(name: str, seconds: float, known: bool = True) -> Store:
    """To be looked at only: each is made once."""
    plan = scenario(name, faults=False)
    session, items = simulate(plan, seconds, started=STARTED)
    devices = Devices({address: packaged(profile) for address, profile in plan.devices.items()} if known else {})
    store = Store(session, dissector_for(session), devices=devices)
    for output in outputs(items, session):
        if isinstance(output, Output):
            store.add(output)
    return store


def keys(see: Any) -> list[str]:
    return [str(key.value) for key in see.main.rows]


def cells(see: Any, key: str) -> list[str]:
    return [cell.plain for cell in see.main.get_row(key)]


def test_values_by_device_and_name(look: Any) -> None:
    async def script(see: Any) -> None:
        for width, height in SIZES.values():
            await see.pilot.resize_terminal(width, height)
            await see.settle()
            text = see.text()
            assert "None" not in text
            assert all(len(line) <= width for line in see.lines())
            assert cells(see, "1/output-frequency")[3].endswith(" Hz")
            assert cells(see, "1/status")[3].lstrip("*").startswith(("running", "stopped"))
            assert cells(see, "1/command")[0].startswith("→")
            assert keys(see)[0].startswith("1/")
            assert "1/status.running" not in keys(see)

    look(store_of("modbus-rtu", 20), script, start="points")


def test_pin_bits_and_commands(look: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("G")
        last = see.main.key_here()
        await see.press("p")
        assert keys(see)[0] == last
        assert "^" in cells(see, last)[0]
        assert see.main.key_here() == last
        await see.press("p")
        assert "^" not in cells(see, last)[0]
        await see.press("b")
        assert "1/status.running" in keys(see)
        await see.press("b", "c")
        assert keys(see)
        assert all("→" in cells(see, key)[0] for key in keys(see))
        assert "only commands (c: everything)" in see.text().replace("\n ", " ")
        await see.press("slash")
        await see.type("nowhere")
        await see.press("enter")
        assert "no such value · only commands" in see.text()

    look(store_of("modbus-rtu", 20), script, start="points")


def test_enter_goes_to_the_frame(look: Any) -> None:
    store = store_of("modbus-rtu", 10)

    async def script(see: Any) -> None:
        await see.press("enter")
        assert see.app.current_mode == "frames"
        point = store.points.get("1", "status")
        assert point is not None
        assert see.main.cursor == point.sample.frame

    look(store, script, start="points")


def test_a_frozen_view_stands_still(look: Any) -> None:
    plan = scenario("modbus-rtu", faults=False)
    session, items = simulate(plan, 10, started=STARTED)
    steps = [output for output in outputs(items, session) if isinstance(output, Output)]
    store = Store(session, dissector_for(session), devices=Devices(default=packaged("teco-e510")))
    for output in steps[: len(steps) // 2]:
        store.add(output)

    async def script(see: Any) -> None:
        await see.press("space")
        before = see.lines()[2:-1]
        for output in steps[len(steps) // 2 :]:
            store.add(output)
        await see.poll()
        assert see.lines()[2:-1] == before
        await see.press("space")
        await see.poll()
        assert see.lines()[2:-1] != before

    look(store, script, start="points", live=True)


def test_no_values_yet_and_no_profile(look: Any, make_bus: Any) -> None:
    async def empty(see: Any) -> None:
        assert "no values yet" in see.text()
        await see.press("enter", "p")

    look(make_bus().store, empty, start="points")

    async def plain(see: Any) -> None:
        assert "1/holding/49505" in keys(see)

    look(store_of("modbus-rtu", 5, known=False), plain, start="points")


def test_names_and_values_from_the_wire_are_harmless(look: Any) -> None:
    from dissectors.profiles.decoding import decode
    from dissectors.readings import Origin, Reading
    from sniff.analysis.point_reader import Sample

    store = store_of.__wrapped__("mstp", 3)
    evil = Reading("device", 5, None, "[red]x[/red]\x1b[2J\u202e", Origin.READ, "object-name\x1b")
    store.points.add([Sample(STARTED, 5, value, 1) for value in decode(None, [evil])])

    async def script(see: Any) -> None:
        assert "\x1b" not in see.text()
        assert "\u202e" not in see.text()
        assert "[red]x[/red]" in see.text()

    look(store, script, (160, 50), "points")


def test_trend_and_age() -> None:
    assert trend([1.0]) == ""
    assert trend([2.0, 2.0]) == "──"
    assert trend([0, 1, 2])[0] < trend([0, 1, 2])[1] < trend([0, 1, 2])[2]
    assert len(trend(list(range(100)))) == 12
    assert [age(seconds * 10**9) for seconds in (-5, 3, 119, 600, 90_000)] == ["0 s", "3 s", "119 s", "10 min", "25 h"]


def test_words_order_columns_and_plot(look: Any) -> None:
    store = store_of("modbus-rtu", 20)

    async def script(see: Any) -> None:
        assert len(cells(see, keys(see)[0])) == 7
        await see.press("slash", *"output-f", "enter")
        assert keys(see) == ["1/output-frequency", "2/output-frequency", "3/output-frequency"]
        await see.press("escape", "s")
        names = [key.partition("/")[2] for key in keys(see)]
        assert names == sorted(names)
        assert "sorted by name" in " ".join(see.text().split())
        assert "seconds before the newest" not in see.text()
        await see.press("v")
        assert "seconds before the newest" in see.text()
        await see.press("v")
        assert "seconds before the newest" not in see.text()

    look(store, script, start="points")


def test_large_screens_show_all_columns_and_the_plot(look: Any) -> None:
    async def script(see: Any) -> None:
        assert len(cells(see, keys(see)[0])) == 12
        assert "seconds before the newest" in see.text()
        assert all(len(line) <= 160 for line in see.lines())

    look(store_of("modbus-rtu", 20), script, (160, 50), "points")


def test_what_nobody_described_is_guessed(look: Any) -> None:
    async def script(see: Any) -> None:
        assert "guessed u16: sensor" in " ".join(see.text().split())

    look(store_of("modbus-rtu", 20, known=False), script, start="points")


def test_two_registers_that_are_one_number_are_one_row_with_its_value(look: Any) -> None:
    """A meter with floats, low word first."""
    dice = random.Random(4)
    line, now, items = LineSettings.parse("9600,8E1"), STARTED, []
    for _ in range(60):
        words = [word for mean in (230, 5) for word in struct.unpack("<2H", struct.pack("<f", dice.gauss(mean, 0.5)))]
        for pdu in (b"\7\4\0\0\0\5", struct.pack(">BBB5H", 7, 4, 10, *words, 17)):
            octets = seal_rtu(pdu)
            now += 20_000_000 + len(octets) * line.char
            items.append(Chunk(now, octets))
        now += 400_000_000
    session = Session("meter", line, "modbus-rtu", STARTED)
    store = Store(session, dissector_for(session), devices=Devices({}))
    for output in outputs(items, session):
        if isinstance(output, Output):
            store.add(output)

    async def script(see: Any) -> None:
        shown = {key: cells(see, key) for key in keys(see)}
        assert list(shown) == ["7/input/30001", "7/input/30003", "7/input/30005"]
        assert [row[0] for row in shown.values()] == ["?", "?", ""]
        value, other, plain = (float(row[3].lstrip("*")) for row in shown.values())
        assert 225 < value < 235
        assert 2 < other < 8
        assert plain == 17

    look(store, script, (100, 30), "points")


def test_without_the_plotting_library_there_are_bars(look: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sniff.tui.plot.HAS_PLOT", False)

    async def script(see: Any) -> None:
        await see.press("slash", *"1/output-f", "enter", "v")
        assert "seconds before the newest" in see.text()
        assert any(bar in see.text() for bar in "▁▂▃▄▅▆▇█")

    look(store_of("modbus-rtu", 20), script, start="points")


def test_counters_have_all_their_digits() -> None:
    point = Point(Sample(0, 1, decode(None, [Reading("holding", 0, 1, 4_294_967_295, Origin.READ)])[0], 1))
    point.reach(0.0, 4_294_967_295.0)
    guess = GuessedPoint("guessed", 4_294_967_295.0, 4_294_900_001.0, 4_294_967_295.0, 0.0, is_itself=False)
    told = [cell.plain for cell in points._cells(point, 0, [], guess, 20, True)]
    assert [told[at] for at in (3, 8, 9)] == ["4294967295", "4294900001", "4294967295"]
    assert points._seen(point, None, True)[1] == "seen 0 … 4294967295"
