"""Every command says of tables what it says row by row (`--reference`), octet for octet."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import Any

import pytest

from tests.seeds import IS_SEARCH, in_turn, some

CAPTURES = Path(__file__).parents[3] / "captures"
LARGE = 30_000
"""Octets of a capture that is only read where one searches: a longer one says nothing else row by row."""


def _below(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.glob("*.cap.txt")) if IS_SEARCH or path.stat().st_size < LARGE]


NAMES = [*some(_below(CAPTURES), 3), *some(_below(CAPTURES / "findings"), 40)]
SMALL = sorted(NAMES, key=lambda path: path.stat().st_size)[: None if IS_SEARCH else 6]
"""Those written again: row by row that takes seconds for a larger one."""

WORDS = (
    "show FILE",
    "show --json FILE",
    "show --csv FILE",
    "show -T fields -e no -e t -e src -e text -e tx.latency_ms -e tx.id -e frame.len -e line.marks -e modbus.func_code",
    "show -V -x -Y !ok FILE",
    "show -c 3 -Y verdict==answered FILE",
    "points FILE",
    "points --csv FILE",
    "points --json --latest --bits -d *=teco-e510 FILE",
    "report --json FILE",
    "stats FILE transactions",
    "profile guess FILE",
    "diff FILE FILE",
)
CUTS = ("--frames 3-9", "--from +0.2 --to +1.5")


@pytest.mark.parametrize(("place", "words"), [*enumerate(WORDS)], ids=WORDS)
def test_the_same_is_said(place: int, words: str, sniff485: Callable[..., Any]) -> None:
    for path in in_turn(NAMES, place, 2):
        command = [str(path) if word == "FILE" else word for word in words.split()]
        command += [] if "FILE" in words else [str(path)]
        assert sniff485(*command) == sniff485(*command, "--reference")


@pytest.mark.timeout(1200 if IS_SEARCH else 120)  # one searches through all of them
@pytest.mark.parametrize(
    "words", ["convert FILE OUT -f", *(f"cut FILE -f -o OUT {cut}" for cut in CUTS), "merge FILE FILE -f -o OUT"]
)
def test_the_same_is_written(words: str, tmp_path: Path, sniff485: Callable[..., Any]) -> None:
    for path in SMALL:
        files = []
        for name, reference in (("one.mcap", []), ("two.mcap", ["--reference"])):
            out = tmp_path / name
            put = {"FILE": str(path), "OUT": str(out)}
            ran = sniff485(*(put.get(word, word) for word in words.split()), *reference)
            files.append((ran.code, _messages(out) if ran.code == 0 else []))
        assert files[0] == files[1]


def _messages(path: Path) -> list[tuple[str, int, bytes]]:
    """The messages of a recording, those of a topic in the order of the file."""
    from mcap.reader import make_reader

    with path.open("rb") as stream:
        found = make_reader(stream).iter_messages(log_time_order=False)
        messages = [(channel.topic, message.log_time, message.data) for _, channel, message in found]
    return list(
        chain.from_iterable([one for one in messages if one[0] == topic] for topic in sorted({m[0] for m in messages}))
    )
