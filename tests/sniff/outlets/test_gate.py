"""The gate: who comes in, how many, how much they may say."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sniff.outlets import gate
from sniff.outlets.gate import CONNECTIONS, HEAD, MOST_MESSAGE, Gate, MessageSizes, refusal

TOKEN = "a token that is long enough"
REQUEST = b"GET / HTTP/1.1\r\nHost: x\r\n\r\n"


def frame(length: int, opcode: int = 1, final: bool = True) -> bytes:
    """A masked frame of zeros."""
    head = bytes([opcode | 0x80 * final])
    if length < 126:
        head += bytes([0x80 | length])
    elif length < 1 << 16:
        head += b"\xfe" + length.to_bytes(2, "big")
    else:
        head += b"\xff" + length.to_bytes(8, "big")
    return head + bytes(4) + bytes(length)


@given(st.lists(st.integers(0, 70_000), max_size=5), st.integers(1, 50_000))
def test_messages_are_measured_however_they_are_cut(lengths: list[int], cut: int) -> None:
    stream = b"".join(map(frame, lengths))
    sizes = MessageSizes(60_000)
    taken = all(sizes.feed(stream[at : at + cut]) for at in range(0, len(stream), cut))
    assert taken is all(length <= 60_000 for length in lengths)


def test_pieces_of_a_message_add_up_and_a_ping_between_them_does_not() -> None:
    sizes = MessageSizes(1000)
    assert sizes.feed(frame(600, final=False) + frame(100, opcode=9) + frame(300, opcode=0))
    assert sizes.feed(frame(600, final=False))
    assert not sizes.feed(frame(500, opcode=0))


@given(st.binary(max_size=300))
def test_any_octets_are_measured_and_any_request_is_judged(octets: bytes) -> None:
    MessageSizes().feed(octets)
    refusal(octets, None)
    refusal(octets, TOKEN)


@pytest.mark.parametrize(
    ("request_head", "token", "why"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", None, None),
        (b"POST / HTTP/1.1\r\n\r\n", None, "405 Method Not Allowed"),
        (b"GET / HTTP/1.1\r\nOrigin: https://evil.example\r\n\r\n", None, "403 Forbidden"),
        (b"GET / HTTP/1.1\r\nOrigin: https://app.foxglove.dev\r\n\r\n", None, None),
        (b"GET / HTTP/1.1\r\nOrigin: http://localhost:8080\r\n\r\n", None, None),
        (b"GET / HTTP/1.1\r\nOrigin: https://evil.example\r\n\r\n", TOKEN, "401 Unauthorized"),
        (b"GET / HTTP/1.1\r\nAuthorization: Bearer " + TOKEN.encode() + b"\r\n\r\n", TOKEN, None),
        (b"GET /?token=a+token+that+is+long+enough HTTP/1.1\r\n\r\n", TOKEN, None),
        (b"GET /?token=another HTTP/1.1\r\n\r\n", TOKEN, "401 Unauthorized"),
        (b"GET / HTTP/1.1\r\n\r\n", TOKEN, "401 Unauthorized"),
    ],
)
def test_who_is_let_in(request_head: bytes, token: str | None, why: str | None) -> None:
    assert refusal(request_head, token) == why


def passing(visit: Callable[[int], Awaitable[None]]) -> None:
    """Run a visit at a gate before a server that answers a request by "in" and then echoes."""

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(b"in")
        while octets := await reader.read(1000):
            writer.write(octets)
        writer.close()

    async def all_of_it() -> None:
        inner = await asyncio.start_server(answer, "127.0.0.1", 0)
        made = Gate(inner.sockets[0].getsockname()[1], None)
        port = await made.open("127.0.0.1", 0)
        await asyncio.wait_for(visit(port), 60)
        made.close()
        inner.close()

    asyncio.run(all_of_it())


async def enter(port: int, head: bytes = REQUEST) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(head)
    return reader, writer


def test_so_many_come_in_and_the_next_when_one_has_gone() -> None:
    async def visit(port: int) -> None:
        inside = [await enter(port) for _ in range(CONNECTIONS)]
        for reader, _ in inside:
            assert await reader.readexactly(2) == b"in"
        reader, writer = await enter(port)
        assert (await reader.read()).startswith(b"HTTP/1.1 503")
        inside[0][1].close()
        while True:
            reader, writer = await enter(port)
            if await reader.read(2) == b"in":
                break
        for _, one in [*inside, (reader, writer)]:
            one.close()

    passing(visit)


def test_a_message_too_large_ends_the_connection() -> None:
    async def visit(port: int) -> None:
        reader, writer = await enter(port)
        assert await reader.readexactly(2) == b"in"
        writer.write(frame(10))
        assert await reader.readexactly(16) == frame(10)
        writer.write(frame(MOST_MESSAGE + 1)[:100])
        assert await reader.read() == b""

    passing(visit)


def test_a_request_too_long_or_too_slow_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gate, "PATIENCE", 0.05)

    async def visit(port: int) -> None:
        reader, _ = await enter(port, b"GET / HTTP/1.1\r\nX: " + b"x" * (2 * HEAD))
        with pytest.raises((ConnectionError, asyncio.IncompleteReadError)):
            await reader.readexactly(1)
        reader, _ = await enter(port, b"GET / HTTP/1.1\r\n")
        assert await reader.read() == b""

    passing(visit)
