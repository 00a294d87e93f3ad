"""Alerts: what is new about a bus as JSON to a command's standard input, or to a webhook. In a thread of their own.

A command or a server that hangs costs its time limit, no more; what does not fit into the queue meanwhile is dropped
and counted, and the count goes with the next alert. Nothing here is waited for, at the end neither.
"""

from __future__ import annotations

import json
import queue
import subprocess
import threading
import urllib.error
import urllib.request
from collections.abc import Callable, Sequence

from sniff.config import AlertSettings
from sniff.outlets.news import News

MOST_WAITING = 64
PATIENCE = 10.0
"""Seconds for one command or one answer of a server."""


class Alerts:
    """`complain`: told in words, once, when alerts do not get through, and again when they do. `sent`, `failed`,
    `dropped`: how many."""

    def __init__(self, settings: AlertSettings, complain: Callable[[str], None]) -> None:
        self.sent = self.failed = self.dropped = 0
        self._settings = settings
        self._complain = complain
        self._troubled = False
        self._queue: queue.Queue[dict[str, object] | None] = queue.Queue(MOST_WAITING)
        self._thread = threading.Thread(target=self._run, name="alerts", daemon=True)
        self._thread.start()

    def tell(self, bus: str, port: str, news: News) -> None:
        """Hand on one thing; never waits."""
        value = value_of(bus, port, news)
        if self.dropped:
            value["dropped_before"] = self.dropped
        try:
            self._queue.put_nowait(value)
        except queue.Full:
            self.dropped += 1

    def close(self, patience: float = 1.0) -> None:
        """Send what waits, for so many seconds at most."""
        try:
            self._queue.put_nowait(None)
        except queue.Full:
            return
        self._thread.join(patience)

    def _run(self) -> None:
        while (value := self._queue.get()) is not None:
            text = json.dumps(value).encode()
            trouble = None
            if self._settings.command:
                trouble = run_command(self._settings.command, text)
            if self._settings.webhook:
                trouble = post(self._settings.webhook, text) or trouble
            self._note(trouble)

    def _note(self, trouble: str | None) -> None:
        if trouble is None:
            self.sent += 1
        else:
            self.failed += 1
        if (trouble is not None) is not self._troubled:
            self._troubled = trouble is not None
            self._complain(f"alerts do not get through: {trouble}" if trouble else "alerts get through again")


def value_of(bus: str, port: str, news: News) -> dict[str, object]:
    """What is sent."""
    one = news.finding
    return {
        "what": news.what.value,
        "bus": bus,
        "port": port,
        "code": one.code,
        "severity": one.severity.label,
        "subject": one.subject,
        "seen": one.seen,
        "means": one.means,
        "next": one.next,
        "count": one.count,
        "first_ns": one.first,
        "last_ns": one.last,
        "held_back": news.held_back,
    }


def run_command(words: Sequence[str], text: bytes) -> str | None:
    """Give a command the text on its standard input; what went wrong, in words."""
    try:
        done = subprocess.run(
            list(words), input=text, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        return f"{words[0]}: took longer than {PATIENCE:g} s, and was ended"
    except OSError as error:
        return f"{words[0]}: {error.strerror}"
    return f"{words[0]}: ended with {done.returncode}" if done.returncode else None


def post(address: str, text: bytes) -> str | None:
    """POST the text; what went wrong, in words that do not show the address' secrets."""
    host = address.split("/")[2] if address.count("/") >= 2 else address
    request = urllib.request.Request(
        address, text, {"Content-Type": "application/json", "User-Agent": "sniff485"}, method="POST"
    )
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            answer.read(1024)
    except urllib.error.HTTPError as error:
        return f"{host.rpartition('@')[2]}: answered {error.code}"
    except (OSError, ValueError) as error:
        return f"{host.rpartition('@')[2]}: {getattr(error, 'reason', error)}"
    return None
