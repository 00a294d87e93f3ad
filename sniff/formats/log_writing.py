"""What programs print in another form than octets side by side, rewritten to that: told by the first lines of a log
together, then done with each line. Pure.

    lists over several lines        data: [          →  data: [ 17, 3, 0 ]
                                      17, 3,
                                      0
                                    ]
    with the index of each          [1] => 17  [2] => 3  →  17, 3
    repeats that were counted       0x0 <repeats 3 times>  →  0x0, 0x0, 0x0
    numbers in columns              "  17   3 107"  →  "17 3 107"
    escapes of other languages      \\017 (Lua, decimal), \\B4 (LabVIEW)  →  \\x11, \\xb4
    characters among escapes        \\x11\\x03k\\x00  →  \\x11\\x03\\x6b\\x00
    characters among brackets       [11][03]k[00], {11}{03}k{00}, {h11}{h03}k{h00}  →  [11][03][6b][00]
    a string a character            [RX:'\\x11'] [RX:'k']  →  RX '\\x11\\x6b'
    rows of numbers (`dump_rows.py`)  0000000 021 003  \\0   k  →  0000000  11 03 00 6b
    groups of eight, with signs     43 40 - 49 ad  →  43 40 49 ad; the ruler above them  →  nothing
    the check in a column           01 03 00 | C4 0B  →  01 03 00 C4 0B
    annotations of sigrok           uart-1: 247, 367, 11110111, [F7], k  →  uart-1: F7
    base 64                         EQMAawADdoc=  →  11 03 00 6b 00 03 76 87
"""

from __future__ import annotations

import re
from base64 import b64decode
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

from dissectors.checksums import ends_with_crc16
from sniff.formats.dump_rows import cells_of, pairs_of_row
from sniff.formats.log_shapes import WAYS
from sniff.formats.log_spellings import ESCAPED_STRING

MOST_JOINED = 6000
"""Characters of a list that is put on one line."""

MOST_REPEATED = 512
"""Octets that a count stands for."""

_LEAST = 2


class Escapes(Enum):
    """What digits behind a backslash are."""

    USUAL = "octal, as in C"
    DECIMAL = "decimal, as in Lua"
    HEX = "hexadecimal, as in LabVIEW"


@dataclass(frozen=True, slots=True)
class Writing:
    """How a log writes octets. `brackets`: those around octets that are no characters, "" where all are in brackets.
    `columns`: whether numbers stand right under one another. `cells`: what stands behind offsets (`CELLS`), "" where
    that is pairs. `base64`: whether frames are in base 64."""

    escapes: Escapes = Escapes.USUAL
    brackets: str = ""
    columns: bool = False
    cells: str = ""
    base64: bool = False
    annotations: str = ""
    """How octets are written that a decoder of sigrok tells (`_ANNOTATED`), "" in pairs."""
    mixed: bool = False
    """Whether characters that can be shown stand among escapes, without quotes around."""
    checks: bool = False
    """Whether behind octets and a sign stands their check, one octet or two."""

    def rewritten(self, text: str) -> str:
        """A line with its octets side by side."""
        if self.cells:
            return pairs_of_row(text, self.cells)
        if _RULER.match(text) is not None:
            return ""
        if "  " in text or "-" in text:
            text = _EIGHT.sub(_together, text)
        if self.checks:
            text = _CHECK.sub(r"\g<octets> ", text)
        if self.annotations:
            return _annotated(text, self.annotations)
        if self.base64:
            text = _BASE64.sub(_in_pairs, text)
        if "<repeats" in text:
            text = _REPEATED.sub(_repeated, text)
        if "=>" in text:
            text = _INDEXED.sub(_without_index, text)
        if "X:'" in text:
            text = _CHARACTER_STRINGS.sub(_joined_strings, text)
        if self.escapes is not Escapes.USUAL and "\\" in text:
            text = _rewritten_escapes(text, self.escapes)
        if self.mixed and "\\" in text and _QUOTED.search(text) is None:
            text = _MIXED.sub(_as_escapes, text)
        if "{h" in text:
            text = _BRACED.sub(r"{\1}", text)
        if self.brackets:
            text = _in_brackets(text, self.brackets)
        if self.columns:
            text = _COLUMNS.sub(_squeezed, text)
        return text


