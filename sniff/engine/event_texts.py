"""The texts of line events that are read again: settings that changed or were refused, a port that went. Pure.

They stand in every recording as they are here, so that an older one is read too.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.session import LineEvent, LineEventKind


@dataclass(frozen=True, slots=True)
class SettingsChange:
    """What a SETTINGS event says, as words with spaces between: "line=19200,8E1 protocol=NAME found".

    `line`, `protocol`: in force from here on; None: as before. `searching`: here a search for them begins, and every
    later change is one of its attempts. `found`: here it ends with these.
    """

    line: LineSettings | None = None
    protocol: str | None = None
    searching: bool = False
    found: bool = False

    def __str__(self) -> str:
        words = [f"line={self.line}"] if self.line is not None else []
        words += [f"protocol={self.protocol}"] if self.protocol is not None else []
        words += ["searching"] if self.searching else []
        return " ".join(words + (["found"] if self.found else []))

    @classmethod
    def parse(cls, text: str) -> SettingsChange:
        """Read an event's text; total: words that are not known are passed over."""
        line, protocol = None, None
        words = text.split()
        for word in words:
            name, _, value = word.partition("=")
            if name == "line":
                try:
                    line = LineSettings.parse(value)
                except ValueError:
                    continue
            elif name == "protocol" and value:
                protocol = value
        return cls(line, protocol, "searching" in words, "found" in words)


def settings_change(item: Chunk | LineEvent) -> SettingsChange | None:
    """The change of settings that an item of a capture is; None for everything else."""
    if isinstance(item, LineEvent) and item.kind is LineEventKind.SETTINGS:
        return SettingsChange.parse(item.text)
    return None


def refusal(line: LineSettings | str, why: str) -> str:
    """Text of a REFUSED event."""
    return f"{line}: {why}"


def refused_line(event: LineEvent) -> LineSettings | None:
    """The line settings that were not taken, of a REFUSED event; None of any other."""
    if event.kind is not LineEventKind.REFUSED:
        return None
    try:
        return LineSettings.parse(event.text.partition(":")[0])
    except ValueError:
        return None


_GONE = re.compile(r".* is gone \((?P<why>.*)\)", re.DOTALL)


def gone(port: str, why: str) -> str:
    """Text of an UNPLUGGED event."""
    return f"{port} is gone ({why})"


def gone_why(event: LineEvent) -> str:
    """Why a port went, of an UNPLUGGED event, in two or three words; its whole text where `gone` did not make it."""
    match = _GONE.fullmatch(event.text)
    return match["why"] if match else event.text
