"""`/`: live validity in words, bit by bit over any number of rows, verdicts that come later."""

from __future__ import annotations

import json
from typing import Any

import pytest

from dissectors.frame import Role
from dissectors.tracker import Transaction, Verdict
from sniff.engine.engine import Output
from sniff.filter.completion import Completion
from sniff.tui.prompt import AskedOnce, Prompt
from sniff.tui.view_state import Viewing


async def filter_by(see: Any, text: str) -> None:
    await see.press("slash")
    await see.type(text)
    await see.press("enter")


def shown(see: Any) -> list[int]:
    return [see.main.index[line] for line in range(len(see.main.index))]


def test_validity_is_said_while_typing(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        said = []
        await see.press("slash")
        assert "empty: everything is shown" in see.text()
        for text in ("dst", " =", "=", " 1"):
            await see.type(text)
            said.append(see.lines()[-2 if "valid" in see.lines()[-2] else -3].split(":")[0])
        assert said == ["valid", "invalid", "invalid", "valid"]
        assert len(see.main.index) == 13  # nothing is filtered before enter
        await see.press("enter")
        assert shown(see) == [1, 9, 11]
        assert "filter: dst == 1" in see.lines()[2]
        assert "3 of 13 rows" in see.lines()[2]

    look(busy_bus.store, script)


def test_an_invalid_filter_is_not_taken(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await filter_by(see, "dst = 1")
        assert see.app.screen.query_one(Prompt).is_open
        assert "invalid: " in see.text()
        assert "column" in see.text()
        await see.press("escape")
        assert see.app.viewing.filter == ""
        assert len(see.main.index) == 13
        assert see.app.focused is see.main

    look(busy_bus.store, script)


def test_escape_removes_the_filter(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await filter_by(see, "noise")
        assert shown(see) == [5]
        assert see.main.cursor == 5
        await see.press("escape")
        assert len(see.main.index) == 13
        assert see.main.cursor == 5
        assert "filter:" not in see.text()

    look(busy_bus.store, script)


def test_keys_typed_into_the_filter_do_nothing_else(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("slash")
        await see.type("q2 f?e")
        assert see.app.current_mode == "frames"
        assert not see.app.viewing.frozen
        assert see.app.screen.query_one(Prompt).query_one("Input").value == "q2 f?e"
        assert "/ filter" not in see.lines()[-1]

    look(busy_bus.store, script)


def test_completion(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("slash")
        await see.type("ok && verd")
        await see.press("tab")
        assert see.app.screen.query_one(Prompt).query_one("Input").value == "ok && verdict"

    look(busy_bus.store, script)


def test_nothing_passes(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await filter_by(see, "dst == 99")
        assert "no frame passes the filter" in see.text()
        await see.press("down", "e", "x", "m", "end", "enter", "escape", "escape")
        assert len(see.main.index) == 13

    look(busy_bus.store, script)


def test_hidden_errors_and_partners_are_not_jumped_to(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await filter_by(see, "dst == 3 || dst == 1")
        await see.press("home", "e")
        assert see.main.cursor == 6
        await see.press("e")
        assert see.main.cursor == 9
        await see.press("x")
        assert see.main.cursor == 9
        assert "frame 10 is hidden by the filter or no longer in memory" in see.notices()

    look(busy_bus.store, script)


def test_new_rows_are_filtered_as_they_come(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await filter_by(see, "dst == 2")
        assert shown(see) == [3, 13]
        busy_bus.ask(1)
        busy_bus.ask(2)
        await see.poll()
        assert shown(see) == [3, 13, 16]

    look(busy_bus.store, script)


def test_a_verdict_that_comes_later_brings_its_rows(look: Any, make_bus: Any) -> None:
    bus = make_bus()
    bus.ask(1)
    bus.ask(1, None)  # row 3, open

    async def script(see: Any) -> None:
        await filter_by(see, "verdict == no-response")
        assert shown(see) == []
        request = bus.store.by_no(3)
        closed = Transaction(2, 1, "read", 3, None, Verdict.NO_RESPONSE, request.event.start, request.event.end)
        bus.store.add(Output((), (closed,)))
        await see.poll()
        assert shown(see) == [3]

    look(bus.store, script)


def test_a_filter_while_frozen_stays_below_the_freeze(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("space")
        busy_bus.ask(1)
        await see.poll()
        await filter_by(see, "dst == 1")
        assert shown(see) == [1, 9, 11]
        await see.press("space")
        assert shown(see) == [1, 9, 11, 14]

    look(busy_bus.store, script, live=True)


def test_transactions_are_filtered_by_their_frames(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await filter_by(see, "!ok")
        assert shown(see) == [4]
        assert "1 of 6 transactions" in see.text()
        await see.press("1")
        assert "filter: !ok" in see.text()

    look(busy_bus.store, script, start="transactions")


@pytest.mark.parametrize("start", ["frames", "transactions"])
def test_the_filter_searches_from_the_cursor_outwards(look: Any, make_bus: Any, start: str) -> None:
    bus = make_bus()
    for station in range(1000):
        bus.ask(station % 5 + 1)

    async def script(see: Any) -> None:
        await see.press("end")
        tested: list[int] = []
        real = Viewing.accepts_row

        def counting(viewing: Viewing, no: int) -> bool:
            tested.append(no)
            return real(viewing, no)

        Viewing.accepts_row = counting  # type: ignore[method-assign]
        try:
            see.app.filter("n2.address == 3")  # no column holds it
            assert len(tested) < 600  # one step, not all 2000
            assert min(tested) > 1000  # and that near the cursor
            await see.settle()
        finally:
            Viewing.accepts_row = real  # type: ignore[method-assign]
        assert see.main.index.pending == 0
        assert len(see.main.index) == (400 if start == "frames" else 200)  # requests and answers

    look(bus.store, script, start=start)


def test_data_only_hides_tokens_and_polls(look: Any, make_bus: Any) -> None:
    bus = make_bus()
    bus.ask(1)
    for role in (Role.TOKEN, Role.POLL, Role.DATA):
        bus.store.add(Output((bus.row(bus.frame(b"\x01\x03\x00"), 9, role),)))
    bus.noise()

    async def script(see: Any) -> None:
        await see.press("d")
        assert shown(see) == [1, 2, 5, 6]
        await see.press("d")
        assert shown(see) == [1, 2, 3, 4, 5, 6]

    look(bus.store, script)


def test_what_may_come_next_is_offered(look: Any, busy_bus: Any) -> None:
    """Fields, then operators, then values with how many rows have them."""

    async def script(see: Any) -> None:
        await see.press("slash")
        await see.type("dst ")
        assert "==  !=  <" in see.text()
        await see.type("== ")
        assert "1 ×3" in see.text()
        await see.type("1 ")
        assert "&&  ||" in see.text()
        await see.press("enter")
        assert see.app.viewing.filters == ["dst == 1"]
        await see.press("escape")
        await see.press("slash")
        await see.press("up")
        assert "dst == 1" in see.text()

    look(busy_bus.store, script)


def test_find_next_and_before(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home")
        await see.press("n")
        await see.type("noise")
        await see.press("enter")
        first = see.main.cursor
        assert "noise" in see.app.store.text(see.app.store.by_no(first))
        await see.press("home")
        await see.press("n")
        assert see.main.cursor == first
        await see.press("end")
        await see.press("N")
        assert see.main.cursor == first

    look(busy_bus.store, script)


def test_the_same_keys_find_in_transactions_and_in_tables(look: Any, make_bus: Any) -> None:
    bus = make_bus()
    for station in (1, 2, 3, 2, 1):
        bus.ask(station)

    async def script(see: Any) -> None:
        await see.press("2")
        await see.press("home")
        await see.press("n")
        await see.type("3 ←")
        await see.press("enter")
        assert see.app.store.closed_by_no(see.main.cursor).station == 3
        await see.press("3")
        table = see.app.screen.query_one("#main")
        see.app.viewing.search = "3"
        await see.press("home")
        await see.press("n")
        assert "3" in table.get_row_at(table.cursor_row)[0].plain

    look(bus.store, script)


def test_what_is_shown_is_saved(look: Any, busy_bus: Any, tmp_path: Any) -> None:
    names = "shown.cap.txt", "shown.csv", "shown.json", "shown.txt"

    async def script(see: Any) -> None:
        await filter_by(see, "dst == 1")
        for name in names:
            await see.press("w")
            await see.type(str(tmp_path / name))
            await see.press("enter")

    look(busy_bus.store, script)
    capture, table, objects, lines = ((tmp_path / name).read_text().splitlines() for name in names)
    assert sum(line[:1].isdigit() or line[:1] == "+" for line in capture) >= 3
    assert table[0].startswith("no,t,start_ns,")
    assert len(table) - 1 == len(objects) == len(lines) >= 3
    assert {json.loads(line)["dst"] for line in objects} == {1}
    assert all(" read" in line for line in lines)


def test_what_is_alike_is_shown_with_one_key(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home")
        await see.press("equals_sign")
        assert see.app.viewing.filter.startswith("kind == read && addr == ")

    look(busy_bus.store, script)


def test_saved_filters_by_name_and_colours(look: Any, busy_bus: Any, tmp_path: Any, monkeypatch: Any) -> None:
    (tmp_path / "sniff485.toml").write_text('[filters]\nfirst = "dst == 1"\n[colours]\nmagenta = "dst == 1"\n')
    monkeypatch.chdir(tmp_path)

    async def script(see: Any) -> None:
        await see.press("F")
        await see.type("frist")
        await see.press("enter")
        assert "no filter of that name: first" in see.text()
        await see.press("escape")
        await see.press("F")
        await see.type("first")
        await see.press("enter")
        assert shown(see) == [1, 9, 11]
        store = see.app.store
        row = store.by_no(1)
        assert see.app.viewing.colour_of(row, store.transaction(row)) == "magenta"

    look(busy_bus.store, script)


def test_how_a_filter_may_go_on_is_worked_out_once_for_a_text() -> None:
    asked: list[str] = []

    def complete(text: str) -> list[Completion]:
        asked.append(text)
        return [Completion(text + "0", text + "0", None)]

    ways = AskedOnce(complete)
    assert [ways(text)[0].text for text in ("a", "a", "ab", "a")] == ["a0", "a0", "ab0", "a0"]
    assert asked == ["a", "ab", "a"]
