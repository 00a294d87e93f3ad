"""Foxglove live: the channels of a recording (/values, /bus, /nodes, /findings) to whoever connects.

By a process of its own that holds the SDK; `foxglove_process.py` says why.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

from sniff.bus.value_topics import ValueChannels
from sniff.capture.spawn import environment
from sniff.outlet_settings import ListenSettings, SettingsError
from sniff.outlets.outlet import AT_THE_END, Outlet
from sniff.outlets.told import LogTold, NumbersTold, Told, ToldBus, ValueTold
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.topics import SCHEMAS

MOST_CHANNELS = 20_000
TAKEN_AT_ONCE = 256
EVERY = 0.0
"""Seconds between two values of a point: each is told, as a plot wants it."""


class FoxgloveOutlet(Outlet):
    """Raises SettingsError where it cannot be served. `port`: where it is."""

    def __init__(self, settings: ListenSettings, complain: Callable[[str], None]) -> None:
        super().__init__("foxglove", complain, int(EVERY * 1e9))
        if importlib.util.find_spec("foxglove") is None:
            raise SettingsError("Foxglove needs a library: pip install 'sniff485[foxglove]'")
        token = settings.required_token()
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "sniff.outlets.foxglove_process"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env=environment(), start_new_session=True,
        )  # fmt: skip
        self._channels: dict[str, int] = {}
        self._values: dict[str, ValueChannels] = {}
        self.port = self._begin(settings, token)
        self.where = f"ws://{replace(settings, port=self.port).address}"

    def _begin(self, settings: ListenSettings, token: str | None) -> int:
        """Tell the process where to listen: by its input, so that the token is in no list of processes."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        told = {"host": settings.host, "port": settings.port, "token": token}
        try:
            self._process.stdin.write(json.dumps(told).encode() + b"\n")
            self._process.stdin.flush()
            said = json.loads(self._process.stdout.readline() or b'{"error": "its process ended at once"}')
        except OSError as error:
            said = {"error": error.strerror}
        if "error" in said:
            self._process.kill()
            self._process.wait()
            raise SettingsError(f"--foxglove {settings.address}: {said['error']}")
        port: int = said["port"]
        return port

    def close(self, patience: float = AT_THE_END) -> None:
        """End the process, too."""
        until = time.monotonic() + patience
        super().close(patience)
        if self._thread.is_alive():
            self._process.kill()  # it takes nothing in
        elif self._process.stdin is not None:
            with contextlib.suppress(OSError):
                self._process.stdin.close()
        try:
            self._process.wait(max(0.0, until - time.monotonic()))
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _run(self) -> None:
        assert self._process.stdin is not None
        while True:
            told = self._take(TAKEN_AT_ONCE, None)
            if not told and self._closing:
                return
            lines = [line for one in told for line in self._lines(one)]
            try:
                self._process.stdin.write(b"".join(lines))
                self._process.stdin.flush()
            except OSError:
                self.dropped += len(told)
                self._fare("its process ended")
                continue
            self.sent += len(told)

    def _lines(self, told: Told) -> Iterator[bytes]:
        """What the process is told: a channel when it is new, and a message."""
        if isinstance(told, ValueTold):
            message: DerivedMessage | None = self._values_of(told.bus).message(told.sample)
        else:
            message = told.message if isinstance(told, NumbersTold | LogTold) else None
        if message is None:
            return
        number = self._channels.get(message.topic)
        if number is None:
            if len(self._channels) >= MOST_CHANNELS:
                return
            number = self._channels[message.topic] = len(self._channels)
            schema = SCHEMAS[message.schema]
            yield _line(
                {
                    "channel": number,
                    "topic": message.topic,
                    "schema": schema.name,
                    "encoding": schema.encoding,
                    "text": schema.text,
                    "metadata": dict(message.metadata),
                }
            )
        yield _line({"c": number, "t": max(0, message.log_time), "d": message.data.decode()})

    def _values_of(self, bus: ToldBus) -> ValueChannels:
        known = self._values.get(bus.name)
        if known is None:
            known = self._values[bus.name] = ValueChannels(bus.name, bus.devices)
        return known


def _line(value: object) -> bytes:
    return json.dumps(value).encode() + b"\n"
