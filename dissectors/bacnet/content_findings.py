"""Findings in the content of good frames: notes about the station that sent it. `content.py` says what is odd."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dissectors.bacnet import message as messages
from dissectors.bacnet.content import Odd, Oddity, oddities
from dissectors.bacnet.frame_types import CARRIES_NPDU, HEADER
from dissectors.bacnet.station_address import remote
from dissectors.findings import Finding, Rule, Severity, Tally, times
from dissectors.frame import Event, Frame, Header
from dissectors.row_columns import RowColumns

if TYPE_CHECKING:
    from dissectors.bacnet.content_columns import Read

CONTENT_RULES = (
    Rule(
        "MS701",
        Severity.NOTE,
        "reply expected or not",
        "Frame type, the reply bit of the network header and the kind of message contradict each other: a confirmed "
        "request is a Data Expecting Reply whose network header says so, an unconfirmed one neither "
        "(ASHRAE 135, 5.4, 6.2.2 and 9.3). Answers and segments are not judged.",
        "an error in the sending station's software: who gets a confirmed request without it must wait for the token "
        "to answer, and who gets anything else with it holds up the bus for a reply that does not come",
        "the firmware of the sender; behind a router, that of the station named",
    ),
    Rule(
        "MS702",
        Severity.NOTE,
        "date or time that cannot be",
        "A date whose weekday is another one in the calendar, a day or time of day that does not exist "
        "(ASHRAE 135, 20.2.12 and 20.2.13). Parts that are 255 fit anything.",
        "a clock or a client that was set by hand, or that counts weekdays in another way; some stations refuse such "
        "dates, others never find the records or schedules meant",
        "how the sender makes its dates; send the weekday as 255 where it does not matter",
    ),
    Rule(
        "MS703",
        Severity.NOTE,
        "value of another type",
        "The value of a standard property of a standard object has another primitive type than the standard gives it, "
        "a context tag, or is not there (ASHRAE 135, clause 12). Null is not judged: written, it gives a property up.",
        "an error in the sender's data or a gateway's mapping; strict clients refuse it, others show it wrong",
        "the object named, in the sender's configuration",
    ),
    Rule(
        "MS704",
        Severity.NOTE,
        "parameters that do not fit",
        "The parameters of a standard service, of an answer or an error to it are cut short, lack what must be there, "
        "hold more than belongs there, have other tags than the standard gives them, or texts of another character set "
        "than they name (ASHRAE 135, 20.2 and 21). What is read is not judged.",
        "an error in the sending station's software; strict programs drop or refuse such a message, others misread it",
        "the firmware of the sender; behind a router, that of the station named",
    ),
)

_CODES = {Odd.REPLY: "MS701", Odd.DATE: "MS702", Odd.TYPE: "MS703", Odd.FORM: "MS704"}
_RULES = {rule.code: rule for rule in CONTENT_RULES}

SENDERS_KEPT = 512
"""Most pairs of sender and kind that are counted apart."""

EXAMPLES = 3


@dataclass(slots=True)
class _Seen:
    """What one sender sends that is odd in one way: how often, and the first different examples."""

    tally: Tally = field(default_factory=Tally)
    examples: list[str] = field(default_factory=list)
    more: bool = False

    def add(self, no: int, frame: Frame, words: str) -> None:
        self.tally.add(frame.end, no)
        if words not in self.examples:
            if len(self.examples) < EXAMPLES:
                self.examples.append(words)
            else:
                self.more = True


class ContentFindings:
    """Fed row by row; gives findings at any time."""

    def __init__(self) -> None:
        self._seen: dict[tuple[Odd, int], _Seen] = {}
        self._read: Read | None = None  # made for the first table

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next row."""
        if header is None or header.function not in CARRIES_NPDU or not isinstance(event, Frame):
            return
        if not header.ok or header.source is None or len(event.octets) <= HEADER:
            return
        for oddity in oddities(event):
            key = oddity.kind, header.source
            if key not in self._seen and len(self._seen) >= SENDERS_KEPT:
                continue
            self._seen.setdefault(key, _Seen()).add(no, event, _whose(event, oddity))

    def take(self, rows: RowColumns) -> None:
        """Take many rows."""
        if self._read is None:
            from dissectors.bacnet.content_columns import Read

            self._read = Read()
        for place in self._read.suspicious(rows).tolist():
            row = rows.row(place)
            self.see(row.no, row.event, row.header)

    def findings(self) -> Iterable[Finding]:
        """What was found so far."""
        for (kind, mac), seen in self._seen.items():
            words = "; ".join(seen.examples) + ("; and others" if seen.more else "")
            yield seen.tally.found(_RULES[_CODES[kind]], f"MAC {mac}", f"sent {times(seen.tally.count)}: {words}")


def _whose(frame: Frame, oddity: Oddity) -> str:
    """The words, with the station behind a router that they come from."""
    message = messages.read(frame)
    npdu = message.npdu if message is not None else None
    if npdu is None or npdu.snet is None:
        return oddity.words
    return f"{remote(npdu.snet, npdu.sadr)} behind it: {oddity.words}"
