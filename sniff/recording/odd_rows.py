"""Rows of which columns do not say all (`Table.odd`), as values that JSON holds, and back.

What comes from a file is not trusted: `row_of` raises ValueError for values that are none of a row.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Any, TypeVar

from dissectors.frame import (
    Assembly,
    Check,
    Damage,
    Flaw,
    FoundBy,
    Frame,
    Header,
    LineError,
    Mark,
    Noise,
    Place,
    Reason,
    Repair,
    Role,
)
from dissectors.tracker import Placement
from sniff.engine.engine import Row

Member = TypeVar("Member", bound=Enum)

_FAR = 1 << 63

LAYOUT = """\
  noise: ["noise", start, end, place, reason, marks]
  frame: ["frame", start, end, check, found, damage, expected, skipped, slack, marks, flags, repair, assembly,
          header, placement]
  marks: [[octet, bits: 1 parity, 2 framing, 4 break, 8 overrun], ...]; repair: [flaw, octets] or null;
  assembly: [octets, numbers of frames, places that are missing] or null;
  header: [source, destination, role, kind, function, address, count, ok, error];
  placement: [transaction, role, source, destination] or null. Octets are in hexadecimal digits.
"""


def values_of(row: Row) -> list[Any]:
    """A row without its number, its protocol and its octets. Raises ValueError for one that no file keeps."""
    event, header, placed = row.event, row.header, row.placement
    if row.searched is not None:
        raise ValueError("heard while settings were searched for")
    marks = [[mark.offset, mark.error.value] for mark in event.marks]
    if isinstance(event, Noise):
        return ["noise", event.start, event.end, event.place.value, event.reason.value, marks]
    if header is None or header.protocol != event.protocol:
        raise ValueError("a frame without a header of its own")
    repair, assembly = event.repair, event.assembly
    return [
        "frame",
        event.start,
        event.end,
        event.check.value,
        event.found.value,
        None if event.damage is None else event.damage.value,
        event.expected,
        event.skipped,
        event.slack,
        marks,
        list(event.flags),
        None if repair is None else [repair.flaw.value, repair.octets.hex()],
        None if assembly is None else [assembly.octets.hex(), list(assembly.frames), list(assembly.missing)],
        [
            header.source,
            header.destination,
            header.role.value,
            header.kind,
            header.function,
            header.address,
            header.count,
            header.ok,
            header.error,
        ],
        None if placed is None else [placed.tx, placed.role.value, placed.source, placed.destination],
    ]


def row_of(values: Sequence[Any], no: int, protocol: str, octets: bytes) -> Row:
    """The row again. Raises ValueError."""
    kind, start, end, *rest = _listed(values)
    if kind == "noise":
        place, reason, marks = rest
        noise = Noise(octets, _number(start), _number(end), Place(place), Reason(reason), _marks(marks))
        return Row(no, noise)
    if kind != "frame":
        raise ValueError(kind)
    check, found, damage, expected, skipped, slack, marks, flags, repair, assembly, header, placed = rest
    frame = Frame(
        protocol,
        octets,
        _number(start),
        _number(end),
        Check(check),
        FoundBy(found),
        None if damage is None else Damage(damage),
        _maybe(expected),
        _number(skipped),
        _number(slack),
        _marks(marks),
        tuple(_text(flag) for flag in _listed(flags)),
        None if repair is None else _repair(*_listed(repair)),
        None if assembly is None else _assembly(*_listed(assembly)),
    )
    return Row(
        no, frame, _header(protocol, *_listed(header)), None if placed is None else _placed(no, *_listed(placed))
    )


def _repair(flaw: Any, octets: Any) -> Repair:
    return Repair(Flaw(flaw), bytes.fromhex(_text(octets)))


def _assembly(octets: Any, frames: Any, missing: Any) -> Assembly:
    return Assembly(bytes.fromhex(_text(octets)), _numbers(frames), _numbers(missing))


def _header(
    protocol: str,
    source: Any,
    destination: Any,
    role: Any,
    kind: Any,
    function: Any,
    address: Any,
    count: Any,
    ok: Any,
    error: Any,
) -> Header:
    ways = _maybe(source), _maybe(destination), Role(role)
    what = _maybe(function), _maybe(address), _maybe(count)
    if not isinstance(ok, bool):
        raise ValueError(ok)
    return Header(protocol, *ways, _text(kind), *what, ok, None if error is None else _text(error))


def _placed(no: int, tx: Any, role: Any, source: Any, destination: Any) -> Placement:
    return Placement(no, _number(tx), Role(role), _maybe(source), _maybe(destination))


def _marks(values: Any) -> tuple[Mark, ...]:
    return tuple(Mark(_number(offset), LineError(_number(bits) & 15)) for offset, bits in map(_listed, _listed(values)))


def _listed(values: Any) -> list[Any]:
    if not isinstance(values, list):
        raise ValueError(values)
    return values


def _numbers(values: Any) -> tuple[int, ...]:
    return tuple(map(_number, _listed(values)))


def _number(value: Any) -> int:
    if type(value) is not int or not -_FAR <= value < _FAR:
        raise ValueError(value)
    return value


def _maybe(value: Any) -> int | None:
    return None if value is None else _number(value)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(value)
    return value
