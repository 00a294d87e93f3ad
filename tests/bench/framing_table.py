"""What framing and pairing keep of a bus under bad conditions, as a table.

python -m tests.bench.framing_table [rtu] [ascii] [n2] [mstp] [--frames 4000] [--seed 1] [--only WORDS]

conserved   octets of all events, in order, are those read
found       of the frames that came through whole, those that were given as good frames
invented    good frames that nobody sent, by 1000 frames
attributed  of the damaged ones of which at least half came right, those that stand at the right station (as a frame,
            or in its transaction)
direction   of those found, those that are told right to be requests or answers
verdict     of the exchanges whose request came through, those whose end is told right
"""

from __future__ import annotations

import argparse
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

from dissectors import registry
from dissectors.frame import Chunk, Event, Frame, Role
from dissectors.line import Timing
from dissectors.tracker import Placement, Transaction, Verdict
from tests.bench.framing_conditions import CONDITIONS, NOBODY, OnWire, Row, by_ftdi, exact, laid_out
from tests.bench.framing_traffic import TRAFFIC, Said, Traffic, is_same
from tests.bus_delivery import FTDI_LATENCY

FILLER = 3
"""Octets beside a frame that some framings take into it (the FF behind an MS/TP frame)."""

_ASKS = frozenset((Role.REQUEST, Role.BROADCAST))
_GOOD_ENDS = frozenset((Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION))
DELIVERIES = {"exact": (exact, 0), "16 ms": (by_ftdi, FTDI_LATENCY)}


@dataclass(frozen=True, slots=True)
class Share:
    """So many of so many."""

    part: int
    of: int

    def __str__(self) -> str:
        return f"{100 * self.part / self.of:.2f} %" if self.of else "-"


@dataclass(frozen=True, slots=True)
class Measured:
    """One line of the table."""

    conserved: bool
    found: Share
    invented: Share
    attributed: Share
    direction: Share
    verdict: Share
    failed: tuple[str, ...] = ()


@dataclass(slots=True)
class Heard:
    """What the program made of the octets: events by number (from 1), where each begins, and what became of them."""

    events: list[Event]
    begins: list[int]
    placements: dict[int, Placement]
    transactions: list[Transaction]


def listen(traffic: Traffic, chunks: Sequence[Chunk], latency: int) -> Heard:
    """Frame and pair what was read."""
    dissector = registry.get(traffic.protocol)
    timing = Timing(traffic.line, latency)
    framer, tracker = dissector.framer(timing), dissector.tracker(timing)
    heard, at = Heard([], [], {}, []), 0

    def take(events: Sequence[Event]) -> None:
        nonlocal at
        for event in events:
            heard.events.append(event)
            heard.begins.append(at)
            at += len(event.octets)
            no = len(heard.events)
            tracked = tracker.track(no, event, dissector.peek(event) if isinstance(event, Frame) else None)
            if tracked.placement is not None:
                heard.placements[no] = tracked.placement
            heard.transactions += tracked.closed

    for chunk in chunks:
        take(framer.feed(chunk))
    take(framer.close())
    heard.transactions += tracker.close()
    return heard


@dataclass(frozen=True, slots=True)
class Truth:
    """What each frame is: whether it asks, and how the exchange ends that it opens."""

    asks: dict[int, bool]
    ends: dict[int, Verdict]


def undisturbed(traffic: Traffic) -> Truth | None:
    """What is made of traffic between equals on an undisturbed line; None where the traffic itself says it."""
    if any(said.asks is not None for said in traffic.said):
        return None
    dice = Random(0)
    wire = laid_out(traffic.said, traffic.line)
    heard = listen(traffic, exact(wire, traffic.line, dice), 0)
    whole = _whole(traffic.said, wire)
    numbers = {bisect_right(heard.begins, begin): index for index, begin in whole.items()}
    asks = {index: heard.placements[no].role in _ASKS for no, index in numbers.items() if no in heard.placements}
    ends = {numbers[t.request]: t.verdict for t in heard.transactions if t.request in numbers}
    return Truth(asks, ends)


