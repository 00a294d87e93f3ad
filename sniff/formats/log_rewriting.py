"""Octets that only the rest of their log tells, written so that their line alone tells them. Pure.

`#80#33` may be two pairs or two decimal codes: where another line has `#128`, it is codes. `b'D'` may be a word: where
other lines have strings with escapes, it is an octet.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from sniff.formats.log_pieces import LONGEST

_PAIRS = re.compile(r"(?<![0-9A-Za-z_])(?:#\d\d){2,}(?![0-9A-Za-z_#])")
_RUN = re.compile(r"(?<![0-9A-Za-z_])(?:#[0-9A-Fa-f]{1,3}){2,}(?![0-9A-Za-z_])")
_STRING = re.compile(r"(?<![0-9A-Za-z_])(?P<head>b|bytearray\(b)(?P<q>['\"])(?P<inner>[ -~]{1,400}?)(?P=q)(?=\)?\s*$)")


def are_codes(texts: Iterable[str]) -> bool:
    """Whether runs behind # are decimal codes of characters: none has a letter, and one has a digit less or more than
    two, or most are frames written in characters."""
    runs = [run.split("#")[1:] for text in texts for run in _RUN.findall(text)]
    if not all(token.isdigit() and int(token) < 256 for run in runs for token in run):
        return False
    if any(len(token) != 2 for run in runs if len(run) > 3 for token in run):
        return True
    return 2 * sum(is_of_characters(bytes(map(int, run))) for run in runs) > len(runs)


def is_of_characters(octets: bytes) -> bool:
    """Whether octets are a sign, characters and CR or LF, as frames of text are."""
    return octets[:1] in (b":", b">") and octets[-1:] in (b"\r", b"\n") and octets.rstrip(b"\r\n").isascii()


def as_codes(text: str) -> str:
    """The line with three digits in the first code of each run of pairs, which makes it one of codes: `#080#33`."""
    return _within(_PAIRS.sub(lambda run: f"#0{run[0][1:]}", text), text)


def with_escapes(text: str) -> str:
    """The line with an escape for each character of the byte string at its end, where that has none."""
    match = _STRING.search(text)
    if match is None or "\\" in match["inner"]:
        return text
    inner = "".join(f"\\x{ord(character):02x}" for character in match["inner"])
    escaped = f"{match['head']}{match['q']}{inner}{match['q']}"
    return _within(f"{text[: match.start()]}{escaped}{text[match.end() :]}", text)


def _within(rewritten: str, text: str) -> str:
    """What is rewritten, where a line may be as long; else as it was."""
    return rewritten if len(rewritten) < LONGEST else text
