"""Answers that come at once and that nobody can take: sent to another address than the request came from, or with the
number of another request.

Each has a cause in the station that answers. A number that fits a request which was postponed, or that was given up, is
no such answer: it is that request's.
"""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.bacnet import message as messages
from dissectors.bacnet.findings_of_hearing import unheard_share
from dissectors.bacnet.limits import BROADCAST
from dissectors.bacnet.message import Message
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_remarks import Remark, of
from dissectors.bacnet.rules import RULES
from dissectors.bacnet.unheard import TRUSTED
from dissectors.findings import Finding, Severity, Tally, times
from dissectors.frame import Event, Frame
from dissectors.tracker import Transaction

LEAST = 3
KEPT = 256
"""Most stations that are counted apart."""


def astray(ring: Ring) -> Iterable[Remark]:
    """Those whose answers go elsewhere."""
    for (what, mac), happened in ring.happened.items():
        if what is RingEventKind.ASTRAY:
            to = ["everybody" if one == BROADCAST else f"MAC {one}" for one in happened.parties]
            seen = f"answered {times(happened.count)} to {', '.join(to)} instead of who had asked it"
            yield of("MS312", mac, seen, happened, Severity.NOTE if happened.count < LEAST else None)


class OtherNumbers:
    """Fed every answer that belongs to no request that is open, and the row before it."""

    def __init__(self) -> None:
        self._seen: dict[int, tuple[Tally, str]] = {}  # by station, with the first of them in words

    def add(self, transaction: Transaction, before: Event | None, answer: Event | None) -> None:
        """Take one; it counts where the row before it is a request that its sender was to answer then."""
        asked, said = _local(before), _local(answer)
        if asked is None or said is None or said.source is None or asked.apdu is None or said.apdu is None:
            return
        if (asked.source, asked.destination) != (said.destination, said.source):
            return
        if not asked.apdu.is_request or not said.apdu.is_answer or asked.apdu.invoke_id == said.apdu.invoke_id:
            return
        if said.source in self._seen or len(self._seen) < KEPT:
            words = f"{said.apdu.invoke_id} for {asked.apdu.invoke_id}"
            tally, _ = self._seen.setdefault(said.source, (Tally(), words))
            tally.add(transaction.end, transaction.response)

    def findings(self, ring: Ring) -> Iterable[Finding]:
        """What was found so far."""
        for mac, (tally, words) in self._seen.items():
            node = ring.nodes.get(mac)
            answers = max(tally.count, node.replies if node is not None else 0)
            if tally.count >= LEAST and tally.count > TRUSTED * unheard_share(ring) * answers:
                seen = f"answered {times(tally.count)} with the invoke id of no open request, first {words}"
                yield tally.found(RULES["MS313"], f"MAC {mac}", seen)


def _local(event: Event | None) -> Message | None:
    """What a good frame says that is neither for nor from another network."""
    if not isinstance(event, Frame) or not event.ok:
        return None
    message = messages.read(event)
    if message is None or message.npdu is None or message.npdu.dnet is not None or message.npdu.snet is not None:
        return None
    return message
