"""A token that was repeated and then used: whether its receiver had heard the first one too, and uses both.

A station that is only slow has the first token before it and finds the second one when it has passed the first on. It
then sends at once, while the next station does: octets are damaged there, or it is heard again sooner than it may
repeat its own token. One that was deaf to the first token uses the second, and all goes on in order.
"""

from __future__ import annotations

from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.limits import T_USAGE_TIMEOUT, T_USAGE_TIMEOUT_MAX
from dissectors.frame import Frame

_TOKEN = int(FrameType.TOKEN)


def is_too_soon(gap: int, slack: int, turnaround: int) -> bool:
    """Whether a token, or a poll, `gap` ns (up to `slack` more) behind the same one is a copy: who repeats its own
    waits for Tusage_timeout. Half of it is granted to programs that do not; not where it may have come directly
    behind."""
    return gap + slack < T_USAGE_TIMEOUT // 2 or (gap < turnaround and gap + slack < T_USAGE_TIMEOUT)


class RepeatedToken:
    """Follows the newest repeated token. `of`: who was sent it, None where there is none to follow. Times in ns."""

    __slots__ = ("_passed", "_sent", "_slack", "_used", "of")

    def __init__(self) -> None:
        self.of: int | None = None
        self._sent = 0  # end of the first of the two
        self._used: int | None = None  # from there to the first frame of its receiver
        self._passed: int | None = None  # when the receiver had passed it on
        self._slack = 0  # of that frame

    def repeat(self, mac: int, sent: int) -> None:
        """The token for `mac` came again; the one before it ended at `sent`."""
        self.of, self._sent, self._used, self._passed = mac, sent, None, None

    def see(self, frame: Frame, frame_type: int, source: int, destination: int) -> int | None:
        """A good frame: how late the first token was used, where this one shows that both were."""
        if self._passed is not None:
            both = source == self.of and frame.start - self._passed + self._slack < T_USAGE_TIMEOUT // 2
            used = self._end()
            return used if both else None
        if source == self.of:
            if self._used is None:
                self._used = max(0, frame.start - self._sent)
            if frame_type == _TOKEN and destination != source:
                self._passed, self._slack = frame.end, frame.slack
        elif frame_type == _TOKEN:
            self.forget()
        return None

    def disturbed(self, start: int) -> int | None:
        """Octets that are no good frame begin at `start`: how late the first token was used, where both were."""
        both = self._passed is not None and start - self._passed < T_USAGE_TIMEOUT_MAX
        used = self._end()
        return used if both else None

    def _end(self) -> int | None:
        used = self._used
        self.forget()
        return used

    def forget(self) -> None:
        """There is none to follow any more."""
        self.of = self._used = self._passed = None
