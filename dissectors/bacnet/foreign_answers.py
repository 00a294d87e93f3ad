"""Answers that go astray: of a station that was not asked, or to one that did not ask.

Some programs answer every request that they hear, whoever it is for. The invoke id and the service tell: a client gives
each of its requests an id of its own, so that an answer with the id of a request to another station is to that one.
Behind routers any station may speak for others, and what was postponed may come later; both say nothing.
"""

from __future__ import annotations

from dissectors.bacnet import message as messages
from dissectors.bacnet.message import Message
from dissectors.frame import Frame


def answered_for(frame: Frame, before: Frame, asked: Frame | None) -> int | None:
    """Whose request an answer is for, where that is not its sender: of the station that was `asked` and has not
    answered yet, or that answered in the frame before. None where it is not for another's, or nothing tells."""
    answer = _local(frame)
    if answer is None or answer.apdu is None or not answer.apdu.is_answer or answer.apdu.segmented:
        return None
    if asked is not None:
        request = _local(asked)
        if request is not None and request.apdu is not None and request.apdu.is_request and asked.ok:
            return _of_another(answer, request, asked.octets[3], asked.octets[4])
        return None
    first = _local(before)
    if first is None or first.apdu is None or not first.apdu.is_answer:
        return None
    return _of_another(answer, first, before.octets[4], before.octets[3])


def is_astray(frame: Frame, asked: Frame) -> bool:
    """Whether a frame of the station that was `asked` is the answer, but goes to another address than the request came
    from: nobody takes it."""
    if frame.octets[4] != asked.octets[3] or frame.octets[3] == asked.octets[4] or not asked.ok:
        return False
    answer, request = _local(frame), _local(asked)
    if answer is None or answer.apdu is None or not answer.apdu.is_answer or answer.apdu.segmented:
        return False
    return request is not None and request.apdu is not None and request.apdu.is_request and _belongs(answer, request)


def _local(frame: Frame) -> Message | None:
    """What a frame says that is neither for nor from another network."""
    message = messages.read(frame)
    if message is None or message.npdu is None or message.npdu.dnet is not None or message.npdu.snet is not None:
        return None
    return message


def _of_another(answer: Message, first: Message, server: int, client: int) -> int | None:
    if answer.destination != client or answer.source == server:
        return None
    return server if _belongs(answer, first) else None


def _belongs(answer: Message, first: Message) -> bool:
    """Whether both are of one exchange: a request and its answer, or two answers to it."""
    assert answer.apdu is not None
    assert first.apdu is not None
    services = {answer.apdu.service, first.apdu.service} - {None}  # Reject and Abort have none
    return answer.apdu.invoke_id == first.apdu.invoke_id and len(services) == 1
