"""Screen 1: the keys do what they say; list, tree and hex are linked."""

from __future__ import annotations

from typing import Any

import pytest

from sniff.tui.field_tree import FieldTree
from sniff.tui.hex_pane import HexPane


def test_moving(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        cursors = []
        for key in ("home", "down", "j", "up", "k", "pagedown", "end", "g", "G", "pageup"):
            await see.press(key)
            cursors.append(see.main.cursor)
        assert cursors == [1, 2, 3, 2, 1, 12, 13, 1, 13, 2]
        await see.press("home")
        assert [line[0] for line in see.lines()[3:6]] == [">", "=", " "]  # cursor, its partner

    look(busy_bus.store, script)


def test_errors_forth_and_back(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home")
        found = []
        for key in ("e", "e", "e", "e", "e", "e", "E", "E", "E", "E", "E"):
            await see.press(key)
            found.append(see.main.cursor)
        assert found == [5, 6, 7, 8, 9, 9, 8, 7, 6, 5, 5]
        assert see.notices() == ["no error after this row", "no error before this row"]
        see.app.filter("addr == 3")
        await see.press("end", "e", "E", "2", "E", "e")
        assert see.notices()[2:] == [
            "no error after this row passes the filter",
            "no error before this row passes the filter",
            "no trouble before this one",
            "no trouble after this one passes the filter",
        ]

    look(busy_bus.store, script)


def test_partner(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home", "x")
        assert see.main.cursor == 2
        await see.press("x")
        assert see.main.cursor == 1
        await see.press("e", "e", "x")  # no answer: nothing to jump to
        assert see.main.cursor == 6
        assert see.notices() == ["no partner: no answer"]

    look(busy_bus.store, script)


def test_marks(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home", "m", "enter", "down", "down", "m")
        await see.type("gate opens")
        await see.press("enter", "down", "apostrophe")
        assert see.main.cursor == 1
        await see.press("apostrophe")
        assert see.main.cursor == 3
        assert see.lines()[3][1] == see.lines()[5][1] == "*"
        assert "[gate opens] " in see.lines()[5]
        await see.press("home", "quotation_mark")
        assert "gate opens" in see.text()
        assert "2 marks" in see.text()
        await see.press("down", "enter")
        assert see.main.cursor == 3
        await see.press("M", "apostrophe", "apostrophe")
        assert see.main.cursor == 1
        assert see.app.viewing.marks == {1: ""}

    look(busy_bus.store, script)


def test_time_modes(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home")
        shown = []
        for _ in range(4):
            shown.append(see.lines()[5].split()[1])
            await see.press("t")
        assert shown[0] == shown[3] == "10:00:00.034"
        assert shown[1] == "+0.034502"
        assert shown[2] == "+0.023437"

    look(busy_bus.store, script)


def test_delta_is_to_the_row_shown_before(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("t", "t", "slash")
        await see.type("dst==1")
        await see.press("enter", "home")
        first, second = (see.main.cells(number, line) for line, number in enumerate([1, 9]))
        assert first["time"].text == "+0.000000"
        gap = busy_bus.store.by_no(9).event.start - busy_bus.store.by_no(1).event.start
        assert float(second["time"].text) == pytest.approx(gap / 1e9, abs=1e-6)

    look(busy_bus.store, script)


def test_freeze_holds_the_view_and_counts(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("space")
        before = see.lines()[2:14]
        for _ in range(5):
            busy_bus.ask(1)
        await see.poll()
        assert see.lines()[2:14] == before
        assert "FROZEN +10" in see.lines()[0]
        await see.press("space")
        assert see.main.cursor == 23
        assert "FOLLOW" in see.lines()[0]
        assert see.feed.store is busy_bus.store

    look(busy_bus.store, script, live=True)


def test_following_ends_with_a_move_and_begins_with_f(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        busy_bus.ask(1)
        await see.poll()
        assert see.main.cursor == 15
        await see.press("up")
        busy_bus.ask(1)
        await see.poll()
        assert see.main.cursor == 14
        assert "FOLLOW OFF" in see.lines()[0]
        await see.press("f")
        assert see.main.cursor == 17
        busy_bus.ask(1)
        await see.poll()
        assert see.main.cursor == 19

    look(busy_bus.store, script, live=True)


def test_a_file_is_not_followed(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        assert see.main.cursor == 1
        busy_bus.ask(1)
        await see.poll()
        assert see.main.cursor == 1
        await see.press("f")
        assert see.notices() == ["a file stands still: there is nothing to follow"]

    look(busy_bus.store, script)


def test_go_to(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("colon")
        await see.type("11")
        await see.press("enter")
        assert see.main.cursor == 11
        await see.press("colon")
        await see.type("10:00:00.1")
        await see.press("enter")
        assert see.main.cursor == 6
        await see.press("colon")
        await see.type("x")
        await see.press("enter")
        assert "invalid: expected a row number" in see.text()
        await see.press("escape")
        assert see.main.cursor == 6
        assert see.app.focused is see.main

    look(busy_bus.store, script)


def test_fields_select_their_octets(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home", "enter")
        tree, octets = see.app.screen.query_one(FieldTree), see.app.screen.query_one(HexPane)
        assert see.app.focused is tree
        assert octets.octets == bytes([1, 3, 0, 7, 99])
        spans = []
        for _ in range(4):
            await see.press("down")
            spans.append((octets.field_name, octets.span))
        assert spans == [("station", (0, 1)), ("function", (1, 2)), ("register", (2, 4)), ("sum", (4, 5))]
        await see.press("up")
        assert "octets 2–3 of 5: register" in see.text()

    look(busy_bus.store, script)


def test_octets_select_their_field(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home", "tab", "tab")
        tree, octets = see.app.screen.query_one(FieldTree), see.app.screen.query_one(HexPane)
        assert see.app.focused is octets
        names = []
        for key in ("right", "right", "right", "right", "right", "left", "home"):
            await see.press(key)
            names.append((octets.cursor, tree.picked.name))
        assert names == [
            (1, "function"),
            (2, "register"),
            (3, "register"),
            (4, "sum"),
            (4, "sum"),
            (3, "register"),
            (0, "station"),
        ]
        await see.press("escape")
        assert see.app.focused is see.main

    look(busy_bus.store, script)


def test_the_selected_octets_are_in_reverse_video(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home", "enter", "down", "down", "down")
        octets = see.app.screen.query_one(HexPane)
        reverse = [segment.text for segment in octets.render_line(1) if segment.style.reverse]
        assert "".join(reverse) == "00 07.."

    look(busy_bus.store, script)


def test_the_tree_keeps_its_field_from_frame_to_frame(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        tree = see.app.screen.query_one(FieldTree)
        await see.press("home", "enter", "down", "down", "down")
        await see.press("escape", "down", "down")
        assert see.main.cursor == 3
        assert tree.picked.name == "register"

    look(busy_bus.store, script)


def test_line_errors_are_letters_and_words(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("colon", "8", "enter")
        assert "04 03 12E34 56 4D" in see.text()
        assert "octet 2: parity or framing" in see.text()
        await see.press("colon", "5", "enter")
        assert "00BFF" in see.text()
        assert "octet 0: break" in see.text()
        assert any("~B" in line for line in see.lines())

    look(busy_bus.store, script)


def test_zoom_and_copy(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        octets, tree = see.app.screen.query_one(HexPane), see.app.screen.query_one(FieldTree)
        await see.press("home", "tab", "tab", "z")
        assert octets.size.width >= 78
        assert octets.size.height == 24 - 2 - 1  # header and keys stay
        assert see.lines()[0].startswith("/dev/ttyUSB0")
        assert see.lines()[-1].endswith("q back")
        assert see.notices() == ["z or esc: back to all panes"]
        await see.press("z")
        assert see.main.size.height > 5
        assert tree.size.height == octets.size.height < 12
        await see.press("z", "escape")
        assert see.main.size.height > 5
        assert see.app.focused is octets
        await see.press("escape", "z")
        assert see.main.size.height == 21
        await see.press("enter")
        assert see.app.focused is tree
        assert tree.size.height < 12
        await see.press("y")
        assert see.app.clipboard == "01 03 00 07 63"

    look(busy_bus.store, script)


def test_rows_dropped_from_memory_leave_the_view_where_it_is(look: Any, make_bus: Any) -> None:
    bus = make_bus(keep=200)
    for _ in range(100):
        bus.ask(1)

    async def script(see: Any) -> None:
        await see.press("end")
        before = see.lines()[3:13]
        for _ in range(20):
            bus.ask(2)
        await see.poll()
        assert bus.store.first_no > 1
        assert see.main.cursor == 200
        assert [line.split()[0] for line in before] == [line.split()[0] for line in see.lines()[3:13]]
        await see.press("home")
        assert see.main.cursor == bus.store.first_no
        await see.press("9")
        gone = bus.store.dropped_rows
        assert f"{gone} older ones had to go, the file has them" in " ".join(see.text().split())

    look(bus.store, script)


def test_an_empty_bus_says_so(look: Any, make_bus: Any) -> None:
    async def script(see: Any) -> None:
        assert "no frames in this file" in see.text()
        await see.press("e", "x", "m", "apostrophe", "enter", "down", "end", "y", "2", "enter", "e", "3", "enter", "9")
        assert "none: not unplugged" in see.text()

    look(make_bus().store, script)


def test_the_panes_say_which_row_they_show_and_y_copies_that(
    look: Any, busy_bus: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def script(see: Any) -> None:
        octets = see.app.screen.query_one(HexPane)
        assert octets.title() == "row 13 · 5 octets"
        monkeypatch.setattr("sniff.tui.screens.frames.FOLLOWING_SECONDS", 1000)  # as on a loaded machine
        busy_bus.ask(7)
        see.app.poll()
        await see.pilot.pause(0.05)
        assert see.main.cursor == 15
        assert octets.title() == "row 13 · 5 octets"
        see.app.screen.action_copy()
        assert see.app.clipboard == "02 03 00 07 63"
        await see.pilot.pause(0)
        assert see.notices()[-1].startswith("frame 13 copied")
        see.app.viewing.follow = False
        see.app.screen.action_copy()
        assert octets.title() == "row 15 · 6 octets"
        assert see.app.clipboard == "07 03 12 34 56 4D"

    look(busy_bus.store, script, live=True)


def test_no_row_is_not_an_empty_row(look: Any, make_bus: Any, busy_bus: Any) -> None:
    async def nothing(see: Any) -> None:
        assert "no row" in see.text()
        assert "0 octets" not in see.text()

    look(make_bus().store, nothing)

    async def at_once(see: Any) -> None:
        assert see.app.screen.query_one(HexPane).row == 1

    look(busy_bus.store, at_once)


def test_the_title_says_how_time_is_counted_and_how_sure_latencies_are(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        titles = []
        for _ in range(3):
            titles.append(see.lines()[2])
            await see.press("t")
        assert [title[6:20].strip() for title in titles] == ["time", "s from start", "s from last"]
        assert all("ms ±16" in title for title in titles)
        assert see.notices()[0] == "time: seconds since the capture began"
        assert "(−0/+16)" not in "".join(see.lines()[2:14])

    look(busy_bus.store, script)


@pytest.mark.parametrize(("width", "shown", "gone"), [(60, ["time", "what"], ["ms ±16"]), (50, ["what"], ["time"])])
def test_narrow_lists_keep_what_rows_say(
    look: Any, busy_bus: Any, width: int, shown: list[str], gone: list[str]
) -> None:
    async def script(see: Any) -> None:
        for key in "1", "2":
            await see.press(key)
            titles = see.lines()[2]
            assert all(title in titles for title in shown)
            assert not any(title in titles for title in gone)

    look(busy_bus.store, script, (width, 24))


def test_a_live_bus_may_still_bring_frames(look: Any, make_bus: Any) -> None:
    async def script(see: Any) -> None:
        assert "no frames yet" in see.text()

    look(make_bus().store, script, live=True)


def test_what_is_shown_of_an_earlier_row_says_so_while_following(
    look: Any, busy_bus: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def script(see: Any) -> None:
        details = see.app.screen.query_one("#details")
        assert details.border_title == "row 13"
        monkeypatch.setattr("sniff.tui.screens.frames.FOLLOWING_SECONDS", 1000.0)  # the tree waits
        busy_bus.ask(1)
        see.app.poll()
        assert details.border_title == "row 13 …, the list is ahead"
        see.app.shown._show_detail()
        assert details.border_title == "row 15"

    look(busy_bus.store, script, live=True)
