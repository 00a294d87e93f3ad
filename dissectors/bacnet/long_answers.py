"""Answers that are longer than who asked says it can take (ASHRAE 135, 5.2.1 and 20.1.2.5)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from dissectors.bacnet import message as messages
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.apdu import MAX_APDU, PduType
from dissectors.bacnet.frame_types import CARRIES_NPDU, HEADER, is_encoded
from dissectors.findings import Finding, Rule, Severity, Tally, times
from dissectors.frame import Event, Frame, Header
from dissectors.row_columns import RowColumns

if TYPE_CHECKING:
    from dissectors.columns import Masks, Times

LENGTH_RULES = (
    Rule(
        "MS705",
        Severity.NOTE,
        "answer longer than asked for",
        "An answer, or a segment of one, has more octets than the request says that its sender takes (max-APDU-length-"
        "accepted; ASHRAE 135, 20.1.2.5). Only of answers directly behind their requests.",
        "a program that does not look at what the other side takes: it is dropped there, or cut off",
        "the longest message that the station named is set to send, and its firmware",
    ),
)

KEPT = 256
"""Most stations that are counted apart."""

_CRC = 2
_APDU = HEADER + 2
_LEAST = _APDU + MAX_APDU[0] + _CRC
_ROUTED = npdus.NETWORK_MESSAGE | npdus.HAS_DESTINATION | npdus.HAS_SOURCE


class LongAnswers:
    """Fed row by row, or many at once; gives findings at any time."""

    def __init__(self) -> None:
        self._seen: dict[int, tuple[Tally, str]] = {}  # by station, with the first of them in words
        self._before: Event | None = None

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next row."""
        before, self._before = self._before, event
        if header is not None and header.ok and len(event.octets) > _LEAST and header.function in CARRIES_NPDU:
            self._judge(no, before, event)

    def take(self, rows: RowColumns) -> None:
        """Take many rows."""
        if not len(rows):
            return
        first = rows.row(0)
        self.see(first.no, first.event, first.header)
        for place in _candidates(rows).tolist():
            row = rows.row(place)
            self._judge(row.no, rows.row(place - 1).event, row.event)
        self._before = rows.row(len(rows) - 1).event

    def _judge(self, no: int, before: Event | None, event: Event) -> None:
        if not isinstance(before, Frame) or not isinstance(event, Frame) or not (before.ok and event.ok):
            return
        asked, answer = messages.read(before), messages.read(event)
        if asked is None or answer is None or asked.apdu is None or answer.apdu is None or answer.npdu is None:
            return
        request, said = asked.apdu, answer.apdu
        if not request.is_request or not said.is_answer or request.invoke_id != said.invoke_id:
            return
        if (asked.source, asked.destination) != (answer.destination, answer.source) or answer.source is None:
            return
        size, code = len(answer.data) - answer.npdu.body, request.max_apdu
        if code is None or code >= len(MAX_APDU) or size <= MAX_APDU[code]:
            return
        if answer.source in self._seen or len(self._seen) < KEPT:
            words = f"one of {size} octets to MAC {answer.destination}, which takes {MAX_APDU[code]}"
            tally, _ = self._seen.setdefault(answer.source, (Tally(), words))
            tally.add(event.end, no)

    def findings(self) -> Iterable[Finding]:
        """What was found so far."""
        for mac, (tally, words) in self._seen.items():
            yield tally.found(
                LENGTH_RULES[0], f"MAC {mac}", f"sent {times(tally.count)} an answer that is too long, first {words}"
            )


def _candidates(rows: RowColumns) -> Times:
    """Places of rows that may be too long, ascending; the first row is not looked at."""
    import numpy as np

    frames, octets = rows.frames, rows.octets
    carries: Masks = rows.good & np.isin(frames.function, sorted(CARRIES_NPDU))
    places = np.flatnonzero((carries & (frames.length > _LEAST))[1:]) + 1
    before = places - 1
    back = carries[before] & (frames.source[before] == frames.destination[places])
    back &= (frames.destination[before] == frames.source[places]) & (frames.length[before] > _APDU + _CRC + 4)
    places, before = places[back], before[back]
    asks, answers = frames.offset[before], frames.offset[places]
    plain = (octets[asks + HEADER + 1] & _ROUTED == 0) & (octets[answers + HEADER + 1] & _ROUTED == 0)
    encoded = [kind for kind in CARRIES_NPDU if is_encoded(kind)]
    plain &= ~np.isin(frames.function[before], encoded) & ~np.isin(frames.function[places], encoded)
    limits = np.full(16, np.iinfo(np.int64).max)
    limits[: len(MAX_APDU)] = MAX_APDU
    size = frames.length[places].astype(np.int64) - _APDU - _CRC
    fits = size <= limits[octets[asks + _APDU + 1] & 15]
    fits |= octets[asks + _APDU] >> 4 != PduType.CONFIRMED_REQUEST
    found: Times = places[~(plain & fits)]
    return found