USUAL = Writing()
"""Octets side by side."""


def writing_of(texts: Sequence[str]) -> Writing:
    """How a log that begins so writes octets."""
    texts = [_BRACED.sub(r"{\1}", text) if "{h" in text else text for text in texts]
    escapes = _escapes_of(texts)
    slashed = [_rewritten_escapes(text, escapes) for text in texts if "\\" in text]
    return Writing(
        escapes,
        next((brackets for brackets in _BRACKETS if _are_among(texts, brackets)), ""),
        sum(any(map(_is_aligned, _COLUMNS.finditer(text))) for text in texts) >= _LEAST,
        cells_of(texts),
        _is_base64(texts),
        _annotations_of(texts),
        sum(any(map(_is_mixed, _MIXED.finditer(text))) for text in slashed if not _QUOTED.search(text)) >= _LEAST,
        _have_checks(texts),
    )


# -- lists over several lines --------------------------------------------------------------------------------------

_OPENS = re.compile(r"[\[({]\s*(?:/\*.*\*/|//.*)?\s*$")
_ITEMS = re.compile(
    r"(?:[\s,]|\[\d{1,5}\]\s?=>|(?<![0-9A-Za-z])(?:int\(\d{1,3}\)|0[xX][0-9A-Fa-f]{1,2}|-?\d{1,3})(?![0-9A-Za-z]))*"
    r"(?P<closed>[\])}][\])}\s;,]*)?(?:/\*[^*]*\*/|//.*)?\s*"
)
_NUMBER = re.compile(r"\d")


def joined_lists(texts: Iterable[str]) -> Iterator[str]:
    """Lines, those of a list of numbers put on one; "" for each that went into another, so that lines keep their
    numbers."""
    held: list[str] = []
    length = 0
    for text in texts:
        if not held:
            if _OPENS.search(text) is not None and len(text) < MOST_JOINED:
                held, length = [text], len(text)
            else:
                yield text
            continue
        items = _ITEMS.fullmatch(text) if len(text) < MOST_JOINED else None
        length += len(text)
        if items is None or length > MOST_JOINED or not text.strip():
            yield from held
            held = []
            if _OPENS.search(text) is not None and len(text) < MOST_JOINED:
                held, length = [text], len(text)
            else:
                yield text
            continue
        held.append(text)
        if items["closed"] is not None:
            many = any(_NUMBER.search(line) for line in held[1:])
            yield from ((_on_one_line(held), *[""] * (len(held) - 1)) if many else held)
            held = []
    yield from held


def _on_one_line(held: Sequence[str]) -> str:
    return f"{held[0].rstrip()} {' '.join(' '.join(line.split()) for line in held[1:])}"


# -- what stands beside numbers -------------------------------------------------------------------------------------

_REPEATED = re.compile(r"(?P<value>0[xX][0-9A-Fa-f]{1,2}|\d{1,3}) <repeats (?P<many>\d{1,4}) times>")
_INDEXED = re.compile(r"(?:\[\d+\]\s*=>\s*(?:int\(\d{1,3}\)|\d{1,3})[,\s]*){2,}")
_VALUE = re.compile(r"=>\s*(?:int\()?(\d{1,3})")
_COLUMNS = re.compile(r"(?<![0-9A-Za-z_.:,;-])(?:\d{1,3} {1,8}){3,}\d{1,3}(?![0-9A-Za-z_.:,;-])")


def _repeated(match: re.Match[str]) -> str:
    return ", ".join([match["value"]] * min(int(match["many"]), MOST_REPEATED))


def _without_index(match: re.Match[str]) -> str:
    return f"{', '.join(_VALUE.findall(match[0]))} "


