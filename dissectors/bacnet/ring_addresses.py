"""Addresses: those that may not stand in a frame, and which device says that it has one."""

from __future__ import annotations

from dissectors.bacnet import message as messages
from dissectors.bacnet.frame_types import FrameType, is_encoded
from dissectors.bacnet.limits import BROADCAST, MAX_DATA, MAX_MASTER
from dissectors.bacnet.ring_events import EVENTS_MAX, RingEventKind
from dissectors.bacnet.ring_tally import NodeTally, RingTally
from dissectors.bacnet.values import ObjectId
from dissectors.frame import Frame


def check_addresses(tally: RingTally, no: int, frame: Frame, frame_type: int, source: int, destination: int) -> None:
    """Forbidden addresses and lengths."""
    length = frame.octets[5] << 8 | frame.octets[6]
    illegal = source == BROADCAST
    if frame_type <= FrameType.POLL_FOR_MASTER and (source > MAX_MASTER or destination > MAX_MASTER):
        illegal = True
    if illegal or (length > MAX_DATA and not is_encoded(frame_type)):
        tally.note(RingEventKind.ILLEGAL, frame.start, no, source, destination, length)


def see_i_am(tally: RingTally, no: int, frame: Frame, source: int, node: NodeTally) -> None:
    """Two devices that say I-Am from one address share it; those behind a router do not count."""
    message = messages.read(frame)
    if message is None or message.npdu is None or message.apdu is None or message.npdu.snet is not None:
        return
    if message.parameters[:1] != b"\xc4" or len(message.parameters) < 5:
        return
    instance = ObjectId.unpack(message.parameters[1:5]).instance
    before, node.device = node.device, instance
    if instance in node.devices:
        if before not in (None, instance):
            tally.note(RingEventKind.SECOND_DEVICE, frame.start, no, source, None, instance)
        return
    if len(node.devices) >= EVENTS_MAX:
        return
    node.devices.append(instance)
    if len(node.devices) > 1:
        tally.note(RingEventKind.OTHER_DEVICE, frame.start, no, source, None, instance)
