"""What an exchange says where there is little room: fewer bits in words, so that the numbers behind them are seen too.

Pure. The whole is in `decoding.say`.
"""

from __future__ import annotations

from collections.abc import Sequence

from dissectors.profiles.decoding import Value, each_bit, joined, mark, number, phrases
from dissectors.profiles.model import EntryRole, Profile
from dissectors.readings import Reading

Bits = list[tuple[str, EntryRole]]
Told = list[tuple[Value, str]]
_TROUBLE = (EntryRole.FAULT, EntryRole.ALARM)
_MOST_BITS = (2, 1)
"""Bits in words that a status word is left with, one try after the other."""


def say_briefly(profile: Profile | None, readings: Sequence[Reading], room: int) -> str:
    """The same as `say`, with as much left out as `room` characters ask for: all of it fits, or its first number does.

    Bits give way, the last ones of each word: "status running, forward +3; output frequency 45.00 Hz"; then what says
    that nothing is wrong, and the names of status words. Where not even the first number has room then, all names do:
    "running +4; 45.00 Hz; 6.9 A".
    """
    told = list(phrases(profile, readings))
    worth = [(value, text) for value, text in told if not _is_well(value)]
    ways = [told]
    ways += [[(value, _with_bits(value, text, most)) for value, text in told] for most in _MOST_BITS]
    ways.append([(value, _with_bits(value, text, 1)) for value, text in worth])
    ways.append([(value, _nameless(value, text)) for value, text in worth])
    whole = next((said for said in map(_joined, ways) if len(said) <= room), None)
    if whole is not None or not any(_is_number(value) for value, _ in told):
        return whole or _joined(told)
    partly = (_joined(way) for way in ways if len(_joined(_to_first_number(way))) < room)  # "…" is behind it
    return next(partly, None) or _joined([(value, _bare(value, text)) for value, text in worth])


def _joined(way: Told) -> str:
    return joined([text for _, text in way])


def _to_first_number(way: Told) -> Told:
    return way[: next(place for place, (value, _) in enumerate(way) if _is_number(value)) + 1]


def _with_bits(value: Value, text: str, most: int) -> str:
    """A value with its name, and its first bits in words, so many and what is wrong."""
    bits = _bits(value)
    return text if len(bits) <= most else text.replace(", ".join(words for words, _ in bits), _few(bits, most), 1)


def _few(bits: Bits, most: int) -> str:
    said = [words for place, (words, role) in enumerate(bits) if place < most or role in _TROUBLE]
    return ", ".join(said) + (f" +{len(bits) - len(said)}" if len(said) < len(bits) else "")


def _nameless(value: Value, text: str) -> str:
    """A status word by its first bit alone; what is wrong, and anything else, with its name."""
    bits = _bits(value)
    is_wrong = any(role in _TROUBLE for _, role in bits)
    return _few(bits, 1) if bits and not is_wrong else _with_bits(value, text, 1)


def _bare(value: Value, text: str) -> str:
    """A value without its name, where its unit or its bits say enough."""
    return number(value.value, value.entry, value.unit) + mark(value) if _is_number(value) else _nameless(value, text)


def _is_well(value: Value) -> bool:
    """Whether it says that nothing is wrong: "no fault"."""
    return value.entry is not None and value.words == f"no {value.entry.title}"


def _is_number(value: Value) -> bool:
    """Whether it is a number with a unit, and not a word."""
    return value.entry is not None and bool(value.unit) and not value.words


def _bits(value: Value) -> Bits:
    entry = value.entry
    if entry is None or value.raw is None or value.bit or not (entry.bits or entry.parts):
        return []
    return each_bit(entry, value.raw)
