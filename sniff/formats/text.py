"""Text captures (`*.cap.txt`): what a person writes by hand, what a diff shows well, what a test reads.

::

    #!sniff-capture 1
    # line: 19200,8E1
    # protocol: modbus-rtu
    # start: 2026-03-01T10:00:00Z
    +0        01 03 00 00 00 02 C4 0B       # poll unit 1
    +8.2      01 03 04 00 D7 00!P 1A CB C0  # parity error marked on one octet
    ~4.1      00!B                          # a break, 4.1 ms of silence before it
    #! +30 dropped count=12 host too busy
    +250      ":010300000002FA" 0D 0A       # quoted ASCII

One line is one chunk. `+D`: its last octet had arrived D ms after the last octet of the line before (the first line:
after `start`); `-D`: D ms before it, for clocks that ran backwards. `~D`: D ms of silence before its first octet,
its octets back to back at line speed. D has up to six decimals. Octets are pairs of hexadecimal digits, or ASCII in
quotes (`\\"`, `\\\\`, `\\r`, `\\n` and `\\xNN` inside them). `!P !F !B !O` mark parity, framing, break and overrun on
the octet before; several may follow one octet.

`#` begins a comment. Two comments are read: header lines before the first chunk (`# key: value`, the keys are in
`HEADER`, session notes are `# note NAME: value`) and events of the line, `#! +D KIND count=N text`, KIND as in
`LineEventKind`, D counted from the last *chunk*, so that a reader that skips all comments finds the same times.
A text that would not survive as it is (control characters, spaces at its ends, empty) is a JSON string.

The reader is lenient: lower case, `0103` for `01 03`, `!PF`, any spacing, no header at all. The writer is canonical.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime, timedelta
from itertools import chain
from pathlib import Path
from typing import NoReturn

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.formats import CaptureError
from sniff.formats.files import NewFile, open_capture
from sniff.session import Completeness, Item, LineEvent, LineEventKind, Session

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
}
"""Header key → key of `Session.to_metadata`."""

MARKS = {"P": LineError.PARITY, "F": LineError.FRAMING, "B": LineError.BREAK, "O": LineError.OVERRUN}

LONGEST_LINE = 4 << 20  # characters; a chunk of a megabyte fits
LATEST = (1 << 63) - 1  # ns; what the other formats can hold

_ALWAYS = ("line", "protocol", "start")
_DELAY = re.compile(r"([+~-])([0-9]{1,15})(?:\.([0-9]{1,6}))?(?![0-9.])")
_OCTETS = re.compile(r"(?:[0-9A-Fa-f]{2})+(?![0-9A-Za-z])")
_QUOTED = re.compile(r'"((?:[ !#-\[\]-~]|\\[\\"rn]|\\x[0-9A-Fa-f]{2})+)"')
_ESCAPE = re.compile(r"\\(x..|.)")
_MARK = re.compile(r"!([PFBOpfbo]+)(?![0-9A-Za-z])")
_SPACE = re.compile(r"\s*")
_HEADER = re.compile(r'#\s*(?P<note>note\s+)?(?P<key>"(?:[^"\\]|\\.)*"\s*|[^:"]*):\s*')
_EVENT = re.compile(r"#!\s*(?:(?P<delay>[+-][0-9.]+)\s+)?(?P<kind>[A-Za-z]+)(?:\s+count=(?P<count>-?[0-9]{1,19}))?")
_START = re.compile(r"(\d{4}-\d\d-\d\d)[Tt ](\d\d:\d\d:\d\d)(?:\.(\d{1,9}))?(Z|z|[+-]\d\d:\d\d)", re.ASCII)
_LINE_END = re.compile(r"\r\n|\n|\r")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


# -- reading ---------------------------------------------------------------------------------------------------


def read(path: str | Path) -> TextCapture:
    """Open a text capture. Raises CaptureError here for a bad header, and from `items` for a bad line."""
    place = Path(path)
    capture = TextCapture(str(place), _FileLines(place))
    if capture.empty:
        raise CaptureError(f"{place}: empty file; a text capture begins with '{MAGIC} {VERSION}'")
    return capture


def parse(text: str, name: str = "<text>") -> TextCapture:
    """A text capture from a string; `name` stands in error messages. Raises as `read` does."""
    return TextCapture(name, _LINE_END.split(text))


class TextCapture:
    """A text capture opened for reading; `items` streams, from the beginning each time."""

    def __init__(self, name: str, lines: Iterable[str]) -> None:
        self.name = name
        self._lines = lines
        self.empty = True
        self.session = self._header()

    def items(self) -> Iterator[Item]:
        """Chunks and line events in the order of the file. Raises CaptureError at the first bad line."""
        line = self._speed
        last = self.session.started
        for number, text in enumerate(self._lines, 1):
            reading = _Line(self.name, number, text)
            stripped = text.strip()
            if stripped.startswith("#!") and not stripped.startswith(MAGIC):
                event = reading.event(last)
                line = _changed(line, event)
                yield event
            elif stripped and not stripped.startswith("#"):
                chunk = reading.chunk(last, line)
                last = chunk.time
                yield chunk

    def completeness(self) -> Completeness:
        """Always whole: a text capture that was cut has a bad line or cannot be told from a shorter one."""
        return Completeness(True)

    def _header(self) -> Session:
        record: dict[str, str] = {}
        for number, text in enumerate(self._lines, 1):
            self.empty = False
            stripped = text.strip()
            if stripped and not stripped.startswith("#"):
                break
            reading = _Line(self.name, number, text)
            if stripped.startswith(MAGIC):
                reading.version()
            elif not stripped.startswith("#!"):
                record.update(reading.header())
        self._speed = LineSettings.parse(record["line"]) if "line" in record else None
        return Session.from_metadata(record)


class _FileLines:
    """The lines of a file, read again for each pass, never more than one in memory."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __iter__(self) -> Iterator[str]:
        with open_capture(self.path) as stream:
            first = True
            while octets := stream.readline(LONGEST_LINE):
                if first and octets[:2] in (b"\xff\xfe", b"\xfe\xff"):
                    raise CaptureError(f"{self.path}: UTF-16 text; save it as UTF-8")
                line = octets.decode("utf-8-sig" if first else "utf-8", "replace")
                first = False
                if len(octets) == LONGEST_LINE and not line.endswith("\n"):
                    raise CaptureError(f"{self.path}: a line longer than {LONGEST_LINE} octets; not a text capture")
                yield from _LINE_END.split(line.removesuffix("\n").removesuffix("\r"))


