"""Text captures and byte logs, cut at every octet, with every octet changed: the whole is given, the rest said."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dissectors.frame import Chunk
from sniff.engine.capture import CaptureError
from sniff.engine.session import Item
from sniff.formats import read
from sniff.formats.bytelog import ByteLog
from sniff.formats.text import parse
from tests.seeds import in_turn
from tests.sniff.formats.written_anew import write_anew

TEXT = """\
#!sniff-capture 1
# line: 19200,8E1
# protocol: modbus-rtu
# start: 2026-03-01T10:00:00Z
# device: 1=teco-e510
# note site: "x"
+0        01 03 00 00 00 02 C4 0B       # poll unit 1
+8.2      01 03 04 00 D7 00!P 1A CB C0
#! +3 dropped count=12 host too busy
~4.1      00!B
+250      ":010300000002FA" 0D 0A
+1        01 03 00 00 00 02 C4 0B
"""
LOGS = {
    "candump": "(1139833427.100000) bus 01 03 00 00 00 02 C4 0B\n(1139833427.110000) bus 1#01030400D7001ACBC0\n",
    "docklight": "2/13/2006 12:23:47.100 [TX] - 01 03 00 00 00 02 C4 0B \n13.02.2006 12:23:47.110 [RX] - 01 03 04 00\n",
    "jpnevulator": "2006-02-13 12:23:47.100000: /dev/ttyS0\n01 03 00 00 00 02 C4 0B   ........\n1A CB C0\n",
    "times": "# a note\n0.100000 01 03 00 00 00 02 c4 0b ; request\n0.110000 01 03 04 00 d7 00 1a cb c0 ; answer\n",
    "clock": "[12:23:47.100] TX: 01 03 00 00 00 02 c4 0b\n[12:23:47.110] RX: 01 03 04 00 d7 00 1a cb c0\n",
    "hexdump": "00000000  01 03 00 00 00 02 c4 0b  01 03 04 00 d7 00 1a cb  |................|\n00000010  c0  |.|\n",
    "pairs": "01 03 00 00 00 02 C4 0B\n01 03 04 00 D7 00 1A CB C0\n",
    "csv": "t_start_s,t_end_s,line,octet\n0.1,0.1005,bus,01\n0.1006,0.101,bus,03\n0.102,0.1025,bus,00\n",
    "saleae": "Time [s],Value,Parity Error,Framing Error\n-0.1,0x01,,\n0.1006,0x03,Error,\n0.102,'A' (0x41),,Error\n",
}


@pytest.fixture
def sniff485(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    from sniff.cli import main

    def run(*arguments: object) -> tuple[int, str, str]:
        code = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


CHANGES = ("", "\0", "9", "-", "\n", "\N{SNOWMAN}", '"')
HEADER_END = TEXT.index("+0 ")
WHOLE = list(parse(TEXT).items())


def read_text(text: str) -> tuple[list[Item], str]:
    """What comes before the damage, and what is said of it."""
    found: list[Item] = []
    try:
        for item in parse(text, "a.cap.txt").items():
            found.append(item)
    except CaptureError as error:
        return found, str(error)
    return found, ""


def heard(items: list[Item]) -> bytes:
    """The octets of all reads; several lines may tell of one."""
    return b"".join(item.octets for item in items if isinstance(item, Chunk))


def whole_lines(text: str, at: int) -> str:
    """The lines that end before a place."""
    return text[: text.rfind("\n", 0, at) + 1]


def test_a_text_capture_cut_at_every_octet() -> None:
    for at in range(len(TEXT)):
        found, said = read_text(TEXT[:at])
        before = len(read_text(whole_lines(TEXT, at))[0])
        assert len(found) - before in (0, 1)  # the line that was cut may still be one
        if at >= HEADER_END:
            assert found[:before] == WHOLE[:before]
        assert not said or said.startswith("a.cap.txt:")
        assert not said or "expected" in said


@pytest.mark.parametrize("change", CHANGES)
def test_a_text_capture_with_any_octet_changed(change: str) -> None:
    for at in range(len(TEXT)):
        found, said = read_text(TEXT[:at] + change + TEXT[at + 1 :])
        if at >= HEADER_END:
            before = len(read_text(whole_lines(TEXT, at))[0])
            assert found[:before] == WHOLE[:before]
        assert not said or said.startswith("a.cap.txt:")


def test_frames_up_to_the_damage_are_shown(tmp_path: Path, sniff485: Callable[..., Any]) -> None:
    """Also the last one, which waits for its answer when the damage comes."""
    path = tmp_path / "a.cap.txt"
    begin = "# line: 19200,8E1\n# protocol: modbus-rtu\n"
    path.write_text(f"{begin}+0 01 03 00 00 00 02 C4 0B\n+8 01 03 04 00 D7 00 1A CB C0\n")
    with path.open("a") as stream:
        stream.write("+50 02 03 00 00 00 02 C4 38\n+90 01 0")
    code, out, err = sniff485("show", path)
    assert code == 3
    assert [line.split()[3] for line in out.splitlines()] == ["1", "1", "2"]
    assert err.startswith(f"sniff485: {path}:6:8: expected pairs of hexadecimal digits")


def test_the_terminal_ui_gets_the_rows_before_the_damage(tmp_path: Path) -> None:
    from sniff.bus.file_source import FileFeed

    path = tmp_path / "a.cap.txt"
    path.write_text("# line: 19200,8E1\n+0 01 03 00 00 00 02 C4 0B\n+8 01 03 04 00 D7 00 1A CB C0\n+90 0\n")
    capture = read(path)
    feed = FileFeed(str(path), capture, capture.session)
    while feed.poll():
        pass
    assert len(feed.store) == 2
    assert feed.status().ended.startswith(f"{path}:4:5: expected")


def read_log(path: Path, text: str) -> tuple[list[Item], str, str]:
    """Items, kind and what is said of a log; no items where it is refused."""
    write_anew(path, text.encode("utf-8", "surrogateescape"))
    try:
        log = read(path)
    except CaptureError as error:
        return [], "", str(error)
    if not isinstance(log, ByteLog):  # comments alone are an empty text capture
        return [], "", f"{path}: "
    found: list[Item] = []
    try:
        for item in log.items():
            found.append(item)
    except CaptureError as error:  # at the end: too much was not understood
        return found, log.kind, str(error)
    complete = log.completeness()
    return found, log.kind, "" if complete.whole else complete.text


@pytest.mark.parametrize("name", LOGS)
def test_a_byte_log_cut_at_every_octet(name: str, tmp_path: Path) -> None:
    text, path = LOGS[name], tmp_path / "x.log"
    whole, kind, said = read_log(path, text)
    assert whole
    assert not said
    lines_before = before = None
    for at in range(len(text)):
        found, as_kind, said = read_log(path, text[:at])
        if as_kind == kind:
            if (lines := whole_lines(text, at)) != lines_before:
                lines_before, (before, _, _) = lines, read_log(path, lines)
            assert heard(found).startswith(heard(before))
            assert heard(whole).startswith(heard(before))
            assert len(found) - len(before) in (0, 1)
        elif not as_kind:
            assert said.startswith((f"{path}: ", *(f"{path}:{number}: " for number in range(1, 5))))


@pytest.mark.parametrize("name", LOGS)
def test_a_byte_log_with_any_octet_changed(name: str, tmp_path: Path) -> None:
    text, path = LOGS[name], tmp_path / "x.log"
    _, kind, _ = read_log(path, text)
    lines_before = before = None
    for at in range(len(text)):
        if (whole := whole_lines(text, at)) != lines_before:
            lines_before, (before, _, _) = whole, read_log(path, whole)
        for change in in_turn(CHANGES[::2], at, 2):
            found, as_kind, said = read_log(path, text[:at] + change + text[at + 1 :])
            if as_kind == kind:  # what has another time now may lie elsewhere
                assert all(item.octets in heard(found) for item in before if isinstance(item, Chunk))
            assert said or as_kind


def test_long_runs_of_spaces_cost_no_time(tmp_path: Path) -> None:
    found, _, said = read_log(tmp_path / "x.log", "(1.0) bus 01 03\n(1.0) bus 01" + 900_000 * " " + "x\n")
    assert [item.octets for item in found if isinstance(item, Chunk)] == [b"\x01\x03"]
    assert "the first is line 2" in said


def test_damage_in_a_log_is_said(tmp_path: Path, sniff485: Callable[..., Any]) -> None:
    path = tmp_path / "x.log"
    path.write_text("(1.0) bus 01 03 00 00 00 02 C4 0B\n(1.1) bus 01 03 04 0\n(1.2) bus 01 03 00 00 00 02 C4 0B\n")
    code, out, err = sniff485("show", path, "-s", "19200,8E1")
    assert code == 0
    assert out.count("read holding") == 2
    assert "1 line was not understood, the first is line 2" in err
