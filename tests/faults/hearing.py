"""What the sniffer gets of a bus when the fault is in the sniffer, its settings or its computer."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from random import Random

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind
from sniff.simulation.collision import low_times, receive
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.tap import TapModel
from sniff.simulation.wire import Burst
from tests.faults.case import Heard

MS = 1_000_000
S = 1_000_000_000


def as_protocol(protocol: str, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A capture with the wrong protocol."""
    session, items = simulate(plan, seconds, tap)
    return replace(session, protocol=protocol), items


def hidden_latency(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A recording of another program: it names no adapter, and the adapter held octets back all the same."""
    session, items = simulate(plan, seconds, tap)
    return replace(session, adapter=Adapter()), items


def busy_host(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A computer that now and then, every two seconds or so, does nothing for 50 … 300 ms: what came meanwhile is in
    one read at its end."""
    session, items = simulate(plan, seconds, tap)
    return session, held_back(items, Random(f"busy {plan.seed}"))


def held_back(items: Sequence[Item] | Iterator[Item], dice: Random) -> Iterator[Item]:
    begins, ends = S, S
    held: list[Chunk] = []
    for item in items:
        while item.time >= ends:
            if held:
                yield _joined(held, ends)
                held = []
            begins = ends + int(dice.expovariate(1 / (2 * S)))
            ends = begins + dice.randrange(50 * MS, 300 * MS)
        if begins <= item.time and isinstance(item, Chunk):
            held.append(item)
        else:
            yield item
    if held:
        yield _joined(held, ends)


def _joined(chunks: Sequence[Chunk], time: int) -> Chunk:
    octets, marks = b"", []
    for chunk in chunks:
        marks += [Mark(len(octets) + mark.offset, mark.error) for mark in chunk.marks]
        octets += chunk.octets
    return Chunk(time, octets, tuple(marks))


Sends = Callable[[Burst], LineSettings | None]
"""How a burst is really sent, where that is not as the session has it."""


def sent_otherwise(sends: Sends, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """Some bursts are sent with other settings than the capture listens with; exact times, every line error."""
    session, _ = simulate(plan, seconds, tap)

    def items() -> Iterator[Item]:
        free = 0
        for burst in plan.wire().run(int(seconds * S)):
            if not burst.octets:
                continue
            real = sends(burst)
            if real is None:
                yield Chunk(max(burst.end, free), burst.octets, burst.marks)
                continue
            received = receive(plan.line, low_times(real, max(burst.start, free), burst.octets, {}))
            if received.octets:
                free = max(received.ends)
                yield Chunk(free, received.octets, received.marks)

    return session, items()


def of_party(party: str, line: LineSettings, burst: Burst) -> LineSettings | None:
    """That party sends so."""
    return line if burst.sent[0].party == party else None


def from_to(begin: int, end: int, line: LineSettings, burst: Burst) -> LineSettings | None:
    """Everybody sends so for a while."""
    return line if begin <= burst.start < end else None


def echoing(missing: int, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A tap behind a converter that gives back what the master sends, and drops the last octets of the copy."""
    session, _ = simulate(plan, seconds, tap)

    def items() -> Iterator[Item]:
        for burst in plan.wire().run(int(seconds * S)):
            if not burst.octets:
                continue
            yield Chunk(burst.end, burst.octets, burst.marks)
            if burst.sent[0].party in ("master", "supervisor"):
                copy = burst.octets[: len(burst.octets) - missing]
                yield Chunk(burst.end + len(copy) * plan.line.char + MS // 5, copy)

    return session, items()


def other_settings(settings: str, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """The same line heard by a UART with other settings, bit by bit."""
    session, _ = simulate(plan, seconds, tap)
    other = LineSettings.parse(settings)

    def items() -> Iterator[Item]:
        for burst in plan.wire().run(int(seconds * S)):
            if burst.octets:
                received = receive(other, low_times(plan.line, burst.start, burst.octets, {}))
                if received.octets:
                    yield Chunk(max(received.ends), received.octets, received.marks)

    return replace(session, line=other), items()


def swapped(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A and B swapped: what was low is high; the silence between frames reads as a break."""
    session, _ = simulate(plan, seconds, tap)

    def items() -> Iterator[Item]:
        silent_since = 0
        for burst in plan.wire().run(int(seconds * S)):
            if not burst.octets:
                continue
            lows = sorted(low_times(plan.line, burst.start, burst.octets, {}))
            inverted, at = [], silent_since
            for begin, end in lows:
                if begin > at:
                    inverted.append((at, begin))
                at = max(at, end)
            silent_since = at
            received = receive(plan.line, inverted)
            if received.octets:
                yield Chunk(max(received.ends), received.octets, received.marks)

    return session, items()


def unheard(parties: Sequence[str], share: float, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A tap that misses frames of some altogether, which everybody else hears; exact times."""
    session, _ = simulate(plan, seconds, tap)
    dice = Random(f"unheard {plan.seed}")

    def items() -> Iterator[Item]:
        for burst in plan.wire().run(int(seconds * S)):
            if burst.octets and not (burst.sent[0].party in parties and dice.random() < share):
                yield Chunk(burst.end, burst.octets, burst.marks)

    return session, items()


def noisy_tap(party: str, share: float, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A tap at which a bit of some frames of one sender is another, and nowhere else; exact times."""
    session, _ = simulate(plan, seconds, tap)
    dice = Random(f"noisy tap {plan.seed}")

    def items() -> Iterator[Item]:
        for burst in plan.wire().run(int(seconds * S)):
            octets = bytearray(burst.octets)
            if octets and burst.sent[0].party == party and dice.random() < share:
                octets[dice.randrange(2, len(octets))] ^= 1 << dice.randrange(8)
            if octets:
                yield Chunk(burst.end, bytes(octets), burst.marks)

    return session, items()


def as_text(change: Callable[[bytes], bytes], plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A port whose driver, or a program whose reads, make something else of octets that mean something in text."""
    session, items = simulate(plan, seconds, tap)
    return session, (replace(one, octets=change(one.octets)) if isinstance(one, Chunk) else one for one in items)


def reading_too_few(count: int, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """The log of a master that takes `count` octets too few of each answer and finds them at its next read."""
    session, _ = simulate(plan, seconds, tap)

    def items() -> Iterator[Item]:
        kept = b""
        for burst in plan.wire().run(int(seconds * S)):
            if burst.octets and burst.sent[0].party == "master":
                yield Chunk(burst.end, burst.octets, burst.marks)
            elif burst.octets:
                kept, taken = kept + burst.octets, len(burst.octets) - count
                yield Chunk(burst.end, kept[:taken])
                kept = kept[taken:]

    return session, items()


def losing(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A computer that loses a read now and then, and says so."""
    session, items = simulate(plan, seconds, tap)
    dice = Random(plan.seed)

    def some() -> Iterator[Item]:
        for item in items:
            if isinstance(item, Chunk) and dice.random() < 0.01:
                yield LineEvent(item.time, LineEventKind.DROPPED, "", len(item.octets))
            else:
                yield item

    return session, some()


def overrunning(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """An adapter that loses octets inside a read, and marks the place."""
    session, items = simulate(plan, seconds, tap)
    dice = Random(plan.seed)

    def some() -> Iterator[Item]:
        for item in items:
            if isinstance(item, Chunk) and len(item.octets) > 4 and dice.random() < 0.02:
                yield Chunk(item.time, item.octets[:2] + item.octets[4:], (Mark(2, LineError.OVERRUN),))
            else:
                yield item

    return session, some()


def stepping(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A computer whose wall clock is put right by two minutes after a while."""
    session, items = simulate(plan, seconds, tap)

    def stepped() -> Iterator[Item]:
        waiting = True
        for item in items:
            if waiting and item.time > S // 2:
                yield LineEvent(item.time, LineEventKind.CLOCK, "", 120 * S)
                waiting = False
            yield item

    return session, stepped()


def counting(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """A driver that counts line errors and does not say where they were."""
    session, items = simulate(plan, seconds, tap)

    def counted() -> Iterator[Item]:
        for item in items:
            if isinstance(item, Chunk) and item.marks:
                yield Chunk(item.time, item.octets)
                yield LineEvent(item.time, LineEventKind.ERRORS, "parity", len(item.marks))
            else:
                yield item

    return session, counted()


def silent(plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """Nothing at all."""
    session, _ = simulate(plan, seconds, tap)
    return session, ()
