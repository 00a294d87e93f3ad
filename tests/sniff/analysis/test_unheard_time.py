"""What is told of the time of a bus is told of the time that somebody listened: a hole of minutes changes nothing."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from sniff.analysis.judging import Judging
from sniff.bus.offline import survey
from sniff.engine.blocks import Block, blocks_of
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.formats import read

CAPTURES = Path(__file__).parents[3] / "captures"
S = 1_000_000_000
AWAY = 600 * S


class WithHole:
    """A capture whose port was away for ten minutes, in the longest pause of its middle third."""

    def __init__(self, name: str, away: int) -> None:
        whole = read(CAPTURES / f"{name}.cap.txt")
        self.session: Session = whole.session
        items = list(whole.items())
        middle = range(len(items) // 3, 2 * len(items) // 3)
        at = max(middle, key=lambda place: items[place].time - items[place - 1].time)
        gone, back = items[at - 1].time + 1, items[at].time - len(getattr(items[at], "octets", b"")) * S // 960 + away
        hole = [LineEvent(gone, LineEventKind.UNPLUGGED), LineEvent(back, LineEventKind.REPLUGGED)]
        later = [replace(item, time=item.time + away) for item in items[at:]]
        self._items: list[Item] = [*items[:at], *hole, *later] if away else items

    def items(self) -> Iterator[Item]:
        """See `sniff.engine.capture.Capture`."""
        return iter(self._items)

    def blocks(self) -> Iterator[Block | LineEvent]:
        """See `sniff.engine.capture.Capture`."""
        return blocks_of(iter(self._items))


def told(name: str, away: int, reference: bool) -> dict[tuple[str, str], str]:
    capture = WithHole(name, away)
    judging = Judging(capture.session, dissector_for(capture.session))
    survey(capture, capture.session, judging, reference=reference)
    return {(one.code, str(one.subject)): f"{one.severity.name} {one.seen}" for one in judging.findings()}


@pytest.mark.parametrize("reference", [False, True])
@pytest.mark.parametrize(
    ("name", "codes"),
    [
        ("rtu-usual-faults", ("MB105", "MB401", "MB104")),
        ("n2-usual-faults", ("N2006", "LN203")),
        ("profibus-clean", ("PB016",)),
    ],
)
def test_shares_and_cycles_are_of_the_time_heard(name: str, codes: tuple[str, ...], reference: bool) -> None:
    whole, torn = told(name, 0, reference), told(name, AWAY, reference)
    for code in codes:
        expected = {key: words for key, words in whole.items() if key[0] == code}
        found = {key: words for key, words in torn.items() if key[0] == code}
        if code in ("MB105", "PB016"):  # whose share of the time it is
            assert set(found) == set(expected)
            assert all("% of the time" in words and "0.0%" not in words for words in found.values())
        else:
            assert found == expected or not expected, code
    assert not any(re.search(r"\d min", words) for key, words in torn.items() if key[0] != "LN006")


@pytest.mark.parametrize("reference", [False, True])
@pytest.mark.parametrize("name", ["mstp-clean", "profibus-clean"])
def test_a_ring_is_told_of_the_time_heard(name: str, reference: bool) -> None:
    said = []
    for away in (0, AWAY):
        capture = WithHole(name, away)
        judging = Judging(capture.session, dissector_for(capture.session))
        survey(capture, capture.session, judging, reference=reference)
        said.append(judging.ring().span)
    assert said[1] == pytest.approx(said[0], abs=S // 10)
