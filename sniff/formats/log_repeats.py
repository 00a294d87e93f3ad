"""Lines of a log that tell again what others of it told: told by its first lines together. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import groupby, pairwise

from dissectors.checksums import ends_with_crc16
from dissectors.line import MS
from sniff.formats.log_lines import Line
from sniff.formats.log_shapes import BUFFER
from sniff.formats.log_times import FASTEST

FEW = 3
"""Lines of one sort from which on they are more than chance."""

_MOSTLY = 0.8
_GROWN = 0.2


def growing(data: Sequence[Line]) -> frozenset[str]:
    """Labels whose lines are the begin of the next one again and again: a buffer, each time more came."""
    grown, cut, many = Counter[str](), Counter[str](), Counter(line.family for line in data)
    for line, after in pairwise(data):
        alike = (line.family, line.way) == (after.family, after.way)
        if alike and _goes_on(line.octets, after.octets):
            grown[line.family] += len(line.octets) > 1
            cut[line.family] += not ends_with_crc16(line.octets)  # a message that is whole may come again
    return frozenset(
        name
        for name, lines in many.items()
        if (grown[name] >= FEW and grown[name] >= _GROWN * lines)
        or (cut[name] > 1 and 2 * cut[name] >= lines)
        or BUFFER.search(name) is not None
    )


def _goes_on(octets: bytes, after: bytes) -> bool:
    """Whether the octets that follow are the same with more behind."""
    return len(after) > len(octets) and after.startswith(octets)


def echoing(lines: Sequence[Line], main: str) -> set[str]:
    """Labels whose lines nearly all repeat the line of another label before, at the same time: no answer comes as
    soon."""
    many, again = Counter[str](), Counter[str]()
    for before, line in pairwise(lines):
        many[line.family] += 1
        is_other = before.family != line.family and line.spelling == before.spelling
        again[line.family] += is_other and line.octets == before.octets and are_at_once(before, line)
    return {
        name
        for name, count in again.items()
        if name not in (main, "") and ((count >= FEW and count >= _MOSTLY * many[name]) or 1 < count == many[name])
    }


def are_at_once(before: Line, line: Line) -> bool:
    """Whether a line has the time of the one before, by a clock that would tell an answer from its request."""
    told, stamp = before.stamp, line.stamp
    if told is None or stamp is None or stamp.tick > MS:
        return False
    return abs(stamp.time - told.time) < FASTEST * len(line.octets)


def doubled(data: Sequence[Line]) -> frozenset[tuple[str, str]]:
    """Labels and directions whose messages all stand there twice at the same time, where what goes the other way does
    not: a program that writes each of its reads in two places."""
    sorts: dict[tuple[str, str], list[int]] = {}
    for (family, way), group in groupby(data, lambda line: (line.family, line.way)):
        for octets, same in groupby(group, lambda line: line.octets):
            lines = list(same)
            twice = len(lines) % 2 == 0 and all(map(are_at_once, lines[::2], lines[1::2]))
            sorts.setdefault((family, way), []).append(twice and len(octets) > FEW)
    ways = {way for _, way in sorts}
    return frozenset(
        sort for sort, twice in sorts.items() if len(twice) > 1 and all(twice) and sort[1] and len(ways) > 1
    )
