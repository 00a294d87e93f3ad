"""Pairing: what belongs together, what comes late, twice, damaged or never; segments; the contract of ids."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.bacnet import MSTP
from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.apdu import MORE_FOLLOWS, SEGMENTED
from dissectors.bacnet.envelope import frame, npdu_frame
from dissectors.bacnet.reassembly import Reassembler
from dissectors.frame import Chunk, Event, Frame, Role
from dissectors.line import LineSettings, Timing
from dissectors.tracker import Placement, Transaction, Verdict
from tests.seeds import examples

MS = 1_000_000
LINE = LineSettings(38400)
TIMING = Timing(LINE)

READ = bytes.fromhex("0c020004d2194d")
VALUE = bytes.fromhex("0c020004d2194d3e7502004131 3f".replace(" ", ""))


def request(invoke: int = 1, destination: int = 5, source: int = 2) -> bytes:
    body = apdus.encode(0, READ, invoke_id=invoke, service=12)
    return npdu_frame(destination, source, npdus.encode(body, expects_reply=True), expects_reply=True)


def answer(invoke: int = 1, destination: int = 2, source: int = 5) -> bytes:
    return npdu_frame(destination, source, npdus.encode(apdus.encode(3, VALUE, invoke_id=invoke, service=12)), False)


def refusal(invoke: int = 1) -> bytes:
    body = apdus.encode(5, bytes.fromhex("9101911f"), invoke_id=invoke, service=12)
    return npdu_frame(2, 5, npdus.encode(body), False)


TOKEN_25, TOKEN_52 = frame(0, 5, 2), frame(0, 2, 5)
POSTPONED = frame(7, 2, 5)


@dataclass
class Run:
    placements: list[Placement] = field(default_factory=list)
    closed: list[Transaction] = field(default_factory=list)

    def of(self, verdict: Verdict) -> list[Transaction]:
        return [t for t in self.closed if t.verdict is verdict]


def track(*steps: tuple[float, bytes], timing: Timing = TIMING, advance: float | None = None) -> Run:
    """Frames after so many ms of silence each."""
    framer, tracker, run, now = MSTP.framer(timing), MSTP.tracker(timing), Run(), 10**18
    events: list[Event] = []
    for silence, octets in steps:
        now += int(silence * MS) + len(octets) * timing.char
        events += framer.feed(Chunk(now, octets))
    events += framer.close()
    for no, event in enumerate(events):
        header = MSTP.peek(event) if isinstance(event, Frame) else None
        tracked = tracker.track(no, event, header)
        run.closed += tracked.closed
        if tracked.placement is not None:
            run.placements.append(tracked.placement)
    if advance is not None:
        run.closed += tracker.advance(now + int(advance * MS))
    run.closed += tracker.close()
    return run


def test_an_answer_at_once():
    run = track((10, request()), (30, answer()))
    (tx,) = run.closed
    assert (tx.verdict, tx.request, tx.response, tx.station, tx.kind) == (Verdict.ANSWERED, 0, 1, 5, "read-property")
    assert tx.latency is not None
    assert abs(tx.latency.nominal - 30 * MS) < 1000
    assert tx.latency.low == tx.latency.nominal == tx.latency.high
    assert [p.role for p in run.placements] == [Role.REQUEST, Role.RESPONSE]
    assert {p.tx for p in run.placements} == {tx.id}


def test_the_adapters_latency_bounds_the_answer_time():
    run = track((10, request()), (30, answer()), timing=Timing(LINE, 16 * MS))
    (tx,) = run.closed
    assert tx.latency is not None
    assert tx.latency.low == tx.latency.nominal - 16 * MS
    assert tx.latency.high == tx.latency.nominal + 16 * MS


def test_an_error_is_an_exception():
    run = track((10, request()), (30, refusal()))
    assert (run.closed[0].verdict, run.closed[0].error) == (Verdict.EXCEPTION, "object unknown-object")


def test_no_answer_then_a_token():
    run = track((10, request()), (260, TOKEN_25), (1, TOKEN_52))
    assert run.closed[0].verdict is Verdict.NO_RESPONSE
    assert run.closed[0].latency is None
    assert run.closed[1].kind == "token"
    assert run.closed[1].verdict is Verdict.DATA


def test_no_answer_then_silence():
    run = track((10, request()), advance=2000)
    assert run.closed[0].verdict is Verdict.NO_RESPONSE
    run = track((10, request()), advance=100)
    assert run.closed[0].verdict is Verdict.OPEN


def test_an_answer_after_the_asker_gave_up_is_late():
    run = track((10, request()), (260, TOKEN_25), (1, answer()))
    gone, _, late = sorted(run.closed, key=lambda t: t.id)
    assert gone.verdict is Verdict.NO_RESPONSE
    assert (late.verdict, late.of, late.request, late.response) == (Verdict.LATE, gone.id, None, 2)
    assert late.latency is not None
    assert late.latency.nominal > 260 * MS


def test_a_second_answer():
    run = track((10, request()), (30, answer()), (3, answer(source=5)))
    first, second = run.closed
    assert first.verdict is Verdict.ANSWERED
    assert (second.verdict, second.of, second.response) == (Verdict.ANSWERED_TWICE, first.id, 2)


def test_an_answer_that_nobody_asked_for():
    run = track((10, answer(invoke=9)))
    assert (run.closed[0].verdict, run.closed[0].response, run.closed[0].station) == (Verdict.UNSOLICITED, 0, 5)


def test_postponed_and_answered_with_the_next_token():
    run = track((10, request()), (20, POSTPONED), (2, TOKEN_25), (2, answer()), (2, TOKEN_52))
    tx = next(t for t in run.closed if t.kind == "read-property")
    assert (tx.verdict, tx.request, tx.response) == (Verdict.ANSWERED, 0, 3)
    assert [p.tx for p in run.placements[:2]] == [tx.id, tx.id]
    assert run.placements[3].tx == tx.id
    assert run.of(Verdict.UNSOLICITED) == []


def test_postponed_and_never_answered():
    steps = [(10, request()), (20, POSTPONED)]
    for _ in range(30):
        steps += [(400, TOKEN_25), (2, TOKEN_52)]
    run = track(*steps)
    tx = next(t for t in run.closed if t.kind == "read-property")
    assert tx.verdict is Verdict.NO_RESPONSE


def test_a_request_tried_again():
    run = track((10, request()), (260, TOKEN_25), (2, TOKEN_52), (2, request()), (20, answer()))
    first, again = [t for t in run.closed if t.kind == "read-property"]
    assert first.verdict is Verdict.NO_RESPONSE
    assert (again.verdict, again.attempt, again.of) == (Verdict.RETRY, 2, first.id)


def test_the_same_invoke_id_later_is_a_new_request():
    run = track((10, request()), (20, answer()), (20, request()), (20, answer()))
    assert [(t.verdict, t.attempt) for t in run.closed] == [(Verdict.ANSWERED, 1)] * 2


def test_a_repeated_token_and_a_lost_one():
    run = track((10, TOKEN_25), (25, TOKEN_25), (25, frame(1, 6, 2)), (30, frame(1, 7, 2)))
    first, again = run.of(Verdict.NO_RESPONSE)
    assert (again.attempt, again.of) == (2, first.id)
    run = track((10, TOKEN_25), (700, frame(1, 3, 2)))
    assert run.closed[0].verdict is Verdict.NO_RESPONSE


def test_polls_and_their_answers():
    run = track((10, frame(1, 5, 2)), (2, frame(2, 2, 5)), (2, frame(1, 6, 2)), (30, TOKEN_25))
    assert [(t.kind, t.verdict) for t in run.closed[:2]] == [
        ("poll-for-master", Verdict.ANSWERED),
        ("poll-for-master", Verdict.DATA),
    ]


def test_test_requests():
    run = track((10, frame(3, 5, 2, b"ping")), (5, frame(4, 2, 5, b"ping")), (5, frame(3, 6, 2)), (300, TOKEN_25))
    assert [t.verdict for t in run.closed[:2]] == [Verdict.ANSWERED, Verdict.NO_RESPONSE]


def test_broadcasts_and_unconfirmed_data():
    who_is = bytes.fromhex("01001008")
    run = track((10, frame(6, 255, 2, who_is)), (10, frame(6, 5, 2, who_is)), (10, frame(5, 255, 2, who_is)))
    assert [t.verdict for t in run.closed] == [Verdict.BROADCAST, Verdict.DATA, Verdict.BROADCAST]


def test_a_damaged_answer_and_a_damaged_request():
    broken = bytearray(answer())
    broken[12] ^= 1
    run = track((10, request()), (20, bytes(broken)), (30, TOKEN_25))
    assert (run.closed[0].verdict, run.closed[0].response) == (Verdict.DAMAGED_ANSWER, 1)
    broken = bytearray(request())
    broken[12] ^= 1
    run = track((10, bytes(broken)), (260, TOKEN_25))
    assert run.closed[0].verdict is Verdict.DAMAGED_REQUEST


def test_an_echo_is_told_only_where_times_are_fine():
    run = track((10, request()), (0.1, request()), (20, answer()))
    assert [t.verdict for t in run.closed] == [Verdict.ECHO, Verdict.ANSWERED]
    assert run.closed[0].of == run.closed[1].id
    run = track((10, request()), (0.1, request()), (20, answer()), timing=Timing(LINE, 17 * MS))
    assert run.of(Verdict.ECHO) == []


@pytest.mark.parametrize("latency", [0, 1, 17])
def test_a_token_that_comes_again_sooner_than_it_may_is_a_copy(latency: int):
    """0.1 ms, behind an adapter in the same read: nobody repeats a token so soon. 24 ms: it is repeated."""
    soon = 0 if latency > 15 else 0.1
    run = track((10, TOKEN_25), (soon, TOKEN_25), (2, request()), (20, answer()), timing=Timing(LINE, latency * MS))
    assert len(run.of(Verdict.ECHO)) == 1
    run = track((10, TOKEN_25), (24, TOKEN_25), (2, request()), (20, answer()), timing=Timing(LINE, latency * MS))
    assert run.of(Verdict.ECHO) == []


def test_two_clients_behind_one_router_with_the_same_invoke_id():
    def routed(client: int, body: bytes, back: bool) -> bytes:
        at = {"dnet": 100, "dadr": bytes((client,))} if back else {"snet": 100, "sadr": bytes((client,))}
        return npdu_frame(1 if back else 5, 5 if back else 1, npdus.encode(body, **at), expects_reply=not back)

    ask = apdus.encode(0, READ, invoke_id=3, service=12)
    reply = apdus.encode(3, VALUE, invoke_id=3, service=12)
    run = track(
        (10, routed(7, ask, False)),
        (10, frame(7, 1, 5)),
        (10, routed(8, ask, False)),
        (10, frame(7, 1, 5)),
        (10, frame(0, 5, 1)),
        (2, routed(8, reply, True)),
        (2, routed(7, reply, True)),
    )
    reads = [t for t in run.closed if t.kind == "read-property"]
    assert [(t.request, t.response, t.verdict) for t in reads] == [(2, 5, Verdict.ANSWERED), (0, 6, Verdict.ANSWERED)]


def segment(number: int, piece: bytes, more: bool) -> bytes:
    flags = SEGMENTED | (MORE_FOLLOWS if more else 0)
    body = apdus.encode(3, piece, invoke_id=17, service=14, flags=flags, sequence=number & 0xFF, window=4)
    return npdu_frame(2, 5, npdus.encode(body), False)


def acknowledge(number: int) -> bytes:
    return npdu_frame(5, 2, npdus.encode(apdus.encode(4, invoke_id=17, sequence=number & 0xFF, window=4)), False)


def ask_many() -> bytes:
    body = apdus.encode(0, bytes.fromhex("0c020004d21e09081f"), invoke_id=17, service=14, flags=2)
    return npdu_frame(5, 2, npdus.encode(body, expects_reply=True), True)


RESULT = bytes.fromhex("0c020004d21e294d4e7504004148554f1f")


def test_segments_belong_to_the_exchange_of_the_request():
    run = track(
        (10, ask_many()),
        (10, segment(0, RESULT[:6], True)),
        (10, acknowledge(0)),
        (10, segment(1, RESULT[6:], False)),
        (10, acknowledge(1)),
    )
    tx = next(t for t in run.closed if t.verdict is Verdict.ANSWERED)
    assert (tx.request, tx.response) == (0, 3)
    assert [p.tx for p in run.placements] == [tx.id] * 5
    assert [t.verdict for t in run.closed] == [Verdict.ANSWERED]


def gather(*pieces: bytes):
    reassembler, found = Reassembler(), []
    for no, octets in enumerate(pieces):
        (event,) = MSTP.framer(TIMING).feed(Chunk(10**18, octets + b"\x55"))
        assert isinstance(event, Frame)
        gathered = reassembler.add(no, event)
        if gathered is not None:
            found.append(gathered)
    return found


def test_segments_are_joined_in_their_order():
    body = RESULT * 40
    cuts = [body[n : n + 2] for n in range(0, len(body), 2)]
    pieces = [segment(n, piece, n < len(cuts) - 1) for n, piece in enumerate(cuts)]
    assert len(pieces) > 256
    (whole,) = gather(*pieces)
    assert whole.frames == tuple(range(len(cuts)))
    assert whole.octets == apdus.encode(3, body, invoke_id=17, service=14)
    repeated = [pieces[0], pieces[1], pieces[1], pieces[0], *pieces[2:]]
    assert gather(*repeated)[-1].octets == whole.octets


def test_a_lost_segment_leaves_a_hole():
    pieces = [segment(n, RESULT[n * 4 : n * 4 + 4], n < 4) for n in range(5)]
    (broken,) = gather(pieces[0], pieces[1], pieces[3], pieces[4])
    assert broken.missing == (2,)
    assert broken.octets == b""
    broken, whole = gather(pieces[0], pieces[1], pieces[3], pieces[4], pieces[2])
    assert not broken.complete
    assert whole.complete
    assert whole.octets == apdus.encode(3, RESULT, invoke_id=17, service=14)


BUS = st.sampled_from(
    [
        request(),
        request(2),
        request(1, 9),
        answer(),
        answer(2),
        refusal(),
        POSTPONED,
        TOKEN_25,
        TOKEN_52,
        frame(1, 6, 2),
        frame(2, 2, 6),
        frame(3, 5, 2),
        frame(4, 2, 5),
        segment(0, RESULT[:6], True),
        segment(1, RESULT[6:], False),
        acknowledge(0),
        ask_many(),
        b"\x00\xff",
        request()[:-3],
        frame(6, 255, 2, bytes.fromhex("01001008")),
    ]
)


def test_segments_that_follow_a_damaged_request_belong_to_what_they_began():
    """Both exchanges end: the one that was answered, and the request that nobody understood."""
    first, last = (
        npdu_frame(2, 5, bytes.fromhex(octets), expects_reply=False)
        for octets in ("01003c1100040e0c020004d21e", "0100381101040e29554475040041")
    )
    run = track((0, first), (5, request()[:-2]), (5, last))
    assert sorted(tx.id for tx in run.closed) == [1, 2]
    assert [placement.tx for placement in run.placements] == [1, 2, 1]
    assert {tx.id: tx.verdict for tx in run.closed}[2] is Verdict.DAMAGED_REQUEST


@settings(max_examples=examples(150), deadline=None)
@given(st.lists(st.tuples(st.sampled_from([0, 1, 20, 260, 600, 11_000]), BUS), max_size=25))
def test_whatever_passes_each_transaction_closes_once(steps: list[tuple[float, bytes]]):
    run = track(*steps)
    ids = [t.id for t in run.closed]
    assert sorted(ids) == list(range(1, len(ids) + 1))
    assert {p.tx for p in run.placements} == set(ids)
    requests = [t.request for t in run.closed if t.request is not None]
    assert len(requests) == len(set(requests))
    for transaction in run.closed:
        assert transaction.start <= transaction.end
        assert transaction.of is None or transaction.of < transaction.id


def test_a_second_answer_needs_a_first():
    """What came first was damaged: the good answer is late, and only one more after it is a second one."""
    damaged = answer()[:-1] + bytes((answer()[-1] ^ 1,))
    run = track((10, request()), (10, damaged), (300, answer()), (300, answer()))
    assert [t.verdict for t in run.closed] == [Verdict.DAMAGED_ANSWER, Verdict.LATE, Verdict.ANSWERED_TWICE]


def test_noise_after_a_long_silence_ends_what_waited():
    run = track((10, request()), (11_000, b"\x00\xff"))
    assert [t.verdict for t in run.closed] == [Verdict.NO_RESPONSE]


@settings(max_examples=examples(80), deadline=None)
@given(st.lists(st.tuples(st.sampled_from([1, 20, 260, 600, 11_000]), BUS), max_size=15), st.data())
def test_live_and_saved_give_the_same(steps: list[tuple[float, bytes]], data: st.DataObject):
    framer, live, now = MSTP.framer(TIMING), MSTP.tracker(TIMING), 10**18
    closed: list[Transaction] = []
    no = 0
    for silence, octets in steps:
        quiet = now
        now += int(silence * MS) + len(octets) * TIMING.char
        for moment in sorted(data.draw(st.lists(st.integers(quiet, now - len(octets) * TIMING.char), max_size=2))):
            for event in framer.advance(moment):
                header = MSTP.peek(event) if isinstance(event, Frame) else None
                closed += live.track(no, event, header).closed
                no += 1
            closed += live.advance(moment)
        for event in framer.feed(Chunk(now, octets)):
            header = MSTP.peek(event) if isinstance(event, Frame) else None
            closed += live.track(no, event, header).closed
            no += 1
    for event in framer.close():
        closed += live.track(no, event, MSTP.peek(event) if isinstance(event, Frame) else None).closed
        no += 1
    closed += live.close()
    assert closed == track(*steps).closed


def test_a_segment_cut_in_its_header_is_a_request_that_nobody_answered():
    """It says that more follow and has no invoke id: nothing can follow it."""
    for pause in (5, 600):
        run = track((5, TOKEN_52), (5, frame(5, 5, 2, b"\x01\x04\x0c")), (pause, TOKEN_25), (5, TOKEN_52))
        assert [transaction.request for transaction in run.of(Verdict.NO_RESPONSE)] == [1]
