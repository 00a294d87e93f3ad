"""BACnet MS/TP: tokens, turns and programs that go wrong in one certain way. Data."""

from __future__ import annotations

from functools import partial

from dissectors.bacnet.application import WRITE_PROPERTY, Application, Outgoing, confirmed
from dissectors.bacnet.envelope import frame, npdu_frame
from dissectors.bacnet.frame_types import EXPECTING, FrameType
from dissectors.bacnet.simulated import Faults, SimulatedNode
from dissectors.frame import Place
from dissectors.line import Timing
from dissectors.simulated import Station
from dissectors.simulated_faults import EarlyRelease, NoiseInGaps
from sniff.simulation.tap import CH340, FTDI
from tests.faults.buses import MSTP_LINE, mstp
from tests.faults.case import Case, Said
from tests.faults.hearing import unheard
from tests.faults.misbehaving import Blinks, Trimmed, When
from tests.faults.ring_nodes import (
    AlsoSends,
    AnswersTests,
    Dawdles,
    FailsFor,
    GivesUpSoon,
    Greedy,
    PollsOnlyTo,
    SpeaksUnasked,
    TestsItself,
    waiting,
)
from tests.faults.ring_programs import (
    Lister,
    Segmenting,
    Sends,
    WrongType,
    asked_without_reply_bit,
    controller,
    drive,
    i_am,
    time_to_all,
)
from tests.faults.stations import OfLong
from tests.faults.workbench import Member, Ring

MS = 1_000_000
S = 1_000_000_000

_one = Member(1, partial(controller, 5, 9))
_two = Member(2, partial(controller, 5))
_five = Member(5, partial(drive, 5))
_nine = Member(9, partial(drive, 9))
_four = (_one, _two, _five, _nine)
_off_for_a_second = partial(FailsFor, at=8 * S, until=9 * S, faults=Faults(off=True))

_LAST = r"\blast\b|too early|too soon|\bends?\b.*missing|lets go|cut (off|short)"
_SLOW = r"slow|late|after the token was (passed|repeated)|took"
_SECOND = r"second (station|device)|two (stations|devices)|same (address|number)|another (station|device)"
_UNASKED = (
    r"unasked|without (a |the |any |having the )?token|no token|not (been )?asked|nobody asked|unsolicited|by itself"
)
_OUT = r"shut out|skip|no (poll|token)|never (polled|passed)|not polled|left out|polls? only|passed over"
_SECONDS = r"max[_ ]?master|every address|up to (address )?12[67]|polls? .*12[0-9]|stop(s|ped)? .*\bs\b|stood still"
_HOG = r"frames (per|a|with|for|in|each|of a) (each |every |one )?token|each token|hog|holds? the token|share"


def _greedy(count: int) -> Application:
    """Asks that many things with each token."""
    return Greedy([(mac, f"analog-input,{number}", "present-value") for number in (4, 5) for mac in (5, 9)], count)


def _with(member: Member, **more: object) -> Member:
    return Member(**{**member.__dict__, **more})


def _unasked(*, seed: int) -> Station:
    """A slave at 200 that sends a value to the controller again and again."""
    value = i_am(200).npdu
    return SpeaksUnasked(npdu_frame(1, 200, value, expects_reply=False), 700 * MS + seed * 7 * MS)


def _behind_polls(*, seed: int) -> Station:
    """The same, into the wait for the answer to a poll: whoever polls lets go of its token then."""
    frame_of_value = npdu_frame(3, 200, i_am(200).npdu, expects_reply=False)
    return SpeaksUnasked(frame_of_value, 3 * S + seed * 7 * MS, behind=FrameType.POLL_FOR_MASTER)


def _twin(mac: int, *, seed: int) -> Station:
    """A second master with that number; it answers what it is asked with values of its own."""
    other = drive(mac)
    for target, held in other.objects.items():
        if target.type == 0:
            held.properties[85] = 77.0
    return SimulatedNode(
        mac, Timing(MSTP_LINE), other, max_master=31, faults=Faults(use_delay=4 * MS, reply_delay=25 * MS)
    )


