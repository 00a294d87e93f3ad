"""Frames that must have been sent and are not in the capture: others go on as after them.

A token that the tap did not hear leaves its trace: the station to which it usually goes uses it, nobody repeats it, and
the one that had it is silent until it comes round again. That is no second token, and nobody's fault on the bus. It is
supposed only where there was time for it, and taken back where the one that had the token goes on talking: then two
stations have one. An answer whose question is not there, and a question after which the one that asked goes on long
before it may give up, are the same.
"""

from __future__ import annotations

from dissectors.bacnet.frame_types import EXPECTING, HEADER, FrameType
from dissectors.bacnet.limits import MS, T_REPLY_DELAY, T_USAGE_DELAY
from dissectors.bacnet.ring import lies_between
from dissectors.bacnet.ring_events import HASTY, RingEventKind
from dissectors.bacnet.ring_tally import RingTally
from dissectors.frame import Frame

_POLL, _TOKEN = int(FrameType.POLL_FOR_MASTER), int(FrameType.TOKEN)
_MOST = 8
"""Tokens in a row that may be unheard; so many too where frames came in one read, and have no times of their own."""

T_IMPATIENT = 100 * MS
"""Whoever asked a station that was never heard to answer, and goes on sooner than that, did not give up."""

TRUSTED = 4
"""What happens to a share of the tokens says something of a station where it is so many times the share of frames that
were not heard."""


