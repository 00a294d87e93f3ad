"""Whole frames from their parts, checks included. For whole layouts use the scapy classes (`dissectors.*.packets`)."""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, signature

from dissectors.checksums import crc8_mstp, crc16_modbus, crc16_x25, lrc, sum8


def modbus_rtu(unit: int, pdu: bytes) -> bytes:
    """Unit, PDU (function code and data), CRC."""
    body = bytes([unit]) + pdu
    return body + crc16_modbus(body).to_bytes(2, "little")


def modbus_ascii(unit: int, pdu: bytes, delimiter: bytes = b"\n") -> bytes:
    """Colon, hex pairs of unit, PDU and LRC, CR, delimiter."""
    body = bytes([unit]) + pdu
    return b":" + (body + bytes([lrc(body)])).hex().upper().encode() + b"\r" + delimiter


def n2_command(text: str) -> bytes:
    """`>`, the characters (address, command, data), their sum, CR."""
    body = text.encode("ascii")
    return b">" + body + f"{sum8(body):02X}".encode() + b"\r"


def n2_answer(text: str = "") -> bytes:
    """`A`, the characters and their sum, CR; without characters the short acknowledgement."""
    body = text.encode("ascii")
    return b"A" + (body + f"{sum8(body):02X}".encode() if body else b"") + b"\r"


def mstp(frame_type: int, destination: int, source: int, data: bytes = b"") -> bytes:
    """Preamble, header with its CRC, data with its CRC (types up to 31: no COBS)."""
    header = bytes([frame_type, destination, source]) + len(data).to_bytes(2, "big")
    frame = b"\x55\xff" + header + bytes([crc8_mstp(header)])
    return frame + (data + crc16_x25(data).to_bytes(2, "little") if data else b"")


MAKERS: dict[str, Callable[..., bytes]] = {
    "modbus-rtu": modbus_rtu,
    "modbus-ascii": modbus_ascii,
    "n2": n2_command,
    "n2-answer": n2_answer,
    "mstp": mstp,
}


def craft(kind: str, **parts: object) -> bytes:
    """A frame of a kind in MAKERS from its parts, by keyword. Raises ValueError that says what there is."""
    maker = MAKERS.get(kind)
    if maker is None:
        raise ValueError(f"craft {kind!r}: expected one of {', '.join(MAKERS)}")
    try:
        signature(maker).bind(**parts)
    except TypeError as error:
        takes = ", ".join(_part(part) for part in signature(maker).parameters.values())
        raise ValueError(f"craft {kind!r}: {error}; its parts are {takes}") from None
    return maker(**parts)


def _part(part: Parameter) -> str:
    shown = f"{part.name}: {part.annotation}"
    return shown if part.default is Parameter.empty else f"{shown} = {part.default!r}"
