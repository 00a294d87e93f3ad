"""Simulated stations that answer in segments: a clean bus stays clean, a noisy one loses no answer for good."""

from __future__ import annotations

import pytest

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet.application import thing
from dissectors.bacnet.reassembly import Reassembler
from dissectors.bacnet.segmenting import RETRIES, SEGMENT_TIMEOUT, SegmentReceiver, SegmentSender
from dissectors.bacnet.simulated import Device, Faults, Poller, SimulatedNode
from dissectors.bacnet.values import ObjectId
from dissectors.frame import Assembly, Frame
from dissectors.tracker import Verdict
from tests.dissectors.bacnet.ring_bus import MS, TIMING, Heard, run


def ring(faults: Faults | None = None, max_apdu: int = 90, objects: int = 60) -> list[SimulatedNode]:
    """2 reads the object list of 5 again and again; 9 is quiet. Simulated stations hear a frame when it has ended: one
    that takes longer than the usage timeout would be taken for a token that nobody used."""
    held = {ObjectId(2, number): thing(ObjectId(2, number), f"value {number}", 1.0) for number in range(objects)}
    held[ObjectId(8, 70)] = thing(ObjectId(8, 70), "controller", None)
    device = Device(70, held, max_apdu=max_apdu, segments=True)
    poller = Poller([(5, "device,70", "object-list")], every=700 * MS)
    return [
        SimulatedNode(2, TIMING, poller, max_master=12),
        SimulatedNode(5, TIMING, device, max_master=12, max_info_frames=3, faults=faults),
        SimulatedNode(9, TIMING, max_master=12),
    ]


def gathered(heard: Heard) -> list[Assembly]:
    reassembler = Reassembler()
    found = [reassembler.add(no, event) for no, event in enumerate(heard.events) if isinstance(event, Frame)]
    return [one for one in found if one is not None]


@pytest.mark.parametrize("max_apdu", [50, 80, 110])
def test_a_clean_bus_with_answers_in_segments_stays_clean(max_apdu: int):
    heard = run(ring(max_apdu=max_apdu), 20)
    assert heard.findings == ()
    reads = [one for one in heard.transactions if one.kind == "read-property" and one.verdict is not Verdict.OPEN]
    assert len(reads) > 20
    assert {one.verdict for one in reads} == {Verdict.ANSWERED}
    assert not [one for one in heard.transactions if one.kind == "segment-ack"]
    whole = gathered(heard)
    assert len(whole) >= len(reads)
    assert len({one.octets[3:] for one in whole}) == 1
    assert all(one.complete for one in whole)
    assert len(whole[0].frames) == -(-311 // (max_apdu - 5))  # 61 objects


def test_damaged_segments_are_refused_or_sent_again():
    heard = run(ring(Faults(damages_every=7)), 60)
    reads = [one for one in heard.transactions if one.kind == "read-property" and one.verdict is Verdict.ANSWERED]
    assert len(reads) > 20
    assert Verdict.ANSWERED_TWICE not in {one.verdict for one in heard.transactions}
    assert Verdict.UNSOLICITED not in {one.verdict for one in heard.transactions}
    assert len({one.octets[3:] for one in gathered(heard) if one.complete}) == 1


def test_a_sender_gives_up_after_its_retries():
    sender = SegmentSender.of(1, 12, bytes(300), 50)
    assert len(sender.window_of_segments()) == 1
    now, sent = 0, 0
    while not sender.is_over:
        sent += len(sender.wake(now))
        now += SEGMENT_TIMEOUT
    assert sent == RETRIES


def test_windows_and_acknowledgements_fit():
    sender, receiver = SegmentSender.of(1, 12, bytes(range(250)) * 5, 50), SegmentReceiver(window=3)
    segments, taken, acknowledged = sender.window_of_segments(), b"", 0
    while segments:
        answers = []
        for octets in segments:
            segment = apdus.decode(octets)
            assert segment is not None
            taken += octets[segment.body :]
            answer = receiver.take(segment)
            answers += [] if answer is None else [answer]
        assert len(answers) == 1
        acknowledged += 1
        header = apdus.decode(answers[0])
        assert header is not None
        segments = sender.take(header)
    assert taken == bytes(range(250)) * 5
    assert receiver.is_whole
    assert sender.is_over
    assert acknowledged == 1 + -(-(len(sender.pieces) - 1) // 3)
