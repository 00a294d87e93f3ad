"""The meaning of a frame to its device: its values by name, before the raw numbers. Pure, total.

A frame alone often does not say: an answer needs its request, a register its profile. Whoever knows both makes a
`Meaning` of them; a protocol's `Dissector.line` puts it into the line of the list, `Meaning.items` into the tree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from dissectors.frame import Frame
from dissectors.profiles.brief_words import say_briefly
from dissectors.profiles.decoding import Value, brief_title, decode, in_range, number, range_words, said_title, say
from dissectors.profiles.model import Entry, Profile
from dissectors.profiles.properties import due_property
from dissectors.readings import PlaceName, Reading

Span = tuple[int, int]
"""Octets of a frame: the first, and the one behind the last."""

Spans = Callable[[Frame, Sequence[Reading]], Sequence[Span | None]]
"""Where each reading of a frame stands in its octets (`Dissector.spans`)."""


@dataclass(frozen=True, slots=True)
class Node:
    """One line of a tree that a protocol makes itself. `begin`, `end`: octets of what it was made of, end exclusive."""

    name: str
    text: str = ""
    begin: int | None = None
    end: int | None = None
    children: tuple[Node, ...] = ()


@dataclass(frozen=True, slots=True)
class Item:
    """One value in words. `place`: where it is; `title`: what it is, empty where nobody knows; `text`: the value with
    its unit, and its bits where they say more; `value`: None for what is only part of another one. `parts`: its named
    bits and what came beside it, as names and texts. `brief`: its name where there is little room, empty where that is
    its place."""

    reading: Reading
    place: str
    title: str
    text: str
    value: Value | None = None
    parts: tuple[tuple[str, str], ...] = ()
    brief: str = ""

    @property
    def name(self) -> str:
        """`Register 2524h (wire 0x2524) output frequency`."""
        return f"{self.place} {self.title}".rstrip()


@dataclass(frozen=True, slots=True)
class Meaning:
    """What is known of a frame besides its octets.

    `station`: whose values they are, None for all stations; `request`: what it answers, None where it is no answer or
    nobody heard the question. `refused`: the maker's words for the exception code that it carries. `asked`: the places
    that a request speaks of without a value (`dissectors.readings.Asks`). `written`: what an answer confirms. `noun`:
    what the people of its protocol call a station.
    """

    station: int | None
    profile: Profile | None
    readings: tuple[Reading, ...] = ()
    refused: str = ""
    request: Frame | None = None
    asked: tuple[Reading, ...] = ()
    written: tuple[Reading, ...] = ()
    noun: str = "station"

    @property
    def who(self) -> str:
        """The device: "drive 3", "all drives"; "station 3" or "MAC 3" without a profile."""
        noun = self.noun if self.profile is None else self.profile.noun
        return f"all {noun}s" if self.station is None else f"{noun} {self.station}"

    @property
    def words(self) -> str:
        """What it says in one line: "status running, forward; output current 12.3 A"; empty without a profile."""
        if self.profile is None:
            return ""
        return self.refused or say(self.profile, self.readings) or self._question() or self._confirmation()

    def briefly(self, room: int) -> str:
        """What `about` says, in `room` characters where leaving out makes it fit."""
        said = self.about
        if len(said) <= room or self.profile is None or self.refused or not self.readings:
            return said
        device = f"{self.who}: " if self.station is None else ""
        brief = say_briefly(self.profile, self.readings, room - len(device))
        return device + brief if brief else said

    def _question(self) -> str:
        """ "read status, fault, output frequency"; what the profile does not know is left out."""
        titles = self._titles(self.asked)
        return f"{self.asked[0].words or 'read'} {titles}" if titles else ""

    def _confirmation(self) -> str:
        """ "frequency command acknowledged": an answer that repeats nothing of what it confirms but where that is."""
        titles = self._titles(self.written)
        return f"{titles} acknowledged" if titles else ""

    def _titles(self, readings: tuple[Reading, ...]) -> str:
        if self.profile is None:
            return ""
        titles: list[str] = []
        for one, more in _runs(self.profile, readings):
            entry = self.profile.at(one.space, one.address)
            if entry is not None and more is not None:
                titles.append(f"{entry.title.removesuffix(f' {entry.name}')}s {entry.name} … {more.name}")
                continue
            lacks = self.profile.lacks(one.space, one.part)
            if lacks or (entry is not None and not entry.reserved):
                title = brief_title(entry) if entry is not None else f"{one.space} {one.address}"
                part = f" {one.part.replace('.', ' ')}" if one.part else ""
                titles.append(title + part + (" (none by its manual)" if lacks else ""))
        return ", ".join(dict.fromkeys(titles))

    def questions(self, place: PlaceName) -> Iterator[tuple[str, str]]:
        """The places that are asked for, each with what is there."""
        profile = self.profile
        for one in self.asked:
            entry = profile.at(one.space, one.address) if profile is not None else None
            offset = 0 if profile is None else profile.address_offset
            kept = profile is not None and profile.is_reserved(one.space, one.address)
            where = place(one, _number(entry, one, offset, kept), offset)
            title = "reserved" if kept else "" if entry is None else _titled(entry)
            lacks = profile is not None and profile.lacks(one.space, one.part)
            without = [f"no {one.part or 'present-value'} by its manual"] if lacks else []
            yield where, "; ".join(part for part in (title, *without) if part)

    @property
    def about(self) -> str:
        """The same, with the device where the line cannot tell it: a broadcast is for all."""
        said = self.words
        return f"{self.who}: {said}" if said and self.station is None else said

    def items(self, place: PlaceName) -> Iterator[Item]:
        """Every reading in words, in the order of the wire; the second word of a number says whose it is."""
        values: dict[int, list[Value]] = {}
        for value in decode(self.profile, self.readings):
            values.setdefault(id(value.reading), []).append(value)
        for reading in self.readings:
            yield self._item(reading, values.get(id(reading), []), place)

    def spans_in(self, frame: Frame, spans: Spans | None) -> Sequence[Span | None]:
        """Where each reading stands in the frame; None where nobody can tell."""
        return [None] * len(self.readings) if spans is None else spans(frame, self.readings)

    def _item(self, reading: Reading, values: list[Value], place: PlaceName) -> Item:
        profile = self.profile
        entry = profile.at(reading.space, reading.address) if profile is not None else None
        offset = 0 if profile is None else profile.address_offset
        kept = profile is not None and profile.is_reserved(reading.space, reading.address)
        numbered = _number(entry, reading, offset, kept)
        where = place(reading, numbered, offset)
        raw = number(reading.value)
        if reading.words:
            raw = reading.words + (f" ({raw})" if reading.raw is not None else "")
        if entry is None:
            value = values[0] if values else None
            title, brief = ("reserved", f"reserved {numbered}") if kept else ("", "")
            return Item(reading, where, title, raw, value, reading.beside, brief)
        if reading.part:
            due = due_property(entry, reading)
            text = raw if due is None else f"{raw}; the manual has {due}"
            if profile is not None and profile.lacks(reading.space, reading.part):
                text = f"{raw}; the manual has none"
            about = f"of {_titled(entry)}"
            part = reading.part.replace(".", " ")
            return Item(reading, where, about, text, values[0] if values else None, reading.beside, part)
        if entry.reserved:
            return Item(reading, where, "reserved", raw, None, reading.beside, f"reserved {numbered}")
        if not values:  # the first register of the number stands for all of it
            word = entry.word_of(reading.address)
            return Item(reading, where, said_title(word), raw, None, reading.beside, brief_title(word))
        first, *bits = values
        doubt = " (?)" if entry.doubt or not reading.sure else _beyond(first)
        titled = _titled(first.entry or entry)
        why = (("doubtful", entry.doubt),) if entry.doubt else ()
        parts, text = (*_parts(first.entry or entry, bits), *why, *reading.beside), _text(first, raw) + doubt
        return Item(reading, where, titled, text, first, parts, brief_title(first.entry or entry))


def _number(entry: Entry | None, reading: Reading, offset: int, kept: bool) -> str:
    """The manual's number of a place; where it has no entry, as its registers are counted."""
    if entry is None:
        return f"{reading.address - offset:04X}h" if offset or kept else ""
    multiple = entry.kind.registers > 1 and reading.address != entry.address
    return f"{reading.address - offset:04X}h" if multiple else entry.number


