"""`sniff485 box` beside its loop: what it prints, and what it says where nothing can be asked or begun."""

from __future__ import annotations

import json
import random
import socket
from contextlib import closing
from pathlib import Path
from xml.etree import ElementTree

import pytest

from sniff.box.page import StatusPage
from sniff.cli import main
from tests.sniff.analysis.sites_made import SITES, write
from tests.sniff.box.box_made import STATUS

pytestmark = pytest.mark.skipif(not hasattr(socket, "AF_UNIX"), reason="no sockets with names here")


@pytest.fixture(autouse=True)
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Nobody's box runs here."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path / "run"))
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setattr("sniff.box.page.runtime_folders", lambda: [tmp_path / "run"])
    (tmp_path / "run").mkdir()
    return tmp_path


def test_what_is_shipped_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["box", "unit"]) == 0
    assert "Type=notify" in capsys.readouterr().out
    assert main(["box", "udev"]) == 0
    assert "latency_timer" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["box"], 2, "no bus with a port is configured"),
        (["box", "status"], 4, "no box runs here (looked in "),
        (["box", "status", "--socket", "absent.sock"], 4, "absent.sock"),
        (["box", "status", "--status-port", "1"], 4, "127.0.0.1:1"),
        (["box", "status", "--name", "other"], 4, "no box runs here"),
        (["box", "--keep-free", "much"], 2, "expected octets"),
    ],
)
def test_what_cannot_be(words: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        ended = main(words)
    except SystemExit as exit_:  # argparse
        ended = int(str(exit_.code))
    assert ended == code
    assert said in capsys.readouterr().err


def test_one_of_several_boxes(alone: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with closing(StatusPage(alone / "run" / "a.sock")) as first, closing(StatusPage(alone / "run" / "b.sock")):
        first.json = json.dumps(STATUS.to_json())
        assert main(["box", "status"]) == 2
        assert "which box?" in capsys.readouterr().err
        assert main(["box", "status", "--name", "a"]) == 1  # a bus is down
        assert "box site: recording" in capsys.readouterr().out
        assert main(["box", "status", "--name", "b"]) == 4  # it says nothing that could be read


def test_what_is_not_understood_is_told_with_its_section(alone: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (alone / "sniff485.toml").write_text(
        '[box]\nrotate = "sometimes"\n[bus.a]\nport = "/dev/none"\nline = "9600,8N1"\n'
    )
    assert main(["box"]) == 2
    assert "[box] rotation 'sometimes'" in capsys.readouterr().err


def test_findings_of_a_site_in_every_format(alone: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(alone / "site.mcap", SITES["power-lost"][0](random.Random(1)))
    assert main(["check", "site.mcap", "--format", "json"]) == 1
    first = json.loads(capsys.readouterr().out.splitlines()[0])
    assert (first["source"], first["code"], first["title"]) == ("site.mcap", "SB001", "buses stopped at one moment")
    assert main(["check", "site.mcap", "--fail-on", "error"]) == 0
    capsys.readouterr()
    assert main(["check", "site.mcap", "--format", "junit"]) == 1
    suites = ElementTree.fromstring(capsys.readouterr().out)
    assert [(suite.get("name"), suite.get("failures")) for suite in suites] == [
        ("site.mcap", "1"),
        *((f"site.mcap [{name}]", "0") for name in ("boiler", "roof", "cellar")),
    ]
    assert main(["check", "site.mcap", "--bus", "roof", "--only", "SB,LN3"]) == 1
    assert "SB001" not in capsys.readouterr().out  # of one bus alone nothing is known of the others