def _is_aligned(match: re.Match[str]) -> bool:
    """Whether numbers end under one another, and not all have as many digits: pairs two spaces apart are read as they
    stand, and those among them without a letter are part of a longer row."""
    numbers = list(re.finditer(r"\d+", match[0]))
    steps = {later.end() - earlier.end() for earlier, later in pairwise(numbers)}
    if len(steps) != 1 or "  " not in match[0]:
        return False
    return len({len(one[0]) for one in numbers}) > 1 or max(steps) > len(numbers[0][0]) + 2


def _squeezed(match: re.Match[str]) -> str:
    """Numbers that stand under one another, side by side; digits between other pairs of a line are some of those."""
    text, begin, end = match.string, *match.span()
    are_among = _PAIR_AHEAD.search(text, max(0, begin - 12), begin) or _PAIR_BEHIND.match(text, end)
    return " ".join(match[0].split()) if _is_aligned(match) and not are_among else match[0]


_PAIR_AHEAD = re.compile(r"(?<![0-9A-Za-z])(?=[0-9]?[A-Fa-f])[0-9A-Fa-f]{2} {1,8}$")
_PAIR_BEHIND = re.compile(r" {1,8}(?=[0-9]?[A-Fa-f])[0-9A-Fa-f]{2}(?![0-9A-Za-z])")


_H = "[0-9A-Fa-f]{2}"
_PAIRS = re.compile(rf"(?<![0-9A-Za-z.:]){_H}(?: {_H})+(?![0-9A-Za-z])")
_CHECK = re.compile(rf"(?P<octets>(?<![0-9A-Za-z.:]){_H}(?: {_H})*) ?[|/] ?(?={_H}(?: {_H})?\s*$)")
_NEARLY_ALL, _CHECKS_LEAST = 0.9, 4


def _have_checks(texts: Sequence[str]) -> bool:
    """Whether nearly every line with octets has one or two more behind a sign: no column of characters is so."""
    lines = [text for text in texts if _PAIRS.search(text) is not None]
    checks = [text for text in lines if _CHECK.search(text) is not None]
    return len(checks) >= _CHECKS_LEAST and len(checks) >= _NEARLY_ALL * len(lines)


_RULER = re.compile(
    r"(?:[\s|]*|\s*offset\W+)(?:0?0[ ]+0?1[ ]+0?2[ ]+0?3[ ]+0?4[ ]+0?5[ ]+0?6[ ]+0?7)"
    r"(?=[\s|-]*(?:$|0?8 |[^\s0-9A-Za-z]))",
    re.IGNORECASE,
)
_EIGHT = re.compile(
    rf"(?<![0-9A-Za-z])(?P<first>{_H}(?: {_H}){{7}})(?: {{2,4}}| ?- ?)"
    rf"(?P<second>{_H}(?: {_H}){{0,7}})(?=\s*$|  |\s?-\s|\s[|])"
)


def _together(match: re.Match[str]) -> str:
    """Sixteen octets in two groups; but two messages stay two."""
    if ends_with_crc16(bytes.fromhex(match["first"])):
        return match[0]
    return f"{match['first']} {match['second']}"


# -- escapes --------------------------------------------------------------------------------------------------------

_BEHIND_SLASH = re.compile(r"\\(\d{1,3}|.)")
_PAIR_OR_SIGN = re.compile(r"\\([0-9A-F]{2}|.)")
_HEX_ONLY = re.compile(r"(?=.?[A-F])[0-9A-F]{2}")
_OF_LABVIEW = ("s", "n", "r", "t", "b", "f", "\\")


def _escapes_of(texts: Sequence[str]) -> Escapes:
    pairs = [match[1] for text in texts if "\\" in text for match in _PAIR_OR_SIGN.finditer(text)]
    only = sum(_HEX_ONLY.fullmatch(one) is not None for one in pairs)
    if only >= _LEAST and all(len(one) == 2 or one in _OF_LABVIEW for one in pairs):
        return Escapes.HEX
    found = [match[1] for text in texts if "\\" in text for match in _BEHIND_SLASH.finditer(text)]
    digits = [one for one in found if one.isdigit()]
    if any(int(one) > 255 and not set("89") & set(one) for one in digits):
        return Escapes.USUAL  # \377 is no decimal octet; \08 is a zero, and an 8
    is_decimal = any("8" in one or "9" in one for one in digits)
    return Escapes.DECIMAL if is_decimal and "x" not in found else Escapes.USUAL


