"""What keys do on every screen, going back, quitting, help, palette, themes, status."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from textual.widgets import Static

from sniff.bus.feed import FeedStatus, StoreFeed
from sniff.tui import run
from sniff.tui.header import SHORT_TITLES, SHORTEST
from sniff.tui.help import HelpScreen
from sniff.tui.keybar import explanation, working_keys
from sniff.tui.palette import ActionCommands
from sniff.tui.screens import SCREENS, load
from sniff.tui.screens.base import ViewScreen
from sniff.tui.seats import PATH, with_step


def test_every_screen_of_the_table_is_there(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        for entry in SCREENS:
            screen = load(entry)
            assert issubclass(screen, ViewScreen)
            assert entry.title == screen.TITLE
            await see.press(entry.key)
            assert see.app.current_mode == entry.name
            shown = SHORT_TITLES.get(entry.title, entry.title)
            assert f"[{entry.key} {shown}]" in see.lines()[1]
            for other in SCREENS:
                assert f"{other.key} {other.title}"[:SHORTEST] in see.lines()[1]
            assert see.app.focused is see.main
            assert see.lines()[-1].endswith("? help  q back")

    look(busy_bus.store, script)


def test_style_sheets_of_screens_touch_nothing_else() -> None:
    """A rule outside a block with the screen's name would change all screens once this one was shown."""
    for entry in SCREENS:
        screen = load(entry)
        path = Path(sys.modules[screen.__module__].__file__).parent / (vars(screen).get("CSS_PATH") or "none")
        if path.is_file():
            outer = [line for line in path.read_text().splitlines() if line.endswith("{") and not line.startswith(" ")]
            assert outer
            assert all(line.startswith(f"{screen.__name__} ") for line in outer), path.name


def test_an_unknown_start_screen_is_refused(busy_bus: Any) -> None:
    from sniff.tui.app import SnifferApp

    with pytest.raises(ValueError, match="expected one of frames, transactions"):
        SnifferApp(StoreFeed(busy_bus.store), "nothing")


