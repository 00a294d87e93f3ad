"""What became of a station's requests: the same counts in every table, and nothing counted twice."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dissectors.checksums import crc16_modbus
from tests.sniff.cli.conftest import Ran

CAPTURES = Path(__file__).parents[3] / "captures"
NAMES = ("rtu-usual-faults", "rtu-early-release", "ascii-usual-faults", "n2-usual-faults", "profibus-noisy-ftdi")
POLLS, FIFTH = 40, 5


@pytest.fixture
def late(tmp_path: Path) -> Path:
    """A master that gives a request up after a while and asks another station; each fifth answer comes after that."""
    sent: list[tuple[int, bytes]] = []
    for number in range(POLLS):
        at = number * 1000
        sent += [(at, b"\1\3\0\1\0\1"), (at + 500, b"\2\3\0\2\0\1"), (at + 512, b"\2\3\2\0\7")]
        if number % FIFTH == 2:
            sent += [(at + 300, b"\3\3\0\1\0\1"), (at + 320, b"\3\3\2\0\7"), (at + 450, b"\1\3\2\0\5")]
        else:
            sent.append((at + 12, b"\1\3\2\0\5"))
    lines, before = ["#!sniff-capture 1", "# line: 19200,8E1", "# protocol: modbus-rtu"], 0
    for when, octets in sorted(sent):
        lines.append(f"+{when - before} {(octets + crc16_modbus(octets).to_bytes(2, 'little')).hex(' ')}")
        before = when
    path = tmp_path / "late.cap.txt"
    path.write_text("\n".join(lines) + "\n")
    return path


def _objects(ran: Ran) -> list[dict[str, Any]]:
    assert ran.code == 0, ran.err
    return [json.loads(line) for line in ran.out.splitlines()]


def test_an_answer_that_came_late_is_neither_in_time_nor_none(late: Path, sniff485: Callable[..., Ran]) -> None:
    one = _objects(sniff485("stats", late, "nodes", "--json"))[0]
    counts = [one[name] for name in ("asked", "answered", "exceptions", "unanswered", "late")]
    assert counts == [POLLS, POLLS - POLLS // FIFTH, 0, 0, POLLS // FIFTH]


@pytest.mark.parametrize("name", ["late", *NAMES])
def test_nodes_polls_and_report_count_alike(name: str, late: Path, sniff485: Callable[..., Ran]) -> None:
    path = late if name == "late" else CAPTURES / f"{name}.cap.txt"
    nodes = _objects(sniff485("stats", path, "nodes", "--json"))
    polls = _objects(sniff485("stats", path, "polls", "--json"))
    (report,) = _objects(sniff485("report", path, "--json"))
    told = {one["address"]: one for one in report["stations"]}
    for node in nodes:
        counts = [node[name] for name in ("answered", "exceptions", "unanswered")]
        mine = [poll for poll in polls if poll["station"] == node["address"]]
        assert [sum(poll[name] for poll in mine) for name in ("answered", "exceptions", "unanswered")] == counts
        station = told[node["address"]]
        assert [station[name] for name in ("answered", "exceptions", "unanswered")] == counts


def test_who_answers_polls_with_damaged_frames_alone_is_a_station(sniff485: Callable[..., Ran]) -> None:
    """`check` finds something of it, so it was heard: every list of stations has it, with all its frames damaged."""
    path = CAPTURES / "findings" / "ms-tp-last-two-octets-missing.cap.txt"
    assert "MAC 31" in {one["subject"] for one in _objects(sniff485("check", path, "--json", "--fail-on", "never"))}
    (node,) = [one for one in _objects(sniff485("stats", path, "nodes", "--json")) if one["address"] == 31]
    assert (node["sent"], node["damaged"]) == (5, 5)
    for how in ((), ("--reference",)):
        (info,) = _objects(sniff485("info", path, "--json", *how))
        assert 31 in {one["address"] for one in info["nodes"]}
        assert info["polled_only"] == []
        health = {one["subject"]: one for one in _objects(sniff485("stats", path, "health", "--json", *how))}["MAC 31"]
        assert "100% of its frames damaged" in health["why"]
    latency = _objects(sniff485("stats", path, "latency", "--json"))
    nodes = _objects(sniff485("stats", path, "nodes", "--json"))
    assert {one["address"] for one in latency} <= {one["address"] for one in nodes}
