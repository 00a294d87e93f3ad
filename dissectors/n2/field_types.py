"""The types of the fields of N2: what `fields.py` may give."""

from __future__ import annotations

from dataclasses import replace

from dissectors.field_types import FieldType, FieldTypes, Kind, named, station, texts, whole
from dissectors.n2.commands import COMMANDS, ERRORS, NATIVE, NONE, UNKNOWN
from dissectors.n2.objects import ATTRIBUTES, REGIONS, region_name

_ANSWERS = ("acknowledge", "answer", "negative-acknowledge", "write-value", "unknown")

_BY_REQUEST = (
    *("n2.address", "n2.region", "n2.region.name", "n2.object", "n2.attribute", "n2.attribute.name", "n2.value"),
    *("n2.changed.tentative", "n2.changed.value.tentative", "n2.changed.status.tentative"),
)
"""Fields of answers that only their request tells."""


def types() -> FieldTypes:
    """By name."""
    regions = {number: region_name(number) for number in REGIONS}
    titles = {COMMANDS[code].title: code for code in COMMANDS}
    kinds = [one.kind for one in (*COMMANDS.values(), NATIVE, UNKNOWN, NONE)]
    functions: dict[str, int | str] = {
        name: int(code.ljust(2, "0"), 16) for code, one in COMMANDS.items() for name in (one.kind, one.title)
    }
    text, number = Kind.TEXT, Kind.NUMBER
    found = {
        "n2.address": station(says="station spoken to"),
        "n2.command": FieldType(text, "command and sub-command as sent", dict(titles), digits=True),
        "n2.region": whole(8, "kind of object", named(regions)),
        "n2.region.name": FieldType(text, "the same as a word", texts(dict.fromkeys(regions.values()))),
        "n2.object": whole(8, "number of the object"),
        "n2.attribute": whole(8, "attribute of the object"),
        "n2.attribute.name": FieldType(
            text, "the same as words", texts(dict.fromkeys(one.name for one in ATTRIBUTES.values()))
        ),
        "n2.value": FieldType(number, "value written"),
        "n2.data": FieldType(text, "characters that follow the named fields", digits=True, several=False),
        "n2.acknowledge": FieldType(text, "A or N", texts("AN"), closed=True),
        "n2.error": FieldType(text, "error code as sent", {words: code for code, words in ERRORS.items()}, digits=True),
        "n2.error.name": FieldType(text, "the same in words", texts(ERRORS.values())),
        "n2.checksum": FieldType(text, "check as sent, two characters", digits=True),
        "n2.checksum.status": FieldType(number, "state of the check", {"Bad": 0, "Good": 1, "Not present": 3}),
        "n2.changed.tentative": FieldType(text, "objects that the answer to a poll tells of"),
        "n2.changed.value.tentative": FieldType(text, "their values", digits=True),
        "n2.changed.status.tentative": FieldType(text, "their status, two hex digits each", digits=True),
        "n2.time.tentative": FieldType(text, "a time, as far as it can be guessed", several=False),
        "n2.bits.tentative": FieldType(text, "named bits, as far as they can be guessed"),
        "func": whole(8, "command and sub-command as one octet", functions),
        "addr": station(),
        "register": whole(16, "kind and number of the object as two octets"),
        "count": FieldType(number, never=True),
        "error": FieldType(text, words=texts(ERRORS.values())),
        "kind": FieldType(text, "what a frame is", texts(dict.fromkeys((*kinds, *_ANSWERS))), closed=True),
    }
    for name in _BY_REQUEST:
        found[name] = replace(found[name], by_request=True)
    return found
