"""A real gateway: ser2net with RFC 2217 before a port without modem lines. Skipped where ser2net is not installed."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.recording_bus import Feeder, octets_of, recordings, wait_until

PROGRAM = shutil.which("ser2net", path=f"{os.environ.get('PATH', '')}:/usr/sbin")
POLL = bytes.fromhex("010300000002c40b")

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="no ser2net here")


@pytest.fixture
def bus() -> Iterator[Feeder]:
    bus = Feeder()
    yield bus
    bus.close()


@pytest.fixture
def gateway(bus: Feeder, tmp_path: Path) -> Iterator[str]:
    """The address of a gateway before the bus, once it listens."""
    assert PROGRAM is not None
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        number = free.getsockname()[1]
    configuration = tmp_path / "ser2net.yaml"
    configuration.write_text(
        "%YAML 1.1\n---\nconnection: &bus\n"
        f"  accepter: telnet(rfc2217),tcp,127.0.0.1,{number}\n"
        f"  connector: serialdev,{bus.path},115200n81,local\n"
    )
    process = subprocess.Popen(
        [PROGRAM, "-n", "-d", "-c", configuration, "-P", tmp_path / "ser2net.pid"],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip

    def listens() -> bool:
        assert process.poll() is None, "ser2net ended"
        with socket.socket() as trial:
            return trial.connect_ex(("127.0.0.1", number)) == 0

    try:
        wait_until(listens, "ser2net does not listen")
        yield f"rfc2217://127.0.0.1:{number}"
    finally:
        process.terminate()
        process.wait()


def test_everything_comes_through_and_nothing_is_sent(bus: Feeder, gateway: str, tmp_path: Path) -> None:
    with recordings(tmp_path, gateway) as begin:
        command = begin()
        bus.poll(POLL)
        wait_until(lambda: len(octets_of(tmp_path / "x.mcap")) > 400, "nothing is recorded")
        bus.quiet()
        command.send(2)
        assert command.end() == 0
        recorded = octets_of(tmp_path / "x.mcap")
    assert recorded in bytes(bus.fed), "what was fed, without a hole, an addition or a Telnet octet"
    assert any("DTR/RTS unknown" in line for line in command.said), command.said
    with pytest.raises(BlockingIOError):
        os.read(bus.master, 1)
