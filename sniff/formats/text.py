"""Text captures (`*.cap.txt`): what a person writes by hand, what a diff shows well, what a test reads.

::

    #!sniff-capture 1
    # line: 19200,8E1
    # protocol: NAME
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
`HEADER`; `# device: 3=teco-e510` says which profile a station has, a line a station, `*` for every one; other session
notes are `# note NAME: value`) and events of the line, `#! +D KIND count=N text`, KIND as in
`LineEventKind`, D counted from the last *chunk*, so that a reader that skips all comments finds the same times.
A text that would not survive as it is (control characters, spaces at its ends, empty) is a JSON string.

The reader is lenient: lower case, `0103` for `01 03`, `!PF`, any spacing, no header at all. The writer is canonical.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from datetime import timedelta
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from dissectors.frame import Chunk
from dissectors.line import MS, LineSettings
from sniff.engine.capture import CaptureError
from sniff.engine.event_texts import settings_change
from sniff.engine.session import (
    ASSUMED,
    DEVICES_NOTE,
    LATEST,
    PROTOCOL_NOTE,
    Completeness,
    Item,
    LineEvent,
    LineEventKind,
    Session,
)
from sniff.formats.files import NewFile, explain, open_capture
from sniff.formats.text_line import DEVICE, EPOCH, HEADER, MAGIC, MARKS, VERSION, Line, is_device, plain_chunk

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

MOST_DEVICES = 256
MOST_COUNT = 10**19 - 1
LONGEST_LINE = 4 << 20  # octets; a chunk of a megabyte fits

_DEVICES = f"note_{DEVICES_NOTE}"
_ALWAYS = ("line", "protocol", "start")
_LINE_END = re.compile(r"\r\n|\n|\r")


# -- reading ---------------------------------------------------------------------------------------------------


def read(path: str | Path, name: str | None = None) -> TextCapture:
    """Open a text capture; `name` stands in error messages, the path when None.

    Raises CaptureError here for a bad header, and from `items` for a bad line.
    """
    place = Path(path)
    called = str(place) if name is None else name
    capture = TextCapture(called, _FileLines(place))
    if capture.empty:
        raise CaptureError(f"{called}: empty file; a text capture begins with '{MAGIC} {VERSION}'")
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
            stripped = text.strip()
            if stripped.startswith("#!") and not stripped.startswith(MAGIC):
                event = Line(self.name, number, text).event(last)
                line = _changed(line, event)
                yield event
            elif stripped and not stripped.startswith("#"):
                chunk = plain_chunk(stripped, last) or Line(self.name, number, text).chunk(last, line)
                last = chunk.time
                yield chunk

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns. Raises CaptureError."""
        from sniff.engine.blocks import blocks_of

        return blocks_of(self.items())

    def comments(self) -> Iterator[LineEvent]:
        """What was written for people, as events at the chunk that they stand beside or behind; up to a bad line."""
        line, last, is_header = self._speed, self.session.started, True
        for number, text in enumerate(self._lines, 1):
            reading = Line(self.name, number, text)
            stripped = text.strip()
            said = ""
            try:
                if stripped.startswith("#!"):
                    if not stripped.startswith(MAGIC):
                        line = _changed(line, reading.event(last))
                elif stripped.startswith("#"):
                    said = "" if is_header and reading.header() else stripped
                elif stripped:
                    is_header = False
                    last = reading.chunk(last, line).time
                    said = text[reading.at :].strip()
            except CaptureError:
                return
            if said := said.removeprefix("#").strip():
                yield LineEvent(last, LineEventKind.COMMENT, said)

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
            reading = Line(self.name, number, text)
            if stripped.startswith(MAGIC):
                reading.version()
            elif not stripped.startswith("#!"):
                _take(record, reading.header())
        self._speed = LineSettings.parse(record["line"]) if "line" in record else None
        if "protocol" not in record:
            record.setdefault(f"note_{PROTOCOL_NOTE}", ASSUMED)
        return Session.from_metadata(record)


def _take(record: dict[str, str], header: dict[str, str]) -> None:
    """Add a header line; devices add up as long as there are addresses, of anything else the last line counts."""
    for key, value in header.items():
        before = record.get(key, "") if key == _DEVICES else ""
        if before.count(",") < MOST_DEVICES:
            record[key] = f"{before},{value}" if before else value


