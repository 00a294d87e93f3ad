"""Answers that the master had and this tap did not hear: the master goes on as after one.

No NAE gives up before 250 ms, and each repeats then. So who asks something else sooner, after one try, and far sooner
than it repeats, had an answer. A tool that looks who is there is impatient, and asks nothing but that. A log without
times does not tell how soon the next command came.
"""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.line import MS
from dissectors.n2.masters import HASTE, OpenCommand

SOON = 250 * MS
"""Shortest message timeout that an NAE can be given, ns (JCI help, N2 trunk)."""

ONLY_LOOKS = "identify"
"""Kind of the command that asks who is there."""


@dataclass(slots=True)
class Patience:
    """How long the master waits for an answer, as far as its repeats tell: `shortest`, ns."""

    shortest: int = SOON
    has_times: bool = True

    def is_unheard(self, waited: int, is_again: bool, attempt: int, kind: str) -> bool:
        """Whether the next command, `waited` ns behind an unanswered one, shows that it was answered.

        `is_again`: it is the same. `attempt`, `kind`: of the unanswered one.
        """
        if is_again:
            if waited >= HASTE:  # else it was given again, or asked twice
                self.shortest = min(self.shortest, waited)
            return False
        return self.has_times and attempt == 1 and kind != ONLY_LOOKS and 4 * waited < 3 * self.shortest

    def tells(self, asked: OpenCommand, attempt: int, then: OpenCommand | None) -> bool:
        """The same of frames; `then`: the newest command behind the unanswered one."""
        if then is None or then.row != asked.row + 1 or not (asked.frame.ok and then.frame.ok):
            return False
        again = asked.frame.octets == then.frame.octets
        return self.is_unheard(then.frame.start - asked.frame.end, again, attempt, asked.command.type.kind)
