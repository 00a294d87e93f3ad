"""The buses that are followed: one of them is shown, the others are listened to meanwhile."""

from __future__ import annotations

from collections.abc import Sequence

from dissectors.findings import Finding
from sniff.analysis.sanitizing import sanitized
from sniff.bus.feed import Feed
from sniff.bus.foreign_rows import ForeignRows
from sniff.filter import FilterError
from sniff.tui.notices import Notice, found, news
from sniff.tui.seats import BusLine, Seat
from sniff.tui.site_meter import SiteMeter


class Buses:
    """`seats`: of each bus; `here`: which of them is shown."""

    def __init__(self, feeds: Sequence[Feed], start_screen: str) -> None:
        self.seats = [Seat.of(each, start_screen) for each in feeds]
        self.here = 0
        self._site = SiteMeter()
        self._polled = 0  # which file was polled last of those that are not shown

    @property
    def shown(self) -> Seat:
        """The bus that is shown."""
        return self.seats[self.here]

    @property
    def others(self) -> list[Seat]:
        """Those that are not."""
        return [seat for number, seat in enumerate(self.seats) if number != self.here]

    @property
    def are_several(self) -> bool:
        """Whether there is another one to show."""
        return len(self.seats) > 1

    @property
    def are_still_read(self) -> bool:
        """Whether a file is not read and judged to its end."""
        return any(seat.is_still_read for seat in self.seats)

    @property
    def lines(self) -> Sequence[BusLine]:
        """What the bar says of each; none where there is only one."""
        return [seat.line(number == self.here) for number, seat in enumerate(self.seats)] if self.are_several else ()

    def after(self, step: int) -> int:
        """Which one comes so many places after the one that is shown."""
        return (self.here + step) % len(self.seats)

    def named(self, name: str) -> int:
        """Which one has that name; the one that is shown where none has."""
        return next((number for number, seat in enumerate(self.seats) if seat.name == name), self.here)

    # -- what they say -----------------------------------------------------------------------------------------

    def site_is_due(self) -> bool:
        """Whether the buses together would say more than they did."""
        return not self.shown.viewing.frozen and self._site.is_due(self.seats)

    def findings(self) -> tuple[Finding, ...]:
        """Of the bus that is shown; where there are several, with what they say together."""
        viewing = self.shown.viewing
        return self._site.findings(self.seats, self.here, viewing.findings(), anew=not viewing.frozen)

    # -- keeping up --------------------------------------------------------------------------------------------

    def poll(self) -> tuple[bool, list[Notice]]:
        """Take what has come of the bus that is shown, and what is due of the others: of captures all, of files one at
        a time, so that keys are answered. Whether anything has come of the first; what is to be said."""
        shown, others, notices = self.shown, self.others, list[Notice]()
        files = [seat for seat in others if not seat.status.live]
        changed = self._poll(shown, notices)
        self._polled += 1
        for seat in [one for one in others if one.status.live] + files[self._polled % max(1, len(files)) :][:1]:
            self._poll(seat, notices)
        return changed, notices

    def work(self) -> bool:
        """Do a piece of what can wait, first for the bus that is shown; whether more is left."""
        return any(seat.feed.work() for seat in (self.shown, *self.others))

    def _poll(self, seat: Seat, notices: list[Notice]) -> bool:
        changed = seat.feed.poll()
        before, seat.status = seat.status, seat.feed.status()
        bus = f"{sanitized(seat.name)}: " if self.are_several else ""
        if before.searching and not seat.status.searching and not seat.status.ended:
            notices.append(found(seat, bus))
            _read_filter_anew(seat)
        if before.reading and not seat.status.reading:  # there is nothing to follow any more
            seat.viewing.follow = False
        if seat.status.second and seat.viewing.foreign is None:
            seat.viewing.foreign = ForeignRows(seat.feed.store, seat.status.second, seat.status.since)
            changed = True
        notices += news(seat, bus)
        return changed


def _read_filter_anew(seat: Seat) -> None:
    """With the settings that were found."""
    try:
        seat.viewing.set_filter(seat.viewing.filter)
    except FilterError:  # it names fields of another protocol
        seat.viewing.set_filter("")
