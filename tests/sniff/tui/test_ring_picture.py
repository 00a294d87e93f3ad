"""The token ring drawn as one, for rings of all sizes and widths."""

from __future__ import annotations

from typing import Any

import pytest
from rich.cells import cell_len

from sniff.bus.offline import outputs
from sniff.bus.rows import Store
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe
from sniff.simulation.scenarios import scenario, simulate
from sniff.tui.ring_picture import ring_picture, share_bars


def test_the_token_goes_round() -> None:
    assert ring_picture([1, 2, 5, 9], "MAC", 78, "13 ms") == [
        "┌──▶ 1 ──▶ 2 ───┐",
        "│     13 ms     │",
        "└─── 9 ◀── 5 ◀──┘",
    ]
    assert ring_picture([7], "MAC", 78) == ["MAC 7 alone passes the token to itself: 7 ↻"]
    assert ring_picture([], "MAC", 78) == []


@pytest.mark.parametrize("count", range(2, 33))
def test_a_ring_fits_and_names_everybody(count: int) -> None:
    masters = list(range(96, 96 + count))
    for width in (76, 120):
        lines = ring_picture(masters, "MAC", width)
        assert all(str(mac) in " ".join(lines) for mac in masters)
        if len(lines) == 3:
            assert {cell_len(line) for line in lines} == {cell_len(lines[0])}
            assert cell_len(lines[0]) <= width


def test_bars_are_as_long_as_the_share() -> None:
    lines = share_bars({1: 0.25, 9: 0.5}, "MAC", 76)
    assert [line.split()[1] for line in lines] == ["9", "1"]
    assert lines[0].count("█") == 2 * lines[1].count("█") == 30


@pytest.mark.parametrize("name", ["mstp", "profibus"])
def test_each_protocol_has_its_own_titles_over_its_own_values(look: Any, name: str) -> None:
    session, items = simulate(scenario(name), 3)
    store = Store(session, dissector_for(session))
    observe(outputs(items, session), store)
    shown = store.dissector.ring
    assert shown is not None
    rows = shown.rows(store.model.ring())

    async def script(see: Any) -> None:
        await see.press("7")
        titles = [column.label.plain for column in see.main.ordered_columns]
        first = dict(zip(titles, (cell.plain for cell in see.main.get_row_at(0)), strict=True))
        assert first["tok."] == str(rows[0][shown.headings.index("tokens")])
        assert first["next"] == str(rows[0][shown.headings.index("next")])
        assert "◀──" in see.text()
        assert not set(store.nodes.absent()) & {int(key.value) for key in see.main.rows}
        await see.press("3")
        listed = {int(str(key.value)) for key in see.main.rows}
        assert not listed & set(store.nodes.absent())

    look(store, script)
