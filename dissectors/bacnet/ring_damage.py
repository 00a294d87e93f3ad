"""Damage on a ring: whose it is, and of what kind."""

from __future__ import annotations

from dissectors import busiest
from dissectors.bacnet.check_mistakes import data_ways, header_ways
from dissectors.bacnet.frame_types import HEADER, PREAMBLE, data_length, is_encoded, total
from dissectors.bacnet.header import is_whole_header
from dissectors.bacnet.mending import WITHOUT_DATA
from dissectors.bacnet.ring_tally import RingTally
from dissectors.bacnet.turn import Speaker, Turn
from dissectors.checksums import crc8_mstp, crc16_x25
from dissectors.frame import Damage, Flaw, Frame, Header

_CUT = frozenset((Damage.SHORT, Damage.RESTARTED))
_CHECK = 2  # octets behind the data; without both of them nothing contradicts the data
_AT_END = frozenset((Flaw.LAST_MISSING, Flaw.LAST_TWO_MISSING))


def speaker_of(frame: Frame, header: Header, turn: Turn) -> Speaker | None:
    """Who sent a damaged frame: by its header where that is whole, else by whose turn it was. Tells the turn."""
    if is_whole_header(frame) and header.source is not None:
        if header.destination is not None and header.function is not None:
            turn.see(frame, header.function, header.source, header.destination)
        return Speaker(header.source, header.destination, header.function)
    speaker = turn.speaker(frame)
    if speaker is not None and speaker.frame_type is not None and speaker.destination is not None:
        turn.see_likely(frame, speaker.frame_type, speaker.source, speaker.destination)
    return speaker


def count_damage(tally: RingTally, no: int, frame: Frame, speaker: Speaker | None) -> None:
    """Count a damaged frame, in that row, with its sender where there is one."""
    if frame.damage is Damage.HEADER:
        tally.header_errors += 1
    elif frame.damage is Damage.CHECK:
        tally.data_errors += 1
    else:
        tally.cut += 1
    busiest.count(tally.when_damaged, frame.start)
    if speaker is None:
        return
    node = tally.node(speaker.source)
    if is_whole_header(frame):
        node.first = node.first or frame.start
        node.last = frame.end
    node.damaged += 1
    busiest.count(node.when_damaged, frame.start)
    node.damaged_octets += len(frame.octets)
    node.cut_last += only_its_end(frame, speaker)
    node.data_checks.see(no, frame.end, data_ways(frame))
    node.header_checks.see(no, frame.end, header_ways(frame))


def only_its_end(frame: Frame, speaker: Speaker) -> bool:
    """Whether only the last octet, or two, is missing or wrong, as when a driver lets go too early."""
    if frame.repair is not None:
        return frame.repair.flaw in _AT_END
    octets = frame.octets
    if frame.damage is Damage.CHECK and not is_encoded(octets[2]):
        return octets[-2] == crc16_x25(octets[HEADER:-2]) & 0xFF
    if frame.damage in _CUT and is_whole_header(frame) and not is_encoded(octets[2]):
        return len(octets) > HEADER and total(data_length(octets)) - len(octets) == _CHECK
    if len(octets) < HEADER - 2 or octets[2] not in WITHOUT_DATA:
        return False
    due = bytes((*PREAMBLE, octets[2], speaker.destination or 0, speaker.source, 0, 0))
    if octets[2:5] != due[2:5] or speaker.frame_type != octets[2] or speaker.destination is None:
        return False
    if frame.damage in _CUT:
        return octets == due[:-1]
    return frame.damage is Damage.HEADER and octets[:-1] == due and crc8_mstp(due[2:]) != octets[7]