def _titled(entry: Entry) -> str:
    """What an entry is called, and in quotes what the device itself calls it, which an operator's client shows."""
    title = said_title(entry)
    return f'{title} "{entry.label}"' if entry.label and entry.label.lower() != title.lower() else title


def _text(value: Value, raw: str) -> str:
    """The value for people, and what stood on the wire where that is not the same."""
    text = raw if value.says_nothing else value.text
    held = raw if value.raw is None or isinstance(value.reading.value, float) else str(value.raw)
    return text if text in (held, f"{held} {value.unit}") else f"{text} ({held})"


def _beyond(value: Value) -> str:
    """ " (out of the range 0 … 400 Hz)": of a value that the profile does not allow."""
    entry = value.entry
    if entry is None or in_range(entry, value.value):
        return ""
    return f" (out of the range {range_words(entry)})"


def _parts(entry: Entry, values: Sequence[Value]) -> tuple[tuple[str, str], ...]:
    """Named bits and numbers in bits, as names and texts."""
    parts = []
    for bit, value in zip(entry.bits, values, strict=False):
        parts.append(
            (f"bit {bit.number:X} {bit.name}", f"{value.raw} ({value.words})" if value.words else f"{value.raw}")
        )
    for part, value in zip(entry.parts, values[len(entry.bits) :], strict=False):
        words = f"{value.raw} ({value.words})" if value.words else f"{value.raw}"
        parts.append((f"bits {part.high:X}-{part.low:X} {part.name}", words))
    return tuple(parts)


RUN = 3
"""So many parameters of a group without words of their own, one behind the other, are said as a span."""


def _runs(profile: Profile, asked: Sequence[Reading]) -> Iterator[tuple[Reading, Entry | None]]:
    """The places that are asked for; of a run of parameters that have but a number, the first with the last entry."""
    at = 0
    while at < len(asked):
        end = at + 1
        first = _nameless(profile, asked[at])
        while first is not None and end < len(asked) and _follows(asked[end - 1], asked[end]):
            entry = _nameless(profile, asked[end])
            if entry is None or entry.title.removesuffix(entry.name) != first.title.removesuffix(first.name):
                break
            end += 1
        if end - at < RUN:
            yield asked[at], None
            at += 1
        else:
            yield asked[at], profile.at(asked[end - 1].space, asked[end - 1].address)
            at = end


def _nameless(profile: Profile, one: Reading) -> Entry | None:
    """The parameter there, where its title is its number."""
    entry = profile.at(one.space, one.address)
    return entry if entry is not None and not one.part and entry.title.endswith(f" {entry.name}") else None


def _follows(before: Reading, one: Reading) -> bool:
    return (before.space, before.address + 1) == (one.space, one.address)
