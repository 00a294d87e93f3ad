"""The octets found in a line of text, however it spells them (`log_spellings.py`). Pure."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from dissectors.checksums import ends_with_crc16
from sniff.formats.log_memory import remembered
from sniff.formats.log_shapes import STAMP, WAYS
from sniff.formats.log_spellings import H2, SPELLINGS, SURELY

PAIRS_ONLY = 0
"""No base: numbers are no octets."""

_MOSTLY = 0.7
"""Share of a run's tokens that are octets, from which on the others are meant as octets."""


@dataclass(frozen=True, slots=True)
class Run:
    """Octets found in a line, and where their text stands. `broken`: beside them stands what should be an octet of
    theirs and is none, so that they are not all. `wordy`: hexadecimal without any decimal digit, as words may be.
    """

    begin: int
    end: int
    octets: bytes
    spelling: str
    broken: bool = False
    wordy: bool = False


_PATTERNS = [(one, one.pattern()) for one in SPELLINGS]

_DIGITS = re.compile(
    r"(?<![0-9A-Za-z_#.])[0-9A-Fa-f]{1,3}(?![0-9A-Za-z_=])"
    r"(?:(?P<between>[ ]?[,;][ ]?|[:._/|-]|[ \t]{1,2})[0-9A-Fa-f]{1,3}(?![0-9A-Za-z_=])"
    r"(?:(?P=between)[ \t]?[0-9A-Fa-f]{1,3}(?![0-9A-Za-z_=]))*)?"
)
"""A run of one to three digits with the same between any two (one space more is a column)."""
_WORDS = re.compile(
    r"(?<![0-9A-Za-z_#.])(?:[0-9A-Fa-f]{2}){1,8}(?: (?:[0-9A-Fa-f]{2}){1,8})+(?![0-9A-Za-z_])"
    r"|(?:(?<![0-9A-Za-z_.])|(?<=0[xX]))(?:[0-9A-Fa-f]{2}){2,4096}(?![0-9A-Za-z_])"
)
_TOKEN = re.compile(r"[0-9A-Fa-f]{1,3}")


@remembered
def octets_in(line: str, base: int = PAIRS_ONLY, least: int = 0) -> Run | None:
    """The octets that a line tells, None when it tells none. `base`: of runs of numbers; PAIRS_ONLY where only pairs of
    hexadecimal digits count. `least`: digits without space that are believed, 0: as many as where they stand asks for.
    """
    for spelling, pattern in _PATTERNS:
        for match in pattern.finditer(line):
            try:
                octets = spelling.decode(match[0])
            except (ValueError, SyntaxError):
                continue
            if octets and not _are_told_ahead(line[: match.start()], octets, base):
                broken = is_broken(line, match.start(), match.end())
                return Run(match.start(), match.end(), octets, spelling.name, broken)
    run = _digits(line, base)
    if run is None or len(run.octets) < SURELY:
        words = _words(line, least)
        run = words if run is None or (words is not None and len(words.octets) > len(run.octets)) else run
    run = run or _single(line, base)
    if run is None or base == 10:
        return run
    text = line[run.begin : run.end]
    wordy = not any(sign.isdigit() for sign in text) and len(set(run.octets)) > 1
    return replace(run, wordy=True) if wordy else run


def _are_told_ahead(lead: str, octets: bytes, base: int) -> bool:
    """Whether what stands before says these octets in numbers: then they are its column of characters, which has not
    all that a row says."""
    body = octets.rstrip(b"\r\n")
    if len(lead) < 3 * len(body) - 1:
        return False
    run = _digits(lead, base)
    return run is not None and body in run.octets


def whole_in(line: str, run: Run) -> Run:
    """The run with the pairs that stand apart from it on its line, between names or signs, where they are a message of
    a frame together with its check, and it alone is none: `addr:01 func:03 data:00 06 crc:39 84`.
    """
    if len(run.octets) < 2 or ends_with_crc16(run.octets):
        return run
    begin, pairs = run.begin, list(_APART.finditer(line))
    while pairs and pairs[0].end() <= run.begin and not _NAMED_BY.search(line[: pairs[0].start()]):
        pairs.pop(0)  # of a time, a number
    octets = bytes.fromhex("".join(pair[0] for pair in pairs))
    if (
        len(octets) <= len(run.octets)
        or len(octets) < SURELY
        or not ends_with_crc16(octets)
        or run.octets not in octets
    ):
        return run
    begin, end = pairs[0].start(), pairs[-1].end()
    return Run(begin, end, octets, run.spelling)


