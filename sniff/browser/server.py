"""A server of pages with a terminal, by textual-serve; each viewer has a terminal UI in a process of its own."""

from __future__ import annotations

import asyncio
import logging
import shlex
import subprocess
import sys
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Any

from aiohttp import web
from textual_serve.server import Server

from sniff.browser.access import COOKIE, Access

MOST_VIEWERS = 8
"""At once: each costs a process and a view of the capture."""

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Viewing(Server):
    """`command`: what shows a terminal UI, started for each viewer. `ready`: called when viewers may come."""

    def __init__(
        self, command: Sequence[str], host: str, port: int, title: str, access: Access, ready: Callable[[int], None]
    ) -> None:
        line = subprocess.list2cmdline(command) if sys.platform == "win32" else shlex.join(command)
        super().__init__(line, host=host, port=port, title=title, templates_path=Path(__file__).parent / "pages")
        self._access = access
        self._ready = ready
        self._viewers = 0

    def initialize_logging(self) -> None:
        """Nothing is logged: what a terminal UI says at its end is not for here."""
        logging.getLogger("textual-serve").addHandler(logging.NullHandler())
        logging.getLogger("textual-serve").propagate = False

    async def serve_until(self, ended: asyncio.Event) -> None:
        """Serve until that. Raises OSError where the address cannot be had."""
        self.initialize_logging()
        runner = web.AppRunner(await self._make_app(), access_log=None)
        await runner.setup()
        try:
            await web.TCPSite(runner, self.host, self.port, shutdown_timeout=2.0).start()
            self._ready(runner.addresses[0][1])
            await ended.wait()
        finally:
            await runner.cleanup()

    async def on_startup(self, app: web.Application) -> None:
        """Said by `ready`, when it is true."""

    async def _make_app(self) -> web.Application:
        app = await super()._make_app()
        app.middlewares.append(self._guard())
        return app

    def _guard(self) -> Any:
        @web.middleware
        async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
            said = request.query.get("token") or request.cookies.get(COOKIE, "")
            refusal = self._access.refusal(request.headers, said, request.path == "/ws")
            if refusal:
                await asyncio.sleep(0.3)
                raise web.HTTPForbidden(text=refusal)
            if self._access.token and "token" in request.query and request.path == "/":
                response: web.StreamResponse = web.HTTPSeeOther("/")  # out of the address, which others may see
                response.set_cookie(COOKIE, self._access.token, httponly=True, samesite="Strict")
                return response
            response = await handler(request)
            if not response.prepared:
                response.headers["Content-Security-Policy"] = _POLICY
                response.headers["X-Content-Type-Options"] = "nosniff"
            return response

        return guard

    async def handle_index(self, request: web.Request) -> web.StreamResponse:
        """The page, under whichever name it was asked for."""
        self.public_url = f"{request.scheme}://{request.host}"
        page: web.StreamResponse = await super().handle_index(request)
        return page

    async def handle_websocket(self, request: web.Request) -> web.WebSocketResponse:
        """One viewer."""
        if self._viewers >= MOST_VIEWERS:
            raise web.HTTPServiceUnavailable(text=f"{MOST_VIEWERS} viewers are here already")
        self._viewers += 1
        try:
            return await super().handle_websocket(request)
        finally:
            self._viewers -= 1


_POLICY = (
    "default-src 'self'; style-src 'self' 'unsafe-inline'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; "
    "img-src 'self' data: blob:; connect-src 'self' ws: wss:; frame-ancestors 'none'"
)