def test_back_walks_the_screens_and_then_quits(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("2", "3", "9", "2")
        for before in ("line", "nodes", "transactions", "frames"):
            await see.press("q")
            assert see.app.current_mode == before
            assert not see.app._exit
        await see.press("q")
        assert see.app._exit

    look(busy_bus.store, script)


@pytest.mark.parametrize("key", ["2", "3"])
def test_back_from_the_frames_of_something_goes_to_it(look: Any, busy_bus: Any, key: str) -> None:
    async def script(see: Any) -> None:
        await see.press(key)
        came_from = see.app.current_mode
        await see.press("enter")
        assert see.app.current_mode == "frames"
        await see.press("q")
        assert see.app.current_mode == came_from
        await see.press("q")
        assert see.app.current_mode == "frames"
        assert not see.app._exit

    look(busy_bus.store, script)


def test_the_way_back_stays_short() -> None:
    path = ["frames"]
    for _ in range(20):
        path = with_step(with_step(path, "nodes"), "frames")
    assert path == ["frames", "nodes", "frames"]
    for number in range(20):
        path = with_step(path, f"screen {number}")
    assert path == [f"screen {number}" for number in range(20 - PATH, 20)]


def test_quitting_a_recording_takes_two(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("q")
        assert not see.app._exit
        assert see.notices() == ["recording to /tmp/x.mcap; q again stops it and quits"]
        await see.press("q")
        assert see.app._exit

    look(busy_bus.store, script, live=True, recording="/tmp/x.mcap")


def test_watching_without_recording_quits_at_once(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("q")
        assert see.app._exit

    look(busy_bus.store, script, live=True)


def test_help_lists_every_key_that_works_here(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        for screen in ("1", "2", "3", "8", "9"):
            await see.press(screen)
            keys = working_keys(see.app.screen)
            await see.press("question_mark")
            assert isinstance(see.app.screen, HelpScreen)
            console = see.app.console
            shown = "\n".join(
                "".join(segment.text for segment in line)
                for static in see.app.screen.query(Static)
                for line in console.render_lines(static.content, console.options.update(width=100))
            )
            for name, active in keys:
                assert name in shown
                assert explanation(active) in shown
            await see.press("escape")
            assert isinstance(see.app.screen, ViewScreen)

    look(busy_bus.store, script, (100, 60))


def test_the_palette_lists_every_action_and_does_it(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        provider = ActionCommands(see.app.screen)
        found = [hit async for hit in provider.discover()]
        assert {hit.display for hit in found} == {explanation(active) for _, active in working_keys(see.app.screen)}
        await next(hit for hit in found if "freeze" in str(hit.display)).command()
        assert see.app.viewing.frozen
        hits = [hit async for hit in provider.search("next mark")]
        assert hits
        await see.press("ctrl+p")
        assert "Search" in see.text()

    look(busy_bus.store, script, live=True)


def test_every_key_is_explained() -> None:
    for entry in SCREENS:
        for binding in load(entry).BINDINGS:
            assert binding.description
            assert binding.tooltip or not binding.show


def test_themes(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        assert see.app.current_theme.dark
        dark = see.text()
        await see.press("T")
        assert not see.app.current_theme.dark
        assert see.text() == dark

    look(busy_bus.store, script)


def test_the_end_is_told_once_and_stays_in_the_header(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        see.feed.current = FeedStatus("/dev/ttyUSB0", "19200,8E1", "toy", "/x", 10, live=True, ended="un[b]plugged\x1b")
        await see.poll()
        await see.poll()
        assert see.notices() == ["un[b]plugged\\x1b"]
        assert "ENDED" in see.lines()[0]

    look(busy_bus.store, script, live=True)


def test_any_size_of_terminal(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        for width, height in [(20, 5), (40, 10), (200, 60)]:
            await see.pilot.resize_terminal(width, height)
            for key in ("2", "3", "8", "9", "1", "enter", "question_mark", "escape", "slash", "escape"):
                await see.press(key)
                assert len(see.lines()) == height
                assert all(len(line) <= width for line in see.lines())

    look(busy_bus.store, script)


def test_resizing_keeps_the_cursor_in_sight(look: Any, busy_bus: Any) -> None:
    for _ in range(100):
        busy_bus.ask(1)

    async def script(see: Any) -> None:
        await see.press("end")
        await see.pilot.resize_terminal(120, 12)
        await see.settle()
        assert any(line.startswith(">") for line in see.lines())
        await see.pilot.resize_terminal(70, 40)
        await see.settle()
        assert any(line.startswith(">") for line in see.lines())

    look(busy_bus.store, script)


def test_mouse(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("home")
        await see.pilot.click("#main", offset=(20, 4))
        await see.settle()
        assert see.main.cursor == 4
        await see.pilot.click("KeyBar", offset=(12, 0))  # "space freeze"
        await see.settle()
        assert see.app.viewing.frozen
        await see.pilot.click("HexPane", offset=(5 + 3 * 2, 1))
        await see.settle()
        assert "octet 2 of 6" in see.text()

    look(busy_bus.store, script, live=True)


def test_run_closes_the_feed_and_says_where_the_file_is(
    busy_bus: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from sniff.tui.app import SnifferApp

    monkeypatch.setattr(SnifferApp, "run", lambda app: None)
    feed = StoreFeed(busy_bus.store, FeedStatus("/dev/ttyUSB0", "19200,8E1", "toy", "/tmp/a\x1b.mcap", live=True))
    run(feed)
    assert feed.closed
    assert capsys.readouterr().out == "recorded to /tmp/a\\x1b.mcap\n"

    def crash(app: Any) -> None:
        raise RuntimeError("broken")

    monkeypatch.setattr(SnifferApp, "run", crash)
    feed = StoreFeed(busy_bus.store)
    with pytest.raises(RuntimeError):
        run(feed)
    assert feed.closed


def test_importing_the_package_loads_no_textual() -> None:
    import subprocess

    code = (
        "import sys, sniff.tui, sniff.bus.feed; sys.exit(any(m in sys.modules for m in ('textual', 'scapy', 'rich')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_file_cannot_be_frozen(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("space")
        assert "FROZEN" not in see.lines()[0]
        assert see.notices() == ["a file stands still: there is nothing to freeze"]

    look(busy_bus.store, script)


def test_a_frozen_view_goes_on_after_the_end(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("space")
        assert "FROZEN" in see.lines()[0]
        see.feed.current = replace(see.feed.current, ended="asked to")
        await see.poll()
        await see.press("space")
        assert "FROZEN" not in see.lines()[0]
        await see.press("space")
        assert "FROZEN" not in see.lines()[0]

    look(busy_bus.store, script, live=True)


@pytest.mark.parametrize(("key", "said"), [("4", "pinned to the top"), ("7", "95th percentile"), ("1", "err")])
def test_help_explains_marks_and_titles(look: Any, busy_bus: Any, key: str, said: str) -> None:
    async def script(see: Any) -> None:
        await see.press(key, "question_mark")
        assert said in see.text()

    look(busy_bus.store, script, (100, 80))


def test_a_small_screen_shows_a_list_and_says_that_more_is_left_out(look, busy_bus):
    async def script(see):
        assert see.notices() == ["40×12 is small: much is left out, 80×24 shows it"]
        for key in "12345":
            await see.press(key)
            await see.poll()
            assert "help" in see.lines()[-1]  # nothing floats
            if key in "123":
                assert see.main.size.height >= 3
        await see.press("1")
        assert not see.app.screen.query_one("HexPane").display
        await see.pilot.resize_terminal(80, 24)
        await see.settle()
        assert see.app.screen.query_one("HexPane").display

    look(busy_bus.store, script, (40, 12))
