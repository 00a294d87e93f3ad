"""Every register, bit, code, parameter, object and error of the devices' manuals, asked for and answered on a line, and
what `show` says of it: by a table of the facts (`manual_facts.tsv`), not by the profiles.
"""

from __future__ import annotations

import json
import re
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from dissectors.bacnet import apdu, codec, npdu, services
from dissectors.bacnet.packets import MSTP, NPDU
from dissectors.checksums import crc16_modbus, sum8
from dissectors.n2.objects import REGIONS

FACTS = Path(__file__).with_name("manual_facts.tsv")
LINES = {
    "modbus": ("19200,8E1", "modbus-rtu"),
    "write": ("19200,8E1", "modbus-rtu"),
    "modbus exception": ("19200,8E1", "modbus-rtu"),
    "n2": ("9600,8N1", "n2"),
    "bacnet": ("38400,8N1", "mstp"),
}
REGION_OF = {region.name: region for region in REGIONS.values()}


class Fact(NamedTuple):
    """One line of the table."""

    device: str
    section: str
    protocol: str
    place: str
    raw: int
    said: str


def facts() -> list[Fact]:
    lines = [line for line in FACTS.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return [Fact(*cells[:4], int(cells[4]), cells[5]) for cells in (line.split("\t") for line in lines)]


def exchange(fact: Fact) -> tuple[bytes, bytes]:
    """A question for the thing, and the answer of station 1."""
    if fact.protocol == "modbus":
        asked = b"\x01\x03" + int(fact.place, 16).to_bytes(2, "big") + b"\x00\x01"
        return _rtu(asked), _rtu(b"\x01\x03\x02" + fact.raw.to_bytes(2, "big"))
    if fact.protocol == "modbus exception":
        asked = b"\x01\x03" + int(fact.place, 16).to_bytes(2, "big") + b"\x00\x01"
        return _rtu(asked), _rtu(bytes((1, 0x83, fact.raw)))
    if fact.protocol == "write":
        both = _rtu(b"\x01\x06" + int(fact.place, 16).to_bytes(2, "big") + fact.raw.to_bytes(2, "big"))
        return both, both
    if fact.protocol == "n2":
        return _n2(fact)
    target, number = fact.place.split(" ")
    about = {"object-identifier": f"{target},{number}", "property-identifier": "present-value"}
    value: Any = float(fact.raw) if target.startswith("analog") else codec.Enumerated(fact.raw, "BinaryPV")
    body = codec.encode(services.CONFIRMED[12], about)
    request = npdu.encode(apdu.encode(0, body, invoke_id=1, service=12, flags=2), expects_reply=True)
    answer = npdu.encode(
        apdu.encode(3, codec.encode(services.ACK[12], {**about, "property-value": value}), invoke_id=1, service=12)
    )
    return _mstp(5, 1, 2, request), _mstp(6, 2, 1, answer)


def _rtu(octets: bytes) -> bytes:
    return octets + crc16_modbus(octets).to_bytes(2, "little")


def _mstp(kind: int, to: int, by: int, octets: bytes) -> bytes:
    return bytes(MSTP(frame_type=kind, destination=to, source=by) / NPDU(octets))


def _n2(fact: Fact) -> tuple[bytes, bytes]:
    if fact.place.startswith("N"):
        return _sealed(b">", "011010103"), f"N{fact.raw:02d}\r".encode()
    kind, number = fact.place.split(" ")
    region = REGION_OF[kind]
    data = "00" + float_characters(fact.raw) if kind in ("AI", "AO") else f"{fact.raw << 6:02X}"
    return _sealed(b">", f"011{region.number:X}{int(number):02X}{region.current:02X}"), _sealed(b"A", data)


def float_characters(value: float) -> str:
    return struct.pack(">f", value).hex().upper()


def _sealed(start: bytes, data: str) -> bytes:
    return start + data.encode() + b"%02X\r" % sum8(data.encode())


def capture(protocol: str, chosen: list[Fact]) -> Iterator[str]:
    line, name = LINES[protocol]
    yield f"#!sniff-capture 1\n# line: {line}\n# protocol: {name}\n# start: 2026-03-01T10:00:00Z"
    for fact in chosen:
        for octets in exchange(fact):
            yield f"+100 {octets.hex(' ')}"


def everything(row: dict[str, Any]) -> str:
    """All that is said of a row: its line, and each of its values."""
    values = [f"{one['place']} {one['title'] or ''}: {one['text']} {one['bits']}" for one in row["values"]]
    return " | ".join([row["text"], *values])


def plain(text: str) -> str:
    return re.sub(r"[^a-z0-9]", "", text.lower())


@pytest.mark.parametrize(
    ("device", "protocol"), sorted({(fact.device, fact.protocol) for fact in facts()}), ids=lambda part: part
)
def test_what_the_manual_says_is_said(
    device: str, protocol: str, tmp_path: Path, sniff485: Callable[..., Any], capsys: pytest.CaptureFixture[str]
) -> None:
    chosen = [fact for fact in facts() if (fact.device, fact.protocol) == (device, protocol)]
    path = tmp_path / "facts.cap.txt"
    path.write_text("\n".join(capture(protocol, chosen)) + "\n")
    ran = sniff485("show", path, "--json", "--fields", "-d", f"*={device}")
    rows = [json.loads(line) for line in ran.out.splitlines()]
    assert len(rows) == 2 * len(chosen)
    rows = rows[::2] if protocol == "write" else rows[1::2]
    counts: Counter[str] = Counter()
    wrong = []
    for fact, row in zip(chosen, rows, strict=True):
        counts[fact.section] += 1
        if plain(fact.said) not in plain(everything(row)):
            wrong.append((fact, everything(row)))
    with capsys.disabled():
        print(f"\n{device} {protocol}: " + ", ".join(f"{name} {count}" for name, count in counts.items()), end="")
        print(f"; wrong {len(wrong)}", end=" ")
    assert not wrong
