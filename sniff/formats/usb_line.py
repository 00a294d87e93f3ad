"""Line settings that a host gave a serial adapter on USB, by the requests that each kind of adapter has. Pure.

| adapter | to | requests |
|---|---|---|
| FTDI | 40h | 3 divisor, 4 format, 9 latency timer (ms); its channel in the low octet of the index |
| CP210x | 41h | 1 divisor, 1Eh baud rate, 3 format; C1h: 1Dh and 4 answer the same |
| CH340, CH341 | 40h | 9Ah registers 1312h (divisor) and 2518h (format), A1h both at once |
| CDC-ACM, PL2303 | 21h | 20h baud rate, stop bits, parity, data bits; A1h: 21h answers the same |

A divisor stands for the usual rate that it is meant for. What an adapter had before the capture began nobody knows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from dissectors.line import LineSettings
from sniff.formats.usb_control import Request
from sniff.formats.usual_rates import nominal

_TO_DEVICE, _TO_INTERFACE, _FROM_INTERFACE = 0x40, 0x41, 0xC1
_CLASS, _CLASS_ANSWERS = 0x21, 0xA1
_FTDI_RATE, _FTDI_FORMAT, _FTDI_TIMER = 3, 4, 9
_FTDI_CHANNELLED = (0, 1, 2, _FTDI_FORMAT, _FTDI_TIMER)  # reset, modem lines, flow: no more in their low octet
_FTDI_EIGHTHS = (0, 4, 2, 1, 3, 5, 6, 7)  # of the divisor, by its three bits
_PARITIES = "NOEMS"
_STOPS = (1.0, 1.5, 2.0)
_TICKS = 48_000_000
_FORMAT_OF_BOTH = 0x9C
"""How a request of CH340 begins that sets format and divisor."""
_CH_HEARS_AND_SENDS = 0xC0

Format = tuple[int, str, float]
"""Data bits, parity, stop bits."""


@dataclass(frozen=True, slots=True)
class Told:
    """What is known of an adapter's line; None: nothing. `timer`: the latency timer, ms."""

    baud: int | None = None
    format: Format | None = None
    timer: int | None = None

    def line(self, usual: LineSettings) -> LineSettings | None:
        """Its line settings, what is not known of the format as usual; None where the rate is not known."""
        if self.baud is None:
            return None
        return LineSettings(self.baud, *(self.format or (usual.data_bits, usual.parity, usual.stop_bits)))


@dataclass(frozen=True, slots=True)
class Setting:
    """What one request sets. `place`: the interface, or FTDI's channel (0: its only one); `is_ftdi`: by the request."""

    told: Told
    place: int
    is_ftdi: bool = False


class Settings:
    """Takes the requests to one device, in order."""

    def __init__(self) -> None:
        self._has_channels = False

    def take(self, request: Request) -> Setting | None:
        """What a request sets; None for nothing that is certain."""
        if request.kind == _TO_DEVICE and request.number in _FTDI_CHANNELLED and request.index & 0xFF:
            self._has_channels = True
        found = self._ftdi(request) or _cp210x(request) or _ch340(request) or _class_request(request)
        if found is None or found.told == Told():
            return None
        return found

    def _ftdi(self, request: Request) -> Setting | None:
        if request.kind != _TO_DEVICE:
            return None
        if request.number == _FTDI_RATE:
            high, channel = request.index >> 8, request.index & 0xFF
            if not high and not self._has_channels:
                high, channel = channel, 0
            return Setting(Told(_rate(_ftdi_rate(request.value, high))), channel, True)
        if request.number == _FTDI_FORMAT:
            data, parity, stop = request.value & 0xFF, request.value >> 8 & 7, request.value >> 11 & 3
            return Setting(Told(format=_format(data, parity, stop)), request.index & 0xFF, True)
        if request.number == _FTDI_TIMER and 1 <= request.value <= 255:
            return Setting(Told(timer=request.value), request.index & 0xFF, True)
        return None


def merged(before: Told, now: Told) -> Told:
    """What is known after a request."""
    return Told(now.baud or before.baud, now.format or before.format, now.timer or before.timer)


def _ftdi_rate(value: int, high: int) -> float:
    whole, eighths = value & 0x3FFF, _FTDI_EIGHTHS[value >> 14 | (high & 1) << 2]
    clock = 12_000_000 if high & 2 else 3_000_000
    if whole == 0:  # the only divisors below 2
        return clock
    if whole == 1 and eighths == 0:
        return clock / 1.5
    return clock / (whole + eighths / 8)


def _cp210x(request: Request) -> Setting | None:
    if request.kind == _TO_INTERFACE and request.number == 1 and request.value:
        return Setting(Told(_rate(3_686_400 / request.value)), request.index)
    if (request.kind, request.number) in ((_TO_INTERFACE, 0x1E), (_FROM_INTERFACE, 0x1D)) and len(request.octets) == 4:
        return Setting(Told(_rate(int.from_bytes(request.octets, "little"))), request.index)
    if request.kind == _TO_INTERFACE and request.number == 3:
        return Setting(Told(format=_cp210x_format(request.value)), request.index)
    if request.kind == _FROM_INTERFACE and request.number == 4 and len(request.octets) == 2:
        return Setting(Told(format=_cp210x_format(int.from_bytes(request.octets, "little"))), request.index)
    return None


def _cp210x_format(value: int) -> Format | None:
    return _format(value >> 8, value >> 4 & 15, value & 15)


def _ch340(request: Request) -> Setting | None:
    if request.kind != _TO_DEVICE:
        return None
    if (request.number, request.value) == (0x9A, 0x1312):
        return Setting(Told(_ch340_rate(request.index)), 0)
    if (request.number, request.value) == (0x9A, 0x2518):
        return Setting(Told(format=_ch340_format(request.index & 0xFF)), 0)
    if request.number == 0xA1 and request.value & 0xFF == _FORMAT_OF_BOTH:
        return Setting(Told(_ch340_rate(request.index), _ch340_format(request.value >> 8)), 0)
    return None


def _ch340_rate(register: int) -> int | None:
    shift = 12 - 3 * (register & 3) - (register >> 2 & 1)
    return _rate(_TICKS / (1 << shift) / (0x100 - (register >> 8)))


def _ch340_format(register: int) -> Format | None:
    if register & _CH_HEARS_AND_SENDS != _CH_HEARS_AND_SENDS:
        return None
    parity = (1 + (register >> 4 & 3)) if register & 8 else 0
    return _format(5 + (register & 3), parity, 2 if register & 4 else 0)


def _class_request(request: Request) -> Setting | None:
    if (request.kind, request.number) not in ((_CLASS, 0x20), (_CLASS_ANSWERS, 0x21)) or len(request.octets) != 7:
        return None
    stop, parity, data = request.octets[4:]
    found = Told(_rate(int.from_bytes(request.octets[:4], "little")), _format(data, parity, stop))
    if found.baud is None or found.format is None:  # an adapter that was never set may answer anything
        return None
    return Setting(found, request.index)


def _rate(rate: float) -> int | None:
    try:
        return replace(LineSettings.parse(str(nominal(rate)))).baud if rate >= 50 else None
    except ValueError:  # no line has it: a divisor in another form
        return None


def _format(data: int, parity: int, stop: int) -> Format | None:
    if 5 <= data <= 8 and parity < len(_PARITIES) and stop < len(_STOPS):
        return data, _PARITIES[parity], _STOPS[stop]
    return None
