"""`record`, `live` and `check` with `auto` on a line whose octets depend on the settings: all of it is in the file."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.offline import outputs
from sniff.capture import link as capture_link
from sniff.capture.config import RecordSpec, SourceSpec
from sniff.cli import main
from sniff.cli.listening import start
from sniff.cli.searching import Unknowns
from sniff.engine.engine import Output
from sniff.engine.event_texts import settings_change
from sniff.formats import read
from tests.e2e.running import rest_of

pytest.importorskip("termios")
SCRIPT = Path(__file__).with_name("line_bus.py")
sys.path.insert(0, str(SCRIPT.parent))
import line_bus  # noqa: E402

RTU = "line-bus:modbus-rtu+19200,8E1+0"
SILENT = "line-bus:modbus-rtu+19200,8E1+3600"
UNKNOWABLE = "line-bus:modbus-rtu+3600,8E1+0"
"""At a rate that no search tries."""

GOES_ON = r"searching, listening with (?!9600,8N1)"
"""What is said once the settings tried are others than those that the search begins with."""


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(SCRIPT), *arguments], capture_output=True, text=True, timeout=100, check=False
    )


@pytest.fixture
def begin() -> Iterator:
    running: list[subprocess.Popen[str]] = []

    def begin(*arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, str(SCRIPT), *arguments]
        running.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        return running[-1]

    yield begin
    for process in running:
        if process.poll() is None:
            process.kill()
        process.communicate()


def said_by(process: subprocess.Popen[str], words: str) -> list[str]:
    """Lines of standard error up to one with these words (a regular expression)."""
    assert process.stderr is not None
    lines: list[str] = []
    for line in process.stderr:
        lines.append(line)
        if re.search(words, line):
            return lines
    pytest.fail(f"never said: {words}; said: {''.join(lines)}")


def octets_of(path: Path) -> bytes:
    return b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))


def shown(path: Path, capsys: pytest.CaptureFixture[str], *options: str) -> list[dict]:
    assert main(["show", "--json", str(path), *options]) == 0
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def holder_of(path: Path) -> int:
    """The capture process that writes a file."""
    for number in filter(str.isdigit, os.listdir("/proc")):
        try:
            words = Path(f"/proc/{number}/cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if b"--capture" in words and str(path).encode() in words:
            return int(number)
    pytest.fail("no capture process")


def test_the_whole_search_is_in_the_file_and_says_nothing_false(tmp_path: Path, capsys) -> None:
    path = tmp_path / "found.mcap"
    ran = run("record", RTU, "-s", "auto", "-p", "auto", "-w", str(path), "--count", "40")
    assert ran.returncode == 0, ran.stderr
    assert "searching, listening with " in ran.stderr
    assert f"{RTU}: Modbus RTU, 19200,8E1" in ran.stderr
    capture = read(path)
    assert (capture.session.protocol, str(capture.session.line)) == ("modbus-rtu", "19200,8E1")
    assert capture.completeness().whole

    # what was heard is what the line gives with the settings that the file says were in force
    in_force, searching, expected, wrong = LineSettings(), False, bytearray(), 0
    bursts = {bytes(burst.octets) for burst in line_bus.sent(RTU)}
    for item in capture.items():
        change = settings_change(item)
        if change is not None:
            in_force, searching = change.line or in_force, not change.found
        elif isinstance(item, Chunk):
            expected += item.octets
            assert (item.octets in bursts) == (str(in_force) == "19200,8E1") or str(in_force) == "19200,8N1"
            wrong += str(in_force) != "19200,8E1"
    assert not searching
    assert wrong > 1, "the search began with wrong settings"

    rows = shown(path, capsys)
    assert "".join(row["hex"] for row in rows) == expected.hex()
    kinds = [row["kind"] for row in rows]
    first_frame = next(number for number, row in enumerate(rows) if row["kind"] != "searching")
    assert kinds[:first_frame] == ["searching"] * wrong
    assert "searching" not in kinds[first_frame:]
    assert "noise" not in kinds
    assert all(row["ok"] for row in rows[first_frame:])
    assert all(row["ok"] is None and row["proto"] is None for row in rows[:first_frame])
    assert len(rows) - first_frame > 20

    main(["check", str(path), "--json", "--fail-on", "never"])
    codes = {json.loads(line).get("code") for line in capsys.readouterr().out.splitlines()}
    assert not {code for code in codes if code and code.startswith("LN") and code != "LN001"}
    assert "MB207" not in codes, "the request to the first answer was only heard"
    assert main(["info", str(path)]) == 0
    said = capsys.readouterr().out
    assert "Modbus RTU, 19200,8E1" in said
    assert "listened with 9600,8N1" in said
    assert ", 0 damaged" in said

    other = tmp_path / "other.mcap"
    for command in (
        ["redissect", str(path), "-o", str(other)],
        ["convert", str(path), str(tmp_path / "x.cap.txt")],
        ["convert", str(path), str(tmp_path / "x.pcapng")],
    ):
        assert main(command) == 0
    for copy in (other, tmp_path / "x.cap.txt", tmp_path / "x.pcapng"):
        assert [(row["kind"], row["hex"]) for row in shown(copy, capsys)] == [(r["kind"], r["hex"]) for r in rows]


def test_live_is_what_is_read_from_the_file_afterwards(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(capture_link, "spawn", line_bus.spawn)
    path = tmp_path / "live.mcap"
    source = SourceSpec(RTU, LineSettings(), "modbus-rtu", unknown=("line", "protocol"))
    live = start(source, RecordSpec(str(path)), search=Unknowns())
    heard: list[object] = []
    was_searching = 0
    while (
        live.ended is None
        and sum(not row.searched for one in heard if isinstance(one, Output) for row in one.rows) < 30
    ):
        was_searching += live.searching is not None
        heard += live.poll(0.02)
    heard += live.stop()
    assert was_searching > 1
    assert live.searching is None
    capture = read(path)
    assert (live.session.line, live.session.protocol) == (capture.session.line, capture.session.protocol)
    saved = [output for output in outputs(capture.items(), capture.session) if isinstance(output, Output)]
    shown_live = [output for output in heard if isinstance(output, Output)]
    rows = [row for output in saved for row in output.rows]
    live_rows = [row for output in shown_live for row in output.rows]
    assert live_rows[:-1] == rows[:-1]
    assert live_rows[-1].event.octets == rows[-1].event.octets  # the file does not say what silence followed
    assert [one for output in shown_live for one in output.transactions] == [
        one for output in saved for one in output.transactions
    ]
    assert any(row.searched for row in rows)


def test_a_silent_bus_is_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "late.mcap"
    ran = run("record", RTU.replace("+0", "+1.5"), "-s", "auto", "-p", "auto", "-w", str(path), "--count", "10")
    assert ran.returncode == 0, ran.stderr
    assert str(read(path).session.line) == "19200,8E1"


@pytest.mark.parametrize(("port", "words"), [(SILENT, "not one octet"), (UNKNOWABLE, "do they make sense")])
def test_interrupted_while_searching_the_file_is_whole_and_says_so(tmp_path, capsys, begin, port, words) -> None:
    path = tmp_path / "given-up.mcap"
    process = begin("record", port, "-s", "auto", "-p", "auto", "-w", str(path))
    said_by(process, "listening with 9600,8N1" if port == SILENT else GOES_ON)
    process.send_signal(signal.SIGINT)
    said = rest_of(process)[1]
    assert process.returncode == 130
    assert "interrupted while searching, no settings found" in said
    assert words in said
    assert read(path).completeness().whole
    assert read(path).session.unknown == ("line", "protocol")
    rows = shown(path, capsys)
    assert bool(rows) == (port == UNKNOWABLE)
    assert {row["kind"] for row in rows} <= {"searching"}
    assert "".join(row["hex"] for row in rows) == octets_of(path).hex()
    assert main(["info", str(path)]) == 0
    assert "no settings found" in capsys.readouterr().out
    main(["check", str(path)])
    told = capsys.readouterr().out
    assert "no settings were found while this was recorded, so nothing is judged; name them with -s and -p" in told
    assert ("LN002" in told) == (port == SILENT)


def test_time_over_while_searching(tmp_path: Path) -> None:
    ran = run("record", SILENT, "-s", "auto", "-w", str(tmp_path / "x.mcap"), "--duration", "1")
    assert ran.returncode == 4
    assert "ended while searching, no settings found: silent" in ran.stderr


def test_capture_killed_while_searching(tmp_path: Path, begin, capsys) -> None:
    path = tmp_path / "killed.mcap"
    process = begin("record", UNKNOWABLE, "-s", "auto", "-p", "auto", "-w", str(path))
    said_by(process, GOES_ON)
    until = time.monotonic() + 20
    while not octets_of(path):
        assert time.monotonic() < until
        time.sleep(0.05)
    os.kill(holder_of(path), signal.SIGKILL)
    said = rest_of(process)[1]
    assert process.returncode == 4
    assert "SIGKILL" in said
    capture = read(path)
    assert not capture.completeness().whole
    assert capture.session.unknown == ("line", "protocol")
    assert {row["kind"] for row in shown(path, capsys)} == {"searching"}


def test_main_process_killed_while_searching(tmp_path: Path, begin) -> None:
    path = tmp_path / "left.mcap"
    process = begin("record", UNKNOWABLE, "-s", "auto", "-p", "auto", "-w", str(path))
    said_by(process, GOES_ON)
    process.kill()
    process.wait()
    until = time.monotonic() + 20
    while not read(path).completeness().whole:  # nobody searches any more: it ends by itself
        assert time.monotonic() < until
        time.sleep(0.1)
    assert octets_of(path)


def test_only_the_protocol_is_searched_for(tmp_path: Path, capsys) -> None:
    path = tmp_path / "p.mcap"
    ran = run("record", RTU, "-s", "19200,8E1", "-p", "auto", "-w", str(path), "--count", "30")
    assert ran.returncode == 0, ran.stderr
    rows = shown(path, capsys)
    assert all(row["ok"] for row in rows), "not one octet was heard with wrong settings"
    assert bytes.fromhex(rows[0]["hex"]) == bytes(line_bus.sent(RTU, 1)[0].octets)


def test_only_the_line_is_searched_for(tmp_path: Path) -> None:
    path = tmp_path / "s.mcap"
    port = "line-bus:n2+19200,8O1+0"
    ran = run("record", port, "-s", "auto", "-p", "n2", "-w", str(path), "--count", "20")
    assert ran.returncode == 0, ran.stderr
    assert (read(path).session.protocol, str(read(path).session.line)) == ("n2", "19200,8O1")


def test_check_of_a_port_judges_only_what_was_heard_right(tmp_path: Path) -> None:
    ran = run("check", RTU, "-s", "auto", "-p", "auto", "--duration", "1.5", "--json", "--fail-on", "never")
    assert ran.returncode == 0, ran.stderr
    codes = {json.loads(line).get("code") for line in ran.stdout.splitlines()}
    assert "LN001" in codes
    assert not {code for code in codes if code and code.startswith("LN") and code != "LN001"}


def test_auto_in_the_configuration(tmp_path: Path, monkeypatch, begin) -> None:
    monkeypatch.chdir(tmp_path)
    Path("sniff485.toml").write_text(
        f'[bus.boiler]\nport = "{RTU}"\nline = "auto"\nprotocol = "auto"\nrecord = "boiler.mcap"\n'
    )
    process = begin("live", "boiler", "--json")
    assert process.stdout is not None
    lines: list[str] = []
    while sum('"searching"' not in line for line in lines) < 10:
        lines.append(process.stdout.readline())
        assert lines[-1], "it has ended"
    process.send_signal(signal.SIGINT)
    said, errors = rest_of(process)
    assert process.returncode == 0, errors
    rows = [row for line in [*lines, *said.splitlines()] if "record" not in (row := json.loads(line))]
    shown, kept = "".join(row["hex"] for row in rows), octets_of(Path("boiler.mcap")).hex()
    said_unseen = re.search(r"(\d+) octets not looked at", errors)  # on a busy machine; then they are counted
    assert kept.startswith(shown)
    assert len(kept) - len(shown) == 2 * int(said_unseen[1] if said_unseen else 0)
    assert {row["kind"] == "searching" for row in rows} == {True, False}
