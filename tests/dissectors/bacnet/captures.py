"""Captures of others, and Wireshark's reading of them; a minimal pcap reader."""

from __future__ import annotations

import csv
import gzip
import json
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from dissectors.bacnet import MSTP
from dissectors.frame import Chunk, Event, Frame
from dissectors.line import LineSettings, Timing

SHARED = Path(__file__).parents[3] / "../shared"
CAPTURES = SHARED / "captures"

PCAPS = {
    "mstp-kargs-2009": "mstp_20090227094623.pcap",
    "mstp-cimetrics-snap-mixed": "derived_linktype165.pcap",
    "mstp-md5-2018-good1": "mstp_2018_Good1.cap",
}
TIMING = Timing(LineSettings(38400))


def pcap_records(path: Path) -> Iterator[tuple[int, bytes]]:
    """(time in ns, octets) of each record of a classic pcap file."""
    data = path.read_bytes()
    order = "<" if data[:4] in (b"\xd4\xc3\xb2\xa1", b"\x4d\x3c\xb2\xa1") else ">"
    at = 24
    while at + 16 <= len(data):
        seconds, fraction, size, _ = struct.unpack_from(order + "IIII", data, at)
        yield seconds * 10**9 + fraction * 1000, data[at + 16 : at + 16 + size]
        at += 16 + size


def folder(name: str) -> Path:
    """A capture's folder; the test is skipped when it is not there."""
    path = CAPTURES / name
    if not path.is_dir():
        pytest.skip(f"no captures: {path} is absent")
    return path


def drive(chunks: list[Chunk], timing: Timing = TIMING) -> list[Event]:
    """All events of chunks."""
    framer = MSTP.framer(timing)
    return [event for chunk in chunks for event in framer.feed(chunk)] + framer.close()


def tagged_frames() -> list[tuple[bool, bytes, str]]:
    """(good, octets, note) of every frame that the protocol notes print."""
    path = SHARED / "protocols/mstp.md"
    if not path.is_file():
        return []
    found = []
    for line in path.read_text(encoding="utf-8").splitlines():
        match = re.match(r"(BAD-)?MSTP ((?:[0-9A-F]{2} ?)+)\s*;?(.*)", line)
        if match:
            found.append((match[1] is None, bytes.fromhex(match[2]), match[3].strip()))
    return found


def rows(name: str) -> list[dict[str, str]]:
    """Wireshark's fields, a dictionary a packet."""
    path = folder(name)
    plain = path / "tshark_fields.tsv"
    text = (
        plain.read_text(encoding="utf-8")
        if plain.exists()
        else gzip.decompress((path / "tshark_fields.tsv.gz").read_bytes()).decode("utf-8")
    )
    return list(csv.DictReader(text.splitlines(), delimiter="\t", quoting=csv.QUOTE_NONE))


def trees(name: str) -> dict[int, dict[str, Any]]:
    """Wireshark's full reading of the packets with an NPDU, by packet number."""
    packets = json.loads(gzip.decompress((folder(name) / "tshark_npdu.json.gz").read_bytes()), object_pairs_hook=list)
    found = {}
    for packet in packets:
        layers = dict(dict(dict(packet)["_source"])["layers"])
        found[int(dict(layers["frame"])["frame.number"])] = layers
    return found


def frame_of(octets: bytes) -> Frame:
    """The one frame in octets."""
    (event,) = drive([Chunk(10**18, octets)])
    assert isinstance(event, Frame)
    return event
