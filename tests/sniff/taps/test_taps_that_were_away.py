"""Two taps of which one did not listen all the time: what it says that it missed is no fault of the line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from sniff.bus.offline import outputs
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.formats import read
from sniff.taps.frames import TapEar
from sniff.taps.matching import matched
from sniff.taps.verdict import SegmentFault, faults, traffic

CAPTURE = read(Path(__file__).parents[3] / "captures" / "rtu-clean.cap.txt")
READS: list[Item] = [item for item in CAPTURE.items() if isinstance(item, Chunk)]
FROM, TO = len(READS) // 3, len(READS) // 2
DOUBT = 1_000_000


def ear(items: Sequence[Item], session: Session = CAPTURE.session) -> TapEar:
    made = TapEar()
    for item in outputs(items, session):
        made.add_line_event(item) if isinstance(item, LineEvent) else made.add(item)
    return made


def found(items: Sequence[Item], turned: bool) -> list[SegmentFault]:
    ears = [ear(READS), ear(items)]
    first, second = ears[::-1] if turned else ears
    crossings = matched(first.frames(), second.frames(), DOUBT, (first.holes, second.holes))
    return faults(traffic(first.frames(), second.frames(), crossings), DOUBT)


def events(*kinds: LineEventKind) -> list[Item]:
    times = (READS[FROM - 1].time + 1_000_000, READS[TO].time - 20_000_000) if len(kinds) > 1 else (READS[TO].time,)
    return [LineEvent(time, kind) for time, kind in zip(times, kinds, strict=True)]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    "kinds",
    [(LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED), (LineEventKind.DROPPED,), (LineEventKind.OMITTED,)],
)
def test_what_a_tap_missed_is_no_fault_of_the_line(kinds: tuple[LineEventKind, ...], turned: bool) -> None:
    assert found([*READS[:FROM], *READS[TO:]], turned)  # where nobody says that he did not listen
    assert not found([*READS[:FROM], *events(*kinds), *READS[TO:]], turned)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("kept", [slice(0, FROM), slice(TO, len(READS)), slice(FROM, TO)])
def test_who_began_later_and_ended_sooner_lost_nothing(kept: slice, turned: bool) -> None:
    assert not found(READS[kept], turned)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("name", "seconds"), [("rtu-usual-faults", 1.1), ("mstp-clean", 0.4)])
def test_rounds_that_are_alike_are_not_taken_for_one_another(name: str, seconds: float, turned: bool) -> None:
    capture = read(Path(__file__).parents[3] / "captures" / f"{name}.cap.txt")
    reads = [item for item in capture.items() if isinstance(item, Chunk)]
    late = [item for item in reads if item.time - reads[0].time >= seconds * 1_000_000_000]
    ears = [ear(reads, capture.session), ear(late, capture.session)]
    first, second = (one.frames() for one in (ears[::-1] if turned else ears))
    senders = traffic(first, second, matched(first, second, DOUBT))
    assert not faults(senders, DOUBT)
    assert sum(one.both for one in senders.values()) == int((second if not turned else first).good.sum())
    assert all(not one.delays.any() for one in senders.values())
