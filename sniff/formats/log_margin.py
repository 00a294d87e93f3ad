"""What stands around the lines of a log and is none of it: marks of a quotation, numbers of lines, numbers of octets.

Told by the first lines together, then taken away from each line. Pure.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

from sniff.formats.log_times import LEAST, is_count

_MOST = 0.8
_SPACES = str.maketrans(
    {"\u00a0": " ", "\u2007": " ", "\u202f": " ", "\u2009": " ", "\u3000": " ", "\u200b": None, "\ufeff": None,
     "：": ":", "，": ",", "；": ";", "（": "(", "）": ")", "【": "[", "】": "]", "`": " ", "\u200e": None, "\0": " "}
)  # fmt: skip
"""Signs that look like others, as web pages and word processors put them."""
_ENTITIES = {"&gt;": ">", "&lt;": "<", "&amp;": "&", "&nbsp;": " ", "&quot;": '"', "&#39;": "'"}
_QUOTE = re.compile(r"(?:> ?){1,8}(?=\S|$)")
_NUMBER = re.compile(r"\s*[\[(#|]?\s*(?P<number>\d{1,9})(?P<behind>\s*[\])}:.|,;]+\s*|\t|\s+)(?=\S)")
_RUN = re.compile(
    r"(?<![0-9A-Za-z_#.,:])(?P<ahead>\d{1,4})?(?(ahead)[ \t]+)(?P<run>[0-9A-Fa-f]{2}(?:[ ][0-9A-Fa-f]{2}){2,})"
    r"(?:[ ](?P<behind>\d{1,3})(?=\s+[^\W\d_]{3,}|\s*$))?(?![0-9A-Za-z])"
)


@dataclass(frozen=True, slots=True)
class Margin:
    """What is taken away from each line. `quotes`: `> ` of an answer to a letter; `numbers`: the number of the line;
    `ahead`, `behind`: the number of its octets, before and behind them.
    """

    quotes: bool = False
    numbers: bool = False
    ahead: bool = False
    behind: bool = False

    def without(self, text: str) -> str:
        """A line without it."""
        text = plain_signs(text)
        if self.quotes:
            text = _QUOTE.sub("", text, count=1) if _QUOTE.match(text) else text
        if self.numbers and (match := _NUMBER.match(text)) is not None:
            text = " " * (match.end() > 1) + text[match.end() :]
        if (self.ahead or self.behind) and (counted := _counted(text)) is not None:
            at, end, before = counted
            if self.ahead if before else self.behind:
                text = text[:at] + " " * (end - at) + text[end:]
        return text


NO_MARGIN = Margin()


def plain_signs(text: str) -> str:
    """A line with the plain signs for those that only look like them."""
    if not text.isascii() or "`" in text or "\0" in text:
        text = text.translate(_SPACES)
    if "&" in text:
        for entity, sign in _ENTITIES.items():
            text = text.replace(entity, sign)
    return text


def margin_of(texts: Sequence[str]) -> Margin:
    """What stands around the lines of a log that begins so."""
    lines = [text for text in map(plain_signs, texts) if text.strip()]
    quotes = _are_quoted(lines)
    lines = [Margin(quotes).without(text) for text in lines]
    numbers = _are_numbered(lines)
    lines = [Margin(False, numbers).without(text) for text in lines]
    ahead, behind = (_have_counts(lines, before) for before in (True, False))
    return Margin(quotes, numbers, ahead, behind)


def _are_quoted(lines: Sequence[str]) -> bool:
    """Whether all lines begin so: a sign that says a direction says the other too."""
    marked = sum(text.startswith(">") for text in lines)
    return marked >= LEAST and marked >= _MOST * len(lines) and not any(text.startswith("<") for text in lines)


def _are_numbered(lines: Sequence[str]) -> bool:
    """Whether the lines count up by one, in numbers that are no octets of theirs: these have two digits each, count
    in hexadecimal and have the same between them as all others.
    """
    found = [match for text in lines if (match := _NUMBER.match(text)) is not None]
    if len(found) < LEAST or 2 * len(found) < len(lines):
        return False
    numbers = [Decimal(match["number"]) for match in found]
    if not is_count(numbers):
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


def _counted(text: str) -> tuple[int, int, bool] | None:
    """Where the number of the octets of a line stands, and whether before them."""
    match = _RUN.search(text)
    if match is None:
        return None
    octets = len(match["run"].split())
    for begin, end, said, before, there in _candidates(match, octets):
        if said is not None and int(said) == there:
            return begin, end, before
    return None


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
