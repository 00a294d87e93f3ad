"""What comes from the wire, a file or a plug-in is text, never markup, never a command to the terminal."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from dissectors.tracker import Transaction, Verdict
from sniff.bus.rows import Store
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, LineEventKind

HOSTILE = "[bold red]x[/] [@click=app.quit]y[/] \x1b[2J\x1b]0;t\x07 \u202eabc \r\n\x00\x9b31m {None} \ud800"


@pytest.fixture
def hostile(busy_bus: Any) -> Store:
    store = busy_bus.store
    dissector = replace(
        store.dissector,
        text=lambda frame, header, role: HOSTILE,
        fields=lambda frame, role: {HOSTILE: HOSTILE},
        packet=lambda frame, role: (_ for _ in ()).throw(ValueError(HOSTILE)),
    )
    store.model.dissector = dissector
    store.model.session = replace(
        store.session,
        port=HOSTILE,
        adapter=replace(store.session.adapter, name=HOSTILE, driver=HOSTILE, detail=HOSTILE, reports=(HOSTILE,)),
    )
    request = store.by_no(13)
    store.add(
        Output((), (Transaction(8, 2, HOSTILE, 13, None, Verdict.EXCEPTION, request.event.start, 0, error=HOSTILE),))
    )
    store.add_line_event(LineEvent(busy_bus.now, LineEventKind.NOTE, HOSTILE))
    return store


def test_nothing_hostile_reaches_the_terminal(look: Any, hostile: Store) -> None:
    async def script(see: Any) -> None:
        for keys in (
            ["1", "end", "enter", "down", "down"],
            ["2", "end"],
            ["3"],
            ["8", "end"],
            ["9", "end"],
            ["question_mark"],
        ):
            await see.press(*keys)
            for line in see.lines():
                assert line.isprintable(), line
            if keys[0] in "12":
                assert "[bold red]x[/] [@cl" in see.text()
        assert see.app.is_running

    look(hostile, script, (160, 40), live=True, recording=HOSTILE, ended=HOSTILE, priority=HOSTILE)


def test_markup_in_a_row_has_no_effect(look: Any, hostile: Store) -> None:
    async def script(see: Any) -> None:
        row = see.main.render_line(1)
        styled = {segment.style.meta.get("@click") for segment in row if segment.style}
        assert styled == {None}
        assert "[bold red]x[/] [@click=app.quit]y[/] \\x1b[2J\\x1b]0;t\\x07 \\u202eabc" in "".join(
            segment.text for segment in row
        )

    look(hostile, script, (250, 40))


def test_a_hostile_filter_is_only_text(look: Any, hostile: Store) -> None:
    async def script(see: Any) -> None:
        see.app.filter('text contains "[red]"')
        await see.settle()
        assert 'filter: text contains "[red]"' in see.text()
        see.app.filter("[red\x1b")
        await see.settle()
        assert all(line.isprintable() for line in see.lines())
        assert any("[" in notice for notice in see.notices())

    look(hostile, script)
