"""Alerts against real commands and a real HTTP server, one that hangs too."""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from dissectors.findings import Finding, Severity
from sniff.config import AlertSettings, ConfigError, parse
from sniff.outlets import alerts as alerts_module
from sniff.outlets.alerts import MOST_WAITING, Alerts, post
from sniff.outlets.news import News, NewsKind

FOUND = Finding("MB001", Severity.ERROR, "station 3", 1, 2, 4, (), "no answer", "it is off", "switch it on")
NEWS = News(NewsKind.NEW, FOUND)


class Server(ThreadingHTTPServer):
    """Keeps what it is given; answers when `go` is set."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.got: list[dict[str, object]] = []
        self.go = threading.Event()
        self.asked = threading.Event()
        self.code = 200
        self.address = f"http://127.0.0.1:{self.server_port}/hook/secret"


class Handler(BaseHTTPRequestHandler):
    server: Server

    def do_POST(self) -> None:
        self.server.got.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.server.asked.set()
        self.server.go.wait(60)
        self.send_response(self.server.code)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def server() -> Iterator[Server]:
    made = Server()
    thread = threading.Thread(target=made.serve_forever, daemon=True)
    thread.start()
    yield made
    made.go.set()
    made.shutdown()
    made.server_close()


def test_a_webhook_gets_what_was_found(server: Server) -> None:
    server.go.set()
    said: list[str] = []
    outlet = Alerts(AlertSettings(webhook=server.address), said.append)
    outlet.tell("boiler", "/dev/ttyUSB0", NEWS)
    outlet.close(60)
    (got,) = server.got
    assert (got["what"], got["bus"], got["code"], got["subject"]) == ("new", "boiler", "MB001", "station 3")
    assert (outlet.sent, outlet.failed, outlet.dropped, said) == (1, 0, 0, [])


def test_a_server_that_hangs_holds_nobody_up_and_what_is_dropped_is_counted(server: Server) -> None:
    outlet = Alerts(AlertSettings(webhook=server.address), lambda text: None)
    outlet.tell("boiler", "x", NEWS)
    assert server.asked.wait(60)
    for _ in range(MOST_WAITING + 30):
        outlet.tell("boiler", "x", NEWS)
    assert outlet.dropped == 30
    server.go.set()
    while outlet._queue.qsize() > MOST_WAITING // 2:
        server.asked.clear()
        assert server.asked.wait(60)
    outlet.tell("boiler", "x", NEWS)
    outlet.close(60)
    assert server.got[-1]["dropped_before"] == 30


def test_a_server_that_refuses_is_said_once_and_when_it_is_over(server: Server) -> None:
    server.go.set()
    server.code = 503
    said: list[str] = []
    outlet = Alerts(AlertSettings(webhook=server.address), said.append)
    for _ in range(3):
        outlet.tell("boiler", "x", NEWS)
    outlet.close(60)
    assert said == [f"alerts do not get through: 127.0.0.1:{server.server_port}: answered 503"]
    assert "secret" not in said[0]


def test_nobody_there_is_said_without_the_secret_of_the_address() -> None:
    said = post("http://user:password@127.0.0.1:1/hook/secret", b"{}")
    assert said is not None
    assert "127.0.0.1" in said
    assert "password" not in said
    assert "secret" not in said


def test_a_command_gets_it_on_its_standard_input(tmp_path: Path) -> None:
    target = tmp_path / "got.json"
    words = (sys.executable, "-c", f"import sys; open({str(target)!r}, 'w').write(sys.stdin.read())")
    outlet = Alerts(AlertSettings(command=words), lambda text: None)
    outlet.tell("boiler", "x", NEWS)
    outlet.close(60)
    assert json.loads(target.read_text())["seen"] == "no answer"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("/no/such/command",), "/no/such/command: No such file or directory"),
        ((sys.executable, "-c", "raise SystemExit(3)"), f"{sys.executable}: ended with 3"),
        ((sys.executable, "-c", "import time; time.sleep(600)"), f"{sys.executable}: took longer than 0.2 s"),
    ],
)
def test_a_command_that_fails_is_said(words: tuple[str, ...], said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(alerts_module, "PATIENCE", 0.2 if "sleep" in words[-1] else 60.0)
    complaint = alerts_module.run_command(words, b"{}")
    assert complaint is not None
    assert complaint.startswith(said)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "whom to tell"),
        ('webhook = "ftp://x"', "expected http"),
        ('command = "mail"', "expected a list of words"),
        ('webhook = "http://x"\nat = "eror"', "error"),
        ('webhook = "http://x"\nevery = "1h"', "expected seconds"),
        ('webhook = "http://x"\nevery = nan', "expected seconds"),
        ('webhook = "http://x"\nevery = inf', "expected seconds"),
        ('webhok = "http://x"', "webhook"),
    ],
)
def test_a_wrong_configuration_names_its_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "sniff485.toml"
    path.write_text(f"[alert]\n{text}\n")
    with pytest.raises(ConfigError, match=said):
        parse(path)


def test_a_configuration_is_read(tmp_path: Path) -> None:
    path = tmp_path / "sniff485.toml"
    path.write_text('[alert]\ncommand = ["notify", "bus"]\nat = "error"\nevery = 60\n')
    assert parse(path).alert == AlertSettings(("notify", "bus"), "", Severity.ERROR, 60.0)
