"""The memory of the rules while a Modbus line is judged: what is open, and what is still to be settled. Bounded."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from dissectors.frame import Flaw, Frame
from dissectors.line import MS, Timing
from dissectors.modbus.asked import AskedRequest
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.cut_echo import CutEcho
from dissectors.modbus.gaps import Gaps
from dissectors.modbus.late_rows import LateRows
from dissectors.modbus.learned_timing import LearnedTiming
from dissectors.modbus.long_silences import LongSilences
from dissectors.modbus.odd_ends import OddEnds
from dissectors.modbus.poll_order import Neighbours
from dissectors.modbus.second_answers import SecondAnswer
from dissectors.modbus.station_record import Lost, StationRecord
from dissectors.modbus.torn import TornFrames
from dissectors.tracker import Transaction

SLOW_UNLEARNT = 500 * MS
"""An answer that takes longer is slow while the master's timeout is not known."""

LAST_STANDARD_UNIT = 247
OPEN_KEPT = 4096
LOST_KEPT = 64
FINAL_KEPT = 64
BEGIN = 5
"""Octets of a request that no noise makes by chance: unit, function, address, half a quantity."""

Wait = tuple[int, int, tuple[Neighbours, ...]]
"""From a request to the next one, ns; that one, and in which order the two may be asked."""

_WORDS_KEPT = 16


@dataclass(frozen=True, slots=True)
class Unfit:
    """An answer that is not what was asked for. `octets`: of the answer."""

    station: StationRecord
    transaction: Transaction
    octets: bytes

    def count(self) -> None:
        """Hold it against the station."""
        one, station = self.transaction, self.station
        station.unfit.add(one.end, one.request, one.response)
        words = station.unfit_words
        if one.error is not None and (one.error in words or len(words) < _WORDS_KEPT):
            words[one.error] += 1


def slow_limit(timeout: int | None) -> int | None:
    """From when on an answer is slow, ns, by the master's timeout; None while that is not known."""
    return None if timeout is None else timeout * 7 // 10


class Remembered:
    """State of the rules between one row and the next; `observer.py` and `judging_columns.py` move it on."""

    def __init__(self, timing: Timing) -> None:
        self.timing = timing
        self.learnt = LearnedTiming(timing)
        self.seen = BusRecord(timing)
        self.gaps = Gaps(timing, self.seen, self.learnt)
        self.ends = OddEnds(timing, self.seen)
        self.silences = LongSilences(self.learnt)
        self.asked: dict[int, AskedRequest] = {}  # by transaction
        self.open: AskedRequest | None = None  # the newest request, while nothing has come after it
        self.broadcast: AskedRequest | None = None  # likewise
        self.unfit: Unfit | None = None  # that may be the master's next request
        self.said: dict[int, bytes] = {}  # the last requests by row, where times do not tell; the newest row is last
        self.given_back = CutEcho()  # behind the newest frame that may be a request
        self.codes: dict[int, int] = {}  # exception codes by transaction
        self.answers: dict[int, bytes] = {}  # good answers by transaction
        self.elsewhere: dict[int, int] = {}  # requests (by frame) that another unit answered, and which
        self.repeats: deque[int] = deque(maxlen=64)  # the last transactions that repeated another
        self.copied: deque[int | None] = deque(maxlen=64)  # the last transactions whose request came twice at once
        self.no_requests: deque[int] = deque(maxlen=64)  # frames that the tracker takes for requests, but are none
        self.copies_of_broadcast: dict[int, tuple[int, AskedRequest]] = {}  # by row; that of the broadcast
        self.damaged: deque[int] = deque(maxlen=64)  # transactions of the last damaged answers
        self.rubbish = -1  # the newest row of so many octets that are no frame that they may have been a request
        self.before_all: int | None = None  # the row of the first answer, if no request came before it
        self.contradictory: deque[int] = deque(maxlen=64)  # transactions whose good answer contradicts itself
        self.flaws: dict[int, Flaw] = {}  # of damaged frames, by transaction
        self.newest: int | None = None  # the transaction of the newest request
        self.newest_for_nobody: int | None = None  # that of the newest read of address 0
        self.stray: dict[int, bytes] = {}  # octets that are no good frame, by the transaction they came in
        self.lost: dict[int, Lost] = {}  # requests without answer, by transaction
        self.begins: set[bytes] = set()  # the first octets of good requests
        self.late = LateRows()
        self.torn = TornFrames()
        self.bad_ends: dict[int, tuple[int, int, Frame]] = {}  # damaged answers (station, row), by transaction
        self.marked: deque[int] = deque(maxlen=64)  # transactions with line errors in what came in answer
        self.waits: dict[int, Wait] = {}  # by request that nothing followed
        self.unheard: deque[int] = deque(maxlen=LOST_KEPT)  # requests after which the master went on as after answers
        self.waited_for: deque[int] = deque(maxlen=LOST_KEPT)  # those for which it waited longer than that
        self.hasty: deque[int] = deque(maxlen=LOST_KEPT)  # those after which another came sooner than that
        self.seconds: dict[int, SecondAnswer] = {}  # that came while another request waited, by its transaction
        self.final: dict[int, bytes] = {}  # the last answers, by transaction

    def settle_unfit(self, newest: int) -> None:
        """Count the last unfit answer once the row behind it is known, unless that is a request that says the same:
        where times do not tell, it was that request, and the one that it seemed to answer an answer behind an echo."""
        if self.unfit is not None and newest > (row := self.unfit.transaction.response or 0):
            if self.said.get(row + 1) != self.unfit.octets:
                self.unfit.count()
            self.unfit = None

    def station(self, unit: int) -> StationRecord:
        """What is known of a station."""
        stations = self.seen.stations
        station = stations.get(unit)
        if station is None:
            station = stations[unit] = StationRecord()
        return station
