"""A disk that does not keep up, told when it begins, whenever it has become twice as bad, and when it is over. Pure."""

from __future__ import annotations

from dissectors.line import NS_PER_S

SLOW = 17 * NS_PER_S // 10
"""ns that something may be on its way to the file: in good times it is there within 1 s."""

AGAIN = 60 * NS_PER_S
"""ns within which a jam that is no worse than the one before is not told again."""


class DiskWatch:
    """Fed what a recorder says of itself; gives what is news. `behind`: ns, as of now, 0 while all is well."""

    def __init__(self) -> None:
        self.behind = 0
        self._worst = 0  # of the present jam
        self._told_at: int | None = None
        self._told = 0  # how bad it was when it was told last
        self._telling = False
        self._lost = 0

    def see(self, now: int, behind: int, syncing: int, lost: int) -> str | None:
        """How it stands at `now`: age of the oldest thing not written, how long a sync has been running (ns), octets
        lost so far. What is to be told, if anything."""
        late = max(behind if behind >= SLOW else 0, syncing if syncing >= SLOW else 0)
        self.behind = late
        if late:
            return self._jam(now, late, behind, lost)
        if not self._worst:
            self._lost = lost
            return None
        worst, self._worst = self._worst, 0
        gone, self._lost = lost - self._lost, lost
        telling, self._telling = self._telling, False
        if not telling and not gone:
            return None
        said = f"{gone} octets lost" if gone else "nothing lost"
        return f"the disk has caught up: it was {_seconds(worst)} behind, {said}"

    def excuse(self, lost: int) -> None:
        """What is behind now has a reason that is said elsewhere: no jam begins, and none is over for that."""
        self.behind = 0
        if not self._worst:
            self._lost = lost

    def _jam(self, now: int, late: int, behind: int, lost: int) -> str | None:
        self._worst = max(self._worst, late)
        recent = self._told_at is not None and 0 <= now - self._told_at < AGAIN
        if late < 2 * self._told if self._telling else recent and late < 2 * self._told:
            return None
        self._told_at, self._told, self._telling = now, late, True
        what = f"{_seconds(late)} behind" if behind >= SLOW else f"syncing takes {_seconds(late)}"
        gone = f"; {lost - self._lost} octets lost, memory is full" if lost > self._lost else ""
        return f"disk slow: {what}{gone}"


def _seconds(time: int) -> str:
    return f"{time / NS_PER_S:.0f} s"
