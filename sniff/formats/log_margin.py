"""What stands around the lines of a log and is none of it: marks of a quotation, numbers of lines, numbers of octets.

Told by the first lines together, then taken away from each line. Pure.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise

from dissectors.checksums import ends_with_crc16
from sniff.formats.log_times import LEAST, is_count
from sniff.formats.log_writing import USUAL, Writing, joined_lists, writing_of

_MOST = 0.8
_SPACES = str.maketrans(
    {"\u00a0": " ", "\u2007": " ", "\u202f": " ", "\u2009": " ", "\u3000": " ", "\u200b": None, "\ufeff": None,
     "：": ":", "，": ",", "；": ";", "（": "(", "）": ")", "【": "[", "】": "]", "\u200e": None, "\0": " "}
)  # fmt: skip
"""Signs that look like others, as web pages and word processors put them."""
_CODE = re.compile(r"(?:(?<=[\s|])|^)(?:`{3,}|(?P<marks>`{1,2})(?P<code>[^`]+)(?P=marks)(?=[\s|,.;:)]|$))")
"""Code in a text: marks stand around it, and none of the octets is a mark."""
_ENTITIES = {"&gt;": ">", "&lt;": "<", "&amp;": "&", "&nbsp;": " ", "&quot;": '"', "&#39;": "'"}
_QUOTE = re.compile(r"(?:> ?){1,8}(?=\S|$)")
_NUMBER_ALONE = re.compile(r"\s*[\[(#|]?\s*(?P<number>\d{1,9})[\])}:.|,;]*\s*")
_NUMBER = re.compile(r"\s*[\[(#|]?\s*(?P<number>\d{1,9})(?P<behind>\s*[\])}:.|,;]+\s*|\t|\s+)(?=\S)")
_NAMES = re.compile(
    r"(?:(?<![0-9A-Za-z.:-])(?:(?!0\d)\d{1,3}\.){3}(?!0\d)\d{1,3}(?::\d{1,5})?(?![0-9.])"
    r"|(?<![0-9A-Za-z.:-])[0-9A-Fa-f]{2}(?P<sign>[:-])(?:[0-9A-Fa-f]{2}(?P=sign)){4}[0-9A-Fa-f]{2}(?![0-9A-Za-z:-])"
    r"|(?<![0-9A-Za-z-])[0-9A-Fa-f]{8}-(?:[0-9A-Fa-f]{4}-){3}[0-9A-Fa-f]{12}(?![0-9A-Za-z-]))"
    r"(?=.*(?:[0-9A-Fa-f]{2}[\s,;:-]?){3})"
)
"""Addresses of hosts and network cards, and identities, before octets of the same line."""
_CARDS = re.compile(
    r"\b(?:mac|bssid|hwaddr|ether|bd[_ ]?addr)(?:[ _]?addr(?:ess)?)?(?:[^0-9A-Za-z]{1,4}| is )"
    r"[0-9A-F]{2}(?P<sign>[:-])(?:[0-9A-F]{2}(?P=sign)){4}[0-9A-F]{2}(?![0-9A-Z:-])",
    re.IGNORECASE,
)
"""Addresses of network cards, by what stands before them."""
_RUN = re.compile(
    r"(?<![0-9A-Za-z_#.,:])(?P<ahead>\d{1,4})?(?(ahead)(?:[ \t]+|[;,|]))"
    r"(?P<run>[0-9A-Fa-f]{2}(?:(?P<sign>[ ;,\t|])[0-9A-Fa-f]{2})(?:(?P=sign)[0-9A-Fa-f]{2})+)"
    r"(?:(?P=sign)(?P<behind>\d{1,3})(?=\s+[^\W\d_]{3,}|\s*$))?(?![0-9A-Za-z])"
)


@dataclass(frozen=True, slots=True)
class Margin:
    """What is taken away from each line. `quotes`: `> ` of an answer to a letter; `numbers`: the number of the line;
    `ahead`, `behind`: the number of its octets, before and behind them. `width`: characters after which lines were
    broken off, within octets too; 0: they were not. `writing`: how octets are written in other forms.
    """

    quotes: bool = False
    numbers: bool = False
    ahead: bool = False
    behind: bool = False
    width: int = 0
    writing: Writing = USUAL

    def joined(self, texts: Iterable[str]) -> Iterator[str]:
        """Lines, those put together that a terminal or a letter broke off where they were full, or that are one list;
        "" for each that went into the one before, so that lines keep their numbers.
        """
        texts = joined_lists(texts)
        if not self.width:
            yield from texts
            return
        held, length, after = "", -2, 0
        for text in texts:
            if self.width - length in (0, 1) and _GOES_ON.match(text) and len(held) < _LONGEST:
                held += " " * (self.width - length) + text
                after += 1
            else:
                if length >= 0:
                    yield from (held, *[""] * after)
                held, after = text, 0
            length = len(text)
        if length >= 0:
            yield held

    def without(self, text: str) -> str:
        """A line without it."""
        text = _NAMES.sub(_blank, self.writing.rewritten(plain_signs(text)))
        text = _CARDS.sub(_blank, text) if ":" in text or "-" in text else text
        if self.quotes:
            text = _QUOTE.sub("", text, count=1) if _QUOTE.match(text) else text
        if self.numbers and (match := _NUMBER.match(text)) is not None:
            text = " " * (match.end() > 1) + text[match.end() :]
        elif self.numbers and _NUMBER_ALONE.fullmatch(text) is not None:
            text = ""  # of an empty line
        if (self.ahead or self.behind) and (counted := _counted(text)) is not None:
            at, end, before = counted
            if self.ahead if before else self.behind:
                text = text[:at] + " " * (end - at) + text[end:]
        return text


NO_MARGIN = Margin()


def plain_signs(text: str) -> str:
    """A line with the plain signs for those that only look like them."""
    if not text.isascii() or "\0" in text:
        text = text.translate(_SPACES)
    if "`" in text:
        text = _CODE.sub(_blank_marks, text)
    if "&" in text:
        for entity, sign in _ENTITIES.items():
            text = text.replace(entity, sign)
    return text


def margin_of(texts: Sequence[str]) -> Margin:
    """What stands around the lines of a log that begins so."""
    writing = writing_of(list(joined_lists(texts)))
    lines = [text for text in map(plain_signs, joined_lists(texts)) if text.strip()]
    quotes = _are_quoted(lines)
    lines = [Margin(quotes).without(text) for text in lines]
    numbers = _are_numbered(lines)
    lines = [Margin(False, numbers).without(text) for text in lines]
    ahead, behind = (_have_counts(lines, before) for before in (True, False))
    return Margin(quotes, numbers, ahead, behind, _width(texts), writing)


def _width(texts: Sequence[str]) -> int:
    """Where lines were broken off: all end there at most, and one of those goes on within an octet."""
    widest = max(map(len, texts), default=0)
    broken = sum(
        len(text) == widest and _HALF_END.search(text) is not None and _HALF_BEGIN.match(after) is not None
        for text, after in pairwise(texts)
    )
    return widest if broken and widest > _NARROWEST else 0


_LONGEST = 4096
_NARROWEST = 30
_HALF_END = re.compile(r"[0-9A-Fa-f]{2}[ :,-][0-9A-Fa-f]$")
_HALF_BEGIN = re.compile(r"[0-9A-Fa-f](?:[ :,-]|$)")
_GOES_ON = re.compile(r"[ :,-]?[0-9A-Fa-f]{1,2}(?:[ :,-]|$)")


def _blank_marks(match: re.Match[str]) -> str:
    """The code without its marks."""
    if match["code"] is None:
        return " " * len(match[0])
    marks = " " * len(match["marks"])
    return f"{marks}{match['code']}{marks}"


def _blank(match: re.Match[str]) -> str:
    return " " * len(match[0])


def _are_quoted(lines: Sequence[str]) -> bool:
    """Whether all lines begin so: a sign that says a direction says the other too."""
    marked = sum(text.startswith(">") for text in lines)
    return marked >= LEAST and marked >= _MOST * len(lines) and not any(text.startswith("<") for text in lines)


def _are_numbered(lines: Sequence[str]) -> bool:
    """Whether the lines count up by one, in numbers that are no octets of theirs: these have two digits each, count
    in hexadecimal and have the same between them as all others.
    """
    found = [match for text in lines if (match := _NUMBER.match(text)) is not None]
    alone = [match for text in lines if (match := _NUMBER_ALONE.fullmatch(text)) is not None]  # of an empty line
    if len(found) < LEAST or 2 * (len(found) + len(alone)) < len(lines) or len(alone) > len(found):
        return False
    numbers = [Decimal(match["number"]) for match in found]
    of_all = sorted(Decimal(match["number"]) for match in (*found, *alone))
    if not is_count(numbers) and not is_count(of_all):
        return False
    if any(len(match["number"]) == 2 for match in found) and all(match["behind"] == " " for match in found):
        tens = any(len(match["number"]) == 2 and int(match["number"]) % 10 == 0 for match in found)
        return tens or any(len(match["number"]) != 2 for match in found)
    return not all(len(match["number"]) == 2 and match["behind"] in ":,-." for match in found)


def _have_counts(lines: Sequence[str], before: bool) -> bool:
    """Whether a number beside the octets of nearly every line says how many they are."""
    runs = [text for text in lines if _RUN.search(text) is not None]
    found = [one for text in runs if (one := _counted(text)) is not None and one[2] is before]
    return len(found) >= LEAST and len(found) >= _MOST * len(runs)


_PAIR = re.compile("[0-9A-Fa-f]{2}")


def _counted(text: str) -> tuple[int, int, bool] | None:
    """Where the number of the octets of a line stands, and whether before them."""
    match = _RUN.search(text)
    if match is None:
        return None
    octets = (len(match["run"]) + 1) // 3
    for begin, end, said, before, there in _candidates(match, octets):
        if said is not None and int(said) == there and not _is_octet(match, said):
            return begin, end, before
    return None


def _is_octet(match: re.Match[str], said: str) -> bool:
    """Whether a number beside octets is one of theirs, by the check that they have with it: station 7, and the other
    seven octets of its request."""
    if len(said) != 2:
        return False
    pairs = [one for one in (match["ahead"], *_PAIR.findall(match["run"]), match["behind"]) if len(one or "") == 2]
    return ends_with_crc16(bytes.fromhex("".join(pairs)))


def _candidates(match: re.Match[str], octets: int) -> list[tuple[int, int, str | None, bool, int]]:
    """Where a count may stand: beside the run, or as its last pair."""
    end = match.end("run")
    last = match["run"][-2:]
    whole = octets + (len(match["ahead"] or "") == 2)  # what stands ahead may be the first octet
    return [
        (*match.span("ahead"), match["ahead"], True, octets),
        (*match.span("behind"), match["behind"], False, whole),
        (end - 2, end, last if last.isdigit() else None, False, whole - 1),
    ]
