"""Only what surrounds a trigger is kept; every octet is in the file or counted."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.capture import trigger_ring
from sniff.capture.trigger_ring import LATE, TriggerRing
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.recording.reader import McapCapture
from sniff.recording.writer import Recorder

S = 1_000_000_000
BASE = 1_772_359_200 * S


class Kept:
    """A recorder that remembers."""

    def __init__(self) -> None:
        self.items: list[Item] = []
        self.chunk = self.items.append
        self.line = self.items.append


def chunk(second: float) -> Chunk:
    return Chunk(BASE + int(second * S), f"{second:08.1f}".encode())


def run(before: float, after: float, steps: list[tuple[float, bool]]) -> tuple[Kept, TriggerRing]:
    """Steps: when something comes, and whether a trigger for it is fired at once."""
    kept = Kept()
    ring = TriggerRing(kept, int(before * S), int(after * S))  # type: ignore[arg-type]
    for second, fires in steps:
        ring.take(chunk(second))
        if fires:
            ring.fire(BASE + int(second * S), f"at {second}")
    ring.finish()
    return kept, ring


def test_before_and_after_and_nothing_else() -> None:
    kept, ring = run(3, 2, [(second, second == 50) for second in range(100)])
    seconds = [int(float(item.octets)) for item in kept.items if isinstance(item, Chunk)]
    assert seconds == [47, 48, 49, 50, 51, 52]
    kinds = [(item.kind, item.count) for item in kept.items if isinstance(item, LineEvent)]
    assert kinds == [(LineEventKind.OMITTED, 47 * 8), (LineEventKind.TRIGGER, 0), (LineEventKind.OMITTED, 47 * 8)]
    assert ring.omitted == 94 * 8


def test_stretches_that_overlap_are_one() -> None:
    kept, _ = run(3, 2, [(second, second in (50, 54)) for second in range(100)])
    assert [int(float(item.octets)) for item in kept.items if isinstance(item, Chunk)] == list(range(47, 57))
    assert sum(isinstance(item, LineEvent) and item.kind is LineEventKind.OMITTED for item in kept.items) == 2


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.1, 4), st.booleans()), min_size=1, max_size=80),
    st.floats(0, 6),
    st.floats(0, 6),
    st.integers(0, 2),
)
def test_what_is_wanted_is_kept_in_order_and_the_rest_counted(
    gaps: list[tuple[float, bool]], before: float, after: float, late: int
) -> None:
    kept, now = Kept(), 0.0
    ring = TriggerRing(kept, int(before * S), int(after * S))  # type: ignore[arg-type]
    given_, wanted, waiting = [], [], []
    for gap, fires in gaps:
        now = round(now + gap, 1)
        given_.append(chunk(now))
        ring.take(given_[-1])
        if fires:
            wanted.append(BASE + int(now * S))
            waiting.append((wanted[-1], late))
        waiting = [(time, turns - 1) for time, turns in waiting]
        for time, turns in waiting:  # a trigger is late by some reads
            if turns < 0 and given_[-1].time - time < LATE:
                ring.fire(time, "now")
            elif turns < 0:
                wanted.remove(time)
        waiting = [one for one in waiting if one[1] >= 0]
    fired = [time for time in wanted if time not in [one[0] for one in waiting]]
    ring.finish()
    chunks = [item for item in kept.items if isinstance(item, Chunk)]
    assert chunks == sorted(set(chunks), key=lambda item: item.time)
    for item in given_:
        near = any(time - int(before * S) <= item.time <= time + int(after * S) for time in fired)
        assert not near or item in chunks
    times = [item.time for item in kept.items]
    assert times == sorted(times)
    said = sum(item.count for item in kept.items if isinstance(item, LineEvent) and item.kind.is_hole)
    assert sum(len(item.octets) for item in chunks) + ring.omitted == sum(len(item.octets) for item in given_)
    assert said == ring.omitted


def test_memory_is_bounded_whatever_is_asked_for(monkeypatch) -> None:
    monkeypatch.setattr(trigger_ring, "MOST", 100_000)
    kept = Kept()
    ring = TriggerRing(kept, 10**15, 0)  # type: ignore[arg-type]
    for number in range(5000):
        ring.take(Chunk(BASE + number, bytes(100)))
        assert ring._size <= 100_000 + 300
    ring.finish()
    assert ring.omitted == 500_000


def test_a_recording_tells_what_was_left_out(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap", Session("p", LineSettings(), "modbus-rtu", BASE))
    ring = TriggerRing(recorder, S, S)
    for second in range(20):
        ring.take(chunk(second))
        if second == 10:
            ring.fire(BASE + 10 * S, "MB001 station 3")
    ring.finish()
    recorder.close()
    items = list(McapCapture(tmp_path / "a.mcap").items())
    assert [item.octets for item in items if isinstance(item, Chunk)] == [chunk(one).octets for one in (9, 10, 11)]
    assert [item.kind.value for item in items if isinstance(item, LineEvent)] == ["omitted", "trigger", "omitted"]


def test_what_memory_does_not_hold_is_not_said_to_be_unwanted(monkeypatch) -> None:
    monkeypatch.setattr(trigger_ring, "MOST", 1100)
    kept, _ = run(60, 1, [(second, second == 50) for second in range(60)])
    said = [item.text for item in kept.items if isinstance(item, LineEvent) and item.kind is LineEventKind.OMITTED]
    assert "more came before a trigger than memory holds" in said[0]
    assert "no trigger fired" in said[1]
