"""A process of its own that serves channels to Foxglove: told by JSON Lines on standard input, until its end.

It is one of its own because the SDK is built of parts that are Apache-2.0 only, which must not be in a process with
scapy (GPL-2.0-only): nothing but the SDK and this file is loaded here. First line: {"host", "port", "token"}; answered
by {"port"} or {"error"}. Then {"channel", "topic", "schema", "encoding", "text", "metadata"} once for each channel, and
{"c", "t", "d"}: number of a channel, ns, content.
"""

from __future__ import annotations

import asyncio
import json
import sys
import threading
from collections import deque
from typing import Any

from sniff.outlets.gate import Gate

BACKLOG = 512
"""Messages that wait for a client; the oldest give way."""

FINDINGS, MOST_STANDING = "/findings", 200
TAKEN_NOTE = 0.1
"""Seconds until the SDK knows a subscription that it has just told of."""


def main() -> int:
    """Serve until standard input ends."""
    import foxglove

    told = json.loads(sys.stdin.readline())
    context, loop = foxglove.Context(), asyncio.new_event_loop()
    standing: Any = Standing(loop)  # as much of its protocol as a server without capabilities calls
    server = foxglove.start_server(
        name="sniff485",
        host="127.0.0.1",
        port=0,
        capabilities=[],  # clients may read, and nothing else
        server_listener=standing,
        context=context,
        message_backlog_size=BACKLOG,
    )
    gate = Gate(server.port, told["token"])
    try:
        port = loop.run_until_complete(gate.open(told["host"], told["port"]))
    except OSError as error:
        _say({"error": error.strerror or str(error)})
        server.stop()
        return 1
    _say({"port": port})
    threading.Thread(target=_read, args=(foxglove, context, loop, standing), daemon=True).start()
    try:
        loop.run_forever()
    finally:
        gate.close()
        server.stop()
    return 0


class Standing:
    """What a channel said last, for whoever comes later; of findings, which are told once, all."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._said: dict[str, tuple[Any, deque[tuple[bytes, int]]]] = {}

    def add(self, topic: str, channel: Any) -> None:
        """A new channel."""
        self._said[topic] = channel, deque(maxlen=MOST_STANDING if topic == FINDINGS else 1)

    def log(self, topic: str, content: bytes, time: int) -> None:
        """Tell whoever listens to a channel."""
        channel, said = self._said[topic]
        said.append((content, time))
        channel.log(content, log_time=time)

    def on_subscribe(self, client: Any, channel: Any) -> None:
        """Called by the SDK: somebody listens from now on; once it has taken note, what stands is said again."""
        self._loop.call_soon_threadsafe(self._loop.call_later, TAKEN_NOTE, self._again, channel.topic)

    def on_unsubscribe(self, client: Any, channel: Any) -> None:
        """Called by the SDK."""

    def _again(self, topic: str) -> None:
        if topic in self._said:
            channel, said = self._said[topic]
            for content, time in tuple(said):
                channel.log(content, log_time=time)


def _say(value: object) -> None:
    sys.stdout.write(json.dumps(value) + "\n")
    sys.stdout.flush()


def _read(foxglove: Any, context: Any, loop: asyncio.AbstractEventLoop, standing: Standing) -> None:
    """Hand on what comes, and stop everything at its end."""
    topics: dict[int, str] = {}
    try:
        for line in sys.stdin.buffer:
            told = json.loads(line)
            if "channel" in told:
                schema = foxglove.Schema(name=told["schema"], encoding=told["encoding"], data=told["text"].encode())
                channel = foxglove.Channel(
                    told["topic"], schema=schema, message_encoding="json", context=context, metadata=told["metadata"]
                )
                topics[told["channel"]] = told["topic"]
                standing.add(told["topic"], channel)
            else:
                standing.log(topics[told["c"]], told["d"].encode(), told["t"])
    finally:
        loop.call_soon_threadsafe(loop.stop)


if __name__ == "__main__":
    sys.exit(main())
