"""Pairing on a Modbus TCP connection: an answer bears the transaction number of its request, several may be open."""

from __future__ import annotations

from dissectors.frame import Event, Frame, Header, Role
from dissectors.line import NS_PER_S, Timing
from dissectors.numbered_exchanges import NumberedExchanges
from dissectors.tracker import NOTHING_TRACKED, Placement, Tracked, Transaction, Verdict

PATIENCE = 10 * NS_PER_S
"""ns that an answer may take: a gateway waits for its line, and requests wait for one another."""

MOST_OPEN = 256
"""Requests of a connection that wait for their answers; the oldest of more is given up."""


class TcpTracker:
    """The tracker of one connection."""

    def __init__(self, timing: Timing) -> None:
        self._exchanges = NumberedExchanges(PATIENCE + timing.latency, MOST_OPEN)

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event."""
        if header is None or not isinstance(event, Frame) or len(event.octets) < 7:
            return NOTHING_TRACKED
        before = self.advance(event.start)
        transaction, unit = event.octets[0] << 8 | event.octets[1], event.octets[6]
        number = transaction, unit
        answers = header.role is not Role.REQUEST and self._exchanges.is_open(number)
        if header.role is Role.RESPONSE or answers:
            closed = self._exchanges.answer(number, no, event, header, _unusual(event))
            return Tracked(Placement(no, closed.id, Role.RESPONSE, unit), (*before, closed))
        tx, over = self._exchanges.ask(number, no, event, header)
        return Tracked(Placement(no, tx, Role.REQUEST, None, unit), before + over)

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now` (ns)."""
        return self._exchanges.advance(now)

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: answers could still have come."""
        return self._exchanges.close()


def _unusual(answer: Frame) -> Verdict | None:
    """What an answer is that is no plain one."""
    if not answer.ok:
        return Verdict.DAMAGED_ANSWER
    return Verdict.EXCEPTION if answer.octets[7:8] and answer.octets[7] & 0x80 else None
