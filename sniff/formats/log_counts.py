"""What became of the lines of a log, and which way its times go. Pure."""

from __future__ import annotations

from sniff.formats.log_lines import Kind

FALLING, FALLS_LEAST = 4, 8
"""Times that go back for one that goes on, and how many at least, where the newest line stands first."""


class Order:
    """How often times go on and back from one to the next."""

    def __init__(self) -> None:
        self.rises = self.falls = 0
        self._before: int | None = None

    def add(self, time: int) -> None:
        """The next."""
        if self._before is not None:
            self.rises += time > self._before
            self.falls += time < self._before
        self._before = time

    @property
    def is_newest_first(self) -> bool:
        """Whether they go back nearly always."""
        return self.falls > FALLING * self.rises


class Counts:
    """Lines of a log, by what became of them. `first`: number of the first that was not understood."""

    def __init__(self) -> None:
        self.data = self.same = self.text = self.strange = self.first = self.completed = 0
        self.unwrapped = 0

    def add(self, was: Kind, kind: Kind, number: int) -> None:
        """Count a line. `was`: what it turned out to be."""
        if was is Kind.OCTETS:
            self.data += 1
        elif was is Kind.STRANGE:
            self.pass_over(number)
        elif was is Kind.TEXT:
            self.text += 1
        elif was is Kind.SHAPE and kind in (Kind.OCTETS, Kind.ROW):
            self.same += 1

    def pass_over(self, number: int) -> None:
        """Count a line that was not understood."""
        self.strange += 1
        self.first = self.first or number
