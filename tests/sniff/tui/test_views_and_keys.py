"""Columns chosen and ordered, views by name in the configuration, other keys, shown as they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from sniff.config import FILE, ConfigError, View, load, save_view
from sniff.engine.session import LineEventKind
from sniff.tui.guest import GUEST
from sniff.tui.key_names import KNOWN, name_of
from sniff.tui.keybar import explanation, key_name, working_keys


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "user"))


def test_columns_are_chosen_and_ordered(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("C")
        await see.press("ctrl+u")
        await see.type("text no bogus")
        assert "no column 'bogus'" in see.text()
        await see.press("ctrl+u")
        await see.type("len text no")
        await see.press("enter")
        assert see.lines()[2].split() == ["len", "what", "no"]
        await see.press("C", "ctrl+u", "enter")
        assert see.lines()[2].split()[:2] == ["no", "time"]

    look(busy_bus.store, script)


def test_a_view_is_saved_and_shown_by_its_name(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        see.app.viewing.columns["frames"] = ("time", "text")
        see.app.filter("addr == 1")
        await see.press("t", "V")
        await see.type("ones")
        await see.press("enter")
        saved = load().views["ones"]
        assert saved == View({"frames": ("time", "text")}, "relative", "addr == 1")
        see.app.viewing.columns.clear()
        see.app.filter("")
        await see.press("t", "t", "V")
        await see.type("ones")
        await see.press("enter")
        assert see.lines()[3].split()[-1] == "what" or see.lines()[2].split()[-1] == "what"
        assert see.app.viewing.filter == "addr == 1"
        assert "s from start" in see.text()

    look(busy_bus.store, script)


def test_a_view_is_added_to_the_configuration_that_is_there(tmp_path: Path) -> None:
    config = tmp_path / FILE
    config.write_text('[filters]\nslow = "latency_ms > 50ms"')
    view = View({"transactions": ("tx", "kind")}, "delta", 'kind contains "write"')
    assert save_view("odd-one", view) == config
    assert load().views == {"odd-one": view}
    assert load().filters == {"slow": "latency_ms > 50ms"}
    with pytest.raises(ConfigError, match="is there already"):
        save_view("odd-one", view)
    with pytest.raises(ConfigError, match="letters"):
        save_view("a b", view)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[view.a]\ntime = "abs"', "unknown time 'abs'; did you mean 'absolute'"),
        ('[view.a]\nframes = "no"', "expected names of columns"),
        ("[view.a]\ncolumns = []", "unknown key 'columns'"),
        ('[view.a]\nfilter = "adr == 1"', "adr"),
        ("[keys]\nmark = 3", "expected a text in quotes"),
    ],
)
def test_what_is_wrong_in_a_view_is_said(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / FILE).write_text(text)
    with pytest.raises(ConfigError, match=said):
        load()


def test_other_keys_work_and_are_shown(look: Any, busy_bus: Any, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text('[keys]\nfreeze = "z"\nzoom = "Z"\nerror = "ctrl+n"\nmak = "b"\n')

    async def script(see: Any) -> None:
        assert "[keys] unknown name 'mak'; did you mean 'mark'?" in see.notices()
        assert "z freeze" in see.lines()[-1]
        assert "E/^n error" in see.lines()[-1]
        await see.press("space")
        assert not see.app.viewing.frozen
        await see.press("home", "ctrl+n")
        assert see.main.cursor == 5
        await see.press("z")
        assert see.app.viewing.frozen
        shown = {key: explanation(active) for key, active in working_keys(see.app.shown)}  # what ? lists
        assert shown["z"].startswith("freeze the view")
        assert "space" not in shown

    look(busy_bus.store, script, live=True)


def test_names_of_keys() -> None:
    assert name_of("find_on(-1)") == "find_on-back"
    assert name_of("error(1)") == "error"
    assert name_of("switch('frames')") == "switch-frames"
    assert name_of("app.follow") == "follow"
    assert name_of("move(-20)") == "move-back20"
    assert {"freeze", "help", "go_back", "switch-line"} <= KNOWN


def test_who_looks_from_elsewhere_keeps_nothing_here(look: Any, busy_bus: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(GUEST, "1")

    async def script(see: Any) -> None:
        await see.press("V")
        await see.type("ones")
        await see.press("enter")
        await see.press("m")
        await see.type("strange")
        await see.press("enter")
        assert not load().views
        assert not any(event.kind is LineEventKind.MARK for event in busy_bus.store.line_events)

    look(busy_bus.store, script)


def test_keys_are_written_as_they_are_on_the_keyboard():
    named = {"equals_sign": "=", "quotation_mark": '"', "slash": "/", "escape": "esc", "ctrl+q": "^q", "f8": "f8"}
    assert {key: key_name(key) for key in named} == named
    plain = {"e": "e", "E": "E", "space": "space", "pageup": "page up", "left": "left"}
    assert {key: key_name(key) for key in plain} == plain