def _answers_tests(*, seed: int) -> Station:
    return AnswersTests(9, b"yes, me")


def _wrong_write() -> Application:
    """Writes a whole number to an analogue output, once a second."""
    values = {
        "object-identifier": "analog-output,0",
        "property-identifier": "present-value",
        "property-value": 7,
        "priority": 8,
    }
    return Sends(Outgoing(9, confirmed(3, WRITE_PROPERTY, values), expects_reply=True), every=S)


def _dawdling(node: SimulatedNode) -> Station:
    """Each station has its own patience, else two tokens go round in step for ever."""
    return Dawdles(waiting(node, 26 * MS), every=3 * S, by=40 * MS)


def _is_poll_reply(octets: bytes) -> bool:
    return octets[2:3] == bytes((FrameType.REPLY_TO_POLL_FOR_MASTER,))


def _is_poll(octets: bytes) -> bool:
    return octets[2:3] == bytes((FrameType.POLL_FOR_MASTER,))


def _is_request(octets: bytes) -> bool:
    return len(octets) > 2 and octets[2] in EXPECTING


_far = {"max_master": 127}
_token_beyond = frame(FrameType.TOKEN, 200, 9)

MSTP_CASES: tuple[Case, ...] = (
    # tokens
    Case(
        "MS/TP token used after it was passed again",
        Ring(
            (
                _with(_one, change=partial(waiting, usage=22 * MS)),
                _with(_two, change=partial(waiting, usage=34 * MS)),
                _with(_five, change=_dawdling),
                _with(_nine, change=partial(waiting, usage=30 * MS)),
            )
        ),
        (Said(("MAC 5",), ("MS103",), _SLOW),),
        struck=("2 → 5",),
        also=("MS104",),  # there are two tokens then
        never=("MS501",),
        seconds=40,
        seeds=1,
    ),
    Case(
        "MS/TP token used when the next was polled already",
        Ring((_one, _two, _with(_five, settings={"faults": {"use_delay": 72 * MS}}), _nine)),
        (Said(("MAC 5", "2 → 5"), ("MS103", "MS102", "MS105"), _SLOW),),
        also=("MS104",),
        never=("MS501",),
        seconds=20,
        seeds=1,
    ),
    Case(
        "MS/TP slow to use the token, FTDI",
        Ring(
            (
                _one,
                _with(_two, change=partial(waiting, usage=95 * MS)),
                _with(_five, settings={"faults": {"use_delay": 60 * MS}}),
                _nine,
            )
        ),
        (Said(("MAC 5",), ("MS103",), _SLOW),),
        FTDI,
        seconds=20,
    ),
    Case(
        "MS/TP lost token, FTDI",
        Ring((_one, _two, _five, _with(_nine, settings={"faults": {"loses_token_every": 200}}))),
        (("MS101", "MAC 9"),),
        FTDI,
        seconds=40,
    ),
    Case(
        "MS/TP station shut out",
        Ring(
            (
                _one,
                _two,
                _with(_five, change=partial(PollsOnlyTo, at=5 * S, max_master=7)),
                _with(_nine, change=partial(FailsFor, at=8 * S, until=9 * S, faults=Faults(off=True))),
            )
        ),
        (Said(("MAC 9", "MAC 5", "5 → 9"), words=_OUT),),
        also=("MS106", "MS101"),
        seconds=40,
        seeds=1,
    ),
    Case(
        "MS/TP master does not wait for answers",
        Ring(
            (
                _with(_one, change=partial(GivesUpSoon, after=60 * MS)),
                _two,
                _with(_five, settings={"faults": {"reply_delay": 90 * MS}}),
                _nine,
            )
        ),
        (("MS307", "MAC 1"),),
        also=("MS101",),  # its answers run into tokens
        struck=("MAC 5", "MAC 9", "1 → 5"),
        seconds=30,
    ),
    *(
        Case(
            f"MS/TP answers when its asker has given up, {delay} ms",
            Ring((_one, _two, _with(_five, settings={"faults": {"reply_delay": delay * MS}}), _nine)),
            (("MS308", "MAC 5"),),
            also=("MS101",),  # it is given tokens while it answers
            struck=("2 → 5", "1 → 5"),
            seconds=20,
            seeds=1,
        )
        for delay in (300, 340)
    ),
    Case(
        "MS/TP several stations shut out",
        Ring(
            (
                _one,
                _with(_two, change=partial(PollsOnlyTo, at=5 * S, max_master=1)),
                _with(_five, change=_off_for_a_second),
                _with(_nine, change=_off_for_a_second),
            )
        ),
        (("MS112", "MAC 2"),),
        also=("MS106", "MS101"),
        seconds=40,
        seeds=1,
    ),
    Case(
        "MS/TP polls up to Max_Master after each loss",
        Ring(
            (
                Member(1, partial(controller, 2), partial(Blinks, every=15 * S, off=200 * MS), _far),
                Member(2, partial(drive, 2), settings=_far),
            )
        ),
        (Said(("MAC 2", "bus", "2 → 1", "MAC 1"), words=_SECONDS),),
        also=("MS101", "MS106"),
        seconds=90,
        seeds=1,
    ),
    Case(
        "MS/TP slave speaks unasked",
        Ring(_four, others={"slave": _unasked}),
        (Said(("MAC 200",), words=_UNASKED),),
        never=("MS104", "MS501"),
        seconds=30,
    ),
    Case(
        "MS/TP slave speaks behind polls, tokens get lost",
        Ring((Member(3, partial(controller, 9)), _five, _nine), others={"slave": _behind_polls}),
        (Said(("MAC 200",), words=_UNASKED),),
        never=("MS104", "MS501"),
        seconds=30,
    ),
    Case(
        "MS/TP last octet of answers to polls lost",
        Ring(
            tuple(_with(member, settings={"max_master": 15}) for member in _four),
            (When(_is_poll_reply, Trimmed("mac 9", last=1)),),
        ),
        (Said(("MAC 9", "5 → 9"), ("MS402", "MS405"), _LAST),),
        seconds=60,
        seeds=1,
    ),
    Case(
        "MS/TP noise after polls",
        Ring(_four, (When(_is_poll, NoiseInGaps(0.5, places=(Place.BETWEEN,))),)),
        (Said(("bus",), ("MS403", "LN203", "MS401", "LN202"), r"noise|stray"),),
        struck=("MAC 2", "MAC 5", "MAC 9"),  # who polls; nobody is at the addresses polled
        seconds=60,
    ),
    Case(
        "MS/TP second token, FTDI",
        partial(mstp, polls_every=12, node_faults={9: {"forges_every": 3}}),
        (("MS104", "bus"),),
        FTDI,
        struck=("MAC 9",),
        never=("MS406",),
        seconds=30,
        seeds=1,
    ),
    Case(
        "MS/TP token to a forbidden address in the first search",
        Ring(
            (
                Member(3, partial(controller, 9), settings=_far),
                Member(5, partial(controller, 9), settings=_far),
                Member(9, partial(drive, 9), partial(AlsoSends, line=MSTP_LINE, every=40, extra=_token_beyond), _far),
                Member(66, partial(drive, 66), settings=_far),
            )
        ),
        (("MS404", "MAC 9"),),
        also=("MS404",),
        never=("MS106", "MS406"),
        seconds=5,
        seeds=1,
    ),
    Case(
        "MS/TP token to a forbidden address, CH340",
        Ring(
            (_one, _two, _five, _with(_nine, change=partial(AlsoSends, line=MSTP_LINE, every=40, extra=_token_beyond)))
        ),
        (("MS404", "MAC 9"),),
        CH340,
        also=("MS404",),
        never=("MS106", "MS406"),
        seeds=1,
    ),
    # what this tap alone does not hear
    Case(
        "MS/TP frames not heard here",
        Ring(_four),
        (("MS406", "bus"),),
        hear=partial(unheard, ("mac 1", "mac 2", "mac 5", "mac 9"), 0.03),
        never=("MS101", "MS104", "MS106", "MS301", "MS302"),
        seconds=30,
        seeds=2,
    ),
    Case(
        "MS/TP one station not heard here",
        Ring(_four),
        (("MS406", "MAC 9"),),
        hear=partial(unheard, ("mac 9",), 1.0),
        never=("MS101", "MS104", "MS106", "MS301"),
        seconds=20,
        seeds=1,
    ),
    # who talks too much
    Case(
        "MS/TP one sends twenty frames with each token",
        Ring((Member(1, partial(_greedy, 20), settings={"max_info_frames": 20}), _two, _five, _nine)),
        (Said(("MAC 1",), ("MS108", "MS601"), _HOG),),
        seconds=40,
        seeds=1,
    ),
    Case(
        "MS/TP broadcast storm",
        Ring((_one, Member(2, partial(Sends, i_am(2), 0, 10), settings={"max_info_frames": 10}), _five, _nine)),
        (Said(("MAC 2", "bus"), words="broadcast"),),
        struck=("MAC 2",),
        seconds=20,
        seeds=1,
    ),
    # who has a number
    Case(
        "MS/TP test of the own number answered by another",
        Ring(
            (_one, _two, _five, _with(_nine, change=partial(TestsItself, line=MSTP_LINE, every=2 * S))),
            others={"twin": _answers_tests},
        ),
        (Said(("MAC 9",), ("MS501",), _SECOND),),
        also=("MS501",),
        seconds=20,
        seeds=1,
    ),
    Case(
        "MS/TP two drives with one number, other values",
        Ring(_four, others={"twin": partial(_twin, 9)}),
        (Said(("MAC 9",), ("MS501",), _SECOND),),
        struck=("MAC 2", "MAC 5", "5 → 9", "9 → 1"),
        also=("MS501", "MS104", "MS101"),
        seconds=40,
        seeds=1,
    ),
    # damage of one
    Case(
        "MS/TP requests of the controller damaged",
        Ring(_four, (When(_is_request, OfLong(20, EarlyRelease(0.7, ("mac 1",)))),)),
        (Said(("MAC 1",), ("MS402", "MS401", "MS405"), r"damag"),),
        never=("MS301",),
        seconds=40,
    ),
    Case(
        "MS/TP first octet of one lost",
        Ring(_four, (Trimmed("mac 5", first=1, rate=0.08),)),
        (Said(("MAC 5",), ("MS402", "MS401", "MS405"), r"\bfirst\b|too late|damag"),),
        struck=("2 → 5", "5 → 9", "MAC 9"),
        seconds=60,
    ),
    # messages
    Case(
        "MS/TP segmented answer aborted",
        Ring((Member(1, partial(Lister, 5, 5)), _two, Member(5, partial(Segmenting, 5, aborts=True)), _nine)),
        (Said(("MAC 5", "1 → 5", "MAC 1"), ("MS305",), r"abort"),),
        struck=("MAC 5",),
        seconds=30,
        seeds=1,
    ),
    Case(
        "MS/TP wrong day of the week",
        Ring((Member(1, partial(Sends, time_to_all(3), 2 * S)), _two, _five, _nine)),
        (Said(("MAC 1", "bus"), words=r"weekday|day of (the|a) week"),),
        seconds=20,
        seeds=1,
    ),
    Case(
        "MS/TP request without the reply bit",
        Ring((Member(1, partial(Sends, asked_without_reply_bit(9), S)), _two, _five, _nine)),
        (Said(("MAC 1", "bus"), words=r"reply"),),
        seconds=20,
        seeds=1,
    ),
    Case(
        "MS/TP values of the wrong type",
        Ring((_one, _two, Member(5, partial(WrongType, 5)), _nine)),
        (Said(("MAC 5", "bus"), words=r"\btype\b|\breal\b"),),
        seconds=20,
        seeds=1,
    ),
    Case(
        "MS/TP writes a value of the wrong type",
        Ring((Member(1, _wrong_write), _two, _five, _nine)),
        (Said(("MAC 1", "MAC 9", "bus"), ("MS305",), r"\btype\b|\breal\b"),),
        seconds=20,
        seeds=1,
    ),
)
