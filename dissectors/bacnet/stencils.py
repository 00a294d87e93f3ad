"""Stencils of MS/TP frames: no check, no invoke ID of requests and acks; reals are numbers."""

from __future__ import annotations

from functools import lru_cache

from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.apdu import SEGMENTED, PduType
from dissectors.bacnet.frame_types import HEADER, FrameType
from dissectors.frame import Role
from dissectors.stencil import Form, Needs, Stencil

_ROUTED = npdus.NETWORK_MESSAGE | npdus.HAS_DESTINATION | npdus.HAS_SOURCE
_APDU = HEADER + 2
"""Where it begins behind a network header without addresses."""
_LOCAL = ((HEADER, 0xFF, npdus.VERSION), (HEADER + 1, _ROUTED, 0))
_PIECE = 0xF0 | SEGMENTED
_REAL_ACK = 29
"""Octets of an answer to ReadProperty, of a real, without array index: context tags 0, 1 and 3, object and property of
one octet."""
_REAL = 22


@lru_cache(1024)
def mstp_stencil(role: Role, kind: str, length: int) -> Stencil | None:
    """See `dissectors.stencil.Stencils`."""
    check = (length - 2, length - 1)
    if length < _APDU + 5:
        return None
    needs: Needs
    if role is Role.REQUEST:
        needs = ((2, 0xFF, FrameType.DATA_EXPECTING_REPLY), *_LOCAL, (_APDU, _PIECE, PduType.CONFIRMED_REQUEST << 4))
        return _of_object(kind, length, needs, _APDU + 4, (_APDU + 2, *check))
    if role is not Role.RESPONSE:
        return None
    needs = ((2, 0xFF, FrameType.DATA_NOT_EXPECTING_REPLY), *_LOCAL)
    if length == _APDU + 5:
        return Stencil((*needs, (_APDU, 0xF0, PduType.SIMPLE_ACK << 4)), (_APDU + 1, *check))
    needs = (*needs, (_APDU, _PIECE, PduType.COMPLEX_ACK << 4))
    numbers: tuple[tuple[int, Form], ...] = ()
    if kind == "read-property" and length == _REAL_ACK:
        tags = ((_REAL - 4, 0x19), (_REAL - 2, 0x3E), (_REAL - 1, 0x44), (_REAL + 4, 0x3F))
        needs, numbers = (*needs, *((place, 0xFF, tag) for place, tag in tags)), ((_REAL, Form.REAL),)
    return _of_object(kind, length, needs, _APDU + 3, (_APDU + 1, *check), numbers)


def _of_object(
    kind: str,
    length: int,
    needs: Needs,
    begin: int,
    unread: tuple[int, ...],
    numbers: tuple[tuple[int, Form], ...] = (),
) -> Stencil:
    """Where the service's first parameter is an object with context tag 0, its instance is a number."""
    if kind in ("read-property", "write-property") and length >= begin + 7:
        return Stencil((*needs, (begin, 0xFF, 0x0C)), unread, ((begin + 1, Form.INSTANCE), *numbers))
    return Stencil(needs, unread, numbers)
