"""One line of a log, taken apart: its time, its direction, its octets, and whose line it is. Pure."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from dissectors.checksums import ends_with_crc16
from dissectors.quick_values import quickly_made
from sniff.formats.log_clock import Stamp, stamp_of
from sniff.formats.log_groups import groups_in, unpadded_in
from sniff.formats.log_memory import remembered
from sniff.formats.log_octets import PAIRS_ONLY, Run, number_in, numbers_in, octets_in, whole_in
from sniff.formats.log_pieces import LONGEST, SPACES
from sniff.formats.log_shapes import COLOURS, REMARK, STAMP, WAYS, Role, shape_of
from sniff.formats.log_times import AS_WRITTEN, Times

MOST_MORE = 512
"""Reads that one line tells."""
_BETWEEN = 60

MOST_STAMPS = 3
"""Times in a line that are taken out of it; a program's log around another's has two."""

MOST_WORDS = 4
"""Between a direction and the octets; with more it is a word of a sentence."""

_NUMBERED = re.compile(r"\s*#\d+(?:[\s:.)]|#\d)")
"""A line with its number, or of numbers of characters, which is no remark."""
_WORD = re.compile(r"[A-Za-z]{2,}")
_DIGITS = re.compile(r"(?<![0-9A-Za-z])(?:0[xX])?(?:[0-9A-Fa-f]*\d[0-9A-Fa-f]*)(?![0-9A-Za-z])|\d+")
_WORDS = re.compile(r"[A-Za-z]{3,}")
_HEXLIKE = re.compile(r"(?<![0-9A-Za-z])(?<!\d\.)(?:0x)?[0-9A-Fa-f]{2}(?![0-9A-Za-z]|\.\d)")
_ROW = re.compile(
    r"(?P<lead>.{0,120}?)(?<![0-9A-Za-z_:.\0])(?:0[xX])?(?P<offset>[0-9A-Fa-f]{4,16})(?P<mark>[:h]?)"
    r"(?:[ \t]*[|:]?[ \t]+(?P<rest>[0-9A-Fa-f]{2}.*)|\s*)"
)
_OCTET = re.compile(r"[0-9A-Fa-f]{1,2}")
_COLUMN = re.compile(r"\s-(?=\s|$)\s*|\s{2,}|\t|\s*[|>]")
_PAIRS = re.compile(r"[0-9A-Fa-f]{2}(?:[ -][0-9A-Fa-f]{2})*")
_SIXTEEN = re.compile(r"([0-9A-Fa-f]{2}(?: [0-9A-Fa-f]{2}){15}) (?![0-9A-Fa-f]{2}(?: |$)).{1,16}")
_WORDS_OF_16 = re.compile(r"(?:[0-9A-Fa-f]{4} )*(?:[0-9A-Fa-f]{4}|[0-9A-Fa-f]{2})")


class Kind(Enum):
    """What was found in a line."""

    OCTETS = "octets"
    ROW = "row"  # of a hexdump: an offset, then octets
    SHAPE = "shape"  # of a known tool, without octets of its own
    TEXT = "text"
    STRANGE = "strange"  # looks like octets, and is none that can be read
    EMPTY = "empty"
    REMARK = "remark"


@quickly_made
@dataclass(frozen=True, slots=True)
class Line:
    """A line of a log. `family`: what lines of one sort have in common (their label); `bare`: it has no label. `way`:
    as written, "" when not told. `offset`: as written, of a row. `samples`: begin and end, of a logic analyser.
    """

    kind: Kind
    stamp: Stamp | None = None
    way: str = ""
    octets: bytes = b""
    family: str = ""
    bare: bool = False
    role: Role | None = None
    tool: str = ""
    spelling: str = ""
    offset: str = ""
    samples: tuple[int, int] | None = None
    cut: bool = False
    broken: bool = False
    """Whether one of its octets is none that can be read."""
    wordy: bool = False
    """Whether its octets may as well be words."""
    lower: bool = False
    """Whether its digits are small letters."""
    more: tuple[tuple[str, bytes], ...] = ()
    """Way and octets of what stands behind on the same line, as the answer beside its request."""
    goes_on: bool = False
    """Whether it ends as a line that another continues."""
    whole: Callable[[bytes], bytes] | None = None
    """What makes its octets, or those below it, what was sent."""


EMPTY, REMARKED = Line(Kind.EMPTY), Line(Kind.REMARK)


def line_of(text: str, base: int = PAIRS_ONLY, rows: bool = True, times: Times = AS_WRITTEN, least: int = 0) -> Line:
    """A line taken apart. `base`, `least`: of numbers, of digits (`octets_in`); `rows`: whether an offset may stand
    before octets; `times`: how its times are read.
    """
    return _taken_apart(text, base, rows, times, least)


@remembered
def _taken_apart(text: str, base: int, rows: bool, times: Times, least: int) -> Line:
    text = SPACES.sub("   ", COLOURS.sub("", text))[:LONGEST].rstrip()
    if not text.strip():
        return EMPTY
    if text.lstrip().startswith(REMARK) and not _NUMBERED.match(text):
        return REMARKED
    stamp, text = without_stamps(text, times)
    known = shape_of(text)
    has_octets = known is not None and known[0].role in _TELLING and "octets" in known[1].re.groupindex
    if rows and not has_octets:
        row = _row(text, stamp)
        if row is not None:
            return row
    if known is None:
        return _general(text, stamp, base, least)
    shape, match = known
    groups = match.groupdict()
    way = groups.get("way") or ""
    if shape.role is Role.HEADING and (found := octets_in(text, base)) is not None and len(found.octets) > 2:
        return Line(Kind.OCTETS, stamp, way, found.octets, shape.tool, False, Role.DATA, shape.tool, found.spelling)
    if shape.role not in _TELLING:
        return Line(Kind.SHAPE, stamp, way, role=shape.role, tool=shape.tool, whole=shape.whole)
    told = groups.get("octets")
    run = octets_in(text if told is None else told, base if shape.base is None else shape.base)
    if told is not None and run is None and _OCTET.fullmatch(told):
        run = Run(0, 1, bytes((int(told, 16),)), "one octet")
    if told is not None and run is None and shape.base is not None and (one := number_in(told.strip("[] "))):
        run = Run(0, 1, bytes((int(one, shape.base) & 0xFF,)), "one octet")
    if run is None and told is None and not _looks(text):
        return Line(Kind.TEXT, stamp, way_of(text))  # what the tool says beside octets
    if run is None:
        return Line(Kind.STRANGE, stamp, tool=shape.tool)
    begin, end = groups.get("begin"), groups.get("end")
    samples = (int(begin[:18]), int(end[:18])) if begin and end else None
    if not way and told is None:
        way = way_of(text[: run.begin])
    if shape.role is Role.PERHAPS and told is not None:
        lead = text[: match.start("octets")]
        return Line(
            Kind.OCTETS, stamp, way or way_of(lead), run.octets, label_of(lead), spelling=run.spelling,
            cut=bool(groups.get("cut")), broken=run.broken, whole=shape.whole,
        )  # fmt: skip
    is_cut = bool(groups.get("cut")) or int(groups.get("count") or 0) > len(run.octets)
    return Line(
        Kind.OCTETS, stamp, way, run.octets, shape.tool, False, Role.DATA, shape.tool, run.spelling,
        samples=samples, cut=is_cut, broken=run.broken, whole=shape.whole,
        more=_more(text, run, base) if told is None else (),
    )  # fmt: skip


_TELLING = (Role.DATA, Role.PERHAPS)


def numbers_of(text: str) -> tuple[str, ...]:
    """The numbers of a line that may be octets, as they are written."""
    text = SPACES.sub("   ", COLOURS.sub("", text))[:LONGEST].rstrip()
    if text.lstrip().startswith(REMARK) and not _NUMBERED.match(text):
        return ()
    text = without_stamps(text)[1]
    return numbers_in(text) or ((alone,) if (alone := number_in(text)) else ())


def head_of(text: str) -> str:
    """What a line says that stands above octets, without times and numbers: the same for all heads of one sort."""
    text = without_stamps(COLOURS.sub("", text)[:LONGEST])[1].replace(STAMP, "")
    return " ".join(_NUMERAL.sub("#", text).split())[:80]


_NUMERAL = re.compile(r"[0-9A-Fa-f]*\d[0-9A-Fa-f]*")


def _general(text: str, stamp: Stamp | None, base: int, least: int) -> Line:
    run = octets_in(text, base, least)
    if base == PAIRS_ONLY:
        run = whole_in(text, run) if run is not None else None
        run = unpadded_in(text, groups_in(text, run))
    if run is None:
        kind = Kind.STRANGE if _looks(text) else Kind.TEXT
        return Line(kind, stamp, way_of(text) if kind is Kind.TEXT else "")
    lead = text[: run.begin]
    if run.broken:
        lead = _LOST.sub("", lead)
    way = way_of(lead)
    label = label_of(lead)
    bare = not _WORDS.search(label) and "~" not in label and "#" not in label and STAMP not in lead
    goes_on = text.rstrip().endswith((",", "\\"))
    return Line(
        Kind.OCTETS, stamp, way, run.octets, label if not bare else "", bare, None, "", run.spelling,
        cut=len(run.octets) > 3 and _LEFT_OUT.fullmatch(text, run.end) is not None,
        broken=run.broken, wordy=run.wordy, lower=text[run.begin : run.end].upper() != text[run.begin : run.end],
        goes_on=goes_on, more=_more(text, run, base),
    )  # fmt: skip


_LOST = re.compile(r"(?:(?<![0-9A-Za-z])[\[<(]?(?:0x)?[0-9A-Za-z?*]{2}[\]>)]?[ ,:.-]{1,2}){1,256}$")
"""What stands ahead of octets and was meant as some of them."""

_LEFT_OUT = re.compile(r" ?[\[(]?(?:\.\.\.|…)[\])]?\s*(?:[\[(<]?\d+ more.*)?")
"""What stands behind octets of which a tool left out the rest."""


def _more(text: str, run: Run, base: int) -> tuple[tuple[str, bytes], ...]:
    """What stands behind the octets of a line, written as they are, after a direction of its own; or another message
    with its check beside the first, in a column of its own."""
    rest = text[run.end :]
    found = _beside(rest, run, base)
    while len(found) < MOST_MORE:
        way = WAYS.search(rest[:_BETWEEN]) if not found or found[0][0] else None
        after = octets_in(rest[way.end() :], base) if way is not None else None
        if way is None or after is None or after.spelling != run.spelling or len(after.octets) < 3:
            break
        if after.begin > _BETWEEN:
            break
        found.append((way[0].lower(), after.octets))
        rest = rest[way.end() + after.end :]
    return tuple(found)


def _beside(rest: str, run: Run, base: int) -> list[tuple[str, bytes]]:
    """A message with its check in the next column, where the first is one too; the same octets once more are none,
    unless the columns are drawn."""
    column = _COLUMN_BESIDE.match(rest) if ends_with_crc16(run.octets) else None
    after = octets_in(rest[column.end() :], base) if column is not None else None
    if column is None or after is None or after.begin or not ends_with_crc16(after.octets):
        return []
    return [("", after.octets)] if after.octets != run.octets or "|" in column[0] else []


_COLUMN_BESIDE = re.compile(r"[ \t]*[|;]?[ \t]+(?=[0-9A-Fa-f(\[<{])")


def label_of(lead: str) -> str:
    """What stands before octets, without times; the same for all lines of one sort."""
    return " ".join(_DIGITS.sub("#", WAYS.sub("~", _WEEKDAY.sub("", lead))).replace(STAMP, "").split())


def key_of(family: str) -> str:
    """The name right before octets, of a label that is names with values: `ERR=BAD_CRC;FRAME=`; "" of another."""
    match = _KEY.search(family)
    return match[1] if match is not None and family.count("=") > 1 else ""


_KEY = re.compile(r"[;,|&\s](\w+=)$")
_WEEKDAY = re.compile(r"(?<![A-Za-z])(?:Mon|Tue|Wed|Thu|Fri|Sat|Sun)(?:[a-z]{0,6}day)?(?![A-Za-z]),?")


def way_of(lead: str) -> str:
    """The direction that a label tells: of several the last, which stands nearest to the octets; "A >> B" whole."""
    found = list(WAYS.finditer(lead))
    if not found:
        return ""
    last = found[-1]
    if len(_WORD.findall(lead[last.end() :])) > MOST_WORDS:
        return ""
    if len(last[0].strip("<>=-→←")) == 0:  # a sign between two names
        names = re.split(r"[\s:|\]\0]+", lead.strip(" :|-\t"))
        return " ".join(names[-3:]).lower() if len(names) >= 3 and last[0] in names[-3:] else last[0]
    return last[0].lower()


def _looks(text: str) -> bool:
    """Whether a line that tells no octets looks as if it did, or is no words either."""
    found = len(_HEXLIKE.findall(text))
    if found >= max(3, len(_WORDS.findall(text))) or (
        found > 0 and not _WORDS.search(text) and (STAMP not in text or bool(way_of(text)))
    ):
        return True
    joined = _JOINED.search(text)  # digits without space, of which a few are none
    if joined is not None and joined[1][:2] in ("0x", "0X") and len(joined[1]) < _ADDRESS:
        return False
    return joined is not None and sum(sign in _HEX for sign in joined[1]) >= 0.8 * len(joined[1])


_ADDRESS = 12
"""0x and digits that are no longer an address of a machine of 32 bits."""
_HEX = frozenset("0123456789ABCDEFabcdef")
_JOINED = re.compile(r"(?:^|[\s:>=\]])(?=[0-9A-Za-z?]*[0-9A-Fa-f]{4})(?=(?:[A-Za-z?]*\d){4})([0-9A-Za-z?]{10,})\s*$")


@remembered
def without_stamps(text: str, times: Times = AS_WRITTEN, most: int = MOST_STAMPS) -> tuple[Stamp | None, str]:
    """The first time of a line, None without one; and the line with STAMP where times were, `most` of them."""
    first: Stamp | None = None
    for _ in range(most):
        stamp = stamp_of(text, times)
        if stamp is None:
            break
        first = first or stamp
        text = text[: stamp.begin] + STAMP + text[stamp.end :]
    return first, text


# -- rows of hexdumps ------------------------------------------------------------------------------------------


def _row(text: str, stamp: Stamp | None) -> Line | None:
    match = _ROW.fullmatch(text)
    if match is None or len(_HEXLIKE.findall(match["lead"])) > 1 or (match["rest"] is None and match["lead"].strip()):
        return None
    lead = match["lead"]
    octets = _of_row(match["rest"] or "", bool(match["mark"]))
    if octets is None:
        return None
    return Line(
        Kind.ROW, stamp, way_of(lead), octets, " ".join(_DIGITS.sub("#", WAYS.sub("~", lead)).split()),
        not lead.strip(), offset=match["offset"],
    )  # fmt: skip


def _are_characters(field: str, octets: bytearray) -> bool:
    """Whether a column shows these octets as characters, with a sign for each that is none."""
    if len(field) != len(octets):
        return False
    if not _PAIRS.fullmatch(field):
        return True
    pairs = zip(field, octets, strict=True)
    return all(sign == chr(octet) if 0x20 < octet < 0x7F else sign not in _HEX for sign, octet in pairs)


def _of_row(rest: str, marked: bool) -> bytes | None:
    """The octets behind an offset, without the characters beside them; b"" for none, None when it is no row.

    Words of 16 bits behind an offset with a colon are as the file has them (xxd); without one they are numbers of a
    little-endian machine (hexdump, od -x).
    """
    found = bytearray()
    for number, field in enumerate(_COLUMN.split(rest)):
        if number and (len(found) % 4 or not found or _are_characters(field, found)):
            break
        if (full := _SIXTEEN.fullmatch(field)) is not None:  # and their characters
            found += bytes.fromhex(full[1])
            break
        if _PAIRS.fullmatch(field):
            found += bytes.fromhex(field.replace("-", " "))
        elif not number and _WORDS_OF_16.fullmatch(field):
            words = [bytes.fromhex(word) for word in field.split()]
            found += b"".join(words if marked else [word[::-1] for word in words])
            break
        else:
            break
    return bytes(found) if found or not rest else None
