"""Checks and ends of frames that a program makes wrongly each time, and what should be said of them. Data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial, reduce
from operator import xor

from dissectors.checksums import crc16_modbus, crc16_x25
from dissectors.profibus.telegram import ED, body_of
from dissectors.simulated import Send, Station
from tests.faults.buses import modbus, mstp
from tests.faults.case import Case, Said
from tests.faults.misbehaving import other_check
from tests.faults.profibus_cases import profibus
from tests.faults.stations import Wrapped
from tests.faults.workbench import Modbus, usual_requests, usual_stations

_THREE = (1, 2, 3)


class Sends(Wrapped):
    """Sends its frames as a function makes them anew."""

    def __init__(self, inner: Station, made: Callable[[bytes], bytes]) -> None:
        super().__init__(inner)
        self.made = made

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        return tuple(replace(send, octets=self.made(send.octets)) for send in sends)

    def wake(self, now: int) -> tuple[Send, ...]:
        return tuple(replace(send, octets=self.made(send.octets)) for send in super().wake(now))


def _message(frame: bytes) -> bytes:
    """Unit and PDU of an ASCII frame."""
    return bytes.fromhex(frame[1:-4].decode("ascii"))


def _lrc(made: Callable[[bytes], int], frame: bytes) -> bytes:
    """An ASCII frame with another LRC, made of its message."""
    return frame[:-4] + b"%02X\r\n" % (made(_message(frame)) & 0xFF)


def _of_characters(frame: bytes) -> bytes:
    return frame[:-4] + b"%02X\r\n" % (-sum(frame[1:-4]) & 0xFF)


def _turned_digits(frame: bytes) -> bytes:
    return frame[:-4] + frame[-3:-2] + frame[-4:-3] + b"\r\n"


def _with_crc(frame: bytes) -> bytes:
    return frame[:-4] + b"%04X\r\n" % int.from_bytes(crc16_modbus(_message(frame)).to_bytes(2, "little"), "big")


def _without_lrc(frame: bytes) -> bytes:
    return frame[:-4] + b"\r\n"


def _ending(end: bytes, frame: bytes) -> bytes:
    """An ASCII frame that ends otherwise."""
    return frame[:-2] + end


def _of_ccitt(frame: bytes) -> bytes:
    """An RTU frame with the CRC that MS/TP has for data."""
    return frame[:-2] + crc16_x25(frame[:-2]).to_bytes(2, "little")


def _summed(frame: bytes) -> bytes:
    """An RTU frame with a sum in place of its CRC."""
    return frame[:-2] + (sum(frame[:-2]) & 0xFFFF).to_bytes(2, "big")


def _begun_with_0(frame: bytes) -> bytes:
    """An RTU frame whose CRC began with 0."""
    return other_check(b"", frame)


def _data_crc(made: Callable[[bytes], int], frame: bytes) -> bytes:
    """An MS/TP frame with another data CRC, made of its data."""
    return frame if len(frame) <= 8 else frame[:-2] + (made(frame[8:-2]) & 0xFFFF).to_bytes(2, "little")


def _header_crc(frame: bytes) -> bytes:
    """An MS/TP frame whose header CRC is not complemented."""
    return frame[:7] + bytes((frame[7] ^ 0xFF,)) + frame[8:] if len(frame) >= 8 else frame


def _fcs(made: Callable[[bytes], int], frame: bytes) -> bytes:
    """A PROFIBUS telegram with another sum."""
    return frame if len(frame) < 6 or frame[-1] != ED else frame[:-2] + bytes((made(body_of(frame)) & 0xFF, ED))


def _slave(made: Callable[[bytes], bytes], is_ascii: bool = True) -> Callable[..., object]:
    return partial(modbus, is_ascii=is_ascii, change={2: partial(Sends, made=made)})


def _master(made: Callable[[bytes], bytes], is_ascii: bool = True) -> Modbus:
    stations = usual_stations(_THREE, is_ascii=is_ascii)
    return Modbus(usual_requests(_THREE), stations, is_ascii=is_ascii, change_master=partial(Sends, made=made))


_SECOND = ("station 2",)
_LRCS: tuple[tuple[str, Callable[[bytes], bytes], str], ...] = (
    ("is not negated", partial(_lrc, sum), "sum of the octets"),
    ("is an exclusive or", partial(_lrc, lambda octets: reduce(xor, octets, 0)), "exclusive or"),
    ("is of the characters", _of_characters, "characters"),
    ("is 0", partial(_lrc, lambda octets: 0), "all zeros"),
    ("is turned", _turned_digits, "changed places"),
    ("is a CRC", _with_crc, "CRC-16"),
    ("is left out", _without_lrc, "left out"),
)
_ENDS = (("LF alone", b"\n"), ("LF CR", b"\n\r"), ("CR CR LF", b"\r\r\n"))

CHECK_CASES: tuple[Case, ...] = (
    *(
        Case(
            f"ASCII LRC of one station {name}",
            _slave(made),  # type: ignore[arg-type]
            (Said(_SECOND, ("MB021",)), Said(_SECOND, words=words, own_words=True)),
            seeds=1,
        )
        for name, made, words in _LRCS
    ),
    *(
        Case(
            f"ASCII LRC of the master {name}",
            _master(made),
            (Said(("master",), ("MB021",)), Said(("master",), words=words, own_words=True)),
            seeds=1,
        )
        for name, made, words in _LRCS
    ),
    Case(
        "RTU check of one station is a CRC of CCITT",
        _slave(_of_ccitt, False),  # type: ignore[arg-type]
        (Said(_SECOND, ("MB021",)), Said(_SECOND, words="CCITT", own_words=True)),
        seeds=1,
    ),
    Case("RTU check of the master is a sum", _master(_summed, False), (("MB021", "master"),), seeds=1),
    Case(
        "ASCII frames of the master end with CR CR LF, and nobody answers",
        _master(partial(_ending, b"\r\r\n")),
        (("MB019", "master"),),
        seeds=1,
    ),
    Case("RTU check of the master computed otherwise", _master(_begun_with_0, False), (("MB021", "master"),), seeds=1),
    *(
        Case(
            f"ASCII frames of one station end with {name}",
            _slave(partial(_ending, end)),  # type: ignore[arg-type]
            (Said(_SECOND, ("MB019",)), Said(_SECOND, words=f"with {name}", own_words=True)),
            seeds=1,
        )
        for name, end in _ENDS
    ),
    Case(
        "ASCII frames of the master end with LF CR", _master(partial(_ending, b"\n\r")), (("MB019", "master"),), seeds=1
    ),
    *(
        Case(
            f"MS/TP {name}",
            partial(mstp, change={5: partial(Sends, made=made)}),
            (("MS407", "MAC 5"),),
            seconds=30,
            seeds=1,
        )
        for name, made in (
            ("data CRC not complemented", partial(_data_crc, lambda data: crc16_x25(data) ^ 0xFFFF)),
            ("data CRC of Modbus", partial(_data_crc, crc16_modbus)),
            ("data CRC 0", partial(_data_crc, lambda data: 0)),
            ("header CRC not complemented", _header_crc),
        )
    ),
    *(
        Case(
            f"PROFIBUS sum {name}",
            partial(profibus, change={"drive 5": partial(Sends, made=partial(_fcs, made))}),
            (("PB020", "station 5"),),
            seconds=10,
            seeds=1,
        )
        for name, made in (("negated", lambda body: -sum(body)), ("one too large", lambda body: sum(body) + 1))
    ),
)