_APART = re.compile(r"(?<![0-9A-Za-z_.])(?:[0-9A-Fa-f]{2})+(?![0-9A-Za-z_.]|[ ]?[:=])")
_NAMED_BY = re.compile(r"[A-Za-z]\w*[ ]?[:=][ ]?$")


def numbers_in(line: str) -> tuple[str, ...]:
    """The tokens of the run of numbers in a line, () when there is none: pairs and others, as they are written."""
    runs = ((one["between"], _TOKEN.findall(one[0])) for one in _DIGITS.finditer(line))
    return next((tuple(run) for between, run in runs if len(run) > 1 and not _is_host(between, run)), ())


def _is_host(between: str | None, tokens: list[str]) -> bool:
    """Whether numbers are an address of a host, or a version."""
    return between == "." and len(tokens) == 4 and all(_DECIMAL.fullmatch(token) for token in tokens)


def _digits(line: str, base: int) -> Run | None:
    at, best = 0, None
    while (match := _DIGITS.search(line, at)) is not None:
        tokens = _TOKEN.findall(match[0])
        at = match.start() + len(tokens[0]) if len(tokens) < 4 else match.end()  # a number may stand before the octets
        if match["between"] == "/" and _is_date(tokens):
            at = match.end()
            continue
        run = _numbers(line, match, tokens, base) if len(tokens) > 1 else None
        if run is not None and (best is None or len(run.octets) > len(best.octets)):
            best = run
            if len(run.octets) >= SURELY:
                break  # what stands behind is another frame, or the same in characters
    return best


def _numbers(line: str, match: re.Match[str], tokens: list[str], base: int) -> Run | None:
    begin, end = match.span()
    if _YEAR_AHEAD.search(line[max(0, begin - 5) : begin]) is not None or _SHORT_DATE.fullmatch(match[0]):
        return None
    if base == PAIRS_ONLY and len(tokens) > SURELY and len(tokens[0]) != 2:
        begin += len(tokens[0]) + len(match["between"])  # the number of the line, or of octets
        tokens = tokens[1:]
    if _is_host(match["between"], tokens):
        return None
    numbers = [_octet(token, base) for token in tokens]
    octets = bytes(number for number in numbers if number is not None)
    sign = (match["between"] or "").strip()
    name = "pairs" if base == PAIRS_ONLY else f"numbers with {sign}" if sign else "numbers"
    if len(octets) == len(tokens):
        if _is_number(line, end, match["between"]):
            return None
        return Run(begin, end, octets, name, is_broken(line, begin, end))
    if len(tokens) > SURELY and len(octets) >= _MOSTLY * len(tokens):
        return Run(begin, end, octets, name, broken=True)
    return None


def _octet(token: str, base: int) -> int | None:
    """The octet that one writes so; None where it is none."""
    if base == PAIRS_ONLY:
        return int(token, 16) if len(token) == 2 else None
    try:
        number = int(token, base)
    except ValueError:
        return None
    return number if number < 256 else None


def _is_date(tokens: list[str]) -> bool:
    """Whether three numbers between slashes are a day, a month and a year."""
    if len(tokens) != 3 or not all(token.isdigit() and len(token) == 2 for token in tokens):
        return False
    first, second, third = map(int, tokens)
    return any(0 < month <= 12 and 0 < day <= 31 for month, day in ((first, second), (second, first), (second, third)))


_DECIMAL = re.compile(r"0|[1-9]\d{0,2}")
_YEAR_AHEAD = re.compile(r"(?:19|20)\d\d[-./]$")
_SHORT_DATE = re.compile(r"(?:0?[1-9]|[12]\d|3[01])/(?:0?[1-9]|[12]\d|3[01])/\d\d")
"""08/17/26: three octets are no message, and nobody writes some so."""
_LONG_NUMBER = re.compile(r"[ \t]?\d{4,}")


def _is_number(line: str, end: int, between: str | None) -> bool:
    """Whether two or three numbers go on in one that is no octet: a date, a version."""
    text = line[end:]
    return (
        bool(between) and text.startswith(between or " ") and _LONG_NUMBER.match(text, len(between or "")) is not None
    )


