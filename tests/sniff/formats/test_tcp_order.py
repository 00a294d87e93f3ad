"""Two directions of a connection, captured apart: what acknowledges octets comes behind them."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from sniff.formats import read
from sniff.formats.network import Address, Segment
from sniff.formats.tcp_order import TcpOrder
from sniff.formats.tcp_stream import TcpStream
from tests.seeds import some
from tests.sniff.formats.packets_made import CLIENT, PUSH, SERVER, as_pcap, tcp
from tests.sniff.formats.test_network_captures import MS, START, _sealed

ACKNOWLEDGED = PUSH | 16
Captured = tuple[int, Segment]


def _dialogue(chance: random.Random) -> tuple[list[Captured], list[bytes]]:
    """Segments of requests, answers and bare acknowledgements with the times at which they were on the wire."""
    next_of = {CLIENT: chance.getrandbits(32), SERVER: chance.getrandbits(32)}
    segments: list[Captured] = []
    said = []
    time = START

    def add(source: Address, payload: bytes, begins: bool = False) -> None:
        other = SERVER if source == CLIENT else CLIENT
        expected = None if begins and source == CLIENT else next_of[other] & 0xFFFFFFFF
        sequence = (next_of[source] - begins) & 0xFFFFFFFF
        segments.append((time, Segment(source, other, payload, sequence, begins, 0, expected)))
        next_of[source] += len(payload)

    if chance.random() < 0.3:
        add(CLIENT, b"", begins=True)
        add(SERVER, b"", begins=True)
    for number in range(12):
        answer_in = chance.choice([MS // 5, 2 * MS, 50 * MS])
        for source in (CLIENT, SERVER):
            time += answer_in
            said.append(bytes([number, source == CLIENT]) * chance.randint(1, 5))
            add(source, said[-1])
        if chance.random() < 0.5:
            time += 10_000
            add(CLIENT, b"")
        time += 80 * MS
    return segments, said


def _captured(segments: list[Captured], early: int) -> list[Captured]:
    """As who captures the server's direction so many ns too early writes them."""
    times = [time - early * (one.source == SERVER) for time, one in segments]
    order = sorted(range(len(segments)), key=times.__getitem__)
    return [(times[at], segments[at][1]) for at in order]


def _said(captured: list[Captured]) -> tuple[list[int], bytes]:
    order = TcpOrder()
    found = [one for captured_one in captured for one in order.add(*captured_one)]
    found += order.close(captured[-1][0])
    return [time for time, _, _ in found], b"".join(one for _, _, one in found if isinstance(one, bytes))


@pytest.mark.parametrize("seed", some(range(400), 4))
def test_each_waits_for_what_it_acknowledges(seed: int) -> None:
    chance = random.Random(seed)
    segments, said = _dialogue(chance)
    times, heard = _said(_captured(segments, chance.choice([0, 0, 3 * MS, 5 * MS])))
    assert heard == b"".join(said)
    assert times == sorted(times)


@pytest.mark.parametrize("seed", some(range(200), 4))
def test_nothing_of_what_was_captured_is_lost_where_packets_are_missing(seed: int) -> None:
    chance = random.Random(seed)
    segments, _ = _dialogue(chance)
    captured = [one for one in _captured(segments, 3 * MS) if chance.random() > 0.1]
    assert len(_said(captured)[1]) == sum(len(one.payload) for _, one in captured)


def test_an_answer_that_was_written_first_stands_behind_its_request(tmp_path: Path) -> None:
    packets = []
    sent = [100, 5000]
    said = b""
    for number in range(8):
        request, answer = _sealed(1, 3, 0, number, 0, 1), _sealed(1, 3, 2, 1, number)
        time = START + number * 100 * MS
        asked = tcp(CLIENT, SERVER, sent[0], request, ACKNOWLEDGED, acknowledged=sent[1])
        told = tcp(SERVER, CLIENT, sent[1], answer, ACKNOWLEDGED, acknowledged=sent[0] + len(request))
        packets += [(time, told), (time + 30_000, asked)]
        sent = [sent[0] + len(request), sent[1] + len(answer)]
        said += request + answer
    capture = read(as_pcap(tmp_path / "mirrored.pcap", packets))
    assert b"".join(item.octets for item in capture.items() if isinstance(item, Chunk)) == said


def test_a_connection_whose_begin_was_not_captured_is_not_the_one_before() -> None:
    """Its octets are counted from another number, which may be lower: none of them came twice."""
    stream = TcpStream()
    found = [one for at in (5_000_000_000 % (1 << 32), 1_000, 1_003) for one in stream.add(_segment(at, b"abc"))]
    assert found == [b"abc", -1, b"abc", b"abc"]
    assert list(stream.close()) == []


def _segment(sequence: int, payload: bytes) -> Segment:
    return Segment(CLIENT, SERVER, payload, sequence)
