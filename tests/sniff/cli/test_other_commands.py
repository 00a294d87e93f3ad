"""`info`, `stats`, `convert`, `--version`: what they say and what they keep."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from sniff.engine.session import LineEventKind
from sniff.formats import read


def test_info_counts(poll: Path, sniff485: Callable) -> None:
    info = json.loads(sniff485("info", "--json", poll).out)
    assert (info["frames"], info["damaged"], info["noise_octets"]) == (6, 1, 1)
    assert info["verdicts"]["no-response"] == 1
    assert info["line_errors"] == {"parity": 1, "break": 1}
    assert [node["address"] for node in info["nodes"]] == [1, 2]
    assert info["complete"] is True


def test_info_in_words_has_units_and_no_holes(poll: Path, sniff485: Callable) -> None:
    out = sniff485("info", poll).out
    assert "Modbus RTU, 19200,8E1" in out
    assert " ms" in out
    assert "None" not in out
    assert "{" not in out


@pytest.mark.parametrize("table", ["nodes", "transactions", "latency", "load"])
@pytest.mark.parametrize("style", [[], ["--json"], ["--csv"]])
def test_every_table_in_every_style(table: str, style: list[str], poll: Path, sniff485: Callable) -> None:
    ran = sniff485("stats", poll, table, *style)
    assert ran.code == 0
    assert len(ran.out.splitlines()) >= 1
    if style == ["--json"]:
        assert all(isinstance(json.loads(line), dict) for line in ran.out.splitlines())


@pytest.mark.parametrize("suffix", [".mcap", ".cap.txt"])
def test_convert_keeps_everything(suffix: str, poll: Path, tmp_path: Path, sniff485: Callable) -> None:
    target = tmp_path / f"copy{suffix}"
    assert sniff485("convert", poll, target).code == 0
    kept = [item for item in read(target).items() if getattr(item, "kind", None) is not LineEventKind.COMMENT]
    assert kept == list(read(poll).items())
    assert read(target).session.line == read(poll).session.line


def test_convert_overwrites_only_when_told(poll: Path, tmp_path: Path, sniff485: Callable) -> None:
    target = tmp_path / "copy.mcap"
    target.write_text("precious")
    ran = sniff485("convert", poll, target)
    assert ran.code == 2
    assert "--force" in ran.err
    assert target.read_text() == "precious"
    assert sniff485("convert", "-f", poll, target).code == 0


def test_pcapng_and_back_keeps_frames_and_their_ends(poll: Path, tmp_path: Path, sniff485: Callable) -> None:
    there, back = tmp_path / "there.pcapng", tmp_path / "back.mcap"
    assert sniff485("convert", poll, there).code == 0
    assert sniff485("convert", there, back).code == 0
    before = [json.loads(line) for line in sniff485("show", "--json", poll).out.splitlines()]
    after = [json.loads(line) for line in sniff485("show", "--json", back).out.splitlines()]
    keep = ("t", "start_ns", "end_ns", "hex", "verdict", "kind", "found")
    assert [{key: row[key] for key in keep} for row in after] == [{key: row[key] for key in keep} for row in before]


def test_pcap_says_what_it_cannot_keep(poll: Path, tmp_path: Path, sniff485: Callable) -> None:
    ran = sniff485("convert", poll, tmp_path / "x.pcap")
    assert "keeps no line settings" in ran.err
    assert "1 octet that is no whole frame was left out" in ran.err


def test_every_command_has_help(sniff485: Callable) -> None:
    from sniff.cli import COMMANDS

    for command in COMMANDS:
        ran = sniff485(command, "--help")
        assert ran.code == 0, command
        assert "usage: sniff485" in ran.out


def test_ports_speaks_json_or_says_that_there_are_none(sniff485: Callable) -> None:
    assert sniff485("ports").code == 0
    for line in sniff485("ports", "--json").out.splitlines():
        assert json.loads(line)["device"]


@pytest.mark.parametrize(
    ("port", "said"),
    [("/dev/no-such-port", "no such port"), ("{folder}", "folder"), ("{file}", "not a serial port")],
)
def test_a_port_that_is_none_is_said_in_a_line(port: str, said: str, tmp_path: Path, sniff485: Callable) -> None:
    file = tmp_path / "file"
    file.write_text("x")
    ran = sniff485("record", port.format(folder=tmp_path, file=file), "-s", "9600", "-w", tmp_path / "x.mcap")
    assert ran.code == 4
    assert said in ran.err
    assert ran.err.count("\n") == 1


def test_health_has_a_table_with_its_reasons(sniff485, poll):
    ran = sniff485("stats", poll, "health", "--json")
    rows = [json.loads(line) for line in ran.out.splitlines()]
    assert rows[0]["subject"] == "bus"
    assert {row["subject"] for row in rows[1:]} >= {"station 1"}
    assert all(bool(row["why"]) == (row["health"] < 100) for row in rows)
    assert [row["health"] for row in rows] != [100] * len(rows)  # one of them does not answer


def test_broadcasts_are_no_stations_that_were_polled_for(sniff485: Callable, poll: Path) -> None:
    poll.write_text(poll.read_text() + "+500 00 06 00 01 00 01 18 1B\n")
    shown = sniff485("info", poll).out
    assert "broadcasts   1 to 0" in shown
    assert "polled only" not in shown
    assert json.loads(sniff485("info", poll, "--json").out)["polled_only"] == []


def test_lists_are_lists(sniff485: Callable) -> None:
    (rule,) = [json.loads(line) for line in sniff485("rule", "MB001", "--json").out.splitlines()]
    assert (rule["explains"], rule["told_by"]) == (["MB105", "MB104"], [])
    profiles = [json.loads(line) for line in sniff485("profile", "list", "--json").out.splitlines()]
    assert next(one for one in profiles if one["name"] == "automationdirect-acn")["protocols"] == ["modbus-rtu"]