def _rewritten_escapes(text: str, escapes: Escapes) -> str:
    if escapes is Escapes.USUAL:
        return text
    if escapes is Escapes.DECIMAL:
        return re.sub(r"\\(\d{1,3})", lambda found: _as_escape(int(found[1]), found[0]), text)
    text = re.sub(r"\\([0-9A-F]{2})", lambda found: f"\\x{found[1].lower()}", text)
    return text.replace("\\s", "\\x20")


_ESCAPE = r"\\(?:x[0-9A-Fa-f]{2}|[abtnvfr0\\])"
_MIXED = re.compile(
    rf"(?:(?<=[\s:=>])|^)(?![^\s\\]{{0,12}}['\"])[!-9;<?-\[\]-~]*{_ESCAPE}(?:[!-\[\]-~]|{_ESCAPE})*(?!\S)"
)
_QUOTED = re.compile(
    rf"(?<![^\s:=(\[{{,>])(?:b|bytearray\(b)?{ESCAPED_STRING}"
    r"(?:(?!(?P=q))[^\\]|\\.)*(?P=q)"
)
"""A string with escapes, in which whatever stands is a character of it."""
_AMONG_ESCAPES = re.compile(r"\\x[0-9A-Fa-f]{2}(?![ ,;])[!-\[\]-~]+\\x[0-9A-Fa-f]{2}")
_ONE = re.compile(rf"{_ESCAPE}|(.)")


def _is_mixed(match: re.Match[str]) -> bool:
    return _AMONG_ESCAPES.search(match[0]) is not None


def _as_escapes(match: re.Match[str]) -> str:
    return _ONE.sub(lambda found: _as_escape(ord(found[1]), "") if found[1] else found[0], match[0])


def _as_escape(octet: int, written: str) -> str:
    return f"\\x{octet:02x}" if octet < 256 else written


_INNER = r"""(?:'((?:[^'\\]|\\.)*)'|"((?:[^"\\]|\\.)*)")"""
_CHARACTER_STRINGS = re.compile(rf"(?:\[[RT]X:{_INNER}\] *)+")
_CHARACTER_STRING = re.compile(rf"\[([RT]X):{_INNER}\]")
_SHOWN = re.compile(r"\\x[0-9a-f]{2}|\\.|.")


def _joined_strings(match: re.Match[str]) -> str:
    """Strings that follow one another and go the same way as one."""
    said: list[tuple[str, str]] = []
    for way, single, double in _CHARACTER_STRING.findall(match[0]):
        inner = _SHOWN.sub(lambda sign: sign[0] if len(sign[0]) > 1 else _as_escape(ord(sign[0]), ""), single or double)
        if said and said[-1][0] == way:
            said[-1] = way, said[-1][1] + inner
        else:
            said.append((way, inner))
    return " ".join(f"{way} '{inner}'" for way, inner in said)


# -- characters among octets in brackets ----------------------------------------------------------------------------

_BRACKETS = ("[]", "{}", "<>")
_BRACED = re.compile(r"\{h([0-9A-Fa-f]{2})\}")
_AMONG = {
    pair: re.compile(
        rf"{re.escape(pair[0])}[0-9A-Fa-f]{{2}}{re.escape(pair[1])}"
        rf"[^\s,:;.{re.escape(pair)}-][^{re.escape(pair)}]{{0,40}}"
        rf"(?<!\s){re.escape(pair[0])}[0-9A-Fa-f]{{2}}{re.escape(pair[1])}"
    )
    for pair in _BRACKETS
}
_WHOLE = {
    pair: re.compile(
        rf"(?P<ahead>[^\s{re.escape(pair)}]*)(?P<octets>{re.escape(pair[0])}[0-9A-Fa-f]{{2}}{re.escape(pair[1])}(?=\S).*)"
    )
    for pair in _BRACKETS
}
_LABEL = re.compile(r".*[:=>|]|(?:" + WAYS.pattern + r")", re.IGNORECASE)


