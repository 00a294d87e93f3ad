"""Logs whose times do not tell an echo from a request again: what is said of their copies, and of their line."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from pathlib import Path

import pytest

from dissectors.bacnet.envelope import frame
from dissectors.findings import Finding, Severity
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_rtu
from sniff.analysis.told_protocol import detected
from sniff.cli import main
from sniff.engine.session import with_settings
from sniff.formats import read
from tests.faults.judged import findings_of

READ = [seal_rtu(bytes((1, 3, 0, 16 + place, 0, 1))) for place in range(8)]
VALUE = [seal_rtu(bytes((1, 3, 2, 0, place))) for place in range(8)]
SLOWER = bytes.fromhex("00788080780078787880788078 80F8 00".replace(" ", ""))
"""What 9600 Bd makes of seven characters at 2400 Bd, but for one bit."""


def findings(path: Path, frames: Iterable[bytes], clock: str = "", line: str = "") -> dict[str, Finding]:
    path.write_text("".join(f"{clock}{one.hex(' ')}\n" for one in frames))
    log = read(path)
    session = with_settings(detected(log.session), "modbus-rtu", LineSettings.parse(line) if line else None)
    return {one.code: one for one in findings_of(session, log.items())}


@pytest.fixture(params=["", "13:44:06 "], ids=["no times", "seconds"])
def clock(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.mark.parametrize("copies", [2, 3, 5])
def test_requests_again_that_nobody_answers_are_not_called_an_echo(tmp_path: Path, clock: str, copies: int) -> None:
    said = findings(tmp_path / "x.log", [one for one in READ for _ in range(copies)], clock)
    echo = said.get("LN205")
    assert echo is None or (echo.severity < Severity.WARNING and "a master that repeats" in echo.seen)


def test_answers_behind_copies_show_an_echo(tmp_path: Path, clock: str) -> None:
    frames = [said for pair in zip(READ, READ, VALUE, strict=True) for said in pair]
    said = findings(tmp_path / "x.log", frames, clock)
    assert said["LN205"].severity is Severity.WARNING
    assert said["LN205"].seen == "8 of 8 requests came twice, the copy directly behind"
    assert "MB002" not in said


def test_repeats_within_one_second_do_not_tell_how_long_the_master_waits(tmp_path: Path) -> None:
    frames = [READ[0], SLOWER, READ[0], SLOWER, *[READ[1]] * 5, READ[2], SLOWER, READ[2], SLOWER, READ[2], SLOWER]
    said = findings(tmp_path / "x.log", frames, "13:44:06 ")
    assert said["MB014"].count == 5
    assert said["LN204"].severity < Severity.WARNING


def test_no_rate_is_told_of_a_line_whose_own_rate_nobody_said(tmp_path: Path) -> None:
    said = findings(tmp_path / "x.log", [said for one in READ for said in (one, SLOWER)])
    assert "4 times as long as those of this line, whose baud rate nobody said" in said["MB014"].seen
    assert " Bd" not in said["MB014"].seen + said["LN204"].seen


def test_a_log_without_times_says_nothing_of_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.log"
    said = findings(path, [said for pair in zip(READ * 2, VALUE * 2, strict=True) for said in pair])
    assert set(said) <= {"LN001", "MB303"}
    for reference in ([], ["--reference"]):
        assert main(["show", str(path), "--json", *reference]) == 0
        assert '"latency_ms": null' in (shown := capsys.readouterr().out)
        assert '"latency_ms": null' * shown.count("\n") == "".join(re.findall('"latency_ms": [^,]*', shown))
        assert main(["info", str(path), *reference]) == 0
        assert "response" not in (told := capsys.readouterr().out)
        assert "bus load" not in told
        assert "times        none: the file does not say when anything came" in told
        assert main(["stats", str(path), "polls", "--json", *reference]) == 0
        assert all(one["every_ms"] is None for one in map(json.loads, capsys.readouterr().out.splitlines()))


def test_a_ring_without_times_has_no_rounds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.log"
    round_ = [frame(0, following, mac) for mac, following in ((1, 3), (3, 7), (7, 1))]
    path.write_text("".join(f"{one.hex(' ')}\n" for one in round_ * 20))
    assert main(["stats", str(path), "ring", "-p", "mstp"]) == 0
    said = capsys.readouterr().out
    assert "60 frames; when they came is not known" in said
    assert "load" not in said
    assert all(line.split()[5:13] == ["–"] * 8 for line in said.splitlines()[1:4])


def test_a_ring_without_times_was_never_silent(tmp_path: Path) -> None:
    """Blocks of a log lie far apart where its line is faster than what its octets were laid at."""
    path = tmp_path / "x.log"
    round_ = [frame(0, following, mac) for mac, following in ((1, 3), (3, 7), (7, 1))]
    path.write_text("".join(f"{one.hex(' ')}\n" for one in round_ * 1000))
    log = read(path)
    session = with_settings(log.session, "mstp", LineSettings.parse("115200,8N1"))
    assert "MS101" not in {one.code for one in findings_of(session, log.items())}


def test_nothing_comes_too_soon_where_nobody_knows_when_it_came(tmp_path: Path) -> None:
    """At 1200 Bd lines of a log lie closer together than a station may answer."""
    asked, answered = seal_rtu(b"\1\x64\1\2"), seal_rtu(b"\1\x64\t\t\t\t\t")
    assert set(findings(tmp_path / "x.log", [asked, answered] * 10, line="1200,8N1")) <= {"LN001", "MB303"}
    write = seal_rtu(b"\1\6\0\1\0\2")
    assert "MB201" not in findings(tmp_path / "x.log", [*READ[:1], *VALUE[:1], write, write, write] * 5)
