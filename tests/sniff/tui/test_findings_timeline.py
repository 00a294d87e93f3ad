"""Screens 5 and 6 over real findings: a Modbus bus with an absent station and noise, in simulated time."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dissectors.findings import Severity
from dissectors.line import NS_PER_S
from dissectors.registry import get
from dissectors.simulated_faults import LostResponse
from sniff.bus.offline import outputs
from sniff.bus.rows import Store
from sniff.engine.observer import observe
from sniff.engine.session import LineEvent, LineEventKind
from sniff.simulation.scenarios import simulate
from sniff.tui.timeline_picture import LABEL
from sniff.tui.view_state import Viewing
from tests.faults.buses import modbus

START = 1_772_359_200_000_000_000


@pytest.fixture(scope="module")
def store() -> Store:
    plan = modbus((LostResponse(0.1, ("unit 2",)),), absent=(4,), seed=3)
    session, items = simulate(plan, 30, started=START)
    made = Store(session, get(plan.protocol))
    observe(outputs(items, session), made)
    return made


def test_a_frozen_view_keeps_its_findings(store):
    viewing = Viewing(store)
    before = viewing.findings()
    viewing.freeze(True)
    store.add_line_event(LineEvent(START, LineEventKind.DROPPED, count=5))
    assert viewing.findings() == before
    viewing.freeze(False)
    assert {finding.code for finding in viewing.findings()} - {finding.code for finding in before} == {"LN005"}


def test_the_gravest_finding_stands_first_and_says_what_to_do(look, store):
    async def script(looking):
        await looking.press("5")
        lines = looking.lines()
        rows = [line for line in lines if "MB001" in line]
        assert "station 4" in rows[0]
        assert lines.index(rows[0]) < next(at for at, line in enumerate(lines) if "MB002" in line)
        assert "next   " in looking.text()
        assert "its supply, address switch" in looking.text()

    look(store, script)


def test_enter_goes_to_the_frame_that_shows_it(look, store):
    evidence = next(finding for finding in store.model.findings() if finding.code == "MB001").evidence

    async def script(looking):
        await looking.press("5", "enter")
        assert looking.app.current_mode == "frames"
        assert looking.app.viewing.row == evidence[0]
        await looking.press("5", "e")
        assert looking.app.viewing.row == evidence[1]

    look(store, script)


def test_facts_and_notes_can_be_left_out(look, store):
    async def script(looking):
        await looking.press("5")
        assert "LN001" in looking.text()
        await looking.press("i")
        assert "LN001" not in looking.text()
        assert "MB001" in looking.text()
        assert looking.notices() == ["notes and infos are hidden: i shows them"]
        shown = looking.app.shown
        light = [one for one in store.findings() if one.severity < Severity.WARNING and one.cause is None]
        looking.app.findings = lambda: light
        shown._look()
        await looking.settle()
        assert "no error and no warning; i shows" in looking.text().replace("\n", " ")
        await looking.press("6", "v")
        assert any(line.strip().startswith("selected: ") for line in looking.lines())

    look(store, script)


def test_the_timeline_shows_all_of_a_capture_and_zooms(look, store):
    async def script(looking):
        await looking.press("6")
        assert "one column 1 s" in looking.text()
        assert "10:00:00" in looking.text()
        axis = next(line for line in looking.lines() if "10:00:00" in line)
        assert axis.split()[-1] > "10:00:10"  # little time fills the screen, too
        assert len(axis.rstrip()) > 60
        await looking.press("minus")
        assert "one column 2 s" in looking.text()

    look(store, script)


def test_a_stretch_of_the_timeline_becomes_a_filter(look, store):
    async def script(looking):
        await looking.press("6", "g", "right", "right", "v", "right", "right", "enter")
        assert looking.app.current_mode == "frames"
        first, last = START + 2 * 10**9, START + 5 * 10**9
        shown = [row for row in store.rows if looking.app.viewing.accepts_row(row.no)]
        assert shown
        assert all(first <= row.event.start < last for row in shown)
        assert len(shown) == sum(first <= row.event.start < last for row in store.rows)

    look(store, script)


def test_e_goes_to_the_next_second_with_an_error(look, store):
    async def script(looking):
        await looking.press("6", "g", "e")
        words = next(line for line in looking.lines() if " error," in line or " errors," in line)
        assert " 0 errors," not in words

    look(store, script)


@pytest.mark.parametrize("key", ["5", "6"])
def test_an_empty_store_is_said_to_be_empty(look, make_bus, key):
    async def script(looking):
        await looking.press(key)
        assert any(
            words in looking.text() for words in ("nothing was found", "not one octet", "no frames in this file")
        )

    look(make_bus().store, script)


def test_two_findings_of_one_code_about_one_station_stand_in_their_places(look, store, monkeypatch):
    """As one line the lesser of them would show in the place of the graver one."""

    async def script(see):
        found = see.app.viewing.findings()
        worst, least = found[0], replace(found[0], severity=Severity.NOTE, seen="the lesser one")
        monkeypatch.setattr(store.model, "findings", lambda: (*found, least))
        await see.press("5")
        rows = [[cell.plain for cell in see.main.get_row_at(at)] for at in range(see.main.row_count)]
        assert len(rows) == len(found) + 1
        assert (rows[0][0], rows[0][-1]) == ("ERROR", worst.code)
        assert (rows[-1][0], rows[-1][-1]) == ("note", worst.code)

    look(store, script)


def test_the_timeline_ends_where_the_capture_ends(look, store):
    async def script(see):
        await see.press("6")
        axis = next(line for line in see.lines() if "┴" in line)
        assert len(axis.strip("└ ")) == 80 - LABEL - 2  # all of the width, and nothing after it
        assert "10:00:00" in see.text()
        await see.press("plus")
        assert see.notices() == ["one second is the least"]
        await see.press("minus", "minus", "minus", "minus")
        assert "10:00:00" in see.text()

    look(store, script)


def test_the_second_v_says_how_to_get_rid_of_its_filter(look, store):
    async def script(see):
        await see.press("6", "g", "v", "right", "v")
        assert see.app.current_mode == "frames"
        assert see.app.viewing.filter
        assert see.notices() == ["a filter shows these frames only; esc removes it"]
        await see.press("escape")
        assert not see.app.viewing.filter

    look(store, script)


def test_the_load_of_a_second_that_is_not_over_is_of_what_was_heard_of_it(look, store):
    last = store.load.last // NS_PER_S
    known = store.load.share_of(store.load.seconds[last], last * NS_PER_S, (last + 1) * NS_PER_S)
    whole = store.load.seconds[last].busy / NS_PER_S
    assert f"{known:.1%}" != f"{whole:.1%}"

    async def script(see):
        await see.press("plus", "plus", "plus", "plus", "G")
        assert f"+ 1 s: load {known:.1%} of " in see.text()
        assert " heard, " in see.text()

    look(store, script, start="timeline")


def test_the_timeline_shows_each_station_and_how_long_it_takes_to_answer(look, store):
    async def script(see):
        await see.press("6")
        rows = [line for line in see.lines() if line.strip().startswith("unit") or "station " in line]
        assert "station 4" in rows[0]  # the worst first
        assert "█" in rows[0]
        assert any(line.strip().startswith("p95") and " ms┤" in line for line in see.lines())
        assert "(p95)" in see.text()
        await see.press("plus")

    look(store, script, (100, 30))


@pytest.mark.parametrize("size", [(80, 24), (200, 60)])
def test_the_timeline_fills_the_screen(look, store, size):
    async def script(see):
        await see.press("6")
        lines = see.lines()
        assert all(len(line) <= size[0] for line in lines)
        empty = sum(not line.strip() for line in lines)
        assert empty <= (2 if size[1] < 30 else 12)

    look(store, script, size)
