"""Our own software on a bus: one that is played from a capture, and one with simulated drives. Linux and macOS."""

import os
import select


def listen(port: str, count: int) -> bytes:
    """The first `count` octets from a port: stands for the software under test."""
    descriptor = os.open(port, os.O_RDONLY | os.O_NOCTTY)
    try:
        octets = b""
        while len(octets) < count and select.select([descriptor], [], [], 10)[0]:
            octets += os.read(descriptor, count - len(octets))
        return octets
    finally:
        os.close(descriptor)


def test_it_reads_what_was_recorded(replay):
    assert listen(replay("captures/poll.cap.txt", speed=50), 8) == bytes.fromhex("010300000002C40B")


def test_it_hears_a_master_and_its_drives(virtual_bus, craft):
    bus = virtual_bus("modbus-rtu", faults=False)
    assert craft("modbus-rtu", unit=1, pdu=bytes.fromhex("0325200004")) in listen(bus.tap(), 200)
