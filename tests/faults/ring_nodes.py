"""Nodes of an MS/TP ring that misbehave in ways `simulated.Faults` has no value for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from dissectors.bacnet.application import Outgoing, Poller
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.simulated import Faults, SimulatedNode
from dissectors.line import LineSettings
from dissectors.simulated import Send
from tests.faults.stations import Wrapped


class Greedy(Poller):
    """Asks `count` things with each token."""

    def __init__(self, targets: Iterable[tuple[int, str, str]], count: int) -> None:
        super().__init__(targets, every=0)
        self.count = count

    def on_token(self, now: int) -> Iterable[Outgoing]:
        return tuple(asked for _ in range(self.count) for asked in super(Greedy, self).on_token(now))


class FailsFor(Wrapped):
    """A node with other faults from `at` on, and without any from `until` on."""

    def __init__(self, inner: SimulatedNode, at: int, until: int | None, faults: Faults) -> None:
        super().__init__(inner)
        self.node, self.at, self.until, self.faults = inner, at, until, faults

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        self._set(now)
        return self.inner.hear(now, octets, quiet)

    def wake(self, now: int) -> tuple[Send, ...]:
        self._set(now)
        return self.inner.wake(now)

    def _set(self, now: int) -> None:
        failing = now >= self.at and (self.until is None or now < self.until)
        self.node.faults = self.faults if failing else Faults()


class ComesAndGoes(Wrapped):
    """A node that is off for the last `away` ns of every `every`: a loose contact, a supply that gives in."""

    def __init__(self, inner: SimulatedNode, every: int, away: int) -> None:
        super().__init__(inner)
        self.node, self.every, self.away = inner, every, away

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        self._set(now)
        return self.inner.hear(now, octets, quiet)

    def wake(self, now: int) -> tuple[Send, ...]:
        self._set(now)
        return self.inner.wake(now)

    def _set(self, now: int) -> None:
        self.node.faults = Faults(off=now % self.every >= self.every - self.away)


class SlowToBeFound(Wrapped):
    """Answers a Poll For Master `by` ns later than it wants."""

    def __init__(self, inner: SimulatedNode, by: int) -> None:
        super().__init__(inner)
        self.by = by

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        return tuple(
            replace(send, at=send.at + self.by) if send.octets[2] == FrameType.REPLY_TO_POLL_FOR_MASTER else send
            for send in sends
        )


class AlsoSends(Wrapped):
    """Sends `extra` too, before each n-th token or poll: an error of its program."""

    def __init__(self, inner: SimulatedNode, line: LineSettings, every: int, extra: bytes) -> None:
        super().__init__(inner)
        self.every, self.extra, self.counted = every, extra, 0
        self.more = (len(extra) + 6) * line.char  # with a pause behind it

    def wake(self, now: int) -> tuple[Send, ...]:
        return self.change(now, b"", self.inner.wake(now))

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        sent: list[Send] = []
        for send in sends:
            if send.octets[2] in (FrameType.TOKEN, FrameType.POLL_FOR_MASTER):
                self.counted += 1
                if self.counted % self.every == 0:
                    sent += (Send(send.at, self.extra), replace(send, at=send.at + self.more))
                    continue
            sent.append(send)
        return tuple(sent)


class TestsItself(Wrapped):
    """Asks with a Test_Request whether somebody else has its number: with its first token, or every `every` ns.

    It waits `wait` ns for the answer before it goes on.
    """

    __test__ = False  # no test of pytest's

    def __init__(self, inner: SimulatedNode, line: LineSettings, every: int = 0, wait: int = 30_000_000) -> None:
        super().__init__(inner)
        self.node, self.char, self.every, self.wait = inner, line.char, every, wait
        self.next: int | None = 0

    def wake(self, now: int) -> tuple[Send, ...]:
        return self.change(now, b"", self.inner.wake(now))

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        sent: list[Send] = []
        for send in sends:
            if send.octets[2] == FrameType.TOKEN and self.next is not None and now >= self.next:
                self.next = now + self.every if self.every else None
                asking = frame(FrameType.TEST_REQUEST, self.node.mac, self.node.mac, b"is it me?")
                later = (len(asking) + 6) * self.char + self.wait
                self.node._busy_until += later  # what it waits for begins with what it really sends
                self.node._wake_at = (self.node._wake_at or 0) + later
                sent += (Send(send.at, asking), replace(send, at=send.at + later))
            else:
                sent.append(send)
        return tuple(sent)


class AnswersTests:
    """A second device with a number, too simple for a token: it answers a Test_Request, with other octets."""

    def __init__(self, mac: int, octets: bytes, after: int = 3_000_000) -> None:
        self.mac, self.octets, self.after = mac, octets, after

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        if len(octets) < 8 or octets[2] != FrameType.TEST_REQUEST or octets[3] != self.mac:
            return ()
        return (Send(now + self.after, frame(FrameType.TEST_RESPONSE, octets[4], self.mac, self.octets)),)

    def wake(self, now: int) -> tuple[Send, ...]:
        return ()

    def next_wake(self) -> int | None:
        return None


class SpeaksUnasked:
    """A slave that sends a value by itself, every `every` ns, as soon as the line is free for `free` ns; directly
    behind a frame of the type `behind`, if one is named."""

    def __init__(self, octets: bytes, every: int, free: int = 1_500_000, behind: FrameType | None = None) -> None:
        self.octets, self.every, self.free, self.behind = octets, every, free, behind
        self.due = every

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        if now < self.due or (self.behind is not None and octets[2:3] != bytes((self.behind,))):
            return ()
        self.due = now + self.every
        return (Send(now + self.free, self.octets),)

    def wake(self, now: int) -> tuple[Send, ...]:
        return ()

    def next_wake(self) -> int | None:
        return None


class PollsOnlyTo(Wrapped):
    """A node whose Max_Master is set to `max_master` at `at`: whoever is above it is never polled again."""

    def __init__(self, inner: SimulatedNode, at: int, max_master: int) -> None:
        super().__init__(inner)
        self.node, self.at, self.max_master = inner, at, max_master

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        if now >= self.at:
            self.node._max_master = self.max_master
        return super().hear(now, octets, quiet)


class GivesUpSoon(Wrapped):
    """A node that waits for answers for no longer than `after` ns."""

    def __init__(self, inner: SimulatedNode, after: int) -> None:
        super().__init__(inner)
        self.node, self.after = inner, after

    def wake(self, now: int) -> tuple[Send, ...]:
        if (due := self._due()) is not None and now >= due:
            self.node._wake_at = now
        return super().wake(now)

    def next_wake(self) -> int | None:
        wake, due = super().next_wake(), self._due()
        return wake if due is None or wake is None else min(wake, due)

    def _due(self) -> int | None:
        return self.node._busy_until + self.after if self.node._state.name == "ASKING" else None


class Dawdles(Wrapped):
    """A node that takes `by` ns for one token every `every` ns. A token that comes meanwhile it uses as well."""

    def __init__(self, inner: SimulatedNode, every: int, by: int) -> None:
        super().__init__(inner)
        self.node, self.every, self.by = inner, every, by
        self.next = every
        self.kept: bytes | None = None

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        is_token = len(octets) == 8 and octets[2] == FrameType.TOKEN and octets[3] == self.node.mac
        if is_token and now < self.node._busy_until:
            self.kept = octets
        slow = is_token and now >= self.next
        if slow:
            self.next = now + self.every
        self.node.faults = Faults(use_delay=self.by if slow else 0)
        return self.inner.hear(now, octets, quiet)

    def wake(self, now: int) -> tuple[Send, ...]:
        if self.kept is not None and now >= self.node._busy_until:
            token, self.kept = self.kept, None
            self.node.faults = Faults()
            return self.inner.hear(now, token, True)
        return self.inner.wake(now)

    def next_wake(self) -> int | None:
        due = self.inner.next_wake()
        return due if self.kept is None else min(self.node._busy_until, due or self.node._busy_until)


def waiting(node: SimulatedNode, usage: int) -> SimulatedNode:
    """The node waits `usage` ns until somebody uses its token: 20 … 35 ms, up to 100 ms by older texts."""
    node._usage_timeout = usage
    return node
