"""One line of a text capture, read from the left; what the lines mean is in `sniff.formats.text`."""

from __future__ import annotations

import json
import re
from datetime import UTC, datetime, timedelta
from typing import NoReturn

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import MS, LineSettings
from sniff.engine.capture import CaptureError
from sniff.engine.session import DEVICES_NOTE, LATEST, LineEvent, LineEventKind, encodable

MAGIC = "#!sniff-capture"
VERSION = 1
HEADER = {
    "line": "line",
    "protocol": "protocol",
    "start": "started_ns",  # ISO 8601 with a zone, up to nine decimals
    "port": "port",
    "bus": "bus",
    "program": "program",
    "adapter": "adapter",
    "driver": "adapter_driver",
    "latency": "adapter_latency_ns",  # ms
    "latency-from": "adapter_latency_from",
    "reports": "adapter_reports",  # "unknown", or the line errors it reports with commas between
    "detail": "adapter_detail",
    "serial-number": "adapter_serial_number",
    "packets": "adapter_packets",  # "yes" where one report stands for a whole packet, "no" where it does not
    "unknown": "unknown",  # "line", "protocol" or both: of a capture whose settings were searched for in vain
    "given": "given",
}
"""Header key → key of `Session.to_metadata`."""

DEVICE = "device"
"""Header key of its own, may stand more than once: `3=teco-e510`, or `*=teco-e510` for every station."""

MARKS = {"P": LineError.PARITY, "F": LineError.FRAMING, "B": LineError.BREAK, "O": LineError.OVERRUN}

_DELAY = re.compile(r"([+~-])([0-9]{1,15})(?:\.([0-9]{1,6}))?(?![0-9.])")
_OCTETS = re.compile(r"[0-9A-Fa-f]{2}(?:[ \t]*[0-9A-Fa-f]{2})*(?![0-9A-Za-z])")
_QUOTED = re.compile(r'"((?:[ !#-\[\]-~]|\\[\\"rn]|\\x[0-9A-Fa-f]{2})+)"')
_ESCAPE = re.compile(r"\\(x..|.)")
_MARK = re.compile(r"!([PFBOpfbo]+)(?![0-9A-Za-z])")
_SPACE = re.compile(r"\s*")
_HEADER = re.compile(r'#\s*(?P<note>note\s+)?(?P<key>"(?:[^"\\]|\\.)*"\s*|[^:"]*):\s*')
_EVENT = re.compile(r"#!\s*(?:(?P<delay>[+-][0-9.]+)\s+)?(?P<kind>[A-Za-z]+)(?:\s+count=(?P<count>-?[0-9]{1,19}))?")
_DEVICE = re.compile(r"(?:\*|0[xX][0-9A-Fa-f]{1,2}|(?:1?[0-9]?[0-9]|2[0-4][0-9]|25[0-5]))=[A-Za-z0-9][A-Za-z0-9_-]*")
_START = re.compile(r"(\d{4}-\d\d-\d\d)[Tt ](\d\d:\d\d:\d\d)(?:\.(\d{1,9}))?(Z|z|[+-]\d\d:\d\d)", re.ASCII)
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


_PLAIN = re.compile(
    r"([+-])([0-9]{1,15})(?:\.([0-9]{1,6}))?[ \t]+([0-9A-Fa-f]{2}(?:[ \t]*[0-9A-Fa-f]{2})*)[ \t]*(?:#.*)?", re.DOTALL
)
"""Nearly every line: a delay, pairs, perhaps a comment."""


def plain_chunk(stripped: str, last: int) -> Chunk | None:
    """The chunk of a line without anything unusual, in a fifth of the time; None where `Line` must look closer."""
    match = _PLAIN.fullmatch(stripped)
    if match is None:
        return None
    sign, whole, part, octets = match.groups()
    delay = int(whole) * MS + (int(part.ljust(6, "0")) if part else 0)
    time = last - delay if sign == "-" else last + delay
    return Chunk(time, bytes.fromhex(octets)) if -LATEST <= time <= LATEST else None


