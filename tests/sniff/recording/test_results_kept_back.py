"""Results of the engine are kept back in a recording, so that many are packed together; octets are not."""

from __future__ import annotations

from pathlib import Path

from dissectors.frame import Chunk
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.writer import Recorder
from sniff.recording.writer_thread import RELEASE_AFTER
from tests.sniff.recording.test_recorder import BASE, SESSION, S, capture, eventually


def test_results_are_packed_together_and_octets_are_not_kept_back(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    now = BASE
    for number in range(100):
        now += S // 10
        recorder.chunk(Chunk(now, b"1234"))
        recorder.derived(DerivedMessage("/bus/b", "sniff485.Bus", now, now, b'{"load": 0.%03d}' % number))
        recorder.tick(now)
    eventually(lambda: recorder._keeper.orders.empty(), "the thread is stuck")
    assert len(list(capture(recorder.path).items())) >= 90
    assert list(capture(recorder.path).messages("/bus")) == []
    recorder.close()
    assert len(list(capture(recorder.path).messages("/bus"))) == 100
    with recorder.path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        assert summary is not None
        raw = next(id for id, channel in summary.channels.items() if channel.topic == "/raw")
        of_results = [index for index in summary.chunk_indexes if raw not in index.message_index_offsets]
        assert len(of_results) == 1
        assert sum(1 for _ in make_reader(stream).iter_messages(topics=["/raw"])) == len(summary.chunk_indexes) - 1
    assert capture(recorder.path).completeness().whole


def test_they_are_kept_back_by_the_clock_of_the_capture(tmp_path: Path) -> None:
    """However fast it runs: what is measured of a simulated bus holds for one that is listened to."""
    recorder = Recorder(tmp_path / "a.mcap", SESSION)
    for second in range(2 * RELEASE_AFTER // S + 10):
        recorder.derived(DerivedMessage("/bus/b", "sniff485.Bus", BASE + second * S, BASE + second * S, b"{}"))
        recorder.tick(BASE + second * S)
    eventually(lambda: recorder._keeper.orders.empty(), "the thread is stuck")
    there = len(list(capture(recorder.path).messages("/bus")))
    assert 2 * RELEASE_AFTER // S - 3 <= there <= 2 * RELEASE_AFTER // S + 3
    recorder.close()
