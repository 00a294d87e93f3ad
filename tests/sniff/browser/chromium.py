"""A headless Chromium, driven over its DevTools protocol: as much of it as a test needs."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import shutil
import tempfile
from collections.abc import AsyncIterator
from typing import Any

import aiohttp

PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

TAP = """
    window.shown = ""
    const Plain = window.WebSocket
    window.WebSocket = class extends Plain {
      constructor(...told) {
        super(...told)
        window.screenSocket = this
        const decoder = new TextDecoder()
        this.addEventListener("message", async event => {
          if (typeof event.data === "string") return
          const octets = event.data instanceof Blob ? await event.data.arrayBuffer() : event.data
          window.shown += decoder.decode(octets, {stream: true})
        })
      }
    }
"""
"""Keeps what comes for the terminal, whose own picture is drawn on a canvas."""


class Page:
    """One tab."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self._socket = socket
        self._number = 0
        self.requests: list[str] = []

    async def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """One command of the protocol."""
        self._number += 1
        await self._socket.send_json({"id": self._number, "method": method, "params": parameters})
        while True:
            told = await self._socket.receive_json()
            if told.get("method") == "Network.requestWillBeSent":
                self.requests.append(told["params"]["request"]["url"])
            if told.get("id") == self._number:
                assert "error" not in told, told
                result: dict[str, Any] = told["result"]
                return result

    async def value(self, expression: str) -> Any:
        """Of an expression of JavaScript."""
        return (await self.call("Runtime.evaluate", expression=expression))["result"].get("value")

    async def until(self, expression: str) -> None:
        """Wait until it is true; the time limit is the test's."""
        while not await self.value(expression):
            await asyncio.sleep(0.1)

    async def open(self, address: str) -> None:
        """Go there."""
        await self.call("Page.enable")
        await self.call("Page.addScriptToEvaluateOnNewDocument", source=TAP)
        await self.call("Network.enable")
        await self.call("Page.navigate", url=address)

    async def press(self, key: str) -> None:
        """A key of one character."""
        for kind in ("keyDown", "keyUp"):
            text = {"text": key} if kind == "keyDown" else {}
            code = ord(key.upper())
            await self.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code, **text)

    async def picture(self) -> bytes:
        """PNG of the page."""
        return base64.b64decode((await self.call("Page.captureScreenshot"))["data"])


@contextlib.asynccontextmanager
async def page() -> AsyncIterator[Page]:
    """A tab of a Chromium of its own."""
    assert PROGRAM is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = await asyncio.create_subprocess_exec(
            PROGRAM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--no-first-run",
            "--disable-background-networking", "--window-size=1200,700", "--remote-debugging-port=0",
            f"--user-data-dir={profile}", "about:blank",
            stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE,
        )  # fmt: skip
        assert process.stderr is not None
        try:
            while b"DevTools listening on " not in (line := await process.stderr.readline()):
                assert line, "Chromium ended"
            port = line.decode().split("://127.0.0.1:")[1].split("/")[0]
            drained = asyncio.ensure_future(process.stderr.read())
            async with aiohttp.ClientSession() as session:
                async with session.get(f"http://127.0.0.1:{port}/json") as told:
                    tabs = await told.json()
                address = next(tab["webSocketDebuggerUrl"] for tab in tabs if tab["type"] == "page")
                async with session.ws_connect(address, max_msg_size=0) as socket:
                    yield Page(socket)
            drained.cancel()
        finally:
            process.kill()
            await process.wait()
