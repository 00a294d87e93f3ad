"""The status page: one box a name, a limit to its readers, nothing but reading."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from sniff.box.notify import Notifier
from sniff.box.page import READERS, RunsAlready, StatusPage, ask, runtime_folders, sockets
from tests.sniff.box.box_made import STATUS

pytestmark = pytest.mark.skipif(not hasattr(socket, "AF_UNIX"), reason="no sockets with names here")


@contextmanager
def served(path: Path | None, port: int | None = None) -> Iterator[StatusPage]:
    page = StatusPage(path, port)
    page.json, page.words = json.dumps(STATUS.to_json()), "in words\n"
    try:
        yield page
    finally:
        page.close()


def test_who_asks_gets_it(tmp_path: Path) -> None:
    with served(tmp_path / "site.sock", 0) as page:
        assert page.port is not None
        assert ask(tmp_path / "site.sock") == ask(page.port) == STATUS
        assert sockets([tmp_path, tmp_path / "absent"]) == [tmp_path / "site.sock"]
        assert (tmp_path / "site.sock").stat().st_mode & 0o777 == 0o660
    assert not (tmp_path / "site.sock").exists()


def test_a_second_box_of_the_name_is_refused_and_one_that_is_gone_is_not(tmp_path: Path) -> None:
    path = tmp_path / "site.sock"
    with served(path), pytest.raises(RunsAlready, match="process 77"):
        StatusPage(path)
    with closing(socket.socket(socket.AF_UNIX)) as left:
        left.bind(str(path))  # as a box that was killed leaves it
    with served(path):
        assert ask(path) == STATUS


def test_a_box_that_does_not_say_how_it_is_keeps_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "site.sock"
    monkeypatch.setattr("sniff.box.page.PATIENCE", 0.05)
    with closing(socket.socket(socket.AF_UNIX)) as hung:
        hung.bind(str(path))
        hung.listen()
        with pytest.raises(RunsAlready, match="did not say how it is"):
            StatusPage(path)
        assert path.exists()


@pytest.mark.parametrize("words", ["{}", "[]", '{"buses": ["x"]}', '{"buses": "x"}', "[" * 100_000])
def test_what_is_no_status_page_is_said(tmp_path: Path, words: str) -> None:
    with served(tmp_path / "site.sock") as page:
        page.json = words
        with pytest.raises(OSError, match="no status page of a box"):
            ask(tmp_path / "site.sock")


def said(path: Path, words: bytes) -> bytes:
    with closing(socket.socket(socket.AF_UNIX)) as reader:
        reader.settimeout(30)
        reader.connect(str(path))
        reader.sendall(words)
        answer = b""
        while more := reader.recv(4096):
            answer += more
        return answer


def test_who_asks_too_slowly_is_hung_up_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sniff.box.page.ALL_PATIENCE", 0.05)
    monkeypatch.setattr("sniff.box.page.PATIENCE", 60.0)
    with served(tmp_path / "site.sock"), closing(socket.socket(socket.AF_UNIX)) as slow:
        slow.settimeout(30)
        slow.connect(str(tmp_path / "site.sock"))
        slow.sendall(b"GET /status HTTP/1.1\r\n")
        assert slow.recv(1) == b""


def test_it_is_for_reading(tmp_path: Path) -> None:
    path = tmp_path / "site.sock"
    with served(path):
        assert said(path, b"GET / HTTP/1.0\r\n\r\n").endswith(b"in words\n")
        assert b" 404 " in said(path, b"GET /../../etc/passwd HTTP/1.0\r\n\r\n")
        assert b" 501 " in said(path, b"POST /status HTTP/1.0\r\nContent-Length: 3\r\n\r\nabc")
        assert b" 414 " in said(path, b"GET /" + b"x" * 70_000)


def test_so_many_readers_and_no_more(tmp_path: Path) -> None:
    path = tmp_path / "site.sock"
    with served(path):
        idle = [socket.socket(socket.AF_UNIX) for _ in range(READERS)]
        for one in idle:
            one.connect(str(path))
        with closing(socket.socket(socket.AF_UNIX)) as late:
            late.settimeout(30)
            late.connect(str(path))
            assert late.recv(1) == b""
        for one in idle:
            one.close()


def test_where_it_is_looked_for() -> None:
    told = {"RUNTIME_DIRECTORY": "/run/a:/run/b", "XDG_RUNTIME_DIR": "/run/user/7"}
    assert [str(one) for one in runtime_folders(told)] == ["/run/a", "/run/sniff485", "/run/user/7/sniff485"]


@pytest.mark.parametrize("abstract", [False, True])
def test_words_to_the_service_manager(tmp_path: Path, abstract: bool) -> None:
    name = f"@box-test-{tmp_path.name}-{tmp_path.parent.name}" if abstract else str(tmp_path / "notify")
    with closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as manager:
        manager.bind("\0" + name[1:] if abstract else name)
        notifier = Notifier({"NOTIFY_SOCKET": name, "WATCHDOG_USEC": "30000000"})
        assert notifier.watchdog == 30
        assert notifier.tell("READY=1", "WATCHDOG=1")
        assert notifier.status("two\nlines \x1b of it" + "x" * 999)
        assert manager.recv(4096) == b"READY=1\nWATCHDOG=1"
        told = manager.recv(4096)
        assert told.startswith(b"STATUS=two lines ")
        assert b"\n" not in told
        notifier.close()


def test_nobody_listens(tmp_path: Path) -> None:
    assert not Notifier({}).tell("READY=1")
    gone = Notifier({"NOTIFY_SOCKET": str(tmp_path / "absent"), "WATCHDOG_USEC": "nonsense"})
    assert gone.watchdog is None
    assert not gone.tell("READY=1")
    gone.close()
    assert Notifier({"WATCHDOG_USEC": "1000", "WATCHDOG_PID": "1"}).watchdog is None
