"""Of a file that holds what is found in it, every command says what it finds anew."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from sniff.engine import bulk
from sniff.engine.session import Session
from sniff.formats import read

CAPTURES = Path(__file__).parents[3] / "captures"

COMMANDS = (
    "info FILE",
    "show FILE",
    "show --json FILE",
    "show -Y !ok --csv FILE",
    "show -T fields -e no -e t -e text FILE",
    "check --json FILE",
    "stats FILE",
    "points --csv FILE",
    "report --json FILE",
)


@pytest.mark.parametrize("name", ["rtu-usual-faults", "mstp-usual-faults", "n2-usual-faults", "ascii-usual-faults"])
def test_commands_say_of_what_is_held_what_they_find(
    name: str, tmp_path: Path, sniff485: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "kept.mcap"
    assert sniff485("redissect", str(CAPTURES / f"{name}.cap.txt"), "-o", str(path)).code == 0
    found = {words: sniff485(*_with(words, path), "--reference") for words in COMMANDS}
    protocol = read(path).session.protocol
    anew = bulk.tables

    def other_protocols_only(blocks: Any, session: Session) -> Iterator[Any]:
        assert session.protocol != protocol, "it was found anew"
        return anew(blocks, session)

    monkeypatch.setattr(bulk, "tables", other_protocols_only)
    for words in COMMANDS:
        assert sniff485(*_with(words, path)) == found[words], words


def _with(words: str, path: Path) -> list[str]:
    return [str(path) if word == "FILE" else word for word in words.split()]


def test_info_says_whether_what_is_kept_is_what_is_found(tmp_path: Path, sniff485: Callable[..., Any]) -> None:
    source, path = str(CAPTURES / "rtu-usual-faults.cap.txt"), str(tmp_path / "kept.mcap")
    assert sniff485("redissect", source, "-o", path).code == 0
    for words, kept, line in (
        ([source], None, None),
        ([path], True, "  kept         what is found in it, by this version with these settings"),
        ([path, "-s", "38400,8E1"], False, "  kept         what another version, or other settings, found in it: found "
         "anew, unless redissect keeps that"),
    ):  # fmt: skip
        assert json.loads(sniff485("info", *words, "--json").out)["kept"] is kept
        assert [one for one in sniff485("info", *words).out.splitlines() if one.startswith("  kept")] == (
            [] if line is None else [line]
        )
    assert sniff485("convert", path, str(tmp_path / "other.mcap")).code == 0
    assert json.loads(sniff485("info", str(tmp_path / "other.mcap"), "--json").out)["kept"] is None
