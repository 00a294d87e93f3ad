"""Numbers and texts that name nobody, for captures that are given away."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import filterfalse
from typing import Protocol

from dissectors.frame import Frame

BLANK = ord("x")

SHORTEST_TEXT = 4
"""Printable octets in a row that are taken for a text where nothing says what they are."""


class Pseudonyms:
    """Numbers instead of numbers, one for one, in the order of their appearance. `kept` ones stay as they are.

    A number's pseudonym is of its own class (masters and slaves, addresses and reserved ones), so that what is
    forbidden to one class stays so. A number of no class stays as it is.
    """

    def __init__(self, *classes: range, kept: Iterable[int]) -> None:
        self._known = {number: number for number in kept}
        self._used = set(self._known)
        self._classes = [(numbers, iter(numbers), reversed(numbers)) for numbers in classes]

    def of(self, number: int) -> int:
        """The pseudonym of a number; itself when all are used up."""
        return self._named(number, is_sure=True)

    def of_doubtful(self, number: int) -> int:
        """The pseudonym of a number out of a damaged frame. It may be nobody's, or somebody's who is heard of later: it
        gets one from the end, so that the first ones are left for those that are sure."""
        return self._named(number, is_sure=False)

    def _named(self, number: int, *, is_sure: bool) -> int:
        if number not in self._known:
            both = next((ends for numbers, *ends in self._classes if number in numbers), None)
            free = iter(()) if both is None else both[0] if is_sure else both[1]
            name = next(filterfalse(self._used.__contains__, free), number)
            self._known[number] = name
            self._used.add(name)
        return self._known[number]


class Renamer(Protocol):
    """What renames the frames of one protocol; each keeps its length, and its damage if it has one.

    `stations`: the numbers that it gives stations. None where others cannot know them: devices that the capture names
    by station are left out then.
    """

    @property
    def stations(self) -> Pseudonyms | None:
        """As above; an attribute will do."""
        ...

    def __call__(self, frame: Frame) -> bytes:
        """The octets of the frame under another name."""
        ...


class Blanks:
    """Texts instead of texts: as long, saying nothing, yet the same for the same and others for others.

    What differs between two answers goes on differing, as far as the length allows: the first text of a length is
    blank, later ones end with their number among those of that length, in letters from "a" on.
    """

    def __init__(self) -> None:
        self._numbers: dict[int, dict[bytes, int]] = {}

    def of(self, text: bytes) -> bytes:
        """The blank of a text; BLANK alone for those that are too many for their length."""
        known = self._numbers.setdefault(len(text), {})
        number = known.get(text, len(known))
        if number == len(known) < MOST_BLANKS:
            known[text] = number
        letters = _letters(number)
        return bytes([BLANK]) * (len(text) - len(letters)) + letters if len(letters) <= len(text) else _blank(text)


MOST_BLANKS = 10_000
"""Texts of one length that are told apart."""


def is_blank(text: str) -> bool:
    """Whether a text may be the blank of another: it says nothing of what stood there."""
    return len(text) >= SHORTEST_TEXT and not text.rstrip("abcdefghij").strip(chr(BLANK)) and text[0] == chr(BLANK)


def _blank(text: bytes) -> bytes:
    return bytes([BLANK]) * len(text)


def _letters(number: int) -> bytes:
    """0: nothing; then "a" … "j", "aa" … of ten letters."""
    found = b""
    while number:
        number, rest = divmod(number - 1, 10)
        found = bytes([ord("a") + rest]) + found
    return found


def without_text(octets: bytes, blanked: Callable[[bytes], bytes] = _blank) -> bytes:
    """Runs of printable octets blanked; `blanked`: what stands for a text, as long as it is."""
    result = bytearray(octets)
    begin = 0
    for at in range(len(octets) + 1):
        if at < len(octets) and 32 <= octets[at] < 127:
            continue
        if at - begin >= SHORTEST_TEXT:
            result[begin:at] = blanked(octets[begin:at])
        begin = at + 1
    return bytes(result)


def inflicted(damaged: bytes, whole: bytes, renamed: bytes) -> bytes:
    """What happened to `whole`, so that `damaged` came, done to `renamed` (as long as `whole`).

    Octets missing at an end are left out there, a swap of the last two is a swap again where that shows, every other
    error is XORed.
    """
    missing = len(whole) - len(damaged)
    if missing < 0:
        return damaged
    swapped = renamed[:-2] + renamed[-2:][::-1]
    if damaged != whole and swapped != renamed and damaged == whole[:-2] + whole[-2:][::-1]:
        return swapped
    front = min(range(missing + 1), key=lambda at: _errors(damaged, whole[at:]))
    window = zip(damaged, whole[front:], renamed[front:], strict=False)
    return bytes(was ^ right ^ new for was, right, new in window)


def _errors(damaged: bytes, whole: bytes) -> int:
    """Octets that differ, in the same places."""
    return sum(a != b for a, b in zip(damaged, whole, strict=False))


def hex_octet(digits: bytes) -> int | None:
    """The value of two hexadecimal digits; None where they are none."""
    try:
        return int(digits, 16) if len(digits) == 2 and digits.isalnum() else None
    except ValueError:
        return None
