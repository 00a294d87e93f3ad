"""Pairing on a Modbus TCP connection: an answer bears the transaction number of its request, several may be open."""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.frame import Event, Frame, Header, Role
from dissectors.line import NS_PER_S, Timing
from dissectors.plain_tracker import closed_exchange
from dissectors.tracker import NOTHING_TRACKED, Placement, Tracked, Transaction, Verdict

PATIENCE = 10 * NS_PER_S
"""ns that an answer may take: a gateway waits for its line, and requests wait for one another."""

MOST_OPEN = 256
"""Requests of a connection that wait for their answers; the oldest of more is given up."""

_Key = tuple[int, int]  # transaction, unit


@dataclass(frozen=True, slots=True)
class _Asked:
    """See `plain_tracker.Request`."""

    id: int
    no: int
    frame: Frame
    header: Header
    attempt: int = 1
    of: int | None = None


class TcpTracker:
    """The tracker of one connection."""

    def __init__(self, timing: Timing) -> None:
        self._patience = PATIENCE + timing.latency
        self._tx = 0
        self._open: dict[_Key, _Asked] = {}

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event."""
        if header is None or not isinstance(event, Frame) or len(event.octets) < 7:
            return NOTHING_TRACKED
        before = self.advance(event.start)
        key = event.octets[0] << 8 | event.octets[1], event.octets[6]
        asked = self._open.get(key)
        if header.role is Role.RESPONSE or (header.role is not Role.REQUEST and asked is not None):
            return self._answer(no, event, header, asked, key, before)
        return self._ask(no, event, header, key, before)

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now` (ns)."""
        late = []
        for key, asked in self._open.items():  # the oldest first
            if now - asked.frame.end <= self._patience:
                break
            late.append(key)
        return tuple(self._give_up(key) for key in late)

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: answers could still have come."""
        waiting, self._open = list(self._open.values()), {}
        return tuple(closed_exchange(asked, Verdict.OPEN) for asked in waiting)

    def _ask(self, no: int, frame: Frame, header: Header, key: _Key, before: tuple[Transaction, ...]) -> Tracked:
        if key in self._open:
            before += (self._give_up(key),)
        elif len(self._open) >= MOST_OPEN:
            before += (self._give_up(next(iter(self._open))),)
        self._tx += 1
        self._open[key] = _Asked(self._tx, no, frame, header)
        return Tracked(Placement(no, self._tx, Role.REQUEST, None, key[1]), before)

    def _answer(
        self, no: int, frame: Frame, header: Header, asked: _Asked | None, key: _Key, before: tuple[Transaction, ...]
    ) -> Tracked:
        if asked is None:
            self._tx += 1
            closed = Transaction(
                self._tx, key[1], header.kind, None, no, Verdict.UNSOLICITED, frame.start, frame.end, error=header.error
            )
            return Tracked(Placement(no, self._tx, Role.RESPONSE, key[1]), (*before, closed))
        del self._open[key]
        verdict = Verdict.ANSWERED
        if not frame.ok:
            verdict = Verdict.DAMAGED_ANSWER
        elif frame.octets[7:8] and frame.octets[7] & 0x80:
            verdict = Verdict.EXCEPTION
        closed = closed_exchange(asked, verdict, no, frame, header.error)
        return Tracked(Placement(no, asked.id, Role.RESPONSE, key[1]), (*before, closed))

    def _give_up(self, key: _Key) -> Transaction:
        asked = self._open.pop(key)
        return closed_exchange(asked, Verdict.NO_RESPONSE if asked.frame.ok else Verdict.DAMAGED_REQUEST)
