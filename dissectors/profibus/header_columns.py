"""Headers of many good telegrams at once, as `peek` gives each.

Role, kind, function, access point and refusal depend on a few octets at the begin of a telegram: the same are asked
once. Telegrams with unusual address extensions, and those whose data tell the service (connections of DP-V1, programs
of S7 controllers), are asked one by one, the same octets once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dissectors.columns import NONE, ROLES
from dissectors.frame import Check, FoundBy, Frame, Role
from dissectors.profibus import s7
from dissectors.profibus.control import Control
from dissectors.profibus.header import peek
from dissectors.profibus.telegram import FIXED, HIGHEST, SC, SD2, SD4

if TYPE_CHECKING:
    from dissectors.columns import Codes, FrameColumns, Masks, Names, Numbers, Octets, Small, Times

_ROLES = {role: code for code, role in enumerate(ROLES)}
_REQUEST = np.array([Control(octet).is_request for octet in range(256)])
_PLAIN = 0x40
"""Address extensions below are one access point each, and no segment."""

_FIRST_SERVICE = 49
"""Access points of a slave below belong to connections."""

_EXTENDED, _BROADCAST = 0x80, 127


def masters_shown(frames: FrameColumns) -> set[int]:
    """Who is shown to be a master by good telegrams, as a framer learns it."""
    token, answers = frames.role == _ROLES[Role.TOKEN], frames.role == _ROLES[Role.RESPONSE]
    shown = np.concatenate((frames.source[~answers], frames.destination[answers | token]))
    return {address for address in np.unique(shown).tolist() if 0 <= address <= HIGHEST}


@dataclass(frozen=True, slots=True)
class Headers:
    """Columns of headers, as in `FrameColumns`."""

    source: Small
    destination: Small
    role: Codes
    kind: Names
    function: Small
    address: Numbers
    count: Numbers
    error: Names
    names: tuple[str, ...]


def headers(octets: Octets, offset: Times, length: Times) -> Headers:
    """Of good telegrams."""
    heads = _Heads.of(octets, offset, length)
    keys, plain = heads.keys()
    told, names = np.zeros((len(offset), 5), np.int64), {"": 0}
    rows = np.flatnonzero(plain)
    _, first, which = np.unique(keys[rows], return_index=True, return_inverse=True)
    alike = [_told(octets, int(offset[row]), int(length[row]), names) for row in rows[first].tolist()]
    if alike:
        told[rows] = np.array(alike, np.int64)[which]
    asked: dict[bytes, tuple[int, ...]] = {}
    for row in np.flatnonzero(~plain).tolist():
        begin = int(offset[row])
        whole = octets[begin : begin + int(length[row])].tobytes()
        if whole not in asked:
            asked[whole] = (*_told(octets, begin, len(whole), names), _count(whole))
        told[row], heads.count[row] = asked[whole][:-1], asked[whole][-1]
    role, kind, error, function, address = told.T
    forms: dict[str, Any] = {"role": np.uint8, "kind": np.uint16, "error": np.uint16}
    return Headers(
        source=heads.source.astype(np.int16),
        destination=heads.destination.astype(np.int16),
        role=role.astype(forms["role"]),
        kind=kind.astype(forms["kind"]),
        function=function.astype(np.int16),
        address=address.astype(np.int32),
        count=heads.count.astype(np.int32),
        error=error.astype(forms["error"]),
        names=tuple(names),
    )


def _told(octets: Octets, begin: int, length: int, names: dict[str, int]) -> tuple[int, ...]:
    """Role, kind, error, function and access point of one telegram; new names are added."""
    header = peek(_frame(octets[begin : begin + length].tobytes()))
    kind, error = (names.setdefault(name or "", len(names)) for name in (header.kind, header.error))
    function, address = (NONE if number is None else number for number in (header.function, header.address))
    return _ROLES[header.role], kind, error, function, address


def _count(whole: bytes) -> int:
    count = peek(_frame(whole)).count
    return NONE if count is None else count


def _frame(whole: bytes) -> Frame:
    return Frame("profibus", whole, 0, 0, Check.GOOD, FoundBy.DELIMITER)


@dataclass(frozen=True, slots=True)
class _Heads:
    """The begins of telegrams. `to`, `by`, `control`: octets of checked ones, else 0. `first`, `second`: address
    extensions, in their order. `count`: octets of data; NONE without a frame control octet. `program`: whether they may
    be of an S7 controller."""

    start: Times
    checked: Masks
    to: Times
    by: Times
    control: Times
    first: Times
    second: Times
    source: Times
    destination: Times
    count: Times
    program: Masks

    @classmethod
    def of(cls, octets: Octets, offset: Times, length: Times) -> _Heads:
        """Of good telegrams."""
        start = octets[offset].astype(np.int64)
        long, checked = start == SD2, length > FIXED[SD4]
        body = offset + np.where(long, 4, 1)
        to, by, control, first, second = (
            np.where(checked, octets.take(body + at, mode="clip"), 0).astype(np.int64) for at in range(5)
        )
        token = start == SD4
        address = [octets.take(offset + at, mode="clip").astype(np.int64) for at in (1, 2)]
        destination, source = (
            np.where(token, bare, np.where(checked, one & 0x7F, NONE))
            for bare, one in zip(address, (to, by), strict=True)
        )
        size = length - np.where(long, 6, 3) - 3 - (to >> 7) - (by >> 7)
        count, data = np.where(checked, size, NONE), body + 3
        told = [octets.take(data + at, mode="clip") for at in range(4)]
        program = (
            (count >= s7.LEAST) & (told[0] == s7.ID) & np.isin(told[1], [*s7.KINDS]) & (told[2] == 0) & (told[3] == 0)
        )
        return cls(start, checked, to, by, control, first, second, source, destination, count, program)

    def keys(self) -> tuple[Times, Masks]:
        """A number for all that role, kind, function, access point and refusal depend on, and where it says all."""
        has_to, has_by = self.to >= _EXTENDED, self.by >= _EXTENDED
        dsap = np.where(has_to, self.first + 1, 0)
        ssap = np.where(has_by, np.where(has_to, self.second, self.first) + 1, 0)
        slave = np.where(_REQUEST[self.control], dsap, ssap)
        plain = (dsap <= _PLAIN) & (ssap <= _PLAIN) & ((slave == 0) | (slave > _FIRST_SERVICE)) & ~self.program
        key = np.where(self.checked, 0, np.where(self.start == SC, 1, 2))
        for part, size in (
            (self.control, 256),
            (dsap, 257),
            (ssap, 257),
            (self.count > 0, 2),
            (self.destination == _BROADCAST, 2),
        ):
            key = key * size + part
        return key, plain
