"""The engine of a session with a search for settings in it: what is frames, what was only heard, that all is there."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings
from dissectors.tracker import Verdict
from sniff.analysis.judging import Judging
from sniff.analysis.summary import Summary
from sniff.bus.offline import outputs
from sniff.editing.cutting import Stretch, cut
from sniff.engine import follow_settings
from sniff.engine.engine import Output, Row
from sniff.engine.event_texts import SettingsChange
from sniff.engine.follow_settings import SessionEngine
from sniff.engine.session import ASSUMED, UNKNOWABLE, Adapter, Item, LineEvent, LineEventKind, Session, with_settings

MS = 1_000_000
FIRST, RIGHT = LineSettings.parse("9600,8N1"), LineSettings.parse("19200,8E1")
ADAPTER = Adapter("an adapter", "ftdi_sio")
OPEN = Session("port", FIRST, "n2", adapter=ADAPTER, unknown=UNKNOWABLE)
FOUND = Session("port", RIGHT, "modbus-rtu", adapter=ADAPTER)
POLL = bytes.fromhex("010300000002c40b")
ANSWER = bytes.fromhex("010304000000 00fa33".replace(" ", ""))


def settings(time: int, **words: object) -> LineEvent:
    return LineEvent(time * MS, LineEventKind.SETTINGS, str(SettingsChange(**words)))


def poll(time: int) -> list[Item]:
    return [Chunk(time * MS, POLL), Chunk((time + 10) * MS, ANSWER)]


def searched(end: bool = True) -> list[Item]:
    """A search: rubbish, the right settings, found (or not), and what follows."""
    items: list[Item] = [
        settings(0, line=FIRST, searching=True),
        Chunk(50 * MS, b"\x80\xf8\x00"),
        Chunk(90 * MS, b"\x80\xf8\x00\x01"),
        settings(100, line=RIGHT),
        *poll(150),
        *poll(250),
    ]
    if end:
        items += [settings(300, line=RIGHT, protocol="modbus-rtu", found=True), *poll(350)]
    return items


def rows_of(items: list[Item], session: Session) -> list[Row]:
    return [row for output in outputs(items, session) if isinstance(output, Output) for row in output.rows]


def octets_of(items: list[Item]) -> bytes:
    return b"".join(item.octets for item in items if isinstance(item, Chunk))


def test_before_it_is_found_octets_are_only_heard_and_from_the_right_attempt_on_they_are_frames() -> None:
    rows = rows_of(searched(), FOUND)
    assert [row.no for row in rows] == list(range(1, 9))
    assert [row.searched for row in rows] == [FIRST] * 2 + [None] * 6
    assert all(isinstance(row.event, Frame) and row.event.ok for row in rows[2:])
    assert b"".join(row.event.octets for row in rows) == octets_of(searched())


def test_live_and_saved_are_the_same() -> None:
    saved = [output for output in outputs(searched(), FOUND) if isinstance(output, Output)]
    live = [output for output in outputs(searched(), OPEN) if isinstance(output, Output)]
    assert [row for output in live for row in output.rows] == [row for output in saved for row in output.rows]
    assert [one for output in live for one in output.transactions] == [
        one for output in saved for one in output.transactions
    ]


def test_a_search_in_vain_leaves_octets_and_no_frame() -> None:
    items = searched(end=False)
    rows = rows_of(items, OPEN)
    assert [row.searched for row in rows] == [FIRST] * 2 + [RIGHT] * 4
    assert b"".join(row.event.octets for row in rows) == octets_of(items)


def test_settings_named_afterwards_read_what_was_heard_with_them() -> None:
    session = with_settings(OPEN, "modbus-rtu", RIGHT)
    assert (session.unknown, session.given) == ((), True)
    rows = rows_of(searched(end=False), session)
    assert [row.searched for row in rows] == [FIRST] * 2 + [None] * 4
    assert all(isinstance(row.event, Frame) for row in rows[2:])
    only_protocol = with_settings(OPEN, "modbus-rtu")
    assert only_protocol.unknown == ("line",)
    assert all(row.searched for row in rows_of(searched(end=False), only_protocol))


def test_what_was_only_heard_is_nobodys_fault() -> None:
    judging, summary = Judging(FOUND, SessionEngine(FOUND).dissector), Summary(RIGHT)
    noisy = [LineEvent(60 * MS, LineEventKind.ERRORS, "parity", 12)]
    items = searched()
    for output in outputs([*items[:2], *noisy, *items[2:]], FOUND):
        if isinstance(output, Output):
            judging.add(output)
            summary.add(output)
        else:
            judging.add_line_event(output)
    assert {finding.code for finding in judging.findings()} == {"LN001"}
    assert (summary.octets, summary.noise, summary.searched) == (3 * len(POLL + ANSWER), 0, 7)
    assert not summary.marks


def test_a_request_that_was_only_heard_does_not_make_its_answer_unsolicited_to_the_rules() -> None:
    items = [
        settings(0, line=FIRST, searching=True),
        Chunk(50 * MS, b"\x80\xf8\x00"),
        settings(55, line=RIGHT),
        Chunk(60 * MS, ANSWER),
        *poll(150),
        settings(300, line=RIGHT, protocol="modbus-rtu", found=True),
    ]
    judging = Judging(FOUND, SessionEngine(FOUND).dissector)
    for output in outputs(items, FOUND):
        if isinstance(output, Output):
            judging.add(output)
    assert {finding.code for finding in judging.findings()} == {"LN001"}


def test_what_an_adapter_may_still_hold_at_a_change_was_heard_with_the_settings_before() -> None:
    session = replace(FOUND, adapter=replace(ADAPTER, latency=16 * MS))
    items = searched()
    items.insert(4, Chunk(110 * MS, b"\xf8\xf8"))
    rows = rows_of(items, session)
    assert [row.searched for row in rows][:3] == [FIRST] * 3
    assert all(isinstance(row.event, Frame) for row in rows[3:])


def test_where_settings_do_not_matter_every_octet_counts() -> None:
    session = replace(FOUND, adapter=Adapter(driver="pty"))
    rows = rows_of([*searched()[:1], *poll(50), *searched()[3:]], session)
    assert [row.searched for row in rows] == [None] * 8


def test_a_change_without_a_search_begins_anew_and_numbers_go_on() -> None:
    items = [*poll(50), Chunk(100 * MS, POLL[:5]), settings(120, line=FIRST), *poll(150), *poll(250)]
    found = [output for output in outputs(items, FOUND) if isinstance(output, Output)]
    rows = [row for output in found for row in output.rows]
    assert [row.no for row in rows] == list(range(1, len(rows) + 1))
    assert rows[2].event.octets == POLL[:5]
    numbers = [one.id for output in found for one in output.transactions]
    assert len(numbers) == len(set(numbers)) >= 3
    assert {row.placement.tx for row in rows if row.placement is not None} <= set(numbers)


def test_memory_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    assert follow_settings.MOST_HELD_READS < 1_000_000
    monkeypatch.setattr(follow_settings, "MOST_HELD_READS", 300)
    engine = SessionEngine(OPEN)
    assert sum(len(engine.feed(Chunk(number, b"x")).rows) for number in range(305)) == 301


def test_a_stretch_cut_out_of_a_search_still_says_with_what_it_was_heard() -> None:
    whole = rows_of(searched(), FOUND)
    for first in (0, 60, 120, 200, 320):
        part = list(cut(searched(), Stretch(first * MS, 1000 * MS), 0))
        rows = rows_of(part, FOUND)
        assert [(row.searched, row.event.octets) for row in rows] == [
            (row.searched, row.event.octets) for row in whole[len(whole) - len(rows) :]
        ]
        assert len(rows) == len([item for item in searched() if isinstance(item, Chunk) and item.time >= first * MS])


LINES = st.sampled_from([FIRST, RIGHT, LineSettings(38400)])
CHANGES = st.builds(
    lambda line, protocol, how: {"line": line, "protocol": protocol, how: True} if how else {"line": line},
    LINES,
    st.sampled_from([None, "modbus-rtu", "n2", "mstp", "no-such"]),
    st.sampled_from(["searching", "found", ""]),
)
STEPS = st.lists(st.tuples(st.integers(-5, 400), st.one_of(st.binary(min_size=1, max_size=40), CHANGES)), max_size=30)


@given(STEPS, st.sampled_from([OPEN, FOUND, with_settings(OPEN, "n2", RIGHT)]))
def test_no_octet_is_lost_and_numbers_have_no_hole(steps: list, session: Session) -> None:
    items: list[Item] = []
    time = 0
    for wait, what in steps:
        time += wait
        items.append(Chunk(time * MS, what) if isinstance(what, bytes) else settings(time, **what))
    rows = rows_of(items, session)
    assert b"".join(row.event.octets for row in rows) == octets_of(items)
    assert [row.no for row in rows] == list(range(1, len(rows) + 1))


@given(st.text(max_size=60))
def test_the_text_of_a_change_is_read_whatever_it_is(text: str) -> None:
    change = SettingsChange.parse(text)
    assert SettingsChange.parse(str(change)) == change


def test_no_request_is_paired_across_a_hole() -> None:
    """The answer that comes first after a replug answers a request that nobody heard."""
    request, answer = poll(100)
    for kind in (LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED, LineEventKind.DROPPED):
        assert isinstance(answer, Chunk)
        items: list[Item] = [
            *poll(0), request, LineEvent(103 * MS, kind), replace(answer, time=3900 * MS), *poll(4000)
        ]  # fmt: skip
        closed = [one for output in outputs(items, FOUND) if isinstance(output, Output) for one in output.transactions]
        assert [one.verdict for one in closed] == [
            Verdict.ANSWERED,
            Verdict.OPEN,
            Verdict.UNSOLICITED,
            Verdict.ANSWERED,
        ]
        assert [row.no for row in rows_of(items, FOUND)] == list(range(1, 7))


@pytest.mark.parametrize("hole", [LineEventKind.DROPPED, LineEventKind.UNPLUGGED])
def test_a_hole_in_what_was_held_parts_what_stands_round_it(hole) -> None:
    """The request before it and the answer behind it belong to nothing, as where nobody searched."""
    items = searched()
    at = next(place for place, item in enumerate(items) if isinstance(item, Chunk) and item.octets == ANSWER)
    items.insert(at, LineEvent(items[at].time - 1, hole, "lost", 8))
    engine = SessionEngine(OPEN)
    made = [engine.take(item) for item in items] + [engine.close()]
    verdicts = [one.verdict for output in made for one in output.transactions]
    assert verdicts.count(Verdict.ANSWERED) == 2
    assert len([row for output in made for row in output.rows]) == 8


def test_a_change_of_the_line_does_not_make_an_unknown_adapter_exact() -> None:
    unnamed = Session("port", FIRST, "modbus-rtu", adapter=Adapter(), notes={"line": ASSUMED})
    engine = SessionEngine(unnamed)
    assert not engine.engine.timing.is_told
    engine.take(settings(1, protocol="n2"))
    assert (engine.engine.timing.is_told, engine.engine.timing.has_rate) == (False, False)
    engine.take(settings(2, line=RIGHT))
    assert (engine.engine.timing.is_told, engine.engine.timing.has_rate) == (False, True)
