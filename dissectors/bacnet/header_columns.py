"""Headers of many MS/TP frames at once, as `peek` gives them one by one.

Tables by frame type, by the first octet of an APDU and by service give kind and role; what is rare (network messages,
encoded data, cut headers, odd errors) is asked of `peek` itself, once for every different frame.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dissectors.bacnet import names
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.apdu import PduType
from dissectors.bacnet.frame_types import CARRIES_NPDU, HEADER, PREAMBLE, is_encoded
from dissectors.bacnet.frame_types import name as type_name
from dissectors.bacnet.header import DAMAGE_WORDS, peek
from dissectors.bacnet.limits import BROADCAST
from dissectors.bacnet.npdu_columns import bodies
from dissectors.columns import NONE, ROLES
from dissectors.frame import Check, Damage, FoundBy, Frame, Role

if TYPE_CHECKING:
    from collections.abc import Callable

    from dissectors.columns import Codes, Masks, Names, Numbers, Octets, Times

_ODD = 0
"""Where the service is, seen from the begin of an APDU, when there is none."""


class Headers(NamedTuple):
    """Columns of `FrameColumns` that come from `peek`."""

    role: Codes
    kind: Names
    address: Numbers
    error: Names
    names: tuple[str, ...]


class Vocabulary:
    """Names and their places; the first is no name."""

    def __init__(self, names: tuple[str, ...] = ("",)) -> None:
        self._places = {name: place for place, name in enumerate(names)}

    def place(self, name: str | None) -> int:
        """The place of a name; 0 for none."""
        return 0 if name is None else self._places.setdefault(name, len(self._places))

    @property
    def names(self) -> tuple[str, ...]:
        """All names, by place."""
        return tuple(self._places)


def _places(name: Callable[[int], str]) -> Names:
    return np.array([_known.place(name(number)) for number in range(256)], np.uint16)


def _service_name(table: dict[int, str]) -> Callable[[int], str]:
    return lambda service: table.get(service) or f"service-{service}"


def _role(kind: int, destination: int) -> Role:
    """The role of a frame whose header alone is looked at."""
    octets = PREAMBLE + bytes((kind, destination, 0, 0, 0, 0))
    return peek(Frame("mstp", octets, 0, 0, Check.BAD, FoundBy.LENGTH, Damage.HEADER)).role


_known = Vocabulary()
_BY_TYPE = _places(type_name)
_CONFIRMED = _places(_service_name(names.CONFIRMED))
_UNCONFIRMED = _places(_service_name(names.UNCONFIRMED))
_WITHOUT_SERVICE = {4: "segment-ack", 6: "reject", 7: "abort"}
for _name in (*_WITHOUT_SERVICE.values(), *DAMAGE_WORDS.values()):
    _known.place(_name)
_KNOWN = _known.names

_CODES = {role: code for code, role in enumerate(ROLES)}
_BROADCAST, _REQUEST, _RESPONSE, _DATA = (
    np.uint8(_CODES[role]) for role in (Role.BROADCAST, Role.REQUEST, Role.RESPONSE, Role.DATA)
)
_ROLES = np.array([[_CODES[_role(kind, to)] for kind in range(256)] for to in (0, BROADCAST)], np.uint8).ravel()
_CARRIES = np.isin(np.arange(256), list(CARRIES_NPDU))
_ENCODED = np.array([is_encoded(kind) for kind in range(256)])


def _service_place(first: int) -> int:
    """Where the service choice of an APDU is that begins so."""
    segmented = 2 if first & 8 else 0
    places: dict[int, int] = {
        PduType.CONFIRMED_REQUEST: 3 + segmented,
        PduType.UNCONFIRMED_REQUEST: 1,
        PduType.SIMPLE_ACK: 2,
        PduType.COMPLEX_ACK: 2 + segmented,
        PduType.ERROR: 2,
    }
    return places.get(first >> 4, _ODD)


_SERVICE_PLACE = np.array([_service_place(first) for first in range(256)], np.int64)
_BY_PDU = np.full(16, _RESPONSE, np.uint8)
_BY_PDU[[PduType.CONFIRMED_REQUEST, PduType.UNCONFIRMED_REQUEST]] = _REQUEST, _DATA


def headers(octets: Octets, offset: Times, length: Times, damage: Codes, damages: dict[int, Damage]) -> Headers:
    """Headers of frames, in which `damage` is 0 for good ones and else a key of `damages`."""
    kinds, destination = octets.take(offset + 2), octets.take(offset + 3)
    vocabulary = Vocabulary(_KNOWN)
    role = _ROLES.take(kinds + ((destination == BROADCAST).astype(np.int64) << 8))
    kind = _BY_TYPE.take(kinds)
    address = np.full(len(offset), NONE, np.int32)
    error = np.zeros(len(offset), np.uint16)
    for code, meant in damages.items():
        error[damage == code] = vocabulary.place(DAMAGE_WORDS[meant])
    rows = np.flatnonzero(_CARRIES.take(kinds) & (damage == 0))
    if len(rows):
        data = _Data(octets, offset[rows] + HEADER, length[rows] - HEADER - 2)
        data.role, data.kind = role[rows], kind[rows]
        data.read(_ENCODED.take(kinds[rows]), vocabulary)
        _ask_peek(data, octets, offset[rows], length[rows], vocabulary)
        role[rows], kind[rows], address[rows], error[rows] = data.role, data.kind, data.address, data.error
    return Headers(role, kind, address, error, vocabulary.names)


class _Data:
    """Good frames that carry an NPDU, as they are read; `odd`: which of them `peek` must be asked about.

    `begin`: place of the NPDU among all octets; `size`: its octets, negative where there are none.
    """

    role: Codes
    kind: Names

    def __init__(self, octets: Octets, begin: Times, size: Times) -> None:
        self.octets, self.begin, self.size = octets, begin, size
        self.odd = np.zeros(len(begin), bool)
        self.address = np.full(len(begin), NONE, np.int32)
        self.error = np.zeros(len(begin), np.uint16)

    def read(self, encoded: Masks, vocabulary: Vocabulary) -> None:
        """Network header, APDU, object or error."""
        control = self._octet(self.begin + 1)
        self.odd |= encoded | (self.size < 2) | (self._octet(self.begin) != npdus.VERSION)
        self.odd |= control & npdus.NETWORK_MESSAGE != 0
        at, cut = bodies(self.octets, self.begin, self.size, control)
        self.odd |= cut | (at >= self.size)
        first = self._octet(self.begin + at)
        self._without_service(at, first, vocabulary)
        service = at + _SERVICE_PLACE.take(first)
        has_service = (_SERVICE_PLACE.take(first) != _ODD) & ~self.odd
        self.odd |= has_service & (service >= self.size)
        has_service &= ~self.odd
        pdu = first >> 4
        choice = self._octet(self.begin + service)
        kind = np.where(pdu == PduType.UNCONFIRMED_REQUEST, _UNCONFIRMED.take(choice), _CONFIRMED.take(choice))
        self.kind = np.where(has_service, kind, self.kind)
        self.role = np.where(has_service & (self.role != _BROADCAST), _BY_PDU.take(pdu), self.role)
        is_error = pdu == PduType.ERROR
        self._errors(np.flatnonzero(has_service & is_error), service + 1, vocabulary)
        sequence = self._octet(self.begin + at + 2 + (pdu == PduType.CONFIRMED_REQUEST))
        first_part = (first & 8 == 0) | (pdu != PduType.CONFIRMED_REQUEST) & (pdu != PduType.COMPLEX_ACK)
        self._objects(np.flatnonzero(has_service & ~is_error & (first_part | (sequence == 0))), service + 1)

    def _octet(self, places: Times) -> Octets:
        return self.octets.take(places, mode="clip")

    def _without_service(self, at: Times, first: Octets, vocabulary: Vocabulary) -> None:
        rows = np.flatnonzero((_SERVICE_PLACE.take(first) == _ODD) & ~self.odd)
        pdu = first[rows] >> 4
        self.odd[rows] |= (pdu > PduType.ABORT) | (at[rows] + 2 >= self.size[rows])
        rows = rows[~self.odd[rows]]
        pdu = first[rows] >> 4
        for number, name in _WITHOUT_SERVICE.items():
            self.kind[rows[pdu == number]] = vocabulary.place(name)
        answers = (pdu == PduType.REJECT) | (first[rows] & 1 != 0)
        self.role[rows] = np.where(self.role[rows] == _BROADCAST, _BROADCAST, np.where(answers, _RESPONSE, _DATA))
        reason = self._octet(self.begin[rows] + at[rows] + 2)
        for number, words in ((PduType.REJECT, _rejected), (PduType.ABORT, _aborted)):
            self.error[rows[pdu == number]] = _spoken(reason[pdu == number].astype(np.int64), words, vocabulary)

    def _errors(self, rows: Times, parameters: Times, vocabulary: Vocabulary) -> None:
        """Class and code, each an enumeration of one octet: 91 class 91 code."""
        at = self.begin[rows] + parameters[rows]
        usual = (parameters[rows] + 4 <= self.size[rows]) & (self._octet(at) == 0x91) & (self._octet(at + 2) == 0x91)
        self.odd[rows] |= ~usual
        rows, at = rows[usual], at[usual]
        number = self._octet(at + 1).astype(np.int64) << 8 | self._octet(at + 3)
        self.error[rows] = _spoken(number, _class_and_code, vocabulary)

    def _objects(self, rows: Times, parameters: Times) -> None:
        """The instance of the object that is named first, or second after a process id, as in COV notifications."""
        begin, at, size = self.begin[rows], parameters[rows], self.size[rows]
        tag = self._octet(begin + at)
        named = ((tag == 0x0C) | (tag == 0xC4)) & (at + 5 <= size)
        named &= ~((tag == 0x0C) & (at + 5 < size) & (self._octet(begin + at + 5) == 0x1C))  # that is a process id
        self.address[rows[named]] = self._instance(begin[named] + at[named])
        process = ~named & (at < size) & (tag & 0xF8 == 0x08) & (tag & 7 <= 4)
        rows, begin, at, size, tag = rows[process], begin[process], at[process], size[process], tag[process]
        at = at + 1 + (tag & 7)
        for wanted in (0x1C, 0x2C):
            named = (at + 5 <= size) & (self._octet(begin + at) == wanted)
            self.address[rows[named]] = self._instance(begin[named] + at[named])
            at = at + 5 * named

    def _instance(self, at: Times) -> Numbers:
        """The lower 22 bits of the four octets after `at`."""
        high = (self._octet(at + 2) & np.uint8(0x3F)).astype(np.int32)
        return high << 16 | self._octet(at + 3).astype(np.int32) << 8 | self._octet(at + 4)


def _rejected(reason: int) -> str:
    return f"reject {names.name('RejectReason', reason)}"


def _aborted(reason: int) -> str:
    return f"abort {names.name('AbortReason', reason)}"


def _class_and_code(number: int) -> str:
    return f"{names.name('ErrorClass', number >> 8)} {names.name('ErrorCode', number & 0xFF)}"


def _spoken(numbers: Times, words: Callable[[int], str], vocabulary: Vocabulary) -> Names:
    """The place of what each number says."""
    said, which = np.unique(numbers, return_inverse=True)
    return np.array([vocabulary.place(words(number)) for number in said.tolist()], np.uint16)[which]


def _ask_peek(data: _Data, octets: Octets, offset: Times, length: Times, vocabulary: Vocabulary) -> None:
    """What `peek` says of the odd ones, asked once for all that are the same."""
    known: dict[bytes, tuple[int, int, int, int]] = {}
    for row in np.flatnonzero(data.odd).tolist():
        begin = int(offset[row])
        whole = octets[begin : begin + int(length[row])].tobytes()
        said = known.get(whole)
        if said is None:
            header = peek(Frame("mstp", whole, 0, 0, Check.GOOD, FoundBy.LENGTH))
            address = NONE if header.address is None else header.address
            said = _CODES[header.role], vocabulary.place(header.kind), address, vocabulary.place(header.error)
            known[whole] = said
        data.role[row], data.kind[row], data.address[row], data.error[row] = said
