"""What stands around the octets of a line. Pure.

Lines of one outline come from one print of a program. So what is too short to be told on its own — `E5`, `b'410d'`,
`recv: 0xe5` — is octets where other lines have more of them between the same words and signs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from sniff.formats.log_clock import Stamp
from sniff.formats.log_lines import Kind, Line, key_of, label_of, way_of, without_stamps
from sniff.formats.log_octets import octets_in
from sniff.formats.log_pieces import LONGEST, SPACES
from sniff.formats.log_shapes import COLOURS, STAMP, WAYS, Role
from sniff.formats.log_spellings import CHARACTERS, ENDS, H2, SPELLINGS, ended
from sniff.formats.log_times import Times

LEAST = 2
"""Lines of one outline before a shorter one of it is believed."""

_CHARACTERS = "\1"
"""Stands in an outline where the octets stood as characters."""

_SHORT = {
    "pairs": re.compile(rf"(?<![0-9A-Za-z_.]){H2}(?:[ :.-]{H2}){{0,2}}(?![0-9A-Za-z_])"),
    "digits without space": re.compile(rf"(?:(?<![0-9A-Za-z_])|(?<=0[xX]))(?:{H2}){{1,5}}(?![0-9A-Za-z_])"),
    CHARACTERS: re.compile(rf"(?<![0-9A-Za-z_])(?:[:>][0-9A-F]+|[AN][0-9A-F]*){ENDS}(?![0-9A-Za-z_])"),
} | {one.name: one.short_pattern() for one in SPELLINGS if one.between is not None}
"""Spelling → octets of a line that has few."""
_DECODED = {one.name: one.decode for one in SPELLINGS if one.between is not None}
_SIGNED = frozenset((*_DECODED, CHARACTERS)) - {"pairs joined by _"}
"""Spellings that are octets wherever they stand."""
_DECIMAL = re.compile(r"(?<![0-9A-Za-z_.])\d{1,3}(?![0-9A-Za-z_])")
_NUMERAL = re.compile(r"0[xX][0-9A-Fa-f]+|\d+")


@dataclass(frozen=True, slots=True)
class Outline:
    """What stands before and behind octets that are spelled so; numbers are #, times a sign of their own."""

    spelling: str
    lead: str
    tail: str


def outlines_of(texts: Iterable[str], base: int, times: Times) -> frozenset[Outline]:
    """Those of two lines and more."""
    seen: dict[Outline, int] = {}
    for text in texts:
        text = without_stamps(_plain(text), times)[1]
        run = octets_in(text, base)
        if run is None or run.broken or len(run.octets) < LEAST or not _may_be_short(run.spelling):
            continue
        outline = _outline(run.spelling, text, run.begin, run.end, run.octets)
        seen[outline] = seen.get(outline, 0) + 1
    return frozenset(outline for outline, many in seen.items() if many >= LEAST and _tells(outline))


def short_line(text: str, base: int, times: Times, outlines: frozenset[Outline]) -> Line | None:
    """A line with few octets that has one of these outlines; None where it has none."""
    text = _plain(text)
    stamp, without = without_stamps(text, times)
    found = _short_line(stamp, without, outlines)
    if found is None and without.count(STAMP) > 1:  # 01:03:02 may be octets, and no second time
        found = _short_line(*without_stamps(text, times, 1), outlines)
    comma = text.find(",", stamp.begin, stamp.end) if stamp is not None else -1
    if found is None and comma >= 0:  # what stands behind may be octets, and no parts of a second
        stamp, lead = without_stamps(text[:comma], times)
        found = _short_line(stamp, lead + text[comma:], outlines)
    return found


def _short_line(stamp: Stamp | None, text: str, outlines: frozenset[Outline]) -> Line | None:
    for spelling in sorted({outline.spelling for outline in outlines}):
        for match in _short(spelling).finditer(text):
            octets = _octets(match[0], spelling)
            if octets and _outlined(spelling, text, *match.span(), octets) & outlines:
                label, lead = label_of(text[: match.start()]), text[: match.start()]
                bare = not label and STAMP not in lead
                return Line(Kind.OCTETS, stamp, way_of(lead), octets, label, bare, Role.DATA, spelling=spelling)
    return None


def _outlined(spelling: str, text: str, begin: int, end: int, octets: bytes) -> frozenset[Outline]:
    """The outline of a line, and the one that it has without the number of its octets, where that is taken away."""
    without = re.sub(rf"(?<![0-9A-Za-z]){len(octets)}(?=[\s:;,|]*$)", "", text[:begin])
    return frozenset(
        (
            _outline(spelling, text, begin, end, octets),
            _outline(spelling, without + text[begin:], len(without), len(without) + end - begin, octets),
        )
    )


def _plain(text: str) -> str:
    return SPACES.sub("   ", COLOURS.sub("", text))[:LONGEST].rstrip()


def _tells(outline: Outline) -> bool:
    """Whether words or signs say that octets stand here: a pair of digits alone on its line may be anything."""
    return bool(outline.lead or outline.tail) or outline.spelling in _SIGNED


def _may_be_short(spelling: str) -> bool:
    return spelling in _SHORT or spelling.startswith("numbers")


def _short(spelling: str) -> re.Pattern[str]:
    return _SHORT.get(spelling, _DECIMAL)


def _octets(text: str, spelling: str) -> bytes:
    """Octets of a short run; b"" where it is none."""
    if spelling == CHARACTERS:
        return ended(text)
    if spelling.startswith("numbers"):
        return bytes((int(text),)) if int(text) < 256 else b""
    if spelling in _DECODED:
        try:
            return _DECODED[spelling](text)
        except ValueError:
            return b""
    return bytes.fromhex(re.sub(r"[^0-9A-Fa-f]", "", text))


def _outline(spelling: str, text: str, begin: int, end: int, octets: bytes) -> Outline:
    lead, tail = _general(text[:begin]), _general(_without_characters(text[end:], octets))
    if (key := key_of(lead)) != "":  # names with values, which lines of one print have others of
        lead, tail = key, tail.partition("=")[0]
    return Outline(spelling, lead, tail)


def _general(text: str) -> str:
    return " ".join(_NUMERAL.sub("#", WAYS.sub("~", text)).split())


def _without_characters(tail: str, octets: bytes) -> str:
    """What stands behind octets, their characters replaced."""
    shown = "".join(chr(octet) if 0x20 <= octet < 0x7F else "." for octet in octets).strip()
    at = len(tail) - len(tail.lstrip(" |[\t"))
    if at and shown and tail.startswith(shown, at):
        return tail[:at] + _CHARACTERS + tail[at + len(shown) :]
    return tail
