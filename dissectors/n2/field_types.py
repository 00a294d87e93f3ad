"""The types of the fields of N2: what `fields.py` may give."""

from __future__ import annotations

from dissectors.field_types import FieldType, FieldTypes, Kind, named, texts
from dissectors.n2.commands import COMMANDS, ERRORS, NATIVE, NONE, UNKNOWN
from dissectors.n2.objects import ATTRIBUTES, REGIONS, region_name

_ANSWERS = ("acknowledge", "answer", "negative-acknowledge", "write-value", "unknown")


def types() -> FieldTypes:
    """By name."""
    regions = {number: region_name(number) for number in REGIONS}
    titles = {COMMANDS[code].title: code for code in COMMANDS}
    kinds = [one.kind for one in (*COMMANDS.values(), NATIVE, UNKNOWN, NONE)]
    text, number = Kind.TEXT, Kind.NUMBER
    return {
        "n2.address": FieldType(Kind.STATION, "station spoken to"),
        "n2.command": FieldType(text, "command and sub-command as sent", dict(titles), digits=True),
        "n2.region": FieldType(number, "kind of object", named(regions)),
        "n2.region.name": FieldType(text, "the same as a word", texts(dict.fromkeys(regions.values()))),
        "n2.object": FieldType(number, "number of the object"),
        "n2.attribute": FieldType(number, "attribute of the object"),
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
        "n2.time.tentative": FieldType(text, "a time, as far as it can be guessed", several=False),
        "n2.bits.tentative": FieldType(text, "named bits, as far as they can be guessed"),
        "kind": FieldType(text, "what a frame is", texts(dict.fromkeys((*kinds, *_ANSWERS))), closed=True),
    }
