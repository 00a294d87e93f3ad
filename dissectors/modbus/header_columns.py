"""Headers of RTU frames, as `peek_rtu` gives them, for all frames of a capture at once.

Reads, writes and exceptions by table and gather; other functions, and requests that contradict themselves, by
`peek_rtu` once for each different frame. A property test holds both equal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from dissectors.columns import NONE, ROLES
from dissectors.frame import Check, Damage, FoundBy, Frame, Role
from dissectors.modbus.envelope import RTU_NAME
from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT, FUNCTIONS, Function, is_open_length
from dissectors.modbus.header import exception_name, peek_rtu
from dissectors.modbus.layout import MAX_READ_BITS
from dissectors.modbus.length_columns import common
from dissectors.modbus.ranges import AGREEMENTS, ANSWERED, ASKED, SHARED, Number

if TYPE_CHECKING:
    from dissectors.columns import Codes, Masks, Names, Numbers, Octets, Small, Times

REQUEST, RESPONSE, EITHER, TO_ALL = (
    ROLES.index(role) for role in (Role.REQUEST, Role.RESPONSE, Role.EITHER, Role.BROADCAST)
)
_MOST_NAMES: Final = np.iinfo(np.uint16).max


@dataclass(frozen=True, slots=True)
class HeaderColumns:
    """Headers as in `FrameColumns`, less their names. `known`: False where there was no room for one more name."""

    expected: Numbers
    source: Small
    destination: Small
    role: Codes
    kind: Names
    function: Small
    address: Numbers
    count: Numbers
    ok: Masks
    error: Names
    known: Masks


class Words:
    """Words by number; 0 is none."""

    def __init__(self) -> None:
        self._places: dict[str, int] = {"": 0}

    def place(self, word: str | None) -> int:
        """Its number; NONE when there are too many."""
        if word is None:
            return 0
        if word not in self._places and len(self._places) > _MOST_NAMES:
            return NONE
        return self._places.setdefault(word, len(self._places))

    @property
    def words(self) -> tuple[str, ...]:
        """All of them, by number."""
        return tuple(self._places)


def headers(
    octets: Octets,
    places: Times,
    lengths: Times,
    request: Masks,
    response: Masks,
    damage: Codes,
    names: Words,
) -> HeaderColumns:
    """The headers of frames of a predicted length, good or (damage: check) with a wrong CRC.

    `request`, `response`: the directions that have this length. `names`: where their names are kept.
    """
    size = len(places)
    codes, units = octets[places + 1], octets[places]
    role = _roles(octets, places, codes, request, response)
    role[(role == EITHER) & (units == BROADCAST)] = TO_ALL
    role[(role == REQUEST) & (units == BROADCAST) & _table(lambda function: function.writes)[codes]] = TO_ALL
    answers = role == RESPONSE
    unit = units.astype(np.int16)
    address, count = _addresses(octets, places, codes, role)
    kinds = np.zeros(256, np.uint16)
    for code, function in FUNCTIONS.items():
        kinds[code] = kinds[code | EXCEPTION_BIT] = names.place(function.name)
    error = np.zeros(size, np.uint16)
    faults = codes & EXCEPTION_BIT != 0
    reasons = octets[places[faults] + 2]
    texts = np.zeros(256, np.uint16)
    for code in np.flatnonzero(np.bincount(reasons)).tolist():
        texts[code] = names.place(exception_name(code))
    error[faults] = texts[reasons]
    columns = HeaderColumns(
        lengths.astype(np.int32),
        np.where(answers, unit, NONE).astype(np.int16),
        np.where(answers, NONE, unit).astype(np.int16),
        role,
        kinds[codes],
        (codes & ~np.uint8(EXCEPTION_BIT)).astype(np.int16),
        address,
        count,
        damage == 0,
        error,
        np.ones(size, bool),
    )
    rare = ~common()[codes] | _contradicts_itself(octets, places, codes, role) | (damage != 0)
    _scatter_peeks(columns, np.flatnonzero(rare), octets, places, lengths, damage, names)
    return columns


def _table(says: Callable[[Function], bool]) -> Masks:
    """bool[256]: function codes of which that is true."""
    table = np.zeros(256, bool)
    for code, function in FUNCTIONS.items():
        table[code] = says(function)
    return table


def _roles(octets: Octets, places: Times, codes: Codes, request: Masks, response: Masks) -> Codes:
    """The role by length, and by shape where both directions have it; as if nothing were for all."""
    role = np.where(request, REQUEST, RESPONSE).astype(np.uint8)
    both = np.flatnonzero(request & response)
    code, place = codes[both], places[both]
    quantity = octets[place + 4].astype(np.int32) << 8 | octets[place + 5]
    plausible = (quantity >= 1) & (quantity <= MAX_READ_BITS)
    of_bits = np.where(plausible, EITHER, RESPONSE)
    of_words = REQUEST  # an answer of three data octets breaks a rule in any case
    role[both] = np.where(code <= 0x02, of_bits, np.where(code <= 0x04, of_words, EITHER))
    return role


class _Numbers(NamedTuple):
    """Where numbers stand, by direction and code as one key (0: nowhere). `octets`: those that are no words."""

    at: Codes
    octets: dict[int, Number]

    def read(self, octets: Octets, places: Times, keys: Names) -> Numbers:
        at = self.at[keys]
        there = places + at
        values: Numbers = octets[there].astype(np.int32) << 8 | octets[there + 1]
        values[at == 0] = NONE
        for key, number in self.octets.items():
            which = np.flatnonzero(keys == key)
            values[which] = octets[there[which]] // number.divisor
        return values


@lru_cache(maxsize=1)
def _ranges() -> tuple[_Numbers, _Numbers, Masks]:
    """Where addresses, where quantities stand, and of which messages there is but one."""
    address, quantity = (_Numbers(np.zeros(1024, np.uint8), {}) for _ in range(2))
    single = np.zeros(1024, bool)
    for direction, ranges in enumerate((ASKED, ANSWERED, SHARED)):
        for code, told in ranges.items():
            key = direction << 8 | code
            single[key] = told.single
            for numbers, number in ((address, told.address), (quantity, told.quantity)):
                if number is not None:
                    numbers.at[key] = number.at
                    if number.size == 1:
                        numbers.octets[key] = number
    return address, quantity, single


@lru_cache(maxsize=1)
def _directions() -> Names:
    """By role: the direction of its ranges, as the high octet of a key; the last has none."""
    of = {REQUEST: 0, TO_ALL: 0, RESPONSE: 1, EITHER: 2}
    return np.array([of.get(role, 3) << 8 for role in range(len(ROLES))], np.uint16)


def _addresses(octets: Octets, places: Times, codes: Codes, role: Codes) -> tuple[Numbers, Numbers]:
    """First address and how many."""
    keys = _directions()[role] | codes
    address, quantity, single = _ranges()
    count = quantity.read(octets, places, keys)
    count[single[keys]] = 1
    return address.read(octets, places, keys), count


def _contradicts_itself(octets: Octets, places: Times, codes: Codes, role: Codes) -> Masks:
    """Requests whose byte count does not fit their quantity."""
    wrong = np.zeros(len(places), bool)
    for code, (quantity_at, count_at, bits) in AGREEMENTS.items():
        which = np.flatnonzero((codes == code) & (role != RESPONSE))
        place = places[which]
        quantity = octets[place + quantity_at].astype(np.int32) << 8 | octets[place + quantity_at + 1]
        needed = quantity * bits + 7 >> 3
        wrong[which] = octets[place + count_at] != needed
    return wrong


def _scatter_peeks(
    columns: HeaderColumns,
    which: Times,
    octets: Octets,
    places: Times,
    lengths: Times,
    damage: Codes,
    names: Words,
) -> None:
    """Headers by `peek_rtu`, once for each different frame, put where they belong."""
    told: dict[tuple[bytes, bool], tuple[int, ...]] = {}
    for row in which.tolist():
        place = int(places[row])
        whole, good = octets[place : place + int(lengths[row])].tobytes(), not damage[row]
        header = told.get((whole, good))
        if header is None:
            header = told[whole, good] = _peeked(whole, good, names)
        expected, source, destination, role, kind, function, address, count, ok, error = header
        columns.expected[row] = expected
        columns.source[row], columns.destination[row], columns.role[row] = source, destination, role
        columns.function[row], columns.address[row], columns.count[row] = function, address, count
        columns.ok[row] = ok
        columns.known[row] = kind != NONE and error != NONE
        columns.kind[row], columns.error[row] = max(kind, 0), max(error, 0)


def _peeked(whole: bytes, good: bool, names: Words) -> tuple[int, ...]:
    expected = None if good and is_open_length(whole) else len(whole)
    frame = Frame(
        RTU_NAME,
        whole,
        0,
        0,
        Check.GOOD if good else Check.BAD,
        FoundBy.GAP,
        None if good else Damage.CHECK,
        expected,
    )
    header = peek_rtu(frame)
    return (
        _some(expected),
        _some(header.source),
        _some(header.destination),
        ROLES.index(header.role),
        names.place(header.kind),
        _some(header.function),
        _some(header.address),
        _some(header.count),
        header.ok,
        names.place(header.error),
    )


def _some(value: int | None) -> int:
    return NONE if value is None else value