# -- octets that are none --------------------------------------------------------------------------------------

_TOKEN_END = r"(?=[\s,;:|)\]}>\"']|$)"
_NONE_BEHIND = re.compile(
    r"[ ]?[\[<({](?=[^\])>}]*[0-9A-Fa-f?*])(?![A-Fa-f]?[G-Zg-z]{2})[^\s\])>}]{1,3}[\])>}]"  # [0G], behind brackets
    r"|\s?\\x"
    r"|['\"]?[ ]?[,;:/|]?[ \t]{0,2}['\"]?0[xX][^\s,;]{0,3}"
)
_BEHIND = re.compile(
    rf"(?P<between>[ ]?[,;][ ]?|[:._/|-]|[ \t]{{1,2}})(?P<token>[0-9A-Za-z?*]{{1,3}}){_TOKEN_END}(?P<next>.{{0,4}})"
)
_AHEAD = re.compile(
    r"(?P<before>.{0,4}?)(?<![0-9A-Za-z])(?P<token>[0-9A-Za-z?*]{2})(?P<between>[ ]?[,;][ ]?|[:._/|-]|[ \t])$"
)
_PAIR_BEHIND = re.compile(r"[\s,;:._/|-]{1,2}[0-9A-Fa-f]{2}(?![0-9A-Za-z])")
_PAIR_AHEAD = re.compile(r"(?:^|[\s,;:._/|-])[0-9A-Fa-f]{2}[\s,;:._/|-]{1,2}$")
_UNIT = re.compile(r"\d(?:[smhSMH]|[.:])")


def is_broken(line: str, begin: int, end: int) -> bool:
    """Whether what stands beside a run of octets, written as they are, is meant as one and is none: 0G, O1, ??."""
    rest, lead = line[end : end + 24], line[max(0, begin - 8) : begin]
    inside = line[begin:end]
    brackets = inside[:1] in ("[", "<", "(", "{") and inside[-1:] in ("]", ">", ")", "}")
    if (match := _NONE_BEHIND.match(rest)) is not None:
        sign = match[0].strip(" ,;:|'\"\t")[:2]
        if (sign[:1] in "[<({" and brackets and sign[:1] == inside[0]) or (
            sign.startswith(("\\x", "0x", "0X")) and inside.startswith(("\\", "0x", "0X", "b", "'", '"'))
        ):
            return True
    if brackets:
        return False
    behind = _BEHIND.match(rest)
    if behind is not None and behind["between"].strip() == _between(inside):
        token = behind["token"]
        follows = _PAIR_BEHIND.match(behind["next"]) is not None
        if _is_meant(token, follows):
            return True
    ahead = _AHEAD.search(lead)
    if ahead is None or ahead["between"].strip() != _between(inside):
        return False
    token = ahead["token"]
    if _PAIR_AHEAD.search(ahead["before"]):
        return _is_meant(token, True)
    return token[0].isdigit() and token[1].isalpha() and not _UNIT.match(token) and token[1] not in _HEX_LETTERS


_HEX_LETTERS = "ABCDEFabcdef"


def _is_meant(token: str, among: bool) -> bool:
    """Whether a token was meant as an octet and is none. `among`: octets stand before it and behind it."""
    if _TOKEN.fullmatch(token) and len(token) == 2:
        return False
    if among:
        return len(token) == 2 and token.lower() not in ("tx", "rx", "to", "in")
    if any(sign.isdigit() for sign in token):
        return len(token) <= 2 and (len(token) == 2 or not token.isalpha())
    return token in ("??", "**")


def _between(inside: str) -> str:
    """What stands between the octets of a run, without spaces."""
    match = re.search(r"[0-9A-Fa-f]([ ]?[,;][ ]?|[:._/|-]|[ \t]{1,2})", inside)
    return match[1].strip() if match is not None else ""


_QUOTES = ("'", '"')
_DATE = re.compile(r"[0-3]\d [01]\d (?:19|20)\d\d")