def _are_among(texts: Sequence[str], brackets: str) -> bool:
    """Whether characters stand right between octets in brackets: those that can be shown are."""
    return sum(len(_AMONG[brackets].findall(text)) > 0 for text in texts) >= _LEAST


def _in_brackets(text: str, brackets: str) -> str:
    """A line with all its octets in brackets, from the first on to its end."""
    match = _WHOLE[brackets].search(text)
    if match is None:
        return text
    begin = match.start("octets") if _LABEL.fullmatch(match["ahead"]) else match.start()
    octets = re.sub(
        rf"{re.escape(brackets[0])}([0-9A-Fa-f]{{2}}){re.escape(brackets[1])}|(.)",
        lambda found: f"[{found[1]}]" if found[1] else f"[{ord(found[2]) & 0xFF:02x}]",
        text[begin:],
    )
    return text[:begin] + octets


# -- annotations -----------------------------------------------------------------------------------------------------

_ANNOTATION = re.compile(r'(?P<lead>(?:\d+-\d+ )?[a-z]\w*-\d+: (?:[a-z-]+: )?"?)(?P<token>.|.{2,8}?)"?')
_ANNOTATED: dict[str, tuple[re.Pattern[str], Callable[[str], int]]] = {
    "": (re.compile(r"[0-9A-F]{2}"), lambda token: int(token, 16)),
    "bits": (re.compile(r"[01]{8}"), lambda token: int(token, 2)),
    "octal": (re.compile(r"[0-3][0-7]{2}"), lambda token: int(token, 8)),
    "decimal": (re.compile(r"\d|[1-9]\d|1\d\d|2[0-4]\d|25[0-5]"), int),
    "characters": (
        re.compile(r"\[[0-9A-F]{2}\]|."),
        lambda token: int(token[1:3], 16) if len(token) > 1 else ord(token),
    ),
}


def _annotations_of(texts: Sequence[str]) -> str:
    """How the octets of a log are written that is nothing but annotations of octets."""
    written = [text for text in texts if text.strip()]
    found = [match["token"] for text in written if (match := _ANNOTATION.fullmatch(text)) is not None]
    if len(found) < _LEAST or len(found) < len(written):
        return ""
    return next((name for name, (form, _) in _ANNOTATED.items() if all(map(form.fullmatch, found))), "")


def _annotated(text: str, name: str) -> str:
    match, (form, read) = _ANNOTATION.fullmatch(text), _ANNOTATED[name]
    if match is None or form.fullmatch(match["token"]) is None:
        return text
    return f"{match['lead']}{read(match['token']):02X}"


# -- base 64 ---------------------------------------------------------------------------------------------------------

_FOUR = "[A-Za-z0-9+/]{4}"
_BASE64 = re.compile(
    rf"(?<![A-Za-z0-9+/=_-])(?:(?:{_FOUR}){{1,1000}}(?:[A-Za-z0-9+/]{{2}}==|[A-Za-z0-9+/]{{3}}=)|(?:{_FOUR}){{2,1000}})"
    r"(?![A-Za-z0-9+/=_-])"
)
_HEX_TOKEN = re.compile(r"[0-9A-Fa-f]+|[A-Za-z]+|[0-9]+")


def _octets_of(token: str) -> bytes | None:
    """What base 64 stands for; None for a word or a number."""
    return None if _HEX_TOKEN.fullmatch(token) else b64decode(token)


def _is_base64(texts: Sequence[str]) -> bool:
    """Whether words of a log are base 64: most of them end with the check of what is before."""
    told = [
        octets for text in texts for match in _BASE64.finditer(text) if (octets := _octets_of(match[0])) is not None
    ]
    checked = sum(ends_with_crc16(octets) for octets in told)
    return checked >= _LEAST and 2 * checked >= len(told)


def _in_pairs(match: re.Match[str]) -> str:
    octets = _octets_of(match[0])
    if octets is None and ends_with_crc16(letters := b64decode(match[0])):  # no word, then
        octets = letters
    return match[0] if octets is None else octets.hex(" ")
