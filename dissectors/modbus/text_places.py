"""Where texts stand in an answer, by the layout: never an octet that says how many follow."""

from __future__ import annotations

from collections.abc import Iterator

from dissectors.modbus.layout import MESSAGES
from dissectors.modbus.notation import Means, Message, has_text

_WITH_TEXT = {code: messages.response for code, messages in MESSAGES.items() if has_text(messages.response)}


def text_places(pdu: bytes) -> Iterator[tuple[int, int]]:
    """Begin and end of each text, by octets from the function code; in a damaged answer as far as can be followed."""
    message = _WITH_TEXT.get(pdu[0]) if pdu else None
    if message is None:
        return
    at = 1
    for field in message:
        if at >= len(pdu):
            return
        if field.is_list:
            yield from _of_groups(field.group, pdu, at) if field.means is Means.GROUPS else [(at, len(pdu))]
            return
        if field.only is not None and pdu[at] != field.only:  # nobody knows what the rest is
            yield at + field.size, len(pdu)
            return
        at += field.size


def _of_groups(group: Message, pdu: bytes, at: int) -> Iterator[tuple[int, int]]:
    while at < len(pdu):
        counted = 0
        for field in group:
            if field.is_list:
                yield at, min(at + counted, len(pdu))
                at += counted
            else:
                if field.means is Means.BYTES:
                    counted = int.from_bytes(pdu[at : at + field.size], "big")
                at += field.size
