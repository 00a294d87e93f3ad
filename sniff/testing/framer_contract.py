"""The framer contract as a property suite: every framer passes it, built-in or plug-in (dissectors/framer.py).

Use, in a test module of its own (it needs hypothesis, which is no dependency of the program):

    from sniff.testing.framer_contract import framer_contract

    TestN2Contract = framer_contract(N2Framer, good_frames())

where `good_frames()` is a strategy of octets that are one good frame each. pytest then runs a test for each clause of
the contract; a failure shows the smallest capture that breaks it. The suite makes the line noise: it lays
frames, broken frames and rubbish on a wire with gaps of every size, lets an adapter deliver the octets late and in
lumps, and cuts what was delivered in other ways.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import cycle, pairwise

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dissectors.frame import Check, Chunk, Event, Frame, LineError, Mark, Noise
from dissectors.framer import Framer
from dissectors.line import MS, LineSettings, Timing
from dissectors.quick_values import quickly_made
from sniff.testing.driving import drive

EPOCH = 1_767_225_600 * 1_000_000_000
LONGEST_DELAY = 6_000 * MS
MOST_HELD = 4096
ERRORS = (LineError.PARITY, LineError.FRAMING, LineError.PARITY | LineError.FRAMING, LineError.BREAK, LineError.OVERRUN)

TIMINGS = st.builds(
    Timing,
    line=st.sampled_from([LineSettings.parse(s) for s in ("1200,8E1", "9600", "19200,8E1", "38400", "115200,8N2")]),
    latency=st.sampled_from([0, 1 * MS, 2 * MS, 17 * MS]),
)

CHOICES = st.binary(min_size=8, max_size=64)
"""What is decided again and again along a capture, an octet a decision, round and round: to draw each costs more than
the framer. Zero is the plainest."""

SPOTS = st.lists(st.tuples(st.integers(0, 4095), st.sampled_from(ERRORS)), max_size=3)
"""Where on a wire a line error is, and which."""


@quickly_made
@dataclass(frozen=True, slots=True)
class Wired:
    """One octet on the wire: when it ended in truth, and the line error it was received with."""

    end: int
    octet: int
    error: LineError | None = None


# --- making a wire, and what an adapter delivers of it ----------------------------------------------------------------


def gaps(timing: Timing) -> st.SearchStrategy[int]:
    """Silences that matter: none, inside frames, round about 3.5 characters, round about the latency, long."""
    char, t35, latency = timing.char, timing.t35, timing.latency
    edges = [0, char // 2, timing.t15, t35 - 1, t35, t35 + 1, t35 + latency, t35 + latency + 1, 5 * t35, 20 * MS]
    return st.one_of(
        st.just(0),
        st.sampled_from([*edges, latency, 2 * latency + t35, 50 * MS, 999 * MS, 1_000 * MS, 1_001 * MS, 3_000 * MS]),
        st.integers(0, 30 * char),
    )


def rubbish(good_frames: st.SearchStrategy[bytes]) -> st.SearchStrategy[bytes]:
    """Octets that are hardly ever a frame, and those that nearly are one."""

    def damaged(parts: tuple[bytes, int, int]) -> bytes:
        octets, at, bit = parts
        at %= len(octets)
        return octets[:at] + bytes([octets[at] ^ 1 << bit]) + octets[at + 1 :]

    return st.one_of(
        st.binary(max_size=40),
        st.binary(min_size=1, max_size=3),
        st.integers(1, 9).map(bytes),
        st.integers(1, 4).map(lambda n: b"\xff" * n),
        st.tuples(good_frames, st.integers(1, 64)).map(lambda p: p[0][: p[1]]),
        st.tuples(good_frames, st.integers(1, 64)).map(lambda p: p[0][p[1] :]),
        st.tuples(good_frames, st.integers(0, 600), st.integers(0, 7)).map(damaged),
        st.tuples(good_frames, st.integers(1, 4)).map(lambda p: p[0] + bytes(p[1])),
    )


@lru_cache(128)
def stretches(timing: Timing, good_frames: st.SearchStrategy[bytes]) -> st.SearchStrategy[list[tuple[int, bytes]]]:
    """Frames and rubbish with gaps of every size; or a run of them with hardly a silence; or a healthy poll with gaps
    that are only just proved, or not."""
    stuff = st.one_of(good_frames, rubbish(good_frames))
    rough = st.tuples(gaps(timing), stuff)
    run_on = st.tuples(st.sampled_from([0, 0, 0, 0, timing.char // 2, 2 * timing.char, timing.t35]), stuff)
    wait = timing.t35 + timing.char
    steady = st.tuples(st.sampled_from([wait, wait, 3 * timing.latency + 8 * wait]), good_frames)
    return st.one_of(
        st.lists(rough, max_size=8),
        st.lists(run_on, min_size=3, max_size=8),
        st.lists(steady, min_size=3, max_size=6),
    )


@st.composite
def wires(draw: st.DrawFn, timing: Timing, good_frames: st.SearchStrategy[bytes]) -> list[Wired]:
    """A stretch of bus, line errors here and there."""
    now, wire = EPOCH, []
    for gap, octets in draw(stretches(timing, good_frames)):
        now += gap
        for octet in octets:
            now += timing.char
            wire.append(Wired(now, octet))
    if wire:
        for spot, error in draw(SPOTS):
            at = spot % len(wire)
            wire[at] = Wired(wire[at].end, wire[at].octet, error)
    return wire


@st.composite
def deliveries(draw: st.DrawFn, timing: Timing, wire: Sequence[Wired]) -> list[Chunk]:
    """What an honest adapter delivers: no octet later than `timing.latency` after its end, times ascending."""
    chunks: list[Chunk] = []
    at, last = 0, EPOCH
    lumpy, choices = draw(st.booleans()), cycle(draw(CHOICES))
    while at < len(wire):
        latest = max(last, wire[at].end + timing.latency)
        most = at + 1
        while most < len(wire) and wire[most].end <= wire[at].end + timing.latency:
            most += 1
        choice = next(choices)
        to = most if lumpy else at + 1 + (choice >> 1) % (most - at)
        earliest = max(last, wire[to - 1].end)
        time = max(earliest, latest) if choice & 1 else earliest
        chunks.append(_chunk(time, wire[at:to]))
        at, last = to, time
    return chunks


def _chunk(time: int, wired: Sequence[Wired]) -> Chunk:
    marks = tuple(Mark(i, w.error) for i, w in enumerate(wired) if w.error is not None)
    return Chunk(time, bytes(w.octet for w in wired), marks)


def whole_frames(frames: Iterable[bytes], timing: Timing, silence: int) -> list[Chunk]:
    """Frames with a silence before each, one chunk an octet, delivered at once."""
    now, chunks = EPOCH, []
    for frame in frames:
        now += silence
        for octet in frame:
            now += timing.char
            chunks.append(Chunk(now, bytes([octet])))
    return chunks


def cut(chunk: Chunk, at: Iterable[int], char: int) -> list[Chunk]:
    """The same octets at the same nominal times, in other chunks: cut before each offset of `at`."""
    count = len(chunk.octets)
    limits = [0, *sorted({a for a in at if 0 < a < count}), count]
    pieces = []
    for begin, end in pairwise(limits):
        marks = tuple(Mark(m.offset - begin, m.error) for m in chunk.marks if begin <= m.offset < end)
        pieces.append(Chunk(chunk.time - (count - end) * char, chunk.octets[begin:end], marks))
    return pieces


# --- what must hold of the events of any capture ----------------------------------------------------------------------


def check_conserved(events: Sequence[Event], chunks: Sequence[Chunk]) -> None:
    """Every octet and every line error in exactly one event, in order."""
    assert b"".join(e.octets for e in events) == b"".join(c.octets for c in chunks)
    fed, base = [], 0
    for chunk in chunks:
        fed += [(base + m.offset, m.error) for m in chunk.marks]
        base += len(chunk.octets)
    given_out, base = [], 0
    for event in events:
        given_out += [(base + m.offset, m.error) for m in event.marks]
        assert all(0 <= m.offset < len(event.octets) for m in event.marks)
        base += len(event.octets)
    assert given_out == fed


def check_provenance(events: Sequence[Event], framer: Framer, timing: Timing) -> None:
    """Each event says truly how it was found, what was skipped and when it was."""
    skipped, last_end = 0, None
    for event in events:
        assert event.octets
        assert event.start <= event.end
        assert last_end is None or last_end <= event.end
        last_end = event.end
        if isinstance(event, Noise):
            skipped += len(event.octets)
            continue
        assert event.protocol == framer.protocol
        assert event.skipped == skipped
        skipped = 0
        assert 0 <= event.slack <= timing.latency
        assert event.flags == tuple(sorted(event.flags))
        assert event.check is not Check.BAD or event.damage is not None, "a bad frame says why"


def good_octets(events: Iterable[Event]) -> list[bytes]:
    """Octets of the frames with nothing wrong; those of a kind that has no check count."""
    return [e.octets for e in events if isinstance(e, Frame) and e.damage is None and e.check is not Check.BAD]


# --- the suite --------------------------------------------------------------------------------------------------------


def framer_contract(
    factory: Callable[[Timing], Framer],
    good_frames: st.SearchStrategy[bytes],
    *,
    timings: st.SearchStrategy[Timing] = TIMINGS,
    silence: int = 3_000 * MS,
    examples: int = 40,
) -> type:
    """A test class for one framer.

    `good_frames`: octets of one frame that the framer calls good when `silence` (ns) lies on both sides.
    `timings`: lines and latencies to try. `examples`: how many cases each property draws.
    """
    relaxed = settings(
        max_examples=examples,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
    )

    @st.composite
    def captures(draw: st.DrawFn) -> tuple[Timing, list[Chunk]]:
        timing = draw(timings)
        return timing, draw(deliveries(timing, draw(wires(timing, good_frames))))

    # any octets at any times, backwards and huge ones too
    times = st.one_of(st.integers(0, 100 * MS), st.integers(-(10**20), 10**20), st.sampled_from([0, -1, 2**63]))
    wild = st.one_of(st.binary(max_size=80), good_frames, st.binary(min_size=300, max_size=1200))
    marks = st.lists(st.builds(Mark, st.integers(-2, 90), st.sampled_from(ERRORS)), max_size=2)
    wild_captures = st.tuples(
        timings, st.lists(st.builds(lambda t, o, m: Chunk(t, o, tuple(m)), times, wild, marks), max_size=8)
    )

    class FramerContract:
        @relaxed
        @given(captures())
        def test_conservation_and_provenance(self, capture: tuple[Timing, list[Chunk]]) -> None:
            timing, chunks = capture
            framer = factory(timing)
            events = drive(framer, chunks)
            check_conserved(events, chunks)
            check_provenance(events, framer, timing)

        @relaxed
        @given(captures(), CHOICES)
        def test_cut_invariance(self, capture: tuple[Timing, list[Chunk]], choices: bytes) -> None:
            timing, chunks = capture
            whole = drive(factory(timing), chunks)
            single = [p for c in chunks for p in cut(c, range(len(c.octets)), timing.char)]
            assert drive(factory(timing), single) == whole
            cuts = cycle(choice >= 192 for choice in choices)
            other = [p for c in chunks for p in cut(c, [at for at in range(len(c.octets)) if next(cuts)], timing.char)]
            assert drive(factory(timing), other) == whole

        @relaxed
        @given(captures(), CHOICES)
        def test_advance_decides_what_the_next_octet_would(
            self, capture: tuple[Timing, list[Chunk]], choices: bytes
        ) -> None:
            timing, chunks = capture
            live = factory(timing)
            events: list[Event] = []
            last = EPOCH
            for chunk, choice in zip(chunks, cycle(choices), strict=False):
                if choice >= 128:  # in some pause, anywhere from its begin to its end
                    events += live.advance(last + (chunk.time - last) * (choice - 128) // 127)
                while (due := live.deadline()) is not None and due <= chunk.time:
                    events += live.advance(due)
                events += live.feed(chunk)
                last = chunk.time
            events += live.close()
            assert events == drive(factory(timing), chunks)

        @relaxed
        @given(captures())
        def test_deadline_is_when_silence_means_something(self, capture: tuple[Timing, list[Chunk]]) -> None:
            timing, chunks = capture
            framer = factory(timing)
            events: list[Event] = []
            for chunk in chunks:
                events += framer.feed(chunk)
            last = max((c.time for c in chunks), default=EPOCH)
            for _ in range(10):
                due = framer.deadline()
                if due is None:
                    break
                assert due <= last + LONGEST_DELAY
                assert framer.advance(due - 1) == []
                assert framer.deadline() == due
                found = framer.advance(due)
                events += found
                later = framer.deadline()
                assert found or later is None or later > due, "the deadline came and nothing moved"
            assert framer.deadline() is None
            assert b"".join(e.octets for e in events) == b"".join(c.octets for c in chunks)
            assert framer.close() == []

        @relaxed
        @given(wild_captures, st.lists(st.integers(-(10**20), 10**20), max_size=3))
        def test_total(self, capture: tuple[Timing, list[Chunk]], moments: list[int]) -> None:
            timing, chunks = capture
            framer = factory(timing)
            events: list[Event] = []
            fed = 0
            for chunk in chunks:
                events += framer.feed(chunk)
                fed += len(chunk.octets)
                assert fed - sum(len(e.octets) for e in events) <= MOST_HELD
                for now in moments:
                    events += framer.advance(now)
                framer.deadline()
            events += framer.close()
            assert b"".join(e.octets for e in events) == b"".join(c.octets for c in chunks)
            assert framer.close() == []
            assert framer.advance(10**20) == []

        @relaxed
        @given(timings, rubbish(good_frames), good_frames)
        def test_resynchronisation(self, timing: Timing, before: bytes, frame: bytes) -> None:
            spacing = silence + 3 * timing.latency
            wire = [*whole_frames([before], timing, 0), *whole_frames([frame], timing, spacing)]
            shift = len(before) * timing.char
            chunks = wire[: len(before)] + [Chunk(c.time + shift, c.octets) for c in wire[len(before) :]]
            framer = factory(timing)
            events = [e for c in chunks for e in framer.feed(c)]
            events += framer.advance(chunks[-1].time + spacing)
            assert good_octets(events)[-1:] == [frame]

        @relaxed
        @given(timings, st.lists(good_frames, max_size=6))
        def test_clean_frames_are_all_found_and_none_invented(self, timing: Timing, frames: list[bytes]) -> None:
            spacing = silence + 3 * timing.latency
            chunks = whole_frames(frames, timing, spacing)
            events = drive(factory(timing), chunks)
            assert [e.octets for e in events] == frames
            assert good_octets(events) == frames

        @relaxed
        @given(timings, good_frames)
        def test_close_gives_a_complete_frame(self, timing: Timing, frame: bytes) -> None:
            framer = factory(timing)
            events = drive(framer, whole_frames([frame], timing, 0))
            assert b"".join(e.octets for e in events) == frame

    return FramerContract
