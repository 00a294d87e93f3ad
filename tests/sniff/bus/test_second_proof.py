"""What waits for the proof of a second protocol: a window's rows, and no more of a capture than that."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from sniff.bus import second_proof
from sniff.engine.blocks import Block
from sniff.engine.bulk import tables
from sniff.engine.session import SECOND_NOTE, LineEvent, Session
from sniff.engine.table import Table
from tests.bench import bulk_mstp

SESSION = Session("bus", bulk_mstp.LINE, "mstp")
BLOCKS = 8


def blocks() -> list[Block]:
    """One after the other, each with some damaged frames."""
    reads = bulk_mstp.reads(400, damaged=0.05)
    step = int(reads.times[-1] - reads.times[0]) + 1_000_000_000
    return [Block(replace(reads, times=reads.times + part * step)) for part in range(BLOCKS)]


def test_a_damaged_capture_comes_as_it_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(second_proof, "WINDOW", len(blocks()[0].reads.octets) * 4 // 5)
    made: list[Table | LineEvent] = []

    def read() -> Iterator[Table | LineEvent]:
        for item in tables(blocks(), SESSION):
            made.append(item)
            yield item

    given = []
    for item in second_proof.proving(read(), second_proof.SecondProof(SESSION)):
        given.append(item)
        assert len(made) - len(given) <= 2, "rows of windows that were asked are still held"
    assert given == made
    assert all(isinstance(item, Table) and not item.good.all() for item in given[:BLOCKS])


def test_a_relative_on_networks_is_no_second_protocol_of_a_line() -> None:
    noted = replace(SESSION, notes={SECOND_NOTE: "modbus-tcp"})
    assert second_proof.SecondProof(noted).name == "", "all rows were held back for it, and none was shown"
    assert second_proof.SecondProof(replace(SESSION, notes={SECOND_NOTE: "n2"})).name == "n2"
