"""The questions in Modbus requests: coils, inputs, registers, by table and number; a 23 reads some, writes others."""

from __future__ import annotations

import numpy as np

from dissectors.columns import Codes, FrameColumns, Octets
from dissectors.frame import Frame
from dissectors.modbus.envelope import adu
from dissectors.modbus.functions import ITEMS_ASKED
from dissectors.modbus.layout import MESSAGES
from dissectors.modbus.notation import Means, first
from dissectors.modbus.ranges import AGREEMENTS
from dissectors.questions import Question, Span, Stems

_SINGLE = {
    code: address.at
    for code, messages in MESSAGES.items()
    if messages.writes
    and code not in AGREEMENTS
    and (address := first(messages.request, Means.ADDRESS)) is not None
    and first(messages.request, Means.QUANTITY) is None
}
"""Of requests that write one thing: where its number stands."""

_STEMS = np.zeros(256, np.int64)
"""By function: octets from the unit on that say what is asked, the values not among them; 0 for all of them."""
for _code, _at in _SINGLE.items():
    _STEMS[_code] = _at + 2
for _code, _agreement in AGREEMENTS.items():
    _STEMS[_code] = _agreement.count_at


def question(frame: Frame) -> Question:
    """See `dissectors.questions.Questions`."""
    octets = adu(frame)
    if len(octets) < 2:
        return Question()
    code, spans = octets[1], list[tuple[int, int | None, bool]]()
    if code in ITEMS_ASKED:
        at = ITEMS_ASKED[code][0]
        spans.append((at - 2, at, False))
    if code in AGREEMENTS:
        at = AGREEMENTS[code].quantity_at
        spans.append((at - 2, at, True))
    elif code in _SINGLE:
        spans.append((_SINGLE[code], None, True))
    return Question(
        tuple(
            Span(MESSAGES[code].space, _word(octets, at), 1 if count is None else _word(octets, count), writes=writes)
            for at, count, writes in spans
            if len(octets) >= (at if count is None else count) + 2
        )
    )


def rtu_stems(frames: FrameColumns, octets: Octets) -> Stems:
    """Of RTU requests."""
    code: Codes = octets.take(frames.offset + 1, mode="clip")
    return _stems(frames, code, 0, 1)


def ascii_stems(frames: FrameColumns, octets: Octets) -> Stems:
    """Of ASCII requests: a colon, and two characters an octet."""
    high, low = (_nibbles(octets.take(frames.offset + at, mode="clip")) for at in (3, 4))
    code: Codes = (high << 4 | low).astype(np.uint8)
    return _stems(frames, code, 1, 2)


def _stems(frames: FrameColumns, code: Codes, head: int, width: int) -> Stems:
    whole = frames.length.astype(np.int64)
    told = _STEMS[code]
    length = np.where(told > 0, np.minimum(head + told * width, whole), whole)
    return Stems(frames.offset, frames.offset + length, np.full(len(frames), -1, np.int64))


def _nibbles(characters: Codes) -> Codes:
    """What hexadecimal digits of either case are worth; anything for others."""
    worth: Codes = ((characters & 0x0F) + np.where(characters & 0x40, 9, 0)).astype(np.uint8)
    return worth & np.uint8(0x0F)


def _word(octets: bytes, at: int) -> int:
    return octets[at] << 8 | octets[at + 1]
