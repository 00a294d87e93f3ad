"""Octets that stand in groups, with signs between those that are one number: `01 03 | 0000 | 00 02`. Pure."""

from __future__ import annotations

import re
from dataclasses import replace

from dissectors.checksums import ends_with_crc16
from sniff.formats.log_octets import Run, octets_in
from sniff.formats.log_spellings import H2

LEAST = 6
"""Octets of a line in groups; fewer may be numbers of anything."""

LONGEST = 1200
"""Characters of a line with groups; nobody writes a longer one by hand."""

_GROUP = rf"[\[(]?{H2}(?:[ :]?{H2}){{0,63}}[\])]?"
_SIGN = r"(?P<sign>[ ]?[-|/,;][ ]?|[ ]{2}|(?<=[\])])(?=[\[(]))"
_GROUPS = re.compile(
    rf"(?<![0-9A-Za-z_.:#/-]){_GROUP}{_SIGN}{_GROUP}(?P<more>(?:(?P=sign){_GROUP}){{0,255}})[\s,;)\]]*$"
)
_NEXT = re.compile(rf"[\])]?{_SIGN}[\[(]?{H2}")
"""Behind octets, where more of them stand."""
_UNPADDED = re.compile(r"(?<![0-9A-Za-z_#.])[0-9A-Fa-f]{1,3}(?:[ ,;:/-]{1,2}[0-9A-Fa-f]{1,3}(?![0-9A-Za-z_])){4}")
"""Where five numbers stand side by side."""
_SPELLINGS = ("pairs", "pairs in brackets", "digits without space", "one octet")
_BASES = (16, 10)


def groups_in(line: str, run: Run | None) -> Run | None:
    """The run with the groups around it, up to the end of the line; as it is where there are none."""
    if run is not None and (run.spelling not in _SPELLINGS or run.broken or ends_with_crc16(run.octets)):
        return run
    if len(line) > LONGEST or (run is not None and _NEXT.match(line, run.end) is None):
        return run
    match = _GROUPS.search(line)
    if match is None or (run is not None and not match.start() <= run.begin <= run.end <= match.end()):
        return run
    if not match["more"] and match["sign"].strip() not in ("-", "/"):
        return run  # a column beside another
    octets = bytes.fromhex("".join(re.findall(H2, match[0])))
    shown = "".join(chr(octet) for octet in octets)
    if len(octets) < LEAST or any(group in shown for group in re.findall(r"[A-F]{2,}", match[0])):
        return run  # its characters, perhaps
    return Run(match.start(), match.end(), octets, "pairs")


def unpadded_in(line: str, run: Run | None) -> Run | None:
    """A message with its check in numbers that have only the digits they need, in a log that has pairs: `2 4 0 8c b2`.
    As it is where there is none."""
    if (run is not None and len(run.octets) > 1) or _UNPADDED.search(line) is None:
        return run
    for base in _BASES:
        found = octets_in(line, base)
        is_run = found is not None and found.spelling.startswith("numbers") and len(found.octets) >= LEAST - 1
        if found is not None and is_run and ends_with_crc16(found.octets):
            return replace(found, spelling="pairs")
    return run
