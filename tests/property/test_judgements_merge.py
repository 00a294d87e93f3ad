"""What is found in parts of a capture, put together: exact where rules count, and always by the same arithmetic."""

from __future__ import annotations

from functools import lru_cache, reduce
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.findings import Finding, Rule, Severity, found
from dissectors.frame import Role
from dissectors.tracker import Verdict
from sniff.analysis.judgement import Heard, Judgement
from sniff.analysis.judging import Judging, rules_over
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent, Session
from sniff.formats import read
from tests.seeds import some

CAPTURES = Path(__file__).parents[2] / "captures"
NAMES = sorted(path for path in CAPTURES.rglob("*.cap.txt") if path.stat().st_size < 40_000)

COUNTED = frozenset(
    (
        *("LN001", "LN005", "LN006", "LN007", "LN102", "LN104", "LN205", "MB009", "MB010", "MB016", "MB017"),
        *("MB201", "MB204", "MB205", "MB206", "MB303", "MB403", "MS101", "MS102", "MS104", "MS107", "MS202", "MS301"),
        *("MS305", "MS404", "MS701", "N2001", "N2002", "N2005", "N2007", "N2008", "N2011"),
    )
)
"""Rules that count what happens, each for itself: of a capture cut while the bus is quiet they find the same."""

Items = list[Output | LineEvent]


@lru_cache(2)  # of a path, all examples are of the same
def given_items(path: Path) -> tuple[Session, Items]:
    capture = read(path)
    return capture.session, list(outputs(capture.items(), capture.session))


@lru_cache(2)
def all_of_whole(path: Path) -> dict[tuple[str, str], list[Finding]]:
    """What is found in a capture that is not cut."""
    return all_of(judged(*given_items(path)))


def judged(session: Session, items: Items) -> Judgement:
    judging = Judging(session, dissector_for(session))
    for item in items:
        if isinstance(item, LineEvent):
            judging.add_line_event(item)
        else:
            judging.add(item)
    return judging.judgement()


def quiet_places(items: Items) -> list[int]:
    """Where no exchange is under way, behind the first few, and not directly behind what is said to all: that somebody
    answers it is known by what was before. Nor behind a master's answer to a poll: it joins with the token after it.
    Nor beside an answer that nobody asked for, or that came late: of the first row its request may be missing, and what
    another answered in somebody's place is known by the request before; a token may be lost behind it."""
    first: dict[int, int] = {}
    last: dict[int, int] = {}
    to_all: set[int] = set()
    for at, item in enumerate(items):
        if isinstance(item, LineEvent):
            continue
        placed = [row.placement.tx for row in item.rows if row.placement is not None]
        if any(row.placement is not None and row.placement.role is Role.BROADCAST for row in item.rows):
            to_all.add(at + 1)
        if any(row.header is not None and row.header.kind == "reply-to-poll-for-master" for row in item.rows):
            to_all.add(at + 1)
        if any(one.verdict in (Verdict.UNSOLICITED, Verdict.LATE) for one in item.transactions):
            to_all |= {at, at + 1}
        closed = [number for one in item.transactions for number in (one.id, one.of) if number is not None]
        for number in (*placed, *closed):
            first.setdefault(number, at)
            last[number] = at
    busy = {at for number, begin in first.items() for at in range(begin + 1, last[number] + 1)}
    return [at for at in range(2, len(items) - 2) if at not in busy | to_all]


def all_of(judgement: Judgement) -> dict[tuple[str, str], list[Finding]]:
    """By rule and subject."""
    made: dict[tuple[str, str], list[Finding]] = {}
    for one in (*judgement.host, *judgement.overall, *judgement.line, *judgement.bus):
        made.setdefault(one.key, []).append(one)
    return made


def of_host(judgement: Judgement) -> dict[tuple[str, str], list[Finding]]:
    """What a part without a row adds to others: what happened to the adapter, not what is said of every capture."""
    return all_of(Judgement(host=tuple(one for one in judgement.host if not one.is_once)))


