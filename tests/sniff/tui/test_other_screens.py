"""Transactions, nodes, line."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from textual.widgets import DataTable

from dissectors.frame import LineError, Mark
from dissectors.tracker import Verdict
from sniff.analysis.load import Second
from sniff.engine.session import LineEvent, LineEventKind
from sniff.tui.screens.line import curves
from sniff.tui.screens.timeline import _answered

MS = 1_000_000


# -- transactions ----------------------------------------------------------------------------------------------------


def test_transactions_follow_errors_and_open(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home", "e")
        assert see.main.cursor == 3
        await see.press("e", "e", "e")
        assert see.main.cursor == 5
        assert see.notices() == ["no trouble after this one"]
        await see.press("E", "enter")
        assert see.app.current_mode == "frames"
        assert see.main.cursor == 7
        await see.press("q")
        assert see.app.current_mode == "transactions"
        assert see.main.cursor == 4

    look(busy_bus.store, script, start="transactions")


def test_both_lists_share_their_cursor(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home", "e", "e", "e", "e", "2")  # row 8: transaction 4
        assert see.main.cursor == 4
        await see.press("down", "1")
        assert see.main.cursor == 9

    look(busy_bus.store, script)


def test_transactions_that_close_while_looking(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        assert see.main.cursor == 6
        busy_bus.ask(1, Verdict.LATE, of=2)
        await see.poll()
        assert see.main.cursor == 7
        assert "late" in see.text()
        assert "of tx 2" in see.text()

    look(busy_bus.store, script, start="transactions", live=True)


# -- nodes -----------------------------------------------------------------------------------------------------------


def cells(see: Any, station: int) -> dict[str, str]:
    titles = [column.label.plain for column in see.main.ordered_columns]
    return dict(zip(titles, (cell.plain for cell in see.main.get_row(str(station))), strict=True))


def test_nodes_count_by_station(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        counted = ("stn", "sent", "received", "asked", "answered", "no answer", "exceptions", "damaged")
        times = ("p50 ms", "p95 ms", "max ms")
        rows = {station: cells(see, station) for station in (1, 2, 3, 4)}
        assert [rows[1][title] for title in counted] == ["1", "3", "3", "3", "100.0%", "0", "!1", "0"]
        assert [rows[3][title] for title in counted] == ["3", "0", "1", "1", "0.0%", "!1", "0", "0"]
        assert [rows[4][title] for title in counted] == ["4", "1", "1", "1", "0.0%", "0", "0", "!1"]
        assert [rows[3][title] for title in times] == ["–", "–", "–"]
        assert [rows[2][title] for title in times] == ["38.0", "38.0", "38.0"]
        assert rows[1]["frame types"] == "read 3"

    look(busy_bus.store, script, (160, 30), start="nodes")


def test_the_worst_station_stands_first_with_what_its_health_is_made_of(look: Any, make_bus: Any) -> None:
    bus = make_bus()
    for _ in range(10):
        bus.ask(1)
        bus.ask(2, Verdict.NO_RESPONSE)
        bus.ask(3)
    bus.ask(3, Verdict.EXCEPTION, error="illegal data address")

    async def script(see: Any) -> None:
        await see.poll()
        assert [str(key.value) for key in see.main.rows] == ["2", "3", "1"]
        assert cells(see, 2)["health"] == "!0"
        assert cells(see, 1)["health"] == "100"
        assert "health  0 of 100: 100% of its requests without answer" in see.text()
        assert "health " in see.lines()[0]
        await see.press("down")
        assert "errors  1 × illegal data address" in see.text()

    look(bus.store, script, start="nodes")


def test_enter_shows_the_frames_of_a_station(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("s", "home", "down", "enter")  # by address
        assert see.app.current_mode == "frames"
        assert see.app.viewing.filter == "addr == 2"
        assert [see.main.index[line] for line in range(len(see.main.index))] == [3, 4, 13]
        await see.press("q")
        assert see.app.current_mode == "nodes"

    look(busy_bus.store, script, start="nodes")


def test_sorting(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        orders = []
        for _ in range(6):
            orders.append("".join(str(key.value) for key in see.main.rows))
            await see.press("s")
        assert orders == ["4123", "1234", "4312", "2143", "4123", "4123"]
        assert "sorted by address" in see.text()

    look(busy_bus.store, script, start="nodes")


def test_nodes_keep_up_and_freeze(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("s", "home", "down")
        busy_bus.ask(9)
        busy_bus.ask(1)
        await see.poll()
        assert cells(see, 1)["asked"] == "4"
        assert cells(see, 9)["asked"] == "1"
        assert see.main.cursor_row == 1
        await see.press("space")
        busy_bus.ask(1)
        await see.poll()
        assert cells(see, 1)["asked"] == "4"
        await see.press("space")
        assert cells(see, 1)["asked"] == "5"

    look(busy_bus.store, script, start="nodes", live=True)


def test_one_failure_in_many_is_not_rounded_away(look: Any, make_bus: Any) -> None:
    bus = make_bus()
    for _ in range(2001):
        bus.ask(1)
    bus.ask(1, Verdict.NO_RESPONSE)

    async def script(see: Any) -> None:
        assert cells(see, 1)["answ."] == "99.9%"

    look(bus.store, script, start="nodes")


def test_a_table_writes_only_what_changed(look: Any, busy_bus: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    async def script(see: Any) -> None:
        written: list[Any] = []
        monkeypatch.setattr(DataTable, "update_cell", lambda table, key, *rest, **more: written.append(key))
        busy_bus.ask(1)
        await see.poll()
        assert set(written) == {"1"}

    look(busy_bus.store, script, start="nodes")


# -- line ------------------------------------------------------------------------------------------------------------


def test_zero_that_means_unknown_is_said(look: Any, make_bus: Any) -> None:
    for reports, said in (
        (None, ["nobody knows", "parity unknown", "overrun unknown"]),
        ((), ["no line errors at all", "framing unknown", "break unknown"]),
        (("parity",), ["parity 0", "framing unknown"]),
    ):
        bus = make_bus(reports=reports)
        bus.ask(1)

        async def script(see: Any, said: list[str] = said) -> None:
            for words in said:
                assert words in see.text()

        look(bus.store, script, start="line")


def test_line_errors_are_counted_by_what_was_reported(look: Any, make_bus: Any) -> None:
    bus = make_bus(reports=("parity", "framing", "break", "overrun"))
    both = LineError.PARITY | LineError.FRAMING
    bus.noise(
        b"abcdef",
        (Mark(0, LineError.PARITY), Mark(1, both), Mark(2, LineError.BREAK), Mark(3, LineError.OVERRUN | both)),
    )

    async def script(see: Any) -> None:
        assert "parity or framing 2 · parity 1 · framing 0 · break 1 · overrun 1" in see.text()

    look(bus.store, script, (120, 40), "line")


def test_silences_fall_into_their_ranges(look: Any, make_bus: Any) -> None:
    bus = make_bus(latency=0)
    for _ in range(3):
        bus.ask(1, latency=7)  # 7 ms within, 20 ms after

    async def script(see: Any) -> None:
        lines = {line.split("ms")[0].strip(): line.split() for line in see.lines() if " … " in line}
        assert lines["5 … 10"][-2:] == ["3", "60.0%"]
        assert lines["20 … 50"][-2:] == ["2", "40.0%"]
        assert "5 times" in see.text()
        assert "±" not in see.text()

    look(bus.store, script, start="line")


def test_line_says_how_the_capture_fares(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        text = " ".join(see.text().split())
        assert "recorded to /tmp/x.mcap, 2.0 kB · priority real-time · 4 lost · ended: unplugged" in text
        assert "holds octets back up to 16.0 ms (latency timer)" in text

    look(
        busy_bus.store,
        script,
        start="line",
        live=True,
        recording="/tmp/x.mcap",
        file_size=2000,
        priority="real-time",
        dropped=4,
        ended="unplugged",
    )


def test_line_events_the_newest_first(look: Any, busy_bus: Any) -> None:
    store = busy_bus.store
    store.add_line_event(LineEvent(busy_bus.now, LineEventKind.DROPPED, "", -1))
    store.add_line_event(LineEvent(busy_bus.now + 5 * MS, LineEventKind.NOTE, "[red]\x1b[2Jx"))

    async def script(see: Any) -> None:
        text = see.text()
        assert text.index("note: [red]\\x1b[2Jx") < text.index("dropped (how many is unknown)")
        assert "\x1b" not in text

    look(store, script, (100, 40), "line")


def test_the_curves_of_the_line_hold_all_that_was_heard(make_bus: Any) -> None:
    bus = make_bus()
    for number in range(200):
        bus.ask(1, Verdict.NO_RESPONSE if number % 3 == 2 else Verdict.ANSWERED, latency=20)
    store = bus.store
    shares, errors = curves(store, 10_000)
    seconds = store.load.seconds
    assert [time // 10**9 for time, _ in shares] == list(range(min(seconds), max(seconds)))
    assert all(value == pytest.approx(100 * seconds[time // 10**9].busy / 1e9) for time, value in shares)
    assert sum(value for _, value in errors) == sum(
        count for second, count in store.failed.items() if second < max(seconds)
    )
    few, _ = curves(store, 3)
    assert 1 <= len(few) <= 3


def test_curves_of_a_clock_that_jumped_take_no_longer() -> None:
    """From 1970 to now there are 1.8 thousand million seconds, two of which were heard."""
    heard = {0: Second(busy=10**9), 1_772_359_200: Second(busy=10**9)}
    load = SimpleNamespace(seconds=heard)
    store: Any = SimpleNamespace(load=load, failed={0: 3}, session=SimpleNamespace(has_times=True))
    shares, errors = curves(store, 240)
    assert len(shares) == len(errors) == 239
    assert sum(value > 0 for _, value in shares) == 1 == sum(value > 0 for _, value in errors)


@pytest.mark.parametrize(
    ("ms", "said"), [(0.001, "under 0.01 ms"), (0.123, "0.12 ms"), (12.3, "12 ms"), (1234.5, "1200 ms")]
)
def test_times_to_the_answers_are_no_powers_of_ten(ms: float, said: str) -> None:
    assert _answered(ms) == said


def test_a_short_file_has_the_health_that_every_command_tells(look: Any, make_bus: Any) -> None:
    """A bus that goes on has none before some frames were heard: one damaged of three says nothing yet."""
    bus = make_bus()
    bus.ask(1)
    bus.ask(1, Verdict.EXCEPTION)
    told = []

    async def script(see: Any) -> None:
        await see.poll()
        told.append("health " in see.lines()[0])

    for live in (False, True):
        look(bus.store, script, start="nodes", live=live)
    assert told == [True, False]
