"""Error answers: of one station, or of each one that is asked; asked for once, or again and again."""

from __future__ import annotations

from dissectors.bacnet.application import read_property
from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.findings_of_refusals import Refusals
from dissectors.findings import Severity
from dissectors.frame import Event
from dissectors.tracker import Transaction, Verdict
from tests.dissectors.bacnet.ring_script import script

UNKNOWN = "property unknown-property"
OPTIONAL = ("description", "location", "profile-name", "active-cov-subscriptions")
READ = "read-property"


def asked(mac: int, name: str) -> Event | None:
    if not name:
        return None
    octets = npdu_frame(mac, 1, read_property(1, f"device,{mac}", name), expects_reply=True)
    (request,) = script([(1, octets)]).events
    return request


def found(asked_for: dict[int, tuple[str, ...]], error: str = UNKNOWN, answered: dict[int, int] | None = None):
    """Each station refuses those properties; `answered`: what it answers besides."""
    refusals, no = Refusals(), 0
    for mac, names in asked_for.items():
        for name in names:
            refusals.answer(mac, READ)
            refused = Transaction(no, mac, READ, no, no + 1, Verdict.EXCEPTION, no, no + 1, error=error)
            refusals.refuse(mac, refused, asked(mac, name))
            no += 2
    for mac, count in (answered or {}).items():
        for _ in range(count):
            refusals.answer(mac, READ)
    return [(one.subject, one.severity, one.count) for one in refusals.findings()]


def test_what_no_station_has_is_looked_for_and_nobodys_fault():
    assert found({3: OPTIONAL * 9, 7: OPTIONAL * 9, 12: OPTIONAL[:3]}) == [("bus", Severity.NOTE, 75)]


def test_what_one_station_has_not_is_said_of_it():
    again = OPTIONAL[:1] * 4
    assert found({7: again}) == [("MAC 7", Severity.WARNING, 4)]
    assert found({7: again}, answered={3: 8}) == [("MAC 7", Severity.WARNING, 4)]


def test_each_thing_asked_for_once_is_a_search():
    assert found({7: OPTIONAL}, answered={3: 8, 7: 4}) == [("MAC 7", Severity.NOTE, 4)]


def test_an_error_that_is_no_matter_of_what_there_is_stays_each_stations_own():
    both = found({3: OPTIONAL, 7: OPTIONAL}, "device operational-problem")
    assert both == [("MAC 3", Severity.WARNING, 4), ("MAC 7", Severity.WARNING, 4)]


def test_what_was_asked_for_is_not_known_and_may_be_the_same_again():
    unknown = OPTIONAL[0], "", OPTIONAL[1], ""
    assert found({7: unknown}, answered={3: 8}) == [("MAC 7", Severity.WARNING, 4)]
    assert found({7: ("",)}, answered={3: 8}) == [("MAC 7", Severity.NOTE, 1)]


def test_what_to_do_next_follows_the_reason():
    """Who cannot send so much at once has what it was asked for; it must be asked for less."""
    refusals = Refusals()
    for no, error in enumerate(("abort segmentation-not-supported", "abort tsm-timeout", UNKNOWN, "device busy") * 2):
        refusals.refuse(9, Transaction(no, 9, READ, 2 * no, 2 * no + 1, Verdict.EXCEPTION, no, no, error=error), None)
    advice = {one.seen.split(" in answer")[0]: one.next for one in refusals.findings()}
    assert "ask for less" in advice["abort segmentation-not-supported"]
    assert "load" in advice["abort tsm-timeout"]
    assert "load" in advice["error device busy"]
    assert "take what it has not out" in advice[f"error {UNKNOWN}"]
