"""The adapter model: nothing lost, nothing early, nothing later than it claims."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.frame import Chunk, LineError
from dissectors.line import LineSettings
from dissectors.simulated_faults import BitFlips, Break, MarkParity, NoiseInGaps
from sniff.engine.session import LineEvent, LineEventKind
from sniff.simulation.tap import CH340, EXACT, FTDI, FTDI_LOW_LATENCY, MODELS, MS, OCTETS, UART, Tap, TapModel
from sniff.simulation.wire import Burst, Wire

LINE = LineSettings.parse("19200,8E1")
CHAR = LINE.char

sendings = st.lists(st.tuples(st.integers(0, 300 * MS), st.binary(min_size=1, max_size=150)), min_size=1, max_size=8)
models = st.one_of(
    st.sampled_from(list(MODELS.values())),
    st.builds(
        TapModel,
        timer=st.sampled_from([0, MS, 16 * MS]),
        packet=st.integers(1, 70),
        idle=st.integers(0, 5),
        usb_frame=st.sampled_from([0, 125_000, MS]),
        jitter=st.integers(0, 5 * MS),
        cut=st.sampled_from([0.0, 0.5, 1.0]),
    ),
)


def bursts_of(sends: list[tuple[int, bytes]], *faults: object) -> list[Burst]:
    wire = Wire(LINE, faults=faults)  # type: ignore[arg-type]
    for place, (at, octets) in enumerate(sends):
        wire.send(f"party {place % 3}", at, octets)
    return list(wire.run(10**12))


def chunks_of(items: list[object]) -> list[Chunk]:
    return [item for item in items if isinstance(item, Chunk)]


@settings(deadline=None)
@given(sendings, models, st.integers(0, 3))
def test_every_octet_is_read_after_its_end_and_within_the_latency(
    sends: list[tuple[int, bytes]], model: TapModel, seed: int
) -> None:
    bursts = bursts_of(sends)
    chunks = chunks_of(list(Tap(LINE, model, seed).tap(bursts)))
    assert b"".join(c.octets for c in chunks) == b"".join(b.octets for b in bursts)
    assert all(before.time <= after.time for before, after in pairwise(chunks))
    ends = [end for burst in bursts for end in burst.ends]
    last = 0
    for chunk in chunks:
        last += len(chunk.octets)
        assert ends[last - 1] <= chunk.time  # the contract of `Chunk.time`
    collided = any(len(burst.sent) > 1 for burst in bursts)  # then octets may follow each other half a bit too soon
    shift = LINE.bits(1) * max(len(chunk.octets) for chunk in chunks) if collided else 0
    for nominal, end in zip(_nominal(chunks), ends, strict=True):
        assert end - shift <= nominal <= end + model.latency(LINE)


def _nominal(chunks: list[Chunk]) -> list[int]:
    """The latest end that each octet may have had: back to back before the read."""
    return [
        chunk.time - (len(chunk.octets) - 1 - place) * CHAR for chunk in chunks for place in range(len(chunk.octets))
    ]


@settings(deadline=None)
@given(sendings, st.sampled_from([EXACT, OCTETS, UART]))
def test_marks_stay_at_their_octets(sends: list[tuple[int, bytes]], model: TapModel) -> None:
    model = replace(model, ambiguous=False)
    bursts = bursts_of(sends, MarkParity(0.1), BitFlips(0.01), Break(0.2))
    chunks = chunks_of(list(Tap(LINE, model).tap(bursts)))
    assert _marks([(c.octets, c.marks) for c in chunks]) == _marks([(b.octets, b.marks) for b in bursts])


def _marks(parts):  # type: ignore[no-untyped-def]
    found, base = [], 0
    for octets, marks in parts:
        found += [(base + mark.offset, mark.error) for mark in marks]
        base += len(octets)
    return found


def test_an_exact_tap_reads_a_burst_as_its_last_octet_ends() -> None:
    bursts = bursts_of([(0, b"abc"), (50 * MS, b"defg")])
    assert list(Tap(LINE).tap(bursts)) == [Chunk(3 * CHAR, b"abc"), Chunk(50 * MS + 4 * CHAR, b"defg")]


def test_octet_by_octet() -> None:
    bursts = bursts_of([(0, b"abc")])
    assert list(Tap(LINE, OCTETS).tap(bursts)) == [Chunk(CHAR * (k + 1), b"abc"[k : k + 1]) for k in range(3)]


def test_sixteen_milliseconds_of_latency_merge_question_and_answer() -> None:
    bursts = bursts_of([(0, b"question"), (8 * CHAR + 3 * MS, b"answer")])
    chunks = chunks_of(list(Tap(LINE, FTDI).tap(bursts)))
    assert b"questionanswer" in [c.octets for c in chunks] or len(chunks[0].octets) > 8


def test_a_long_answer_is_cut_every_62_octets() -> None:
    bursts = bursts_of([(0, bytes(200))])
    slow = replace(FTDI, timer=200 * MS, jitter=0, usb_frame=0)
    assert [len(c.octets) for c in chunks_of(list(Tap(LINE, slow).tap(bursts)))] == [62, 62, 62, 14]


def test_one_error_flag_covers_the_whole_packet_of_an_ftdi_and_cannot_tell_parity_from_framing() -> None:
    bursts = bursts_of([(0, bytes(20))], MarkParity(0.08))
    (marked,) = [b for b in bursts if b.marks]
    assert len(marked.marks) < 20
    one_packet = replace(FTDI, timer=100 * MS)
    (chunk,) = chunks_of(list(Tap(LINE, one_packet).tap(bursts)))
    assert [mark.offset for mark in chunk.marks] == list(range(20))
    assert {mark.error for mark in chunk.marks} == {LineError.PARITY | LineError.FRAMING}


def test_an_adapter_that_cannot_report_says_so_and_reports_nothing() -> None:
    bursts = bursts_of([(0, bytes(50))], MarkParity(1.0))
    assert bursts[0].marks
    assert all(not c.marks for c in chunks_of(list(Tap(LINE, CH340).tap(bursts))))
    assert CH340.adapter(LINE).reports == ()
    assert FTDI_LOW_LATENCY.adapter(LINE).latency == 2 * MS + MS // 2


def test_while_unplugged_nothing_is_read_and_both_moments_are_told() -> None:
    bursts = bursts_of([(0, b"one"), (100 * MS, b"two"), (200 * MS, b"three")], NoiseInGaps(0.0))
    model = replace(FTDI_LOW_LATENCY, unplugged=((90 * MS, 150 * MS),))
    items = list(Tap(LINE, model).tap(bursts))
    kinds = [item.kind if isinstance(item, LineEvent) else item.octets for item in items]
    assert b"".join(k for k in kinds if isinstance(k, bytes)) == b"onethree"
    place = kinds.index(LineEventKind.UNPLUGGED)
    assert kinds[place + 1] is LineEventKind.REPLUGGED
    assert all(before.time <= after.time for before, after in pairwise(items))


@pytest.mark.parametrize("name", MODELS)
def test_the_same_seed_reads_the_same(name: str) -> None:
    bursts = bursts_of([(k * 20 * MS, bytes(range(k, k + 30))) for k in range(20)])
    model = replace(MODELS[name], cut=0.3)
    assert list(Tap(LINE, model, 5).tap(bursts)) == list(Tap(LINE, model, 5).tap(bursts))
