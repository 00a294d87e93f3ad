"""Shapes of messages: how rarely chance makes octets look as well formed; a function for each message of the layout.

A field held to some values tells as many bits as chance seldom hits them (a quantity of 1 … 125 of 65536: 9 bits); a
byte count that must agree with a quantity tells all of its bits. No frame is believed for its shape beyond 12 bits.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from math import log2
from typing import Final, NamedTuple

from dissectors.modbus.lengths import MAX_FRAME, Octets
from dissectors.modbus.notation import CHECK, Counted, FieldPlace, Group, Means, Message, counted, places

Shape = Callable[[Octets, int, int], int]
"""(octets, start, length) → bits: how rarely random octets look so well formed (0 … 12), negative when they break
a rule that a healthy device keeps. The frame is complete: all `length` octets are there."""

IMPLAUSIBLE: Final = -6
"""One rule is broken; of a message with several rules, which chance breaks sooner, twice that."""

MOST_BITS: Final = 12

Test = Callable[[Octets, int, int], bool]


class ShapeRule(NamedTuple):
    """What a healthy device keeps, the bits that it tells, and how many things it asks for."""

    holds: Test
    bits: float
    asks: int = 1


def shape_of(message: Message) -> Shape:
    """What tells how well formed a message is."""
    holds = [rule.holds for rule in _rules(message)]
    if not holds:
        return _anything
    bits, penalty = told(message)
    ranges = held(message)
    if len(holds) > 1:
        return _all_held(holds, bits, penalty)
    if ranges and isinstance(ranges[0][1], range) and ranges[0][0].field.size == 2:
        return _word_held(ranges[0][0].at, ranges[0][1], bits, penalty)
    count = counted(message)
    if count is not None and count.quantity is None and not ranges and count.items.means is Means.REGISTERS:
        return _even_held(count.count.at, bits, penalty)
    return _one_held(holds[0], bits, penalty)


def told(message: Message) -> tuple[int, int]:
    """Bits of a message that keeps its rules, and of one that does not."""
    rules = _rules(message)
    selected = sum(8 * each.size for each in message if each.means is Means.SELECTOR and each.only is not None)
    bits = min(MOST_BITS, round(selected + sum(rule.bits for rule in rules)))
    return (bits if rules else 0), IMPLAUSIBLE * min(2, sum(rule.asks for rule in rules))


def held(message: Message) -> tuple[tuple[FieldPlace, Collection[int]], ...]:
    """The fields that are held to some values, and these values."""
    count = counted(message)
    end = count.count.at if count is not None else MAX_FRAME  # the byte count itself holds a quantity behind it
    return tuple((place, place.field.among) for place in places(message) if place.field.among and place.at <= end)


def _rules(message: Message) -> list[ShapeRule]:
    """All that its octets are held to."""
    count = counted(message)
    rules = [_among(place, values) for place, values in held(message)]
    if count is None:
        return rules
    if count.items.means is Means.GROUPS:
        rules.append(_chained(count))
    elif count.quantity is not None:
        rules.append(_agreeing(count, count.quantity))
    elif count.items.size > 1:
        rules.append(_dividing(count))
    return rules


def _anything(octets: Octets, start: int, length: int) -> int:
    return 0


def _word_held(at: int, values: range, bits: int, penalty: int) -> Shape:
    """By far the most frequent: the quantity of a read."""
    least, most = values.start, values.stop - 1

    def shape(octets: Octets, start: int, length: int) -> int:
        return bits if least <= octets[start + at] << 8 | octets[start + at + 1] <= most else penalty

    return shape


def _even_held(at: int, bits: int, penalty: int) -> Shape:
    """The answer to it: an even byte count."""

    def shape(octets: Octets, start: int, length: int) -> int:
        return penalty if octets[start + at] & 1 else bits

    return shape


def _one_held(holds: Test, bits: int, penalty: int) -> Shape:
    def shape(octets: Octets, start: int, length: int) -> int:
        return bits if holds(octets, start, length) else penalty

    return shape


def _all_held(holds: list[Test], bits: int, penalty: int) -> Shape:
    if len(holds) == 2:
        first, second = holds

        def both(octets: Octets, start: int, length: int) -> int:
            return bits if first(octets, start, length) and second(octets, start, length) else penalty

        return both

    def shape(octets: Octets, start: int, length: int) -> int:
        for each in holds:
            if not each(octets, start, length):
                return penalty
        return bits

    return shape


def _among(place: FieldPlace, values: Collection[int]) -> ShapeRule:
    """The field has one of these values."""
    at, size = place.at, place.field.size
    listed = values if isinstance(values, range) else frozenset(values)
    least, most = (values.start, values.stop - 1) if isinstance(values, range) else (min(values), max(values))

    def word_within(octets: Octets, start: int, length: int) -> bool:
        return least <= octets[start + at] << 8 | octets[start + at + 1] <= most

    def word_listed(octets: Octets, start: int, length: int) -> bool:
        return octets[start + at] << 8 | octets[start + at + 1] in listed

    def octet_listed(octets: Octets, start: int, length: int) -> bool:
        return octets[start + at] in listed

    bits = 8 * size - log2(len(listed))
    if size == 1:
        return ShapeRule(octet_listed, bits)
    return ShapeRule(word_within if isinstance(values, range) else word_listed, bits)


def _agreeing(count: Counted, quantity: FieldPlace) -> ShapeRule:
    """The byte count is what so many items take, and the single fields before them."""
    at, size, beside, of = count.count.at, count.count.field.size, count.beside, quantity.at
    bits = count.items.bits

    def agrees(octets: Octets, start: int, length: int) -> bool:
        there = octets[start + at] if size == 1 else octets[start + at] << 8 | octets[start + at + 1]
        many = octets[start + of] << 8 | octets[start + of + 1]
        return there == beside + (many * bits + 7 >> 3)

    return ShapeRule(agrees, 8 * size)


def _dividing(count: Counted) -> ShapeRule:
    """The byte count is that of whole items."""
    at, item = count.count.at, count.items.size

    def divides(octets: Octets, start: int, length: int) -> bool:
        return octets[start + at] % item == 0

    return ShapeRule(divides, log2(item))


def _chained(count: Counted) -> ShapeRule:
    """Groups follow one another, each with its type, and the last ends where the frame does."""
    first, group = count.start, Group.of(count.items.group)

    def chained(octets: Octets, start: int, length: int) -> bool:
        at, end = start + first, start + length - CHECK
        while at + group.size <= end and group.is_begin(octets, at):
            at += group.whole(octets, at)
        return at == end

    return ShapeRule(chained, MOST_BITS, asks=2)
