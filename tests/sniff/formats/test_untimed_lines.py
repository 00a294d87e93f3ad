"""Lines of a log that have no time of their own: by how much nobody knows when their octets came is said."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS
from sniff.engine.capture import CaptureError
from sniff.formats import read
from sniff.formats.log_untimed import unknown_by

ASKED, ANSWERED = "11 03 00 6B 00 01 F7 46", "11 03 02 02 2B 38 F8"
S = 1000 * MS


@pytest.mark.parametrize(
    ("reads", "unknown"),
    [
        ([(at * S, True) for at in range(20)], 0),
        ([(0, False), *((at * S, True) for at in range(1, 20))], 0),  # a cut begin
        ([(at * S // 2, at % 2 == 0) for at in range(20)], 1 * S),  # requests alone have a time
        ([(0, True), *((at, False) for at in range(1, 9))], None),
        ([(at, False) for at in range(9)], None),
    ],
)
def test_how_far_nobody_knows(reads: list[tuple[int, bool]], unknown: int | None) -> None:
    assert unknown_by(reads) == unknown


def test_answers_without_a_time(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text(
        "".join(f"2024-05-01 10:00:{2 * at:02d}.000 Sending: {ASKED}\nAnswer: {ANSWERED}\n" for at in range(6))
    )
    adapter = read(path).session.adapter
    assert adapter.latency == 2 * S
    assert "without a time" in adapter.latency_from


def test_one_time_in_a_log_is_not_that_of_all(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    block = f"[N] Raw buffer received: @3FFB33BC/8:\n  | 0000: {ASKED}   |...k...F        |\n"
    path.write_text("[E] 8018|server.cpp  [ 265] serve: RTU receive: E5 - Packet length error\n" + block * 4)
    assert not read(path).session.has_times


def test_what_waits_for_a_time_is_given_where_the_file_ends_in_damage(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x.log"
    path.write_text(f"2024-05-01 10:00:00.000 Sending: {ASKED}\nAnswer: {ANSWERED}\n" * 3)
    capture = read(path)
    lines = path.read_text().splitlines()

    def damaged() -> Iterator[str]:
        yield from lines
        raise CaptureError("damaged")

    monkeypatch.setattr(capture, "_lines", damaged)
    given: list[bytes] = []
    with pytest.raises(CaptureError):
        given.extend(item.octets for item in capture.items() if isinstance(item, Chunk))
    assert given == [bytes.fromhex(ASKED), bytes.fromhex(ANSWERED)] * 3
