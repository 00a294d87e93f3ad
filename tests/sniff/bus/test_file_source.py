"""A capture file as the terminal UI gets it: its first rows at once, the rest from a thread, judged last."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from io import FileIO
from pathlib import Path

import pytest

from dissectors.tracker import Transaction
from sniff.bus import closings_ahead, file_source
from sniff.bus.file_source import FileFeed, Progress
from sniff.bus.model import BusModel
from sniff.bus.offline import outputs, survey
from sniff.engine.blocks import Block
from sniff.engine.engine import Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.packed_table import PackedTable
from sniff.engine.session import LineEvent, Session
from sniff.formats import read
from tests.bench import bulk_files, bulk_mstp


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Some thousand frames, damaged ones among them, in a recording."""
    path = tmp_path / "night.mcap"
    session = Session("/dev/ttyUSB0", bulk_mstp.LINE, "mstp", bulk_mstp.BASE)
    bulk_files.write_mcap(path, bulk_mstp.reads(4000, damaged=0.01), session)
    return path


@pytest.fixture
def by_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """All but the first rows are read by the thread, in many pieces."""
    monkeypatch.setattr(file_source, "AT_FIRST", 0.0)
    monkeypatch.setattr(file_source, "FIRST_READS", 100)
    monkeypatch.setattr(file_source, "READS", 200)


def feed_of(path: Path) -> FileFeed:
    capture = read(path)
    return FileFeed(str(path), capture, capture.session)


def reference_of(path: Path) -> tuple[list[Row], list[Transaction]]:
    capture = read(path)
    made = [one for one in outputs(capture.items(), capture.session) if isinstance(one, Output)]
    return [row for one in made for row in one.rows], [tx for one in made for tx in one.transactions]


@pytest.mark.usefixtures("by_thread")
def test_the_thread_gives_the_rows_of_the_reference(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    looked, go_on = threading.Event(), FileFeed._go_on

    def go_on_later(feed: FileFeed) -> None:  # else it may be ahead by the end of the first poll
        looked.wait()
        go_on(feed)

    monkeypatch.setattr(FileFeed, "_go_on", go_on_later)
    feed = feed_of(path)
    assert feed.poll()
    begun = feed.status()
    assert 0 < len(feed.store) < 200
    assert begun.reading
    assert begun.read is None or begun.read < 1
    assert begun.judged < 1
    looked.set()
    shares = [begun.read]
    while feed.status().reading:
        feed.poll()
        shares.append(feed.status().read)
    known = [share for share in shares if share is not None]
    assert known == sorted(known)
    assert shares[-1] == 1
    rows, closed = reference_of(path)
    assert list(feed.store.rows) == rows
    assert [feed.store.closed_by_no(no) for no in range(1, feed.store.last_closed + 1)] == closed
    feed.close()


@pytest.mark.usefixtures("by_thread")
def test_findings_are_final_when_all_is_judged(path: Path) -> None:
    feed = feed_of(path)
    feed.poll()
    while feed.work():
        pass
    assert feed.status().judged == 1
    capture = read(path)
    model = BusModel(capture.session, dissector_for(capture.session))
    survey(capture, capture.session, model)
    assert feed.store.findings() == model.findings()
    feed.poll()
    assert not feed.poll()  # nothing changes any more
    feed.close()


def test_a_small_file_is_read_in_the_first_poll(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_source, "AT_FIRST", 60.0)  # a busy computer reads no less
    path = tmp_path / "a.cap.txt"
    path.write_text("# line: 19200,8E1\n+0 01 03 00 00 00 02 C4 0B\n+8 01 03 04 00 D7 00 1A CB C0\n")
    feed = feed_of(path)
    assert feed.poll()
    assert len(feed.store) == 2
    assert not feed.status().reading
    feed.close()


@pytest.mark.usefixtures("by_thread")
def test_closing_ends_the_thread(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_source, "WAITING", 1)
    feed = feed_of(path)
    feed.poll()
    feed.close()
    assert feed._thread is not None
    assert not feed._thread.is_alive()


@pytest.mark.usefixtures("by_thread")
def test_what_goes_wrong_in_the_thread_is_raised_where_one_polls(path: Path) -> None:
    class Broken:
        session = read(path).session

        def blocks(self) -> Iterator[Block | LineEvent]:
            yield from read(path).blocks()
            raise ZeroDivisionError

    feed = FileFeed(str(path), Broken(), Broken.session)  # type: ignore[arg-type]

    def all_of_it() -> None:
        while True:
            feed.poll()

    with pytest.raises(ZeroDivisionError):
        all_of_it()
    assert len(feed.store) > 3000
    feed.close()


def test_a_cut_file_says_so(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-2000])
    feed = feed_of(path)
    while feed.poll() or feed.status().reading:
        pass
    assert feed.status().ended
    assert len(feed.store) > 100
    feed.close()


@pytest.mark.usefixtures("by_thread")
def test_what_became_of_rows_is_known_before_a_filter_asks(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_source, "PACKED_ROWS", 100)
    feed = feed_of(path)
    feed.poll()
    while feed.work():
        pass
    kept = feed.store.kept
    packed = [part for part in kept.parts if isinstance(part.whole, PackedTable)]
    assert len(packed) > 10
    for part in packed[:-1]:
        closing = kept.closing_parts(*part.placed_ids)
        known = dict(part.remembered)
        for name in ("verdict", "latency"):
            told, values = known[name]
            assert told == [one.whole for one in closing]  # so that nobody puts it together again
            assert closings_ahead.became(part, closing, name) is values
            del part.remembered[name]
            assert closings_ahead.became(part, closing, name).tolist() == values.tolist()


def test_a_file_that_is_closed_is_not_read_by_a_share(tmp_path: Path) -> None:
    """Small files are read whole before anybody looks; it stood at 0 % then while their rows came."""
    progress, names = Progress(), [tmp_path / "1", tmp_path / "2"]
    assert progress.share(100) == 0
    shares: list[float | None] = []
    for name in names:
        name.write_bytes(bytes(50))
        with FileIO(name) as stream:
            progress.see(stream)
            stream.read(25)
            shares.append(progress.share(100))
    assert [*shares, progress.share(100)] == [0.25, 0.75, None]
