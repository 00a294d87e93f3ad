"""The command as a process: a browser sees the list and its keys work; viewers do not come near a recording."""

from __future__ import annotations

import asyncio
import contextlib
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("textual_serve")
pytest.importorskip("fcntl", reason="pseudo-terminals")
import aiohttp

from dissectors.frame import Chunk
from sniff.formats import read
from tests.e2e.recording_bus import Feeder
from tests.sniff.browser import chromium

pytestmark = pytest.mark.timeout(400)  # processes of their own, on a machine that may be busy
CAPTURE = Path(__file__).parents[3] / "captures" / "rtu-usual-faults.cap.txt"
TOKEN = "0123456789abcdef0123"
PATIENCE = 90.0
"""Seconds for anything to happen on an overloaded machine."""


@contextlib.contextmanager
def served(*arguments: str) -> Iterator[str]:
    """`serve` at a free port; its address."""
    command = [sys.executable, "-m", "sniff", "serve", "--port", "0", *arguments]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    try:
        found = None
        while found is None:
            line = process.stderr.readline()
            assert line, "it ended"
            found = re.search(r" at (http://\S+?)/", line)
        yield found[1]
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE)
        assert process.returncode == 0


class Viewer:
    """A screen without a browser. `shown`: all that came for the terminal."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self._socket = socket
        self.shown = ""

    async def until(self, word: str) -> None:
        async with asyncio.timeout(PATIENCE):
            while word not in self.shown:
                told = await self._socket.receive()
                assert told.type in (aiohttp.WSMsgType.BINARY, aiohttp.WSMsgType.TEXT), "the view ended"
                if told.type is aiohttp.WSMsgType.BINARY:
                    self.shown += told.data.decode(errors="replace")

    async def press(self, key: str) -> None:
        await self._socket.send_json(["stdin", key])


@contextlib.asynccontextmanager
async def viewing(session: aiohttp.ClientSession, address: str):  # type: ignore[no-untyped-def]
    url = f"{address}/ws?width=120&height=40"
    async with session.ws_connect(url, headers={"Origin": address}, max_msg_size=0) as socket:
        yield Viewer(socket)


@pytest.mark.skipif(chromium.PROGRAM is None, reason="no Chromium here")
def test_a_browser_shows_the_list_and_its_keys_work() -> None:
    async def look(address: str) -> list[str]:
        async with chromium.page() as page, asyncio.timeout(PATIENCE):
            await page.open(address)
            await page.until("window.shown && window.shown.includes('read holding 0x2520')")
            await page.until("document.activeElement.className === 'xterm-helper-textarea'")
            assert "no answer to any" not in await page.value("window.shown")
            before = await page.picture()
            await page.press("5")
            await page.until("window.shown.includes('no answer to any')")
            assert await page.picture() != before
            return page.requests

    with served(str(CAPTURE)) as address:
        requests = asyncio.run(look(address))
    assert requests
    assert [url for url in requests if not url.startswith((f"{address}/", "data:"))] == []


def test_viewers_do_not_disturb_the_recording(tmp_path: Path) -> None:
    request = bytes.fromhex("01030000000ac5cd")
    feeder = Feeder()
    path = tmp_path / "site.mcap"

    async def look(address: str) -> None:
        async with aiohttp.ClientSession() as session, viewing(session, address) as stays:
            feeder.feed(request * 20)
            await stays.until("read holding")
            async with viewing(session, address) as leaves:
                await leaves.until("read holding")
                await leaves.press("3")  # looks around, and goes while the other stays
                feeder.feed(request * 20)
            stays.shown = ""
            await stays.press("5")
            await stays.until("means")
            feeder.feed(bytes.fromhex("02030000000ac5fe") * 20)

    with served(feeder.path, "-s", "115200,8N1", "-p", "modbus-rtu", "-w", str(path)) as address:
        asyncio.run(look(address))
    capture = read(str(path))
    heard = b"".join(item.octets for item in capture.items() if isinstance(item, Chunk))
    assert capture.completeness().whole
    assert heard == bytes(feeder.fed)


def test_a_token_is_really_asked_for(tmp_path: Path) -> None:
    async def look(address: str) -> list[int]:
        given = []
        async with aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True)) as session:
            for path in ("/", "/ws", "/static/js/textual.js", "/?token=wrong", "/download/x"):
                async with session.get(address + path, headers={"Origin": address}) as answer:
                    given.append(answer.status)
            with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
                async with viewing(session, address):
                    pass
            async with session.get(f"{address}/?token={TOKEN}") as answer:
                given.append(answer.status)
                assert TOKEN not in str(answer.url)  # it went into a cookie
            async with viewing(session, address) as viewer:
                await viewer.until("read holding")
        return given

    held = tmp_path / "token"
    held.write_text(f"{TOKEN}\n", encoding="utf-8")
    with served(str(CAPTURE), "--allow-remote", "--token-file", str(held)) as address:
        assert asyncio.run(look(address)) == [403, 403, 403, 403, 403, 200]


def test_the_process_of_the_server_holds_no_scapy() -> None:
    program = (
        "import sys\n"
        "from sniff.browser.server import Viewing\n"
        "from sniff.cli import main\n"
        "async def at_once(self, ended):\n"
        "    await self._make_app()\n"
        "Viewing.serve_until = at_once\n"
        f"main(['serve', '--port', '0', {str(CAPTURE)!r}])\n"
        "print([name for name in sys.modules if name.split('.')[0] == 'scapy'])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
