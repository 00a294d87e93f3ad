"""The framer contract on N2, and what N2 asks beyond it: context for answers, restarts, exchanges without a pause."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dissectors.checksums import sum8
from dissectors.frame import Check, Chunk, Event, Frame, LineError, Mark, Noise
from dissectors.line import Timing
from dissectors.n2.framing import MAX_LENGTH, N2Framer
from sniff.testing.framer_contract import framer_contract
from tests.seeds import examples

relaxed = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
MS = 1_000_000
START = 10**18

COMMANDS = [b">0111010387\r", b">01FA7\r", b">0104C5\r", b">01250141a80000E7\r", b">11Z66L015842\r", b">FE130103B3\r"]
ANSWERS = [b"A0042910000F0\r", b"A4064\r", b"A1061\r", b"AC073\r", b"A0060\r", b"A301004248000086\r"]
SHORT = [b"A\r", b"N11\r", b"N00\r"]

TestN2Contract = framer_contract(N2Framer, st.sampled_from(COMMANDS + ANSWERS), examples=examples(120))

wire = st.one_of(
    st.binary(max_size=12),
    st.text("0123456789ABCDEFN>A\r\n:", max_size=20).map(str.encode),
    st.sampled_from(COMMANDS + ANSWERS + SHORT),
)
latencies = st.sampled_from([0, 1 * MS, 17 * MS])
pauses = st.one_of(st.just(0), st.integers(0, 5 * MS), st.sampled_from([30 * MS, 250 * MS, 5000 * MS]))
stretches = st.lists(st.tuples(wire, pauses), max_size=12)


def chunks_of(parts: list[tuple[bytes, int]], timing: Timing) -> list[Chunk]:
    now, made = START, []
    for octets, pause in parts:
        now += pause + len(octets) * timing.char
        made.append(Chunk(now, octets))
    return made


def run(framer: N2Framer, chunks: list[Chunk]) -> list[Event]:
    events: list[Event] = []
    for chunk in chunks:
        events += framer.feed(chunk)
    return events + framer.close()


@relaxed
@given(stretches, latencies, st.data())
def test_cuts_do_not_matter(parts, latency, data):
    timing = Timing(latency=latency)
    chunks = chunks_of(parts, timing)
    cut: list[Chunk] = []
    for chunk in chunks:
        places = sorted(data.draw(st.sets(st.integers(1, max(1, len(chunk.octets) - 1)), max_size=3)))
        bounds = [0, *(p for p in places if p < len(chunk.octets)), len(chunk.octets)]
        for low, high in pairwise(bounds):
            late = (len(chunk.octets) - high) * timing.char
            cut.append(Chunk(chunk.time - late, chunk.octets[low:high]))
    assert run(N2Framer(timing), cut) == run(N2Framer(timing), chunks)


@relaxed
@given(stretches, latencies)
def test_listening_live_gives_what_a_replay_gives(parts, latency):
    """Octet by octet, `advance` at every deadline and just before each octet changes nothing."""
    timing = Timing(latency=latency)
    single = [
        Chunk(c.time - (len(c.octets) - 1 - i) * timing.char, c.octets[i : i + 1])
        for c in chunks_of(parts, timing)
        for i in range(len(c.octets))
    ]
    live, events = N2Framer(timing), []
    for chunk in single:
        while (due := live.deadline()) is not None and due <= chunk.time:
            before = len(events)
            events += live.advance(due)
            assert len(events) > before, "a deadline that gives nothing"
        events += live.advance(chunk.time - 1)
        events += live.feed(chunk)
    events += live.close()
    assert events == run(N2Framer(timing), single)


@relaxed
@given(st.lists(st.tuples(st.integers(-(10**12), 10**12), st.binary(max_size=300)), max_size=20), latencies)
def test_any_octets_any_times(reads, latency):
    framer, seen = N2Framer(Timing(latency=latency)), b""
    for time, octets in reads:
        for event in framer.feed(Chunk(time, octets, (Mark(0, LineError.PARITY),))):
            seen += event.octets
        framer.advance(time)
        held = sum(len(o) for _, o in reads) - len(seen)
        assert held >= 0
        framer.deadline()
    framer.close()


@settings(relaxed, max_examples=25)
@given(st.binary(min_size=2000, max_size=4000).map(lambda o: o.replace(b"\r", b"\n")))
def test_memory_is_bounded_without_any_end(octets):
    timing = Timing()
    framer = N2Framer(timing)
    given_out = sum(len(e.octets) for e in framer.feed(Chunk(START, octets)))
    assert len(octets) - given_out <= 2 * MAX_LENGTH


@relaxed
@given(stretches, latencies, st.sampled_from(COMMANDS))
def test_after_any_rubbish_the_next_command_is_found_at_once(parts, latency, command):
    timing = Timing(latency=latency)
    framer = N2Framer(timing)
    chunks = chunks_of(parts, timing)
    for chunk in chunks:
        framer.feed(chunk)
    last = chunks[-1].time if chunks else START
    events = framer.feed(Chunk(last + len(command) * timing.char, command))
    assert isinstance(events[-1], Frame)
    assert events[-1].ok
    assert events[-1].octets == command


@relaxed
@given(stretches, latencies, st.sampled_from(ANSWERS))
def test_after_any_rubbish_and_silence_the_next_answer_is_found(parts, latency, answer):
    timing = Timing(latency=latency)
    framer = N2Framer(timing)
    chunks = chunks_of([*parts, (b"x", 0)], timing)
    for chunk in chunks:
        framer.feed(chunk)
    events = framer.feed(Chunk(chunks[-1].time + 1200 * MS + len(answer) * timing.char, answer))
    assert isinstance(events[-1], Frame)
    assert events[-1].ok
    assert events[-1].octets == answer


@relaxed
@given(stretches, latencies, st.sampled_from(COMMANDS), st.sampled_from(ANSWERS + SHORT))
def test_after_any_rubbish_an_exchange_without_a_pause_is_found(parts, latency, command, answer):
    timing = Timing(latency=latency)
    events = run(N2Framer(timing), chunks_of([*parts, (command + answer, 0)], timing))
    assert [e.octets for e in events[-2:]] == [command, answer]
    assert all(isinstance(e, Frame) and e.damage is None for e in events[-2:])


@relaxed
@given(stretches, latencies)
def test_what_a_frame_says_of_how_it_was_found_is_true(parts, latency):
    timing = Timing(latency=latency)
    skipped, seen = 0, b""
    for event in run(N2Framer(timing), chunks_of(parts, timing)):
        seen += event.octets
        if isinstance(event, Noise):
            skipped += len(event.octets)
            continue
        assert event.skipped == skipped
        skipped = 0
        assert len(event.octets) <= MAX_LENGTH
        if event.damage is None:
            assert event.octets.endswith(b"\r")
            assert event.octets.count(b">") == (event.octets[0] == 0x3E)
        if event.check is Check.GOOD:
            assert int(event.octets[-3:-1], 16) == sum8(event.octets[1:-3])
    assert seen == b"".join(octets for octets, _ in parts)


@relaxed
@given(st.lists(st.sampled_from(COMMANDS), min_size=1, max_size=4), st.integers(1, 60), latencies)
def test_joined_in_the_middle_no_answer_is_made_of_a_command(commands, cut, latency):
    """`A` is a hex digit: a tail of a command must not pass for an answer that nobody sent."""
    timing = Timing(latency=latency)
    octets = b"".join(commands)[cut:]
    events = run(N2Framer(timing), chunks_of([(octets, 0)], timing))
    assert all(e.octets[:1] == b">" for e in events if isinstance(e, Frame))


@relaxed
@given(st.sampled_from(COMMANDS + ANSWERS), st.data())
def test_one_damaged_octet_is_never_a_good_frame(frame, data):
    at = data.draw(st.integers(1, len(frame) - 1))
    other = data.draw(
        # (a CR makes a whole acknowledgement of the begin of an answer, which nothing can tell)
        st.integers(0, 255).filter(
            lambda o: o not in (frame[at], 0x0D) and bytes([o]).upper() != frame[at : at + 1].upper()
        )
    )
    octets = frame[:at] + bytes([other]) + frame[at + 1 :]
    timing = Timing()
    events = run(N2Framer(timing), chunks_of([(b">0104C5\r", 0), (octets, 20 * MS)], timing))
    good = [e for e in events if isinstance(e, Frame) and e.ok]
    assert [e.octets for e in good] == [b">0104C5\r"]
    assert b"".join(e.octets for e in events) == b">0104C5\r" + octets