def measure(traffic: Traffic, row: Row, delivery: str, seed: int, truth: Truth | None = None) -> Measured:
    """One condition through one adapter."""
    dice = Random(f"{seed} {row.name}")
    wire = row.strike(laid_out(traffic.said, traffic.line, back_to_back=row.back_to_back), traffic.line, dice)
    read, latency = row.reads or DELIVERIES[delivery]
    chunks = read(wire, traffic.line, dice)
    return judged(traffic, wire, listen(traffic, chunks, latency), truth)


def judged(traffic: Traffic, wire: OnWire, heard: Heard, truth: Truth | None = None) -> Measured:
    """What was heard, against the truth."""
    said = traffic.said
    whole = _whole(said, wire)
    good: dict[int, int] = {}  # frame said → number of the event that is it
    failed = []
    for index, begin in whole.items():
        no = bisect_right(heard.begins, begin)
        if _is_it(heard.events[no - 1], begin - heard.begins[no - 1], said[index].octets):
            good[index] = no
        else:
            around = b"".join(bytes((octet.value,)) for octet in wire[max(0, begin - 24) : begin + 40])
            failed.append(f"not found: {said[index].octets!r} in {around!r}")
    known = set(good.values())
    invented = [
        no
        for no, event in enumerate(heard.events, 1)
        if isinstance(event, Frame) and event.ok and no not in known and not _is_said(event, heard, no, wire, said)
    ]
    failed += [f"invented: {heard.events[no - 1].octets!r}" for no in invented]
    struck = _struck(whole, wire)
    told = {index: places for index, places in struck.items() if _is_half_right(said[index], places, wire)}
    by_request: dict[int | None, Transaction] = {t.request: t for t in heard.transactions if t.request is not None}
    held = {index: _holder(places, heard) for index, places in told.items()}
    attributed = 0
    for index, no in held.items():
        right = _is_attributed(said[index], heard, no, good, by_request)
        attributed += right
        if not right:
            failed.append(f"not attributed: {said[index].octets!r} as {heard.events[no - 1].octets!r}")
    asks = {index: one.asks for index, one in enumerate(said)} if truth is None else truth.asks
    turned = [(index, no) for index, no in good.items() if asks.get(index) is not None]
    direction = sum((heard.placements[no].role in _ASKS) == asks[index] for index, no in turned)
    ends = _ends(said, good, struck, by_request) if truth is None else _same_ends(truth, good, by_request)
    failed += [f"verdict: {said[index].octets!r} {verdict}" for index, verdict, right in ends if not right]
    octets = bytes(octet.value for octet in wire)
    return Measured(
        b"".join(event.octets for event in heard.events) == octets,
        Share(len(good), len(whole)),
        Share(len(invented), len(said)),
        Share(attributed, len(told)),
        Share(direction, len(turned)),
        Share(sum(right for _, _, right in ends), len(ends)),
        tuple(failed),
    )


def _whole(said: Sequence[Said], wire: OnWire) -> dict[int, int]:
    """Frames that came through: index → place of the first octet."""
    places: dict[int, int] = {}
    counts: dict[int, int] = {}
    for place, octet in enumerate(wire):
        if octet.of == NOBODY:
            continue
        begin = places.setdefault(octet.of, place)
        if octet.right and place - begin == counts.get(octet.of, 0):
            counts[octet.of] = counts.get(octet.of, 0) + 1
    return {index: begin for index, begin in places.items() if counts.get(index) == len(said[index].octets)}


def _is_it(event: Event, offset: int, octets: bytes) -> bool:
    """Whether an event is a good frame that has these octets from `offset` on, and at most filler beside them."""
    around = len(event.octets) - len(octets)
    return (
        isinstance(event, Frame)
        and event.ok
        and 0 <= around <= FILLER
        and event.octets[offset : offset + len(octets)] == octets
    )


def _struck(whole: dict[int, int], wire: OnWire) -> dict[int, list[int]]:
    """Frames of which something came, but not all: index → places of its octets."""
    struck: dict[int, list[int]] = {}
    for place, octet in enumerate(wire):
        if octet.of != NOBODY and octet.of not in whole:
            struck.setdefault(octet.of, []).append(place)
    return struck


