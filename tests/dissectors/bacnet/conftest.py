"""Fixtures of the BACnet tests."""

from __future__ import annotations

import pytest

from dissectors.bacnet import MSTP
from dissectors.frame import Chunk, Event
from tests.dissectors.bacnet.captures import PCAPS, TIMING, folder, pcap_records


@pytest.fixture(scope="session", params=sorted(PCAPS))
def capture(request: pytest.FixtureRequest) -> tuple[str, list[tuple[int, bytes]], list[list[Event]]]:
    """(name, pcap records, events of each record) of a capture; the records are fed one by one as chunks."""
    name = request.param
    records = list(pcap_records(folder(name) / PCAPS[name]))
    framer = MSTP.framer(TIMING)
    events: list[Event] = []
    for time, octets in records:
        events += framer.feed(Chunk(time, octets))
    events += framer.close()
    by_record: list[list[Event]] = []
    at = 0
    for _, octets in records:
        mine, size = [], 0
        while size < len(octets):
            mine.append(events[at])
            size += len(events[at].octets)
            at += 1
        assert size == len(octets), "an event crosses records"
        by_record.append(mine)
    return name, records, by_record
