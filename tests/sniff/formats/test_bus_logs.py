"""A conversation of several stations in the logs of more tools: every frame, whose it is, and when it came."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk, Frame
from dissectors.frame import Role as Way
from sniff.analysis.told_protocol import detected
from sniff.bus.offline import settled
from sniff.formats import read
from tests.sniff.formats.bus_logs import LOGS, NS, TALK
from tests.sniff.formats.written_anew import write_anew

DATED = ("tabs-within-the-time", "thread-of-a-trace", "export-of-a-journal")


@pytest.mark.parametrize("name", LOGS)
def test_frames_directions_and_times(name: str, tmp_path: Path) -> None:
    log = LOGS[name]
    path = tmp_path / f"{name}.log"
    write_anew(path, log.log)
    capture = read(path)
    items = [item for item in capture.items() if isinstance(item, Chunk)]
    said = [one for one in TALK if log.only is None or one.asks is log.only]
    if name == "truncated-last-line":
        said = said[:-1]
    assert b"".join(item.octets for item in items)[: sum(len(one.octets) for one in said)] == b"".join(
        one.octets for one in said
    )
    rows = [item.row for item in settled(items, detected(capture.session))][: len(said)]
    assert [row.event.octets for row in rows] == [one.octets for one in said]
    assert all(isinstance(row.event, Frame) and row.event.ok for row in rows)
    assert name == "truncated-last-line" or capture.completeness().whole, capture.completeness().text
    if log.only is None:
        assert [row.placement is not None and row.placement.role is Way.REQUEST for row in rows] == [
            one.asks for one in said
        ]
    assert name not in DATED or rows[0].event.end > 1_700_000_000 * NS
    if log.tick is not None:
        for row, one in zip(rows, said, strict=True):
            assert (row.event.end - rows[0].event.end) / 1e9 == pytest.approx(one.at - said[0].at, abs=log.tick)