def _is_half_right(said: Said, places: Sequence[int], wire: OnWire) -> bool:
    return 2 * sum(wire[place].right for place in places) >= len(said.octets)


def _holder(places: Sequence[int], heard: Heard) -> int:
    """The event that holds most of these octets."""
    counts: dict[int, int] = {}
    for place in places:
        no = bisect_right(heard.begins, place)
        counts[no] = counts.get(no, 0) + 1
    return max(counts, key=lambda no: (counts[no], isinstance(heard.events[no - 1], Frame)))


def _is_said(event: Frame, heard: Heard, no: int, wire: OnWire, said: Sequence[Said]) -> bool:
    """Whether a good frame is a damaged one that says the same (the case of a hex digit)."""
    owner = wire[heard.begins[no - 1]].of
    return owner != NOBODY and is_same(event, said[owner].octets)


def _is_attributed(
    said: Said, heard: Heard, no: int, good: dict[int, int], by_request: dict[int | None, Transaction]
) -> bool:
    placement = heard.placements.get(no)
    if placement is not None:
        named = (placement.source,) if said.asks is None else (placement.source, placement.destination)
        return said.station in named
    if said.answers is None:
        return False
    ended = by_request.get(good.get(said.answers))
    return ended is not None and ended.station == said.station and ended.verdict is Verdict.DAMAGED_ANSWER


def _ends(
    said: Sequence[Said],
    good: dict[int, int],
    struck: dict[int, list[int]],
    by_request: dict[int | None, Transaction],
) -> list[tuple[int, Verdict | None, bool]]:
    """Of each exchange whose request was found: its verdict, and whether that is right."""
    answers = {frame.answers: index for index, frame in enumerate(said) if frame.answers is not None}
    ends: list[tuple[int, Verdict | None, bool]] = []
    for index, frame in enumerate(said[:-2]):
        if not frame.asks or index not in good:
            continue
        ended = by_request.get(good[index])
        verdict = ended.verdict if ended is not None else None
        answer = answers.get(index)
        if answer in good:
            right = verdict in _GOOD_ENDS
        elif answer in struck:
            right = verdict is Verdict.DAMAGED_ANSWER
        else:
            right = verdict is Verdict.NO_RESPONSE
        ends.append((index, verdict, right))
    return ends


def _same_ends(
    truth: Truth, good: dict[int, int], by_request: dict[int | None, Transaction]
) -> list[tuple[int, Verdict | None, bool]]:
    """The same where frames pass between equals: of those that were found together with the two behind them."""
    ends: list[tuple[int, Verdict | None, bool]] = []
    for index, verdict in truth.ends.items():
        if all(other in good for other in (index, index + 1, index + 2)):
            ended = by_request.get(good[index])
            told = ended.verdict if ended is not None else None
            ends.append((index, told, told is verdict))
    return ends


def main(words: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.framing_table")
    parser.add_argument("protocols", nargs="*", choices=[[], *TRAFFIC], default=[])
    parser.add_argument("--frames", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="conditions whose name has this in it")
    parser.add_argument("--failed", type=int, default=0, help="print so many failing inputs of each line")
    options = parser.parse_args(words)
    columns = ("conserved", "found", "invented", "attributed", "direction", "verdict")
    print(f"{'':41}" + "".join(f"{column:>12}" for column in columns))
    for name in options.protocols or TRAFFIC:
        traffic = TRAFFIC[name](Random(options.seed), options.frames)
        truth = undisturbed(traffic)
        for row in CONDITIONS:
            if options.only not in row.name:
                continue
            for delivery in DELIVERIES if row.reads is None else ("busy host",):
                got = measure(traffic, row, delivery, options.seed, truth)
                cells = [
                    "all" if got.conserved else "LOST",
                    *map(str, (got.found, got.invented, got.attributed, got.direction, got.verdict)),
                ]
                print(f"{name:9}{row.name:24}  {delivery:6}" + "".join(f"{c:>12}" for c in cells), flush=True)
                for line in got.failed[: options.failed]:
                    print(f"    {line}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
