"""What an exchange says where there is little room: fewer bits in words, so that the numbers behind them are seen too.

Pure. The whole is in `decoding.say`.
"""

from __future__ import annotations

from collections.abc import Sequence

from dissectors.profiles.decoding import Value, each_bit, joined, number, phrases
from dissectors.profiles.model import EntryRole, Profile
from dissectors.readings import Reading

Bits = list[tuple[str, EntryRole]]
_TROUBLE = (EntryRole.FAULT, EntryRole.ALARM)
_MOST_BITS = (2, 1)
"""Bits in words that a status word is left with, one try after the other."""


def say_briefly(profile: Profile | None, readings: Sequence[Reading], room: int) -> str:
    """The same as `say`, with as much left out as `room` characters ask for: all of it fits, or its first number does.

    Bits give way, the last ones of each word: "status running, forward +3; output frequency 45.00 Hz". Where not even
    the first number has room then, names do, too: "running +4; 45.00 Hz; 6.9 A".
    """
    told = list(phrases(profile, readings))
    ways = [[text for _, text in told]]
    ways += [[_with_bits(value, text, most) for value, text in told] for most in _MOST_BITS]
    whole = next((joined(way) for way in ways if len(joined(way)) <= room), None)
    first = next((place for place, (value, _) in enumerate(told) if _is_number(value)), None)
    if whole is not None or first is None:
        return whole or joined(ways[0])
    partly = next((way for way in ways if len(joined(way[: first + 1])) <= room), None)
    return joined(partly or [text for text in map(_bare, told) if text])


def _with_bits(value: Value, text: str, most: int) -> str:
    """A value with its name, and its first bits in words, so many and what is wrong."""
    bits = _bits(value)
    return text if len(bits) <= most else text.replace(", ".join(words for words, _ in bits), _few(bits, most), 1)


def _few(bits: Bits, most: int) -> str:
    said = [words for place, (words, role) in enumerate(bits) if place < most or role in _TROUBLE]
    return ", ".join(said) + (f" +{len(bits) - len(said)}" if len(said) < len(bits) else "")


def _bare(told: tuple[Value, str]) -> str:
    """A value without its name, where its unit or its bits say enough; empty where it says that nothing is wrong."""
    value, text = told
    bits = _bits(value)
    if bits:
        return _few(bits, 1)
    if value.entry is not None and value.words == f"no {value.entry.title}":
        return ""
    return number(value.value, value.entry, value.unit) if _is_number(value) else text


def _is_number(value: Value) -> bool:
    """Whether it is a number with a unit, and not a word."""
    return value.entry is not None and bool(value.unit) and not value.words


def _bits(value: Value) -> Bits:
    entry = value.entry
    if entry is None or value.raw is None or value.bit or not (entry.bits or entry.parts):
        return []
    return each_bit(entry, value.raw)