def told(findings: list[Finding]) -> tuple[int, int, int]:
    """How often, from when, until when."""
    count = 1 if findings[0].is_once else sum(one.count for one in findings)
    return count, min(one.first for one in findings), max(one.last for one in findings)


@pytest.mark.parametrize("path", NAMES[::8], ids=lambda path: path.name)
@settings(max_examples=3, deadline=None)
@given(st.data())
def test_findings_add_up_wherever_a_capture_is_cut(path: Path, data: st.DataObject) -> None:
    session, items = given_items(path)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(items)), min_size=2, max_size=2)))
    parts = [judged(session, items[begin:end]) for begin, end in pairwise((0, *cuts, len(items)))]
    one, two, three = parts
    merged = one.merge(two).merge(three)
    assert merged == one.merge(two.merge(three))
    assert merged.merge(Judgement()) == merged == Judgement().merge(merged)
    of_parts = [all_of(part) if part.heard.rows or not merged.heard.rows else of_host(part) for part in parts]
    expected: dict[tuple[str, str], list[Finding]] = {}
    for of_part in of_parts:
        for key, findings in of_part.items():
            expected.setdefault(key, []).extend(findings)
    assert {key: told(findings) for key, findings in all_of(merged).items()} == {
        key: told(findings) for key, findings in expected.items()
    }
    for key, findings in all_of(merged).items():
        assert max(one.severity for one in findings) is max(one.severity for one in expected[key])


@pytest.mark.parametrize("path", some(NAMES[::3], 2), ids=lambda path: path.name)
@settings(max_examples=2, deadline=None)
@given(st.data())
def test_what_rules_count_is_the_same_in_parts_that_begin_and_end_quietly(path: Path, data: st.DataObject) -> None:
    session, items = given_items(path)
    places = quiet_places(items)
    if len(places) < 2:
        pytest.skip("this bus is never quiet")
    cuts = sorted(data.draw(st.lists(st.sampled_from(places), min_size=1, max_size=2)))
    parts = [judged(session, items[begin:end]) for begin, end in pairwise((0, *cuts, len(items)))]
    merged, whole = all_of(reduce(Judgement.merge, parts)), all_of_whole(path)
    for code in COUNTED:
        assert _of_rule(code, merged) == _of_rule(code, whole), code


def _of_rule(code: str, findings: dict[tuple[str, str], list[Finding]]) -> dict[str, tuple[int, int, int]]:
    return {subject: told(made) for (of, subject), made in findings.items() if of == code}


CAUSE = Rule("XX001", Severity.ERROR, "a cause", "", explains=("XX002",))
EFFECT = Rule("XX002", Severity.WARNING, "an effect", "")


def test_what_explains_what_is_settled_over_all_parts() -> None:
    """The cause shows in one part, its consequence in the other."""
    heard = Heard(octets=800, in_frames=800, rows=100, good=100)
    one, other = (Judgement(heard, bus=(found(rule, "bus", "x", count=2),)) for rule in (CAUSE, EFFECT))
    catalogue = {rule.code: rule for rule in (CAUSE, EFFECT)}
    (cause, effect) = one.merge(other).findings(catalogue)
    assert (cause.code, effect.cause, effect.severity) == ("XX001", ("XX001", "bus"), Severity.NOTE)


def test_a_part_in_which_nothing_was_heard_silences_nobody() -> None:
    path = CAPTURES / "rtu-usual-faults.cap.txt"
    session, items = given_items(path)
    rules = rules_over(dissector_for(session))
    whole, nothing = judged(session, items), judged(session, [])
    assert [one.code for one in nothing.findings(rules)] == ["LN002", "LN001"]
    codes = [one.code for one in nothing.merge(whole).findings(rules)]
    assert codes == [one.code for one in whole.findings(rules)]
