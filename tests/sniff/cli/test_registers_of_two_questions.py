"""A register that two questions ask for: what is said of its values is said of all of them."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dissectors.modbus.envelope import seal_rtu

HEAD = "#!sniff-capture 1\n# line: 9600,8N1\n# protocol: modbus-rtu\n# start: 2026-03-01T10:00:00Z\n"


def asked(first: int, values: list[int]) -> str:
    """A question for registers of station 7, and its answer."""
    ask = struct.pack(">BBHH", 7, 3, first, len(values))
    answer = struct.pack(f">BBB{len(values)}H", 7, 3, 2 * len(values), *values)
    return f"+40 {seal_rtu(ask).hex()}\n+20 {seal_rtu(answer).hex()}\n"


def capture(path: Path, rounds: int = 60) -> Path:
    """Register 17 is 2300 to 2306 in the one, 2400 to 2404 in the other; asked for far more often than is kept."""
    turns = (asked(16, [500, 2300 + at % 7]) + asked(17, [2400 + at % 5]) for at in range(rounds))
    path.write_text(HEAD + "".join(turns))
    return path


def test_the_range_holds_what_both_heard(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    for rounds in (60, 700):
        path = capture(tmp_path / f"{rounds}.cap.txt", rounds)
        ran = sniff485("points", "--latest", "--json", path)
        (point,) = (one for one in map(json.loads, ran.out.splitlines()) if one["point"] == "holding/40018")
        assert (point["samples"], point["low"], point["high"]) == (2 * rounds, 2300, 2404)


def test_a_draft_counts_the_answers_of_both(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    out = sniff485("profile", "draft", capture(tmp_path / "x.cap.txt")).out
    assert "2300 … 2404, 119 changes" in out
    assert "in 120 answers" in out
