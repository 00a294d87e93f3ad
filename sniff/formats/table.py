"""The file formats: one line each. A capture is told by its content; its suffix only breaks ties.

A format that another package brings is an entry point of the group `sniff485.formats` whose value is a `Format`; such
are asked before those that are told by an absence of anything better (`Format.last`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any

from dissectors.installed import entry_points
from sniff.engine.capture import CaptureError

GROUP = "sniff485.formats"

SEEN = 1 << 16
"""Octets of a file that are looked at to tell what it is."""


@dataclass(frozen=True, slots=True)
class Format:
    """A file format. Functions are named "module:function" and imported when they are wanted.

    | field | what |
    |---|---|
    | `name` | as people call it |
    | `suffixes` | lower case, with the dot; the first is the usual one; () where others have it and the content tells |
    | `magics` | how such a file begins, any of them; () when octets at its begin do not tell |
    | `content` | (the first SEEN octets) → whether it is one; "" when `magics` are enough |
    | `reader` | (path) → Capture; "" when it is only written |
    | `items_writer` | (path, session) → CaptureWriter, of formats that keep reads; "" otherwise |
    | `frames_writer` | (path, session, link type, live) → FrameFile, of formats that keep frames; "" otherwise |
    | `last` | whether it is what remains when nothing else recognises the content |
    """

    name: str
    suffixes: tuple[str, ...]
    magics: tuple[bytes, ...] = ()
    content: str = ""
    reader: str = ""
    items_writer: str = ""
    frames_writer: str = ""
    last: bool = False

    def recognises(self, start: bytes) -> bool:
        """Whether a file that begins so is of this format."""
        if self.magics and not start.startswith(self.magics):
            return False
        return bool(self.magics if not self.content else function(self.content)(start))

    def named(self, name: str) -> bool:
        """Whether a file of that name says that it is of this format."""
        return name.lower().endswith(self.suffixes)


_PCAP = (b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1", b"\xa1\xb2\x3c\x4d")
_PCAPNG = (b"\x0a\x0d\x0d\x0a",)
_MCAP = (b"\x89MCAP0\r\n",)
_IS_TEXT_CAPTURE = "sniff.formats.contents:is_text_capture"
_LOGS = (".log", ".hex", ".csv", ".txt")
_DUMPS = (".bin", ".raw", ".dat", ".dump")

# Earlier lines win where two recognise the same content and neither suffix fits: put the more special one first.
# fmt: off
BUILT_IN: tuple[Format, ...] = (
    Format("MCAP recording", (".mcap",), _MCAP, reader="sniff.recording.reader:read",
           items_writer="sniff.recording.mcap_writer:create"),
    Format("pcapng", (".pcapng",), _PCAPNG, reader="sniff.formats.pcapng:read",
           frames_writer="sniff.formats.pcapng:create"),
    Format("pcap", (".pcap", ".cap"), _PCAP, reader="sniff.formats.pcap:read",
           frames_writer="sniff.formats.pcap:create"),
    Format("text capture", (".cap.txt",), content=_IS_TEXT_CAPTURE, reader="sniff.formats.text:read",
           items_writer="sniff.formats.text:create"),
    Format("sigrok session", (".sr",), (b"PK\3\4",), "sniff.formats.waves_told:is_sigrok",
           reader="sniff.formats.logic_capture:read_sigrok"),
    Format("value change dump", (".vcd",), content="sniff.formats.waves_told:is_vcd",
           reader="sniff.formats.logic_capture:read_vcd"),
    Format("table of levels", (), content="sniff.formats.waves_told:is_levels",
           reader="sniff.formats.logic_capture:read_digital_csv"),
    Format("table of voltages", (), content="sniff.formats.waves_told:is_voltages",
           reader="sniff.formats.logic_capture:read_voltages"),
    Format("Saleae binary export", (), content="sniff.formats.waves_told:is_saleae_binary",
           reader="sniff.formats.logic_capture:read_digital_binary"),
    Format("raw dump", _DUMPS, content="sniff.formats.contents:is_raw", reader="sniff.formats.raw_dump:read",
           last=True),
    Format("byte log", _LOGS, content="sniff.formats.contents:is_text", reader="sniff.formats.bytelog:read",
           last=True),
)
# fmt: on

UNREADABLE: tuple[tuple[bytes, str], ...] = (
    (b"PK\3\4", "a zip archive; unpack it, and name the capture in it"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive; unpack it, and name the capture in it"),
    (b"Rar!", "a RAR archive; unpack it, and name the capture in it"),
    (b"%PDF", "a PDF document; save the log as text"),
    (b"\x89PNG", "a picture; save the log as text"),
    (b"\xff\xd8\xff", "a picture; save the log as text"),
    (b"GIF8", "a picture; save the log as text"),
    (b"\xd0\xcf\x11\xe0", "an old Office document; save the table as CSV"),
    (b"SQLite format 3", "an SQLite data base; export the table as CSV"),
    (b"PAR1", "a Parquet table; this program writes such and does not read them: keep the capture that it was made of"),
    (b"\x7fELF", "a program"),
    (b"MZ", "a program"),
    (b"<!DOCTYPE", "a web page; save the log as text"),
    (b"<html", "a web page; save the log as text"),
    (b"RIFF", "sound, a film or a picture"),
    (b"OggS", "sound or a film"),
    (b"LOGG", "a binary log of Vector's tools; export it as text"),
    (b"ElfFile\0", "an event log of Windows"),
    (b"{\\rtf", "a document; save the log as text"),
    (b"btsnoop\0", "a Bluetooth capture; it holds no serial frames"),
    (b"snoop\0\0\0", "a snoop capture; convert it with `editcap -F pcapng`"),
)
"""How files begin that no format reads, and what to do with each."""
_TAR, _TAR_AT = b"ustar", 257


def unreadable(start: bytes) -> str | None:
    """What a file is that begins so, and what to do with it, where no format reads it; None for all others."""
    if start.startswith(_TAR, _TAR_AT):
        return "a tar archive; unpack it, and name the capture in it"
    return next((what for magic, what in UNREADABLE if start.startswith(magic)), None)


def formats() -> tuple[Format, ...]:
    """All formats: built-in ones, those of other packages, and last those that remain."""
    first = [one for one in BUILT_IN if not one.last]
    return (*first, *plugged(), *(one for one in BUILT_IN if one.last))


@cache
def plugged() -> tuple[Format, ...]:
    """The formats that other packages bring. Raises CaptureError for one that cannot be used."""
    found = []
    for point in sorted(entry_points(group=GROUP), key=lambda one: one.name):
        try:
            made = point.load()
        except Exception as error:  # its module is imported: anything may happen
            raise CaptureError(f"plug-in format {point.name!r}: {error or type(error).__name__}") from error
        if not isinstance(made, Format):
            raise CaptureError(f"plug-in format {point.name!r}: {point.value} is no Format")
        found.append(made)
    return tuple(found)


def told(start: bytes, name: str) -> Format | None:
    """The format of a file that begins so, `name` as that of the file; None when neither tells.

    A raw dump does not take a file away from the format that its name says: it is such a file, and damaged.
    """
    for one in BUILT_IN:  # the first of all: nobody else is asked, who would have to be looked for or imported
        if one.reader and not one.last and one.named(name) and one.recognises(start):
            return one
    named = [one for one in formats() if one.reader and one.named(name)]
    certain = next((one for one in named if not one.last and one.recognises(start)), None)
    if certain is not None:
        return certain
    recognised = [one for one in formats() if one.reader and one.recognises(start)]
    best = next((one for one in recognised if not one.last), None)
    if best is not None:
        return best
    damaged = next((one for one in named if not one.last), None)
    if damaged is not None and not any(one.name == "byte log" for one in recognised):
        return damaged
    both = [one for one in recognised if one in named]
    return both[0] if both else next(iter(recognised), next(iter(named), None))


def writers(kind: str) -> dict[str, str]:
    """Suffix → function of those formats that have a writer of that kind: "items_writer" or "frames_writer"."""
    return {suffix: getattr(one, kind) for one in formats() if getattr(one, kind) for suffix in one.suffixes}


def suffixes() -> tuple[str, ...]:
    """Suffixes of everything that can be read."""
    return tuple(dict.fromkeys(suffix for one in formats() if one.reader for suffix in one.suffixes))


def is_named_so(name: str) -> bool:
    """Whether a name ends in one of `suffixes`. For one of ours nobody looks what other packages bring."""
    return any(one.reader and one.named(name) for one in BUILT_IN) or name.lower().endswith(suffixes())


def names() -> Iterable[str]:
    """Names of everything that can be read."""
    return (one.name for one in formats() if one.reader)


def function(target: str) -> Any:
    """The function that "module:function" names."""
    module, _, attribute = target.partition(":")
    return getattr(import_module(module), attribute)
