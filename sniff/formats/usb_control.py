"""Requests that a host makes to a USB device by control transfers, once the device has carried them out. Pure.

A transfer is a record of its begin and one of its end; a request that failed, or of whose end nothing is known, changed
nothing for certain.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from sniff.formats.usb import SETUP, Stage

_MOST_UNDER_WAY = 256
_TO_HOST = 0x80


@dataclass(frozen=True, slots=True)
class Request:
    """A request that was carried out. `kind`: direction, class or vendor, and to what; `octets`: what was sent with it,
    or what was answered.
    """

    device: tuple[int, int]
    kind: int
    number: int
    value: int
    index: int
    octets: bytes


class ControlTransfers:
    """Puts the records of control transfers together."""

    def __init__(self) -> None:
        self._begun: dict[tuple[tuple[int, int], bytes], tuple[bytes, bytes]] = {}

    def take(self, stage: Stage) -> Request | None:
        """The request that a record completes; None for none."""
        key = stage.device, stage.transfer
        if stage.ended is None:
            setup, octets = self._begun.get(key, (b"", b"")) if not stage.setup else (stage.setup, b"")
            if len(setup) == SETUP:
                self._begun.pop(key, None)  # the latest is the last to be forgotten
                self._begun[key] = setup, octets + stage.octets
                if len(self._begun) > _MOST_UNDER_WAY:
                    del self._begun[next(iter(self._begun))]
            return None
        setup, octets = self._begun.pop(key, (b"", b""))
        if not setup or not stage.ended:
            return None
        kind, number, value, index, length = struct.unpack("<BBHHH", setup)
        told = (stage.octets if kind & _TO_HOST else octets)[:length]
        return Request(stage.device, kind, number, value, index, told)
