"""Foxglove live: a WebSocket client of somebody else reads the channels of a recording."""

from __future__ import annotations

import asyncio
import json
import struct
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from sniff.outlet_settings import ListenSettings, Secret, SettingsError, listen
from sniff.outlets.foxglove import FoxgloveOutlet
from sniff.outlets.told import LogTold
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.topics import SCHEMAS
from tests.sniff.outlets.given import BUS, NOW, numbers, value

pytest.importorskip("foxglove")
websockets = pytest.importorskip("websockets")

TOKEN = "a token that is long enough"
PROTOCOLS = ["foxglove.sdk.v1", "foxglove.websocket.v1"]
SUBSCRIBED = 1


@pytest.fixture(scope="module")
def outlet() -> Iterator[FoxgloveOutlet]:
    made = FoxgloveOutlet(listen("0"), lambda text: None)
    made.start()
    found = DerivedMessage("/findings", "foxglove.Log", NOW, NOW, b'{"name": "MB001", "message": "no answer"}')
    made.tell([value(59.0), numbers(), LogTold(BUS, found)])
    yield made
    made.close(60)


async def channels_of(client: Any, wanted: int) -> dict[int, dict[str, Any]]:
    """Channels by their number, once there are as many."""
    channels: dict[int, dict[str, Any]] = {}
    while len(channels) < wanted:
        told = await client.recv()
        if isinstance(told, str) and json.loads(told)["op"] == "advertise":
            channels |= {one["id"]: one for one in json.loads(told)["channels"]}
    return channels


async def read_all(port: int, **options: Any) -> dict[str, tuple[dict[str, Any], int, dict[str, Any]]]:
    """Of each topic its channel, and time and content of what stands."""
    async with websockets.connect(f"ws://127.0.0.1:{port}", subprotocols=PROTOCOLS, **options) as client:
        channels = await channels_of(client, 3)
        wanted = [{"id": number, "channelId": number} for number in channels]
        await client.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        got = {}
        while len(got) < 3:
            told = await client.recv()
            if isinstance(told, bytes) and told[0] == SUBSCRIBED:
                number, time = struct.unpack("<IQ", told[1:13])
                got[channels[number]["topic"]] = channels[number], time, json.loads(told[13:])
        return got


def test_a_client_reads_the_channels_of_a_recording_also_what_was_said_before(outlet: FoxgloveOutlet) -> None:
    assert outlet.port is not None
    got = asyncio.run(asyncio.wait_for(read_all(outlet.port), 60))
    assert set(got) == {"/values/boiler/3/output-frequency", "/bus/boiler", "/findings"}
    channel, time, content = got["/values/boiler/3/output-frequency"]
    assert (channel["encoding"], channel["schemaName"]) == ("json", "sniff485.Value")
    assert channel["schema"] == SCHEMAS["sniff485.Value"].text
    assert (time, content["value"]) == (NOW, 59.0)
    assert got["/bus/boiler"][2]["load"] == 0.5
    assert got["/findings"][2]["name"] == "MB001"


def test_nothing_but_reading_is_offered(outlet: FoxgloveOutlet) -> None:
    async def capabilities() -> list[str]:
        async with websockets.connect(f"ws://127.0.0.1:{outlet.port}", subprotocols=PROTOCOLS) as client:
            while True:
                told = json.loads(await client.recv())
                if told["op"] == "serverInfo":
                    return list(told["capabilities"])

    assert asyncio.run(asyncio.wait_for(capabilities(), 60)) == []


def test_its_process_holds_no_scapy_and_ours_holds_no_sdk(outlet: FoxgloveOutlet) -> None:
    program = "import sniff.outlets.foxglove_process, sys; print([one for one in sys.modules if 'scapy' in one])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    program = "import sniff.outlets.foxglove, sys; print([one for one in sys.modules if one.startswith('foxglove')])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_token_is_asked_for_and_is_in_no_list_of_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OUR_TOKEN", TOKEN)
    made = FoxgloveOutlet(ListenSettings("127.0.0.1", 0, token=Secret("OUR_TOKEN")), lambda text: None)
    made.start()
    try:
        address = f"ws://127.0.0.1:{made.port}"

        async def visit() -> None:
            with pytest.raises(websockets.InvalidStatus):
                await websockets.connect(address, subprotocols=PROTOCOLS)
            async with websockets.connect(f"{address}/?token={TOKEN.replace(' ', '+')}", subprotocols=PROTOCOLS) as one:
                assert json.loads(await one.recv())["op"] == "serverInfo"

        asyncio.run(asyncio.wait_for(visit(), 60))
        words = made._process.args
        assert TOKEN not in str(words)
    finally:
        made.close(60)
    assert made._process.poll() is not None


def test_a_port_that_is_taken_is_said(outlet: FoxgloveOutlet) -> None:
    with pytest.raises(SettingsError, match="--foxglove"):
        FoxgloveOutlet(listen(str(outlet.port)), lambda text: None)
