"""Another token than the one that is followed: given up and used after all, or made by a station that had none."""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.bacnet.limits import T_NO_TOKEN
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_tally import RingTally
from dissectors.frame import Frame

T_LATE_USE = 2 * T_NO_TOKEN
"""So long a token that was given up may still be used, and the two that are there then last."""


@dataclass(slots=True)
class GivenUp:
    """A station that did not use its token, who took the token back, and when it was sent."""

    mac: int
    by: int
    token_end: int


class SecondTokens:
    """`of`: who has another token, or was sent it, as far as seen. `given_up`: the newest that may still be used."""

    def __init__(self, tally: RingTally) -> None:
        self.of: int | None = None
        self.given_up: GivenUp | None = None
        self._tally = tally
        self._until = 0  # ns; two tokens until then are known of

    def uses_given_up(self, no: int, frame: Frame, source: int, doubt: bool) -> bool:
        """Whether this is the late use of a token that was given up: its cause is told once."""
        late = self.given_up
        if late is None or source != late.mac or frame.start - late.token_end > T_LATE_USE:
            return False
        self.given_up = None
        self._tally.node(source).gone = False
        if not doubt:
            gap = frame.start - late.token_end
            self._tally.note(RingEventKind.GIVEN_UP, frame.start, no, source, late.by, gap)
        self._until = frame.end + T_LATE_USE
        self.of = source
        return True

    def are_known(self, time: int) -> bool:
        """Whether two are known of at that time: either may go on, or give way when it hears the other."""
        return time < self._until

    def passed(self, destination: int) -> None:
        """The station was sent the token that is followed: what it had or gave up before is over."""
        if self.of == destination:
            self.of = None
        if self.given_up is not None and self.given_up.mac == destination:
            self.given_up = None
