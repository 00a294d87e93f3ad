"""How a box says that it stands: nothing bad is left out, nothing from outside does harm."""

from __future__ import annotations

import json
from dataclasses import replace

from sniff.box import words
from sniff.box.status import BoxStatus, State
from tests.sniff.box.box_made import HOSTILE, NOW, STATUS, S


def test_it_crosses_as_json() -> None:
    value = json.loads(json.dumps(STATUS.to_json()))
    assert BoxStatus.from_json(value) == STATUS
    assert BoxStatus.from_json({**value, "of a later version": 1}) == STATUS
    assert value["well"] is False
    assert value["buses"][1]["state"] == "down"


def test_everything_bad_is_in_the_words() -> None:
    said = words.text(STATUS)
    for bad in ("7", "DOWN", "started anew 1 time", "SIGKILL", "set by +86400 s", "site-0002.mcap", "LN006", "3 more"):
        assert bad in said
    assert "outlet     mqtt mqtts://broker:8883: NOT CONNECTED (connection refused), 120 sent, 9 DROPPED" in said
    assert "outlet     metrics http://127.0.0.1:9485/metrics\n" in said
    assert "gone 2 times, 1 min 35 s altogether" in said
    assert all(line.isprintable() for line in said.splitlines())
    assert HOSTILE not in said


def test_the_headline_names_what_is_down() -> None:
    assert words.headline(STATUS).startswith("recording 2 buses; boiler heard since ")
    assert "cellar DOWN since" in words.headline(STATUS)
    assert "7 LOST" in words.headline(STATUS)
    stopped = replace(STATUS, recording=False, trouble="no space left on the disk")
    assert words.headline(stopped).startswith("NOT RECORDING: no space left on the disk")


def test_well_is_only_what_is_well() -> None:
    boiler = replace(STATUS.buses[0], lost=0)
    well = replace(STATUS, buses=(boiler,))
    assert well.is_well
    assert not replace(well, trouble="x").is_well
    assert not replace(well, recording=False).is_well
    for state in (State.SILENT, State.DOWN, State.OVER):
        assert not replace(well, buses=(replace(boiler, state=state),)).is_well


def test_spans_and_sizes() -> None:
    said = [words.span(seconds * S) for seconds in (0, 59, 60, 3725, 90_000, 86_400 * 8)]
    assert said == ["0 s", "59 s", "1 min", "1 h 2 min", "1 d 1 h", "8 d"]
    assert [words.size(octets) for octets in (0, 999, 95_200, 412 * 10**6, 75_400_000_000)] == [
        "0 B",
        "999 B",
        "95.2 kB",
        "412 MB",
        "75.4 GB",
    ]
    assert len(words.clock(NOW, NOW)) == len("18:07:15")
    assert len(words.clock(NOW - 2 * 86_400 * S, NOW)) == len("2026-03-01 18:07:15")
