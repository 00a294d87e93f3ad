"""A request given back at once and cut short, also where its octets come in several pieces."""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.frame import Event, Frame
from dissectors.modbus.exchange import is_begin_of


@dataclass(slots=True)
class CutEcho:
    """What stands behind the newest frame that may be a request, as far as it repeats its begin.

    `request`: that frame, None where nothing of the kind came last. `within`: ns behind it in which an echo begins.
    `octets`: of it so far, all pieces together.
    """

    request: Frame | None = None
    within: int = 0
    octets: bytes = b""

    def takes(self, event: Event, latest: int) -> bool:
        """Whether an event is such a piece. Further ones may come until `latest` ns behind the request."""
        if self.request is None:
            return False
        gap = max(0, event.start - self.request.end)
        if gap >= (latest if self.octets else self.within):
            return False
        together = self.octets + event.octets
        if not is_begin_of(together, self.request.octets):
            return False
        self.octets = together
        return True