class UnheardFrames:
    """Notes them in the tally. `least_gap`: ns, the least silence between frames of two stations."""

    def __init__(self, tally: RingTally, least_gap: int) -> None:
        self._tally = tally
        self._least_gap = least_gap
        self._least = HEADER * tally.timing.char + least_gap  # of a frame, with the silence before it
        self._supposed: dict[int, tuple[int, int, int]] = {}  # who passed it on: frame, its start, who used it

    def forget(self) -> None:
        """Nothing that was supposed can be taken back any more."""
        self._supposed.clear()

    def heard(self, mac: int) -> None:
        """A token for that station was heard."""
        if self._supposed:
            self._supposed.pop(mac, None)

    # Tokens

    def passed_on(self, no: int, frame: Frame, before: Frame, holder: int, source: int) -> bool:
        """Whether the token of `holder` came to `source`, which sends, in frames that were not heard. Notes them."""
        fits = self._fit(frame, before, holder, source)
        if self._searches(frame, source):
            return False
        return self._pass_on(no, frame, holder, source, fits, hasty=self._is_hasty(frame, before, holder))

    def _pass_on(self, no: int, frame: Frame, holder: int, source: int, most: int, *, hasty: bool = False) -> bool:
        way = self._way(holder, source, most)
        if way is None:
            return False
        nodes = self._tally.nodes
        for mac, following in zip(way, (*way[1:], source), strict=True):
            self._tally.note(RingEventKind.UNHEARD, frame.start, no, mac, source, HASTY if hasty else None)
            self._supposed.pop(following, None)
            self._supposed[mac] = no, frame.start, source
            if following in nodes:
                nodes[following].got = None  # its round is not known
        return True

    def take_back(self, source: int) -> bool:
        """Whether `source`, which sends, was supposed to have passed its token on: it had it all the time.

        Then the other one had a second token, which is noted instead.
        """
        supposed = self._supposed.pop(source, None)
        if supposed is None:
            return False
        no, time, other = supposed
        self._tally.take_back(RingEventKind.UNHEARD, no, source, other)
        self._tally.note(RingEventKind.TWO_TOKENS, time, no, other, source)
        return True

    def is_mute(self, mac: int | None) -> bool:
        """Whether the tap hears nothing of a station that must have used its token before."""
        node = self._tally.nodes.get(mac) if mac is not None else None
        unheard = self._tally.happened.get((RingEventKind.UNHEARD, mac))
        return node is not None and not node.first and unheard is not None and unheard.count > 0

    def _fit(self, frame: Frame, before: Frame, holder: int, source: int) -> int:
        """How many tokens there was time for since the frame before, by the longest reading of the time."""
        gap = frame.start - before.end
        if gap < self._least_gap:
            return _MOST
        room = gap + before.slack - self._least_gap
        kind, destination = before.octets[2], before.octets[3]
        if before.octets[4] == holder and kind == _POLL:  # answered by the one that sends now, or waited for
            room -= self._least if destination == source else T_USAGE_DELAY
        elif before.octets[4] == holder and kind in EXPECTING:
            room -= self._least
        return min(_MOST, max(0, room) // self._least)

    def _is_hasty(self, frame: Frame, before: Frame, holder: int) -> bool:
        """Whether the holder polled, and as the times are read there was none to wait for the answer and pass a token.

        One such pair of frames may have come together in a late read, but not all of them.
        """
        polled = before.octets[2] == _POLL and before.octets[4] == holder
        return polled and frame.start - before.end < T_USAGE_DELAY + self._least

    def _searches(self, frame: Frame, source: int) -> bool:
        """Whether the frame is a poll as only one sends that has lost its neighbour, or made a token anew."""
        node = self._tally.nodes.get(source)
        following = None if node is None else node.next
        if frame.octets[2] != _POLL or following is None:
            return False
        return not lies_between(frame.octets[3], source, following)

    def _way(self, holder: int, source: int, most: int) -> tuple[int, ...] | None:
        """Through whose hands a token comes from one station to another, the shortest way that was ever seen.

        Of a station that nobody has heard pass a token, any other may be the next.
        """
        ways: list[tuple[int, ...]] = [(holder,)]
        known = {holder}
        for _ in range(most):
            longer: list[tuple[int, ...]] = []
            for way in ways:
                following = [to for by, to in self._tally.edges if by == way[-1]]
                if source in following or not following:
                    return way
                longer += [(*way, to) for to in following if to not in known]
                known.update(following)
            ways = longer
        return None

    # Questions and answers

    def asked(self, no: int, frame: Frame, before: Frame, holder: int, client: int, server: int) -> bool:
        """Whether an answer of `server` shows that `client` asked, and was not heard. Notes it.

        The token of `holder` must have come to `client` before, unheard too where that is another one.
        """
        fits = self._fit(frame, before, holder, client) - 1
        if fits < 0 or (client != holder and not self._pass_on(no, frame, holder, client, fits)):
            return False
        self._tally.note(RingEventKind.UNHEARD, frame.start, no, client, server)
        return True

    def answered(self, no: int, asked: Frame, frame: Frame) -> bool:
        """Whether who asked goes on so soon that it had the answer, which was not heard. Notes it.

        It waits for at least 255 ms; of one that does not, the wait is not known. Nor is it in a log without times.
        `RingEvent.value` is how long it waited, where it is heard to go on itself.
        """
        if not self._tally.timing.has_times:
            return False
        server, client = asked.octets[3], asked.octets[4]
        node = self._tally.nodes.get(server)
        limit = T_REPLY_DELAY if node is not None and node.replies else T_IMPATIENT
        gap = frame.start - asked.end
        longest = gap + asked.slack
        if longest >= limit or (gap >= self._least_gap and longest < self._least + self._least_gap):
            return False
        self._tally.note(
            RingEventKind.UNHEARD, asked.end, no, server, client, gap if frame.octets[4] == client else None
        )
        return True

    def overtaken(self, no: int, asked: Frame, waited: int) -> None:
        """The answer that was supposed to be unheard comes now: who asked went on without it. Notes that instead."""
        server, client = asked.octets[3], asked.octets[4]
        self._tally.take_back(RingEventKind.UNHEARD, no, server, client)
        self._tally.note(RingEventKind.OVERTAKEN, asked.end, no, client, server, waited)

    def poll_answered(self, no: int, asked: Frame, frame: Frame) -> bool:
        """Whether the one that was polled is passed the token at once, so that it must have answered. Notes it."""
        polled, by = asked.octets[3], asked.octets[4]
        if frame.octets[2] != _TOKEN or frame.octets[3:5] != bytes((polled, by)):
            return False
        self._tally.note(RingEventKind.UNHEARD, asked.end, no, polled, by)
        return True
