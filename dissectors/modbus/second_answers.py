"""Second answers of a Modbus station, and those of them that something else explains.

Two stations with one address answer more often than they are asked. So what comes while the station leaves a request
unanswered proves no second one: it is late, or the station is an answer behind.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from dissectors.line import NS_PER_S
from dissectors.modbus.asked import AskedRequest
from dissectors.modbus.functions import EXCEPTION_BIT
from dissectors.modbus.pairing import another_function, mismatch
from dissectors.modbus.station_record import Lost, StationRecord
from dissectors.tracker import Transaction, Verdict

_OWED = 3  # times the master's timeout, for which a station may still answer what it left
_OWED_UNLEARNT = 5 * NS_PER_S


@dataclass(frozen=True, slots=True)
class SecondAnswer:
    """A second answer. `octets`: what it says, `first`: what the one before said, None where nobody knows."""

    station: StationRecord
    transaction: Transaction
    octets: bytes
    first: bytes | None

    def count(self) -> None:
        """Hold it against the station."""
        self.station.twice.add(self.transaction.start, self.transaction.response)
        self.station.same_twice += not self.octets or self.first is None or self.first == self.octets

    def in_answer_to(self, transaction: Transaction, asked: AskedRequest) -> Transaction:
        """The exchange of the request that was open and got no other answer, with this one for its answer."""
        is_same = asked.octets[1:2] == bytes((self.octets[1] & ~EXCEPTION_BIT,))
        why = (mismatch if is_same else another_function)(asked.octets, self.octets)
        end, response = max(transaction.end, self.transaction.end), self.transaction.response
        return replace(transaction, verdict=Verdict.ANSWERED, response=response, end=end, error=why)


def owed(lost: dict[int, Lost], answer: Transaction, timeout: int | None) -> int | None:
    """The newest request that the station of an answer left, and may still answer; its transaction, None if there is
    none. `timeout`: the master's, ns, None while unlearnt."""
    most = _OWED_UNLEARNT if timeout is None else _OWED * timeout
    left = (tx for tx in reversed(lost) if lost[tx].unit == answer.station)
    return next((tx for tx in left if answer.start - lost[tx].end <= most), None)
