"""File names and headers with terminal escapes: written out wherever they are printed, and in the page of a report."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.capture_writer import create
from sniff.cli import main
from sniff.engine.session import Session
from sniff.formats import read
from sniff.recording.mcap_writer import PartPlace, create_part

TITLE = "\x1b]0;title\x07\x9b2J\u202e"
"""What terminals obey: escapes, one octet or two, and what turns a line round."""
POLL = bytes.fromhex("010300000002c40b")


@pytest.fixture
def name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    session = Session(f"port{TITLE}", LineSettings(19200, 8, "E", 1), "modbus-rtu", 10**18, notes={"where": TITLE})
    with create(f"a{TITLE}.cap.txt", session) as writer:
        writer.write(Chunk(10**18, POLL))
    return f"a{TITLE}.cap.txt"


@pytest.mark.parametrize(
    "words",
    [
        ("show", ...), ("info", ...), ("check", ...), ("stats", ...), ("points", ...), ("check", ..., "--json"),
        ("check", ..., "--format", "junit"), ("recover", ..., "-o", f"d{TITLE}.mcap"), ("snapshot", ...),
        ("detect", ...), ("record", ..., "-s", "19200,8E1", "-w", f"e{TITLE}.mcap"),
        ("convert", ..., f"b{TITLE}.mcap"), ("report", ..., "-o", "-"), ("report", ..., "-o", f"b{TITLE}.html"),
        ("merge", ..., "-o", f"c{TITLE}.mcap"), ("show", f"none{TITLE}.mcap"),
    ],
)  # fmt: skip
def test_no_escape_reaches_the_terminal(name: str, words: tuple[object, ...], capsys: pytest.CaptureFixture[str]):
    main([name if word is ... else str(word) for word in words])
    said = "".join(capsys.readouterr())
    assert said
    assert not {*"\x1b\x07\x9b\u202e"} & {*said}
    for page in Path().glob("b*.html"):
        assert "\x1b" not in page.read_text()


@pytest.mark.parametrize("time", [-(1 << 63), (1 << 63) - 1])
def test_what_convert_writes_show_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], time: int
) -> None:
    monkeypatch.chdir(tmp_path)
    with create("ends.mcap", Session("p", LineSettings(19200, 8, "E", 1), "modbus-rtu", time)) as writer:
        writer.write(Chunk(time, POLL))
    assert main(["convert", "ends.mcap", "ends.cap.txt"]) == 0
    assert main(["show", "ends.cap.txt"]) == 0
    assert [item.octets for item in read("ends.cap.txt").items() if isinstance(item, Chunk)] == [POLL]


def test_nor_does_one_of_a_part_that_is_not_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    session = Session("p", LineSettings(19200, 8, "E", 1), "modbus-rtu", 10**18)
    for part in (1, 2):
        with create_part(f"a{TITLE}-{part}.mcap", [session], PartPlace(part, (part - 1,), (0,))) as writer:
            writer.write(Chunk(10**18 + part, POLL))
    last = Path(f"a{TITLE}-2.mcap")
    last.write_bytes(last.read_bytes()[:-60])
    main(["check", *map(str, sorted(Path().glob("*.mcap")))])
    said = "".join(capsys.readouterr())
    assert "incomplete: " in said
    assert not {*"\x1b\x07\x9b\u202e"} & {*said}
