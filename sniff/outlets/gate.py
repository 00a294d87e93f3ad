"""A gate before a WebSocket server of this process: who comes in, how many, and how much they may say.

It lets pass: connections up to a limit, each with a complete request within some seconds; a token, where one is asked
for; pages of browsers only from where such a page may be. What a client says is measured: a message beyond the limit
ends its connection. What it is told waits in a bounded buffer for a client that is slow; the server behind drops.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import socket
from urllib.parse import parse_qsl, urlsplit

CONNECTIONS = 8
HEAD = 8192
"""Octets of a request."""

PATIENCE = 5.0
"""Seconds for a request to be complete."""

MOST_MESSAGE = 64 << 10
"""Octets of a message of a client: it only names channels."""

WAITING = 256 << 10
"""Octets that wait for a client before the server behind has to wait."""

ORIGINS = ("https://app.foxglove.dev", "https://studio.foxglove.dev", "file://", "null")
"""Where a browser's page may be from that connects without a token, besides this machine."""

_PIECE = 64 << 10


class MessageSizes:
    """Adds up the messages in a stream of WebSocket frames, as a client sends them (RFC 6455, 5.2). Pure."""

    def __init__(self, most: int = MOST_MESSAGE) -> None:
        self._most = most
        self._head = bytearray()
        self._left = 0  # octets of the frame that is being read
        self._size = 0  # of the message so far

    def feed(self, octets: bytes) -> bool:
        """Take more of the stream; False once a message is too large."""
        at = 0
        while at < len(octets):
            if self._left:
                taken = min(self._left, len(octets) - at)
                self._left -= taken
                at += taken
                continue
            self._head.append(octets[at])
            at += 1
            if not self._read_head():
                return False
        return True

    def _read_head(self) -> bool:
        head = self._head
        if len(head) < 2:
            return True
        short, masked = head[1] & 0x7F, bool(head[1] & 0x80)
        wide = {126: 2, 127: 8}.get(short, 0)
        if len(head) < 2 + wide:
            return True
        length = int.from_bytes(head[2 : 2 + wide], "big") if wide else short
        opcode, final = head[0] & 0x0F, bool(head[0] & 0x80)
        control = opcode >= 8
        size = length if control else self._size + length
        if size > self._most:
            return False
        if len(head) < 2 + wide + 4 * masked:
            return True
        if not control:
            self._size = 0 if final else size
        self._left = length
        head.clear()
        return True


def refusal(head: bytes, token: str | None) -> str | None:
    """Why a request is not let in, as the status of an answer; None where it is. Total."""
    lines = head.decode("latin-1").split("\r\n")
    words = lines[0].split(" ")
    if len(words) != 3 or words[0] != "GET":
        return "405 Method Not Allowed"
    headers: dict[str, str] = {}
    for line in lines[1:]:
        name, colon, text = line.partition(":")
        if colon:
            headers[name.strip().lower()] = text.strip()
    if token is not None:
        return None if _shows(token, words[1], headers) else "401 Unauthorized"
    origin = headers.get("origin")
    return None if origin is None or _is_known(origin) else "403 Forbidden"


def _shows(token: str, path: str, headers: dict[str, str]) -> bool:
    shown = headers.get("authorization", "")
    shown = shown.removeprefix("Bearer ").strip() if shown.startswith("Bearer ") else ""
    if not shown:
        shown = next((text for key, text in parse_qsl(path.partition("?")[2]) if key == "token"), "")
    return hmac.compare_digest(shown.encode("utf-8", "replace"), token.encode())


def _is_known(origin: str) -> bool:
    try:
        host = urlsplit(origin).hostname
    except ValueError:
        return False
    return origin in ORIGINS or host in ("localhost", "127.0.0.1", "::1")


class Gate:
    """`inner`: the port of the server behind, on the loopback. `token`: that everybody must show, None: nobody."""

    def __init__(self, inner: int, token: str | None) -> None:
        self._inner = inner
        self._token = token
        self._inside = 0
        self._server: asyncio.Server | None = None

    async def open(self, host: str, port: int) -> int:
        """Let people in from now on; which port it is. Raises OSError."""
        self._server = await asyncio.start_server(self._come, host, port, limit=HEAD, backlog=CONNECTIONS)
        number: int = self._server.sockets[0].getsockname()[1]
        return number

    def close(self) -> None:
        """Let nobody in any more."""
        if self._server is not None:
            self._server.close()

    async def _come(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._inside >= CONNECTIONS:
            await _leave(writer, "503 Service Unavailable")
            return
        self._inside += 1
        try:
            await self._let_in(reader, writer)
        except (OSError, EOFError, TimeoutError, asyncio.LimitOverrunError):
            pass  # it went away, or took too long, or said too much
        finally:
            self._inside -= 1
            writer.close()

    async def _let_in(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), PATIENCE)
        why = refusal(head, self._token)
        if why is not None:
            await _leave(writer, why)
            return
        taken: socket.socket = writer.get_extra_info("socket")
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        writer.transport.set_write_buffer_limits(WAITING)
        inner_reader, inner_writer = await asyncio.open_connection("127.0.0.1", self._inner)
        try:
            _, _, rest = head.partition(b"\r\n")
            inner_writer.write(b"GET / HTTP/1.1\r\n" + rest)  # a token in the address goes no further
            told = asyncio.ensure_future(_pump(inner_reader, writer, None))
            said = asyncio.ensure_future(_pump(reader, inner_writer, MessageSizes()))
            done, left = await asyncio.wait({told, said}, return_when=asyncio.FIRST_COMPLETED)
            for task in left:
                task.cancel()
            await asyncio.gather(*done, *left, return_exceptions=True)
        finally:
            inner_writer.close()


async def _pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, sizes: MessageSizes | None) -> None:
    while octets := await reader.read(_PIECE):
        if sizes is not None and not sizes.feed(octets):
            return
        writer.write(octets)
        await writer.drain()


async def _leave(writer: asyncio.StreamWriter, status: str) -> None:
    writer.write(f"HTTP/1.1 {status}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n".encode())
    with contextlib.suppress(OSError, TimeoutError):
        await asyncio.wait_for(writer.drain(), PATIENCE)
    writer.close()