class _Line:
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
        delay = int(match[2]) * 1_000_000 + int((match[3] or "").ljust(6, "0"))
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
        match = _HEADER.match(self.text, self.at)
        if match is None:
            return {}
        at = match.end()
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

    def start(self, value: str, at: int) -> int:
        match = _START.fullmatch(value)
        try:
            if match is None:
                raise ValueError
            moment = datetime.fromisoformat(f"{match[1]}T{match[2]}{match[4].upper().replace('Z', '+00:00')}")
            seconds = (moment - _EPOCH) // timedelta(seconds=1)
        except (ValueError, OverflowError):
            self.expected("a time with a zone such as 2026-03-01T10:00:00Z", at)
        time = seconds * 1_000_000_000 + int((match[3] or "").ljust(9, "0"))
        self.check_time(time, at)
        return time

    def latency(self, value: str, at: int) -> int:
        match = _DELAY.fullmatch(f"+{value.removesuffix('ms').strip()}")
        if match is None:
            self.expected("milliseconds, at most six decimals", at)
        return int(match[2]) * 1_000_000 + int((match[3] or "").ljust(6, "0"))

    def unquoted(self, value: str, at: int) -> str:
        value = value.strip()
        if not value.startswith('"'):
            return value
        try:
            text = json.loads(value)
        except ValueError:
            self.expected("a JSON string", at)
        return str(text)

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


def _unescape(match: re.Match[str]) -> str:
    named = {"r": "\r", "n": "\n", '"': '"', "\\": "\\"}
    return named.get(match[1]) or chr(int(match[1][1:], 16))


def _changed(line: LineSettings | None, event: LineEvent) -> LineSettings | None:
    """The line settings after an event: `~` follows them."""
    if event.kind is LineEventKind.SETTINGS:
        for word in event.text.split():
            if word.startswith("line="):
                try:
                    return LineSettings.parse(word[5:])
                except ValueError:
                    return line
    return line


# -- writing ---------------------------------------------------------------------------------------------------


def create(path: str | Path, session: Session) -> TextWriter:
    """Create a text capture; it takes its name when it is closed. Raises CaptureError."""
    return TextWriter(NewFile(Path(path)), session)