def _words(line: str, least: int = 0) -> Run | None:
    best: Run | None = None
    for match in _WORDS.finditer(line):
        digits = match[0].replace(" ", "")
        if len(digits) == len(match[0].split()) * 2 and " " in match[0]:
            continue  # pairs, of which one was cut
        if _DATE.fullmatch(match[0]):
            continue
        if _is_keyed(line, match.start(), match.end()):
            return Run(match.start(), match.end(), bytes.fromhex(digits), "digits without space")
        enough = least or _enough(line, match.start(), match.end())
        if len(digits) >= enough and (best is None or len(digits) > 2 * len(best.octets)):
            best = Run(match.start(), match.end(), bytes.fromhex(digits), "digits without space")
    return best


_COMPARED = ("!=", "==")
"""Between two numbers of which a program says whether they are the same."""
_CLOSING = " \t\"'`)]}>,;"
_WAY_AHEAD = re.compile(rf"(?:{WAYS.pattern})[\s:,;=|>\]\"'-]{{1,4}}$", re.IGNORECASE)
_KEY_AHEAD = re.compile(r"(?:raw|hex|data|payload|frame|bytes|octets)['\"]?\s*[:=]\s*['\"]$", re.IGNORECASE)
_AS_FAR = 24


def _is_keyed(line: str, begin: int, end: int) -> bool:
    """Whether digits stand in quotes behind a name that says octets."""
    quoted = line[begin - 1 : begin] in _QUOTES and line[begin - 1 : begin] == line[end : end + 1]
    return quoted and _KEY_AHEAD.search(line[max(0, begin - _AS_FAR) : begin]) is not None


def _enough(line: str, begin: int, end: int) -> int:
    """Digits without space that are octets and no number; fewer where they stand alone at the end, in quotes, or where
    a direction stands before what only closing signs are behind."""
    before, rest = line[begin - 1 : begin], line[end:]
    alone = not rest.strip()
    if line[max(0, begin - 3) : begin].rstrip().endswith(_COMPARED):
        return 18
    if before in ("x", "X"):  # a shorter one is an address
        return 10 if alone else 18
    if before in _QUOTES and rest[:1] == before and before:
        return 8
    if not rest.strip(_CLOSING) and _WAY_AHEAD.search(line[max(0, begin - _AS_FAR) : begin]) is not None:
        return 8
    if not alone:
        return 12
    return 4 if before in ("", "#") else 8 if before in (" ", "\t", "|", ";", ":", "=") else 12


_BEHIND_ONE = r"\s*(?:\(\S{1,6}\)|\([A-Za-z][\w .,:/-]{0,40}\)|'.'|\".\"|[|;].*)?\s*"
_ALONE = re.compile(rf"(?:^|.*[\s:<>\]|#,-])(?P<octet>(?:0[xX])?{H2}){_BEHIND_ONE}")
_ALONE_SAID = re.compile(rf"(?:^|.*[\s:<>\]|#,-])(?P<octet>0[xX]{H2}){_BEHIND_ONE}")
_ALONE_UNPADDED = re.compile(rf"(?:^|.*[\s:<>\]|#,=-])(?P<octet>[0-9A-Fa-f]{{1,3}}){_BEHIND_ONE}")


_VALUE_AHEAD = re.compile(r"\d[.,]\d{1,6}[ ]?[,;\t][ ]?$")
_SAID_AGAIN = re.compile(r"\(0[xX]([0-9A-Fa-f]{1,8})\)")


def _single(line: str, base: int) -> Run | None:
    """One octet, as the last word of a line."""
    match = (_ALONE_SAID.fullmatch(line) or _ALONE.fullmatch(line)) if base == PAIRS_ONLY else None
    if base != PAIRS_ONLY:
        match = _ALONE_UNPADDED.fullmatch(line)
    if match is None:
        return None
    try:
        number = int(match["octet"], base or 16)
        octet = bytes((number,))
    except ValueError:
        return None
    if STAMP in line and _VALUE_AHEAD.search(line, 0, match.start("octet")) is not None:
        return None  # of a table of values
    beside = _SAID_AGAIN.search(line, match.end("octet"))
    if beside is not None and int(beside[1], 16) not in (number, int(match["octet"].lower().removeprefix("0x"), 16)):
        return None  # the number of a register, and what it holds
    return Run(match.start("octet"), match.end("octet"), octet, "one octet")


def number_in(line: str) -> str:
    """The token that one octet would be, as the last word of a line; "" where there is none."""
    match = _ALONE_UNPADDED.fullmatch(line)
    return match["octet"] if match is not None else ""
