"""Who sent a frame with a damaged header: the ring tells, whatever was done to the octets."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from functools import cache
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.bacnet import MSTP
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.simulated import Poller, SimulatedNode, f510
from dissectors.bacnet.turn import Turn
from dissectors.frame import Check, Chunk, Damage, Flaw, FoundBy, Frame, Noise, Role
from dissectors.line import LineSettings, Timing
from sniff.simulation.wire import Burst, Party, Wire
from tests.dissectors.bacnet.ring_script import data, poll, rounds, script, spoil, token

LINE = LineSettings(38400)
TIMING = Timing(LINE)
Harm = Callable[[bytes, Random], bytes]


def flips(rate: float) -> Harm:
    return lambda octets, dice: bytes(
        octet ^ (1 << dice.randrange(8)) if dice.random() < rate else octet for octet in octets
    )


def lost(rate: float) -> Harm:
    return lambda octets, dice: bytes(octet for octet in octets if dice.random() >= rate)


def one_of_header(octets: bytes, dice: Random) -> bytes:
    return spoil(octets, dice.randrange(8), dice.randrange(1, 256)) if dice.random() < 0.1 else octets


def one_missing(octets: bytes, dice: Random) -> bytes:
    at = dice.randrange(8)
    return octets[:at] + octets[at + 1 :] if dice.random() < 0.1 else octets


def end_missing(octets: bytes, dice: Random) -> bytes:
    return octets[: -dice.randrange(1, 3)] if dice.random() < 0.1 else octets


def begin_missing(octets: bytes, dice: Random) -> bytes:
    return octets[dice.randrange(1, 3) :] if dice.random() < 0.1 else octets


def ring() -> list[SimulatedNode]:
    targets = [(5, "analog-input,4", "present-value"), (9, "analog-input,5", "present-value")]
    applications = {1: Poller(targets, every=100_000_000), 2: Poller(targets), 5: f510(5), 9: f510(9)}
    return [SimulatedNode(mac, TIMING, made, max_master=31, polls_every=10) for mac, made in applications.items()]


@cache
def _said() -> tuple[Burst, ...]:
    """Half a minute of a ring."""
    return tuple(Wire(LINE, [Party(str(node.mac), node) for node in ring()]).run(30 * 10**9))


@pytest.mark.parametrize("latency", [0, 17_500_000])
@pytest.mark.parametrize(
    ("harm", "least"),
    [
        (flips(1e-3), 0.97),
        (flips(3e-3), 0.97),
        (flips(2e-2), 0.93),
        (lost(1e-3), 0.95),
        (lost(1e-2), 0.9),
        (one_of_header, 0.97),
        (one_missing, 0.93),
        (end_missing, 0.95),
        (begin_missing, 0.98),
    ],
)
def test_damaged_frames_have_their_sender(harm: Harm, least: float, latency: int):
    """Of all that were damaged and left five octets at least; the nodes hear each other well."""
    dice, timing = Random(7), Timing(LINE, latency)
    framer, tracker = MSTP.framer(timing), MSTP.tracker(timing)
    starts: list[int] = []
    truth: list[tuple[int, bool]] = []
    at = position = no = 0
    right: set[int] = set()
    for burst in [*_said(), None]:
        if burst is None:
            events = framer.close()
        else:
            octets = harm(burst.octets, dice)
            if not octets:
                continue
            starts.append(at)
            truth.append((int(burst.sent[0].party), octets != burst.octets and len(octets) > 4))
            at += len(octets)
            events = framer.feed(Chunk(burst.end + latency, octets))
        for event in events:
            header = MSTP.peek(event) if isinstance(event, Frame) else None
            placement = tracker.track(no, event, header).placement
            which = bisect_right(starts, position + len(event.octets) // 2) - 1
            if placement is not None and placement.source == truth[which][0]:
                right.add(which)
            position += len(event.octets)
            no += 1
    damaged = {which for which, (_, harmed) in enumerate(truth) if harmed}
    assert len(damaged) > 20
    assert len(damaged & right) >= least * len(damaged)


@given(st.binary(min_size=1, max_size=40), st.lists(st.binary(min_size=5, max_size=12), max_size=5))
def test_any_octets_have_a_sender_or_none(octets: bytes, before: list[bytes]):
    turn = Turn(TIMING)
    for earlier in before:
        turn.see(Frame("mstp", earlier, 0, 10, Check.GOOD, FoundBy.LENGTH), earlier[2], earlier[4], earlier[3])
    speaker = turn.speaker(Frame("mstp", octets, 20, 30, Check.BAD, FoundBy.LENGTH, Damage.HEADER))
    assert speaker is None or 0 <= speaker.source <= 255


@pytest.mark.parametrize(
    ("octets", "flaw"),
    [
        (token(2, 5)[1:], Flaw.FIRST_MISSING),
        (token(2, 5)[2:], Flaw.FIRST_TWO_MISSING),
        (spoil(token(2, 5), 0), Flaw.FIRST_SPOILT),
        (spoil(token(2, 5), 1), Flaw.ONE_SPOILT),
        (spoil(spoil(token(2, 5), 0), 1), Flaw.FIRST_TWO_SPOILT),
        (token(2, 5)[:1] + token(2, 5)[2:], Flaw.ONE_MISSING),
        (token(2, 5)[:-1], Flaw.LAST_MISSING),
    ],
)
def test_a_frame_that_can_be_put_right(octets: bytes, flaw: Flaw):
    read = script([*rounds(1, 5, 2), (2, octets), (2, token(5, 2))])
    damaged = read.events[2]
    assert isinstance(damaged, Frame)
    assert damaged.octets == octets
    assert not damaged.ok
    assert damaged.repair is not None
    assert (damaged.repair.flaw, damaged.repair.octets) == (flaw, token(2, 5))
    assert (read.placements[2].source, read.placements[2].destination) == (2, 5)


VALUE = "010030010c0c020004d2194d3e75030041313f"


@pytest.mark.parametrize("cut", [1, 2])
def test_a_repaired_frame_has_the_fields_of_what_it_was(cut: int):
    """As the whole one has them, but for the check that failed."""
    whole = data(5, 2, VALUE)
    steps = [*rounds(2, 2, 5), (2, data(2, 5, "010400030 10c0c020004d2194d".replace(" ", ""), expects=True))]
    frames = [script([*steps, (9, octets), (2, token(2, 5))]).events[5] for octets in (whole, whole[cut:])]
    good, repaired = (MSTP.fields(one, Role.RESPONSE) for one in frames if isinstance(one, Frame))
    differing = {name for name in good.keys() | repaired.keys() if good.get(name) != repaired.get(name)}
    assert "bacapp.invoke_id" in repaired
    assert differing == {"mstp.checksum.status"}


def spoilt(*places: int) -> bytes:
    """A token from 2 to 5 with those octets wrong."""
    octets = token(2, 5)
    for at in places:
        octets = spoil(octets, at, 0x6B)
    return octets


@pytest.mark.parametrize("latency", [0, 17.5])
@pytest.mark.parametrize(
    "octets", [token(2, 5)[:4], token(2, 5)[:5], spoilt(1, 2), spoilt(1, 2, 3), spoilt(0, 2), spoilt(1, 7)]
)
def test_what_is_left_of_a_token_is_of_who_had_it(octets: bytes, latency: float):
    """Cut within its header, or with so much spoilt that only its length, half a preamble and its place tell."""
    read = script([*rounds(2, 2, 5), (2, octets), (2, token(5, 2)), (2, token(2, 5))], latency)
    damaged = read.events[4]
    assert isinstance(damaged, Frame)
    assert (damaged.octets, damaged.ok, damaged.repair) == (octets, False, None)
    assert read.placements[4] is not None
    assert read.placements[4].source == 2
    assert all(isinstance(event, Frame) and event.ok for event in read.events[5:])


@pytest.mark.parametrize(("after", "source"), [(34, 1), (5, 5)])
def test_who_gave_up_its_neighbour_polls_on(after: float, source: int):
    """A poll whose source is 0, one bit from 1 and two from 5: 5 was passed the token, and has it until 1 gives up."""
    spoilt_poll = spoil(poll(1, 6), 4, 1)
    read = script([*rounds(2, 1, 5, 9), (2, token(1, 5)), (34, token(1, 5)), (after, spoilt_poll)])
    assert read.placements[-1] is not None
    assert read.placements[-1].source == source


@pytest.mark.parametrize(
    "octets",
    [
        token(2, 5)[:3],
        bytes(8),
        b"\x55" + bytes(7),
        b"\x12\xff" + bytes(6),
        spoilt(1, 2) + b"\x31",
        b"\x31" + spoilt(1, 2),
        spoilt(0, 1, 2),
        b"\x55\xff\x55\xff",
    ],
)
def test_what_may_be_anything_is_no_frame(octets: bytes):
    read = script([*rounds(2, 5, 2), (2, octets), (2, token(5, 2))])
    assert [type(event) for event in read.events] == [Frame] * 4 + [Noise] + [Frame]


def test_a_length_that_the_data_contradict():
    whole = frame(6, 255, 2, bytes.fromhex("01001008"))
    damaged = script([*rounds(1, 5, 2), (2, spoil(whole, 6, 0x40)), (2, token(5, 2))]).events[2]
    assert isinstance(damaged, Frame)
    assert damaged.repair is not None
    assert (damaged.repair.flaw, damaged.repair.octets) == (Flaw.ONE_SPOILT, whole)


def test_data_with_the_check_octets_swapped():
    whole = frame(6, 255, 2, bytes.fromhex("01001008"))
    swapped = whole[:-2] + whole[:-3:-1]
    damaged = script([*rounds(1, 5, 2), (2, swapped), (2, token(5, 2))]).events[2]
    assert isinstance(damaged, Frame)
    assert damaged.repair is not None
    assert (damaged.repair.flaw, damaged.repair.octets) == (Flaw.CHECK_SWAPPED, whole)


def test_what_cannot_be_proved_is_not_mended():
    """One octet wrong among type, addresses and CRC: which one, the frame alone does not tell."""
    for at in (2, 3, 4, 7):
        damaged = script([*rounds(1, 5, 2), (2, spoil(token(2, 5), at)), (2, token(5, 2))]).events[2]
        assert isinstance(damaged, Frame)
        assert damaged.repair is None


def test_a_capture_that_begins_inside_a_frame_has_no_damaged_one_there():
    read = script([(2, token(2, 5)[2:]), (2, token(5, 2)), (2, poll(2, 3))])
    assert [isinstance(event, Frame) for event in read.events] == [False, True, True]