class _FileLines:
    """The lines of a file, read again for each pass, never more than one in memory."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __iter__(self) -> Iterator[str]:
        with open_capture(self.path) as stream:
            for number, octets in enumerate(self._octets(stream)):
                if number == 0 and octets[:2] in (b"\xff\xfe", b"\xfe\xff"):
                    raise CaptureError(f"{self.path}: UTF-16 text; save it as UTF-8")
                if len(octets) == LONGEST_LINE and not octets.endswith(b"\n"):
                    raise CaptureError(f"{self.path}: a line longer than {LONGEST_LINE} octets; not a text capture")
                line = octets.decode("utf-8" if number else "utf-8-sig", "replace")
                yield from _LINE_END.split(line.removesuffix("\n").removesuffix("\r"))

    def _octets(self, stream: BinaryIO) -> Iterator[bytes]:
        try:
            while octets := stream.readline(LONGEST_LINE):
                yield octets
        except OSError as error:
            raise explain(self.path, error) from None


def _changed(line: LineSettings | None, event: LineEvent) -> LineSettings | None:
    """The line settings after an event: `~` follows them."""
    change = settings_change(event)
    return line if change is None or change.line is None else change.line


# -- writing ---------------------------------------------------------------------------------------------------


def create(path: str | Path, session: Session) -> TextWriter:
    """Create a text capture; it takes its name when it is closed. Raises CaptureError."""
    return TextWriter(NewFile(Path(path)), session)


class TextWriter:
    """Writes the canonical form. A mark outside its chunk cannot be kept: a comment says so, and `losses`."""

    def __init__(self, file: NewFile, session: Session) -> None:
        self._file = file
        self._last = readable_time(session.started)
        self._not_kept = 0
        self._moved = 0
        self._in_header = True
        self.losses: list[str] = []
        self._put(header_lines(session))

    def write(self, item: Item) -> None:
        """Add a chunk or line event. An empty chunk says nothing and is not written. Raises CaptureError."""
        self._moved += readable_time(item.time) != item.time
        if isinstance(item, LineEvent):
            is_comment = item.kind is LineEventKind.COMMENT and is_plain_comment(item.text, self._in_header)
            self._put([f"# {item.text}" if is_comment else event_line(item, self._last)])
        elif item.octets:
            self._in_header = False
            lines = list(chunk_lines(item, self._last))
            self._not_kept += len(lines) - 1
            self._put(lines)
            self._last = readable_time(item.time)

    def close(self) -> None:
        """Finish the file and give it its name. Raises CaptureError."""
        if self._not_kept:
            self.losses.append(f"line errors that stand at no octet of their read became comments: {self._not_kept}")
            self._not_kept = 0
        if self._moved:
            self.losses.append(f"times beyond 1677 … 2262 became the last there is: {self._moved}")
            self._moved = 0
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
    last = readable_time(session.started)
    parts: list[Iterable[str]] = [header_lines(session)]
    for item in items:
        if isinstance(item, LineEvent):
            parts.append([event_line(item, last)])
        elif item.octets:
            parts.append(chunk_lines(item, last))
            last = readable_time(item.time)
    return "".join(f"{line}\n" for line in chain.from_iterable(parts))


def header_lines(session: Session) -> Iterator[str]:
    """The lines before the first chunk: what differs from the default, and always line, protocol and start."""
    yield f"{MAGIC} {VERSION}"
    record = session.to_metadata()
    default = Session.from_metadata({}).to_metadata()
    for key, name in HEADER.items():
        value = record.get(name, "")
        if key == "start":
            value = iso(readable_time(session.started))
        elif key == "latency":
            value = exact_milliseconds(min(session.adapter.latency, LATEST))
        if key in _ALWAYS or record.get(name) != default.get(name):
            yield f"# {key}: {_quoted(value)}"
    devices = session.notes.get(DEVICES_NOTE, "").split(",")
    as_devices = all(is_device(word) for word in devices)
    if as_devices:
        yield from (f"# {DEVICE}: {word}" for word in devices)
    for note, value in session.notes.items():
        if note == DEVICES_NOTE and as_devices:
            continue
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
    yield f"{_delay(readable_time(chunk.time) - last):<9} {' '.join(pairs)}"


def event_line(event: LineEvent, last: int) -> str:
    """One line for an event of the line; `last`: time of the chunk before, ns."""
    number = min(max(event.count, -MOST_COUNT), MOST_COUNT)
    count = f" count={number}" if number else ""
    text = event.text
    shown = ""
    if text:
        shown = f" {json.dumps(text)}" if text.startswith("count=") else f" {_quoted(text)}"
    return f"#! {_delay(readable_time(event.time) - last)} {event.kind.value}{count}{shown}"


def is_plain_comment(text: str, in_header: bool) -> bool:
    """Whether a comment can stand in a file as it is, and would not be read as something else."""
    return (
        bool(text)
        and text.isprintable()
        and text == text.strip()
        and not text.startswith(("!", "#"))
        and not (in_header and ":" in text)
    )


def readable_time(time: int) -> int:
    """The nearest time (ns) that a text capture can say."""
    return min(max(time, -LATEST), LATEST)


def exact_milliseconds(time: int) -> str:
    """ns ≥ 0 as ms with as many decimals as it takes: 8200000 → "8.2"."""
    whole, part = divmod(time, MS)
    return f"{whole}.{part:06}".rstrip("0").rstrip(".")


def iso(time: int) -> str:
    """ns since the epoch as ISO 8601 with as many decimals as it takes."""
    seconds, part = divmod(time, 1_000_000_000)
    try:
        moment = EPOCH + timedelta(seconds=seconds)
    except OverflowError:
        moment, part = EPOCH, 0
    decimals = f".{part:09}".rstrip("0").rstrip(".")
    return f"{moment:%Y-%m-%dT%H:%M:%S}{decimals}Z".zfill(len("2026-03-01T10:00:00") + len(decimals) + 1)


def _delay(time: int) -> str:
    return f"-{exact_milliseconds(-time)}" if time < 0 else f"+{exact_milliseconds(time)}"


def _quoted(value: str) -> str:
    plain = value.isprintable() and value == value.strip() and value and not value.startswith('"')
    return value if plain else json.dumps(value)