class Line:
    """One line being read from the left; every complaint says file, line and column."""

    def __init__(self, name: str, number: int, text: str) -> None:
        self.name = name
        self.number = number
        self.text = text
        self.at = 0
        self.skip_space()

    def expected(self, what: str, at: int | None = None) -> NoReturn:
        column = self.at if at is None else at
        rest = self.text[column:].split()
        found = f"{rest[0][:20]!r}" if rest else "the end of the line"
        raise CaptureError(f"{self.name}:{self.number}:{column + 1}: expected {what}, found {found}")

    def skip_space(self) -> None:
        self.at = _SPACE.match(self.text, self.at).end()  # type: ignore[union-attr]

    # a chunk

    def chunk(self, last: int, line: LineSettings | None) -> Chunk:
        """`last`: time of the chunk before. `line` for `~`, None when the header does not say."""
        begin = self.at
        sign, delay = self.delay()
        octets, marks = self.octets()
        time = last + delay
        if sign == "~":
            if line is None:
                self.expected("'+'; '~' needs the line speed, from a header line such as '# line: 19200,8E1'", begin)
            time += line.bits(len(octets) * line.bits_per_char)
        self.check_time(time, begin)
        return Chunk(time, octets, marks)

    def delay(self) -> tuple[str, int]:
        match = _DELAY.match(self.text, self.at)
        if match is None:
            self.expected("+D, ~D or -D with D in milliseconds, at most six decimals")
        self.at = match.end()
        delay = int(match[2]) * MS + int((match[3] or "").ljust(6, "0"))
        return match[1], -delay if match[1] == "-" else delay

    def check_time(self, time: int, at: int) -> None:
        if abs(time) > LATEST:
            self.expected("a time before the year 2262", at)

    def octets(self) -> tuple[bytes, tuple[Mark, ...]]:
        octets = bytearray()
        marks: dict[int, LineError] = {}
        while True:
            self.skip_space()
            here = self.text[self.at : self.at + 1]
            if here in ("", "#"):
                break
            if here == "!":
                self.mark(len(octets) - 1, marks)
            elif here == '"':
                octets += self.quoted()
            else:
                octets += self.pairs()
        if not octets:
            self.expected("octets such as 01 03, or ASCII in quotes")
        return bytes(octets), tuple(Mark(offset, error) for offset, error in sorted(marks.items()))

    def pairs(self) -> bytes:
        match = _OCTETS.match(self.text, self.at)
        if match is None:
            self.expected("pairs of hexadecimal digits, ASCII in quotes, !P !F !B !O, or #")
        self.at = match.end()
        return bytes.fromhex(match[0])

    def quoted(self) -> bytes:
        match = _QUOTED.match(self.text, self.at)
        if match is None:
            self.expected('printable ASCII in quotes (\\" \\\\ \\r \\n \\xNN are allowed in them)')
        self.at = match.end()
        return _ESCAPE.sub(_unescape, match[1]).encode("latin-1")

    def mark(self, offset: int, marks: dict[int, LineError]) -> None:
        match = _MARK.match(self.text, self.at)
        if match is None:
            self.expected("!P (parity), !F (framing), !B (break) or !O (overrun)")
        if offset < 0:
            self.expected("an octet before the mark")
        self.at = match.end()
        for letter in match[1].upper():
            marks[offset] = marks.get(offset, LineError(0)) | MARKS[letter]

    # comments that are read

    def version(self) -> None:
        told = self.text[self.at + len(MAGIC) :].strip()
        if told != str(VERSION):
            self.expected(f"version {VERSION}; a newer sniff485 may read this file", self.at + len(MAGIC))

    def header(self) -> dict[str, str]:
        """What a comment before the first chunk says: nothing, or one key of `Session.to_metadata`."""
        match = _HEADER.match(self.text, self.at)
        if match is None:
            return {}
        at = match.end()
        if not match["note"] and match["key"].strip().lower() == DEVICE:
            return {f"note_{DEVICES_NOTE}": self.devices(self.text[at:], at)}
        if match["note"]:
            name = self.unquoted(match["key"], match.start("key"))
            return {f"note_{name}": self.unquoted(self.text[at:], at)}
        key = HEADER.get(match["key"].strip().lower())
        if key is None:
            return {}  # a comment that happens to have a colon
        value = self.unquoted(self.text[at:], at)
        if key == "line":
            try:
                value = str(LineSettings.parse(value))
            except ValueError:
                self.expected("line settings such as 19200,8E1", at)
        elif key == "started_ns":
            value = str(self.start(value, at))
        elif key == "adapter_latency_ns":
            value = str(self.latency(value, at))
        elif key == "adapter_reports":
            value = ",".join(word.strip() for word in value.split(","))
        return {key: value}

    def devices(self, value: str, at: int) -> str:
        """One device or several with commas between, as a note of the session keeps them."""
        words = [word.strip() for word in value.split(",")]
        for word in words:
            if not is_device(word):
                self.expected("ADDRESS=PROFILE such as 3=teco-e510, ADDRESS 0 … 255 or * for every station", at)
        return ",".join(words)

    def start(self, value: str, at: int) -> int:
        match = _START.fullmatch(value)
        try:
            if match is None:
                raise ValueError
            moment = datetime.fromisoformat(f"{match[1]}T{match[2]}{match[4].upper().replace('Z', '+00:00')}")
            seconds = (moment - EPOCH) // timedelta(seconds=1)
        except (ValueError, OverflowError):
            self.expected("a time with a zone such as 2026-03-01T10:00:00Z", at)
        time = seconds * 1_000_000_000 + int((match[3] or "").ljust(9, "0"))
        self.check_time(time, at)
        return time

    def latency(self, value: str, at: int) -> int:
        match = _DELAY.fullmatch(f"+{value.removesuffix('ms').strip()}")
        if match is None:
            self.expected("milliseconds, at most six decimals", at)
        return int(match[2]) * MS + int((match[3] or "").ljust(6, "0"))

    def unquoted(self, value: str, at: int) -> str:
        value = value.strip()
        if not value.startswith('"'):
            return value
        try:
            text = json.loads(value)
        except ValueError:
            self.expected("a JSON string", at)
        return encodable(str(text))

    def event(self, last: int) -> LineEvent:
        begin = self.at
        match = _EVENT.match(self.text, begin)
        kinds = ", ".join(kind.value for kind in LineEventKind)
        if match is None:
            self.expected(f"'#! +D KIND count=N text' with KIND one of {kinds}")
        try:
            kind = LineEventKind(match["kind"].lower())
        except ValueError:
            self.expected(f"one of {kinds}", match.start("kind"))
        time = last
        if match["delay"]:
            self.at = match.start("delay")
            time += self.delay()[1]
            if self.at != match.end("delay"):
                self.expected("a space")
        self.check_time(time, begin)
        rest = self.text[match.end() :]
        if rest and not rest[0].isspace():
            self.expected("a space", match.end())
        return LineEvent(time, kind, self.unquoted(rest, match.end()), int(match["count"] or 0))


def is_device(word: str) -> bool:
    """Whether a word is an address and a profile's name, `3=teco-e510`."""
    return _DEVICE.fullmatch(word) is not None


def _unescape(match: re.Match[str]) -> str:
    named = {"r": "\r", "n": "\n", '"': '"', "\\": "\\"}
    return named.get(match[1]) or chr(int(match[1][1:], 16))