class TextWriter:
    """Writes the canonical form. A mark outside its chunk cannot be kept: a comment says so."""

    def __init__(self, file: NewFile, session: Session) -> None:
        self._file = file
        self._last = session.started
        self._put(header_lines(session))

    def write(self, item: Item) -> None:
        """Add a chunk or line event. An empty chunk says nothing and is not written. Raises CaptureError."""
        if isinstance(item, LineEvent):
            self._put([event_line(item, self._last)])
        elif item.octets:
            self._put(chunk_lines(item, self._last))
            self._last = item.time

    def close(self) -> None:
        """Finish the file and give it its name. Raises CaptureError."""
        self._file.close()

    def _put(self, lines: Iterable[str]) -> None:
        self._file.write("".join(f"{line}\n" for line in lines).encode("utf-8", "replace"))

    def __enter__(self) -> TextWriter:
        return self

    def __exit__(self, kind: object, *exc: object) -> None:
        if kind is None:
            self.close()
        else:
            self._file.discard()


def render(session: Session, items: Iterable[Item]) -> str:
    """A whole text capture as a string."""
    last = session.started
    parts: list[Iterable[str]] = [header_lines(session)]
    for item in items:
        if isinstance(item, LineEvent):
            parts.append([event_line(item, last)])
        elif item.octets:
            parts.append(chunk_lines(item, last))
            last = item.time
    return "".join(f"{line}\n" for line in chain.from_iterable(parts))


def header_lines(session: Session) -> Iterator[str]:
    """The lines before the first chunk: what differs from the default, and always line, protocol and start."""
    yield f"{MAGIC} {VERSION}"
    record = session.to_metadata()
    default = Session.from_metadata({}).to_metadata()
    for key, name in HEADER.items():
        value = record[name]
        if key == "start":
            value = iso(session.started)
        elif key == "latency":
            value = milliseconds(session.adapter.latency)
        if key in _ALWAYS or record[name] != default[name]:
            yield f"# {key}: {_quoted(value)}"
    for note, value in session.notes.items():
        name = json.dumps(note) if ":" in note or '"' in note else _quoted(note)
        yield f"# note {name}: {_quoted(value)}"


def chunk_lines(chunk: Chunk, last: int) -> Iterator[str]:
    """One line for a chunk, after a comment for each mark that it cannot carry; `last` as in `event_line`."""
    pairs = chunk.octets.hex(" ").upper().split(" ")
    for mark in chunk.marks:
        letters = "".join(f"!{letter}" for letter, error in MARKS.items() if error in mark.error)
        if 0 <= mark.offset < len(pairs) and letters:
            pairs[mark.offset] += letters
        else:
            yield f"# not kept: {mark.error!r} at offset {mark.offset}"
    yield f"{_delay(chunk.time - last):<9} {' '.join(pairs)}"


def event_line(event: LineEvent, last: int) -> str:
    """One line for an event of the line; `last`: time of the chunk before, ns."""
    count = f" count={event.count}" if event.count else ""
    text = event.text
    shown = ""
    if text:
        shown = f" {json.dumps(text)}" if text.startswith("count=") else f" {_quoted(text)}"
    return f"#! {_delay(event.time - last)} {event.kind.value}{count}{shown}"


def milliseconds(time: int) -> str:
    """ns ≥ 0 as ms with as many decimals as it takes: 8200000 → "8.2"."""
    whole, part = divmod(time, 1_000_000)
    return f"{whole}.{part:06}".rstrip("0").rstrip(".")


def iso(time: int) -> str:
    """ns since the epoch as ISO 8601 with as many decimals as it takes."""
    seconds, part = divmod(time, 1_000_000_000)
    try:
        moment = _EPOCH + timedelta(seconds=seconds)
    except OverflowError:
        moment, part = _EPOCH, 0
    decimals = f".{part:09}".rstrip("0").rstrip(".")
    return f"{moment:%Y-%m-%dT%H:%M:%S}{decimals}Z".zfill(len("2026-03-01T10:00:00") + len(decimals) + 1)


def _delay(time: int) -> str:
    return f"-{milliseconds(-time)}" if time < 0 else f"+{milliseconds(time)}"


def _quoted(value: str) -> str:
    plain = value.isprintable() and value == value.strip() and value and not value.startswith('"')
    return value if plain else json.dumps(value)
