"""What is wrong with a ring of BACnet MS/TP, and what a technician should be told. Data."""

from __future__ import annotations

from functools import partial

from dissectors.bacnet.application import read_property
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.simulated import Faults
from dissectors.frame import Place
from dissectors.simulated_faults import BitFlips, EarlyRelease, NoiseInGaps
from tests.faults.buses import MSTP_LINE, mstp
from tests.faults.case import Case
from tests.faults.ring_nodes import AlsoSends, ComesAndGoes, FailsFor, SlowToBeFound
from tests.faults.stations import OfLong

MS = 1_000_000
S = 1_000_000_000

_AWAY = 3_050 * MS  # another one has the token then
_token_to_itself = frame(FrameType.TOKEN, 5, 5)
_asking_all = frame(FrameType.DATA_EXPECTING_REPLY, 255, 9, read_property(1, "device,9", "object-name"))
_token_beyond = frame(FrameType.TOKEN, 200, 9)

RING_CASES: tuple[Case, ...] = (
    Case("MS/TP lost token", partial(mstp, node_faults={9: {"loses_token_every": 400}}), (("MS101", "MAC 9"),)),
    Case("MS/TP slow to use the token", partial(mstp, node_faults={5: {"use_delay": 18 * MS}}), (("MS103", "MAC 5"),)),
    Case("MS/TP silent drive", partial(mstp, node_faults={9: {"silent": True}}), (("MS301", "MAC 9"),)),
    Case(
        "MS/TP object that is not there",
        partial(mstp, also_logged=((9, "analog-input,999", "present-value"),)),
        (("MS305", "MAC 9"),),
    ),
    Case(
        "MS/TP damaged frames of one",
        partial(mstp, node_faults={5: {"damages_every": 40}}),
        (("MS401", "bus"),),
        struck=("MAC 5",),
    ),
    Case("MS/TP bit errors everywhere", partial(mstp, (BitFlips(3e-4),)), (("MS401", "bus"),)),
    Case("MS/TP postponed replies", partial(mstp, node_faults={9: {"postpones": True}}), (("MS303", "MAC 9"),)),
    Case(
        "MS/TP station leaves",
        partial(mstp, change={9: partial(FailsFor, at=3 * S, until=None, faults=Faults(off=True))}),
        (("MS102", "5 → 9"), ("MS106", "MAC 9")),
        struck=("MAC 9",),
    ),
    Case(
        "MS/TP station comes back",
        partial(mstp, polls_every=20, change={9: partial(FailsFor, at=_AWAY, until=4 * S, faults=Faults(off=True))}),
        (("MS105", "5 → 9"),),
        struck=("MAC 9", "1 → 9", "2 → 9"),
    ),
    Case(
        "MS/TP station comes and goes",
        partial(mstp, polls_every=20, change={9: partial(ComesAndGoes, every=10 * S, away=3 * S)}),
        (("MS105", "5 → 9"),),
        seconds=58,
        struck=("MAC 9", "1 → 9", "2 → 9"),
        never=("MS106",),
    ),
    Case(
        "MS/TP second token",
        partial(mstp, polls_every=12, node_faults={9: {"forges_every": 3}}),
        (("MS104", "bus"),),
        struck=("MAC 9",),
    ),
    Case(
        "MS/TP token to itself",
        partial(mstp, present=(5,), change={5: partial(AlsoSends, line=MSTP_LINE, every=50, extra=_token_to_itself)}),
        (("MS107", "MAC 5"),),
    ),
    Case(
        "MS/TP slow round",
        partial(mstp, requests=5, node_faults={5: {"reply_delay": 245 * MS}, 9: {"reply_delay": 245 * MS}}),
        (("MS108", "bus"),),
        struck=("MAC 2", "MAC 5", "MAC 9"),
    ),
    Case("MS/TP alone", partial(mstp, present=(5,)), (("MS109", "MAC 5"),)),
    Case(
        "MS/TP too many polls",
        partial(mstp, polls_every=4),
        (("MS201", "bus"), ("MS201", "MAC 9")),
        struck=("MAC 2", "MAC 5"),
    ),
    Case(
        "MS/TP found late",
        partial(mstp, change={9: partial(SlowToBeFound, by=17 * MS)}),
        (("MS202", "5 → 9"),),
    ),
    Case("MS/TP late answers", partial(mstp, node_faults={5: {"reply_delay": 252 * MS}}), (("MS302", "MAC 5"),)),
    Case(
        "MS/TP broadcast that asks",
        partial(mstp, change={9: partial(AlsoSends, line=MSTP_LINE, every=40, extra=_asking_all)}),
        (("MS304", "MAC 9"),),
    ),
    Case(
        "MS/TP data of one damaged",
        partial(mstp, (OfLong(20, EarlyRelease(0.9, ("mac 5",))),)),
        (("MS402", "MAC 5"),),
    ),
    Case(
        "MS/TP noise between frames",
        partial(mstp, (NoiseInGaps(0.08, places=(Place.AFTER,)),)),
        (("MS403", "bus"),),
        struck=("MAC 1", "MAC 2", "MAC 5", "MAC 9"),
    ),
    Case(
        "MS/TP forbidden address",
        partial(mstp, change={9: partial(AlsoSends, line=MSTP_LINE, every=40, extra=_token_beyond)}),
        (("MS404", "MAC 9"),),
    ),
    Case("MS/TP address twice", partial(mstp, twin_of=9), (("MS501", "MAC 9"),), struck=("MAC 2",)),
)
