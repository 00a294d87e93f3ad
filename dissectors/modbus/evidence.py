"""What was seen on a Modbus line as a whole: what `findings.py` gathers and `judgement.py` judges."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from dissectors.findings import Tally
from dissectors.line import NS_PER_S, Timing
from dissectors.modbus.station_record import Cycles, Station

_SENDERS_KEPT = 300

PAUSE_MARGIN = 5
"""So many times the adapter's delay must fit into 1.5 characters before pauses inside frames are judged."""


def _no_words(unit: int, code: int) -> str:
    return ""


@dataclass(slots=True)
class Evidence:
    """What was seen on the bus. Times are ns.

    `hasty`: requests after another that nothing had followed: (longest reading of the silence between, unit asked
    before, time, frame before, frame). `close`, `paused`: by sender. `pairs`: (unit asked, unit that answered);
    `repeated_elsewhere`: repeats of requests that such a pair is about, by unit asked.
    `maker_words`: unit and exception code → what the maker of the device says of it, empty where not known.
    """

    timing: Timing
    first: int | None = None
    now: int = 0
    requests: int = 0
    answers: int = 0
    echoes: int = 0
    stations: dict[int, Station] = field(default_factory=dict)
    damaged_requests: Tally = field(default_factory=Tally)
    unasked: Tally = field(default_factory=Tally)
    answers_to_broadcast: Tally = field(default_factory=Tally)
    noise_after_broadcast: Tally = field(default_factory=Tally)
    hasty: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    close: dict[str, Tally] = field(default_factory=dict)
    paused: dict[str, Tally] = field(default_factory=dict)
    pairs: dict[tuple[int, int], Tally] = field(default_factory=dict)
    repeated_elsewhere: Counter[int] = field(default_factory=Counter)
    cycles: Cycles = field(default_factory=Cycles)
    maker_words: Callable[[int, int], str] = _no_words

    @property
    def span(self) -> int:
        """From the first octet to the last, ns; at least 1."""
        return max(1, self.now - (self.first or 0))

    @property
    def judges_pauses(self) -> bool:
        """Whether a pause inside a frame is the sender's: a busy computer goes well over what its adapter may add."""
        return PAUSE_MARGIN * self.timing.latency <= self.timing.t15

    def pair(self, pair: tuple[int, int]) -> Tally:
        """The record of one unit that answers for another."""
        return self.pairs.setdefault(pair, Tally()) if len(self.pairs) < _SENDERS_KEPT else self.unasked

    def gap_tally(self, by_sender: dict[str, Tally], sender: str) -> Tally:
        """The record of one sender's gaps."""
        return by_sender.setdefault(sender, Tally())

    def rare(self, count: int, of: int) -> bool:
        """Whether so few are not worth a warning: one, or under 1 in 100 and at most two a minute."""
        minutes = max(1, -(-self.span // (60 * NS_PER_S)))
        return count == 1 or (count <= 2 * minutes and 100 * count < of)
