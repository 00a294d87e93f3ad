"""Time patterns, noise from outside, settings: what is wrong with the line or the capture as a whole. Data."""

from __future__ import annotations

from functools import partial

from dissectors.bacnet.simulated import SimulatedNode
from dissectors.frame import Place
from dissectors.line import LineSettings, Timing
from dissectors.modbus.simulated_master import read_holding, write_register
from dissectors.simulated import Station
from dissectors.simulated_faults import LostResponse, NoiseInGaps
from sniff.simulation.tap import FTDI
from tests.faults.buses import modbus, mstp, n2
from tests.faults.case import Case, Said
from tests.faults.hearing import (
    as_protocol,
    busy_host,
    echoing,
    from_to,
    hidden_latency,
    other_settings,
    sent_otherwise,
    swapped,
)
from tests.faults.interference import Interference
from tests.faults.misbehaving import Halts
from tests.faults.ring_programs import controller, drive
from tests.faults.stations import Dies
from tests.faults.workbench import N2, Member, Modbus, Ring, by_turns, follower, usual_requests, usual_stations

MS = 1_000_000
S = 1_000_000_000

_bus = ("bus",)
_FOUR = (1, 2, 3, 4)
_NOISE = ("MB007", "LN101", "LN103", "LN203", "LN204", "MS401", "MS403")

_HUM = r"mains|hum\b|50 Hz|100 Hz|\b[12]0(\.0)? ms|regular|period|rhythm"
_CONTACTOR = r"every (5|4\.9|5\.0)|regular|period|rhythm|contactor|switch"
_STOPPED = r"silen|stopp?ed|paus|nothing|quiet|stood still|stands still"
_TOGETHER = r"at (one|the same|that) (moment|time)|together|at once|same moment|in common|simultaneous"
_OTHER = r"other protocol|another protocol|ms/?tp|bacnet|another baud|two protocols"
_COPY = r"\becho|\bcop(y|ies|ied)|gives? back|repeats? the request"
_LOAD = r"\bload|busy|limit|occup|capacity|in use|utili|of the (line|time)|line time"

RTU_8N1 = LineSettings.parse("19200,8N1")

_hum = partial(Interference, 20 * MS, jitter=MS // 2, octets=(1, 2), share=0.08)
_contactor = partial(Interference, 5 * S, jitter=20 * MS, octets=(12, 40))
_sparks = partial(Interference, 1_500 * MS, jitter=None, octets=(1, 3))

_rtu = Modbus(usual_requests(_FOUR), usual_stations(_FOUR))
_ascii = Modbus(usual_requests(_FOUR), usual_stations(_FOUR, is_ascii=True), is_ascii=True)
_uneven = (read_holding(1, 0, 2), read_holding(2, 0, 110), read_holding(3, 0, 2), read_holding(4, 0, 2))
_followers = {"drive 1": partial(follower, 1, 10 * MS), "drive 2": partial(follower, 2, 18 * MS)}
_n2 = N2(partial(by_turns, 1, 2), _followers)
_members = (Member(1, partial(controller, 5, 9)), Member(5, partial(drive, 5)), Member(9, partial(drive, 9)))
_ringing = NoiseInGaps(0.3, most=1, places=(Place.AFTER,), values=b"\xff\xfe\xf8")


def _with(bus: Modbus, **more: object) -> Modbus:
    return Modbus(**{**bus.__dict__, **more})


def _with_n2(**more: object) -> N2:
    return N2(**{**_n2.__dict__, **more})


def _dying(*units: int) -> dict[int, partial[Dies]]:
    return {unit: partial(Dies, at=30 * S, until=42 * S) for unit in units}


def _bacnet_drive(*, seed: int) -> Station:
    """A drive whose port still speaks BACnet MS/TP; it looks for other masters as soon as nobody speaks."""
    return SimulatedNode(7, Timing(RTU_8N1), max_master=127)


def _dies(address: int, delay: int) -> Station:
    return Dies(follower(address, delay), at=30 * S, until=42 * S)


_beside_bacnet = Modbus(
    usual_requests(_FOUR),
    usual_stations(_FOUR),
    others={"bacnet drive": _bacnet_drive},
    line=RTU_8N1,
    interval=1_300 * MS,
)

LINE_CASES: tuple[Case, ...] = (
    # patterns in time
    Case("RTU mains hum", _with(_rtu, others={"hum": _hum}), (Said(_bus, words=_HUM),)),
    Case("N2 mains hum", _with_n2(others={"hum": _hum}), (Said(_bus, words=_HUM),), seconds=120),
    Case(
        "RTU contactor every five seconds",
        _with(_rtu, others={"contactor": _contactor}),
        (Said(_bus, words=_CONTACTOR),),
        seconds=180,
    ),
    Case(
        "ASCII contactor every five seconds",
        _with(_ascii, others={"contactor": _contactor}),
        (Said(_bus, words=_CONTACTOR),),
        seconds=180,
    ),
    Case(
        "MS/TP contactor every five seconds",
        Ring(_members, others={"contactor": _contactor}),
        (Said(_bus, words=_CONTACTOR),),
        seconds=120,
    ),
    Case(
        "RTU baud rate another one for a while",
        partial(modbus, pause=60 * MS),
        (Said(_bus, words=r"baud|9600", own_words=True),),
        hear=partial(sent_otherwise, partial(from_to, 20 * S, 34 * S, LineSettings(9600, 8, "E", 1))),
        seconds=60,
        seeds=1,
    ),
    Case(
        "RTU master stops for 20 s",
        _with(_rtu, change_master=partial(Halts, at=30 * S, until=50 * S)),
        (Said(("bus", "master"), words=_STOPPED),),
        seconds=80,
        seeds=1,
    ),
    Case(
        "N2 supervisor stops for 20 s",
        _with_n2(change_master=partial(Halts, at=30 * S, until=50 * S)),
        (Said(("bus", "master"), words=_STOPPED),),
        seconds=80,
        seeds=1,
    ),
    Case(
        "RTU several stations lost at one moment",
        _with(_rtu, change=_dying(2, 3)),
        (Said(_bus, words=_TOGETHER),),
        struck=("station 2", "station 3"),
        also=("MB001", "MB003"),
        seconds=70,
        seeds=1,
    ),
    Case(
        "ASCII several stations lost at one moment",
        _with(_ascii, change=_dying(1, 3, 4)),
        (Said(_bus, words=_TOGETHER),),
        struck=("station 1", "station 3", "station 4"),
        also=("MB001", "MB003"),
        seconds=70,
        seeds=1,
    ),
    Case(
        "N2 several stations lost at one moment",
        N2(
            partial(by_turns, 1, 2, 3),
            {
                "drive 1": partial(follower, 1, 10 * MS),
                "drive 2": partial(_dies, 2, 18 * MS),
                "drive 3": partial(_dies, 3, 14 * MS),
            },
        ),
        (Said(_bus, words=_TOGETHER),),
        struck=("station 2", "station 3"),
        seconds=80,
        seeds=1,
    ),
    # noise that falls anywhere
    Case(
        "RTU noise anywhere, mostly on the one with long answers",
        Modbus(_uneven, usual_stations(_FOUR), others={"sparks": _sparks}, pause=40 * MS),
        (Said(_bus, _NOISE, r"noise|stray|damag"),),
        seconds=120,
    ),
    Case(
        "ASCII noise anywhere, mostly on the one with long answers",
        Modbus(
            _uneven,
            usual_stations(_FOUR, is_ascii=True),
            others={"sparks": _sparks},
            pause=40 * MS,
            timeout=500 * MS,
            is_ascii=True,
        ),
        (Said(_bus, _NOISE, r"noise|stray|damag"),),
        seconds=120,
    ),
    Case(
        "N2 noise anywhere",
        _with_n2(others={"sparks": _sparks}),
        (Said(_bus, _NOISE, r"noise|stray|damag"),),
        seconds=120,
    ),
    Case(
        "MS/TP noise anywhere",
        Ring(_members, others={"sparks": partial(Interference, 400 * MS, jitter=None, octets=(1, 3))}),
        (Said(_bus, _NOISE, r"noise|stray|damag"),),
        seconds=60,
    ),
    Case(
        "RTU ringing after everybody's frames",
        _with(_rtu, faults=(_ringing,)),
        (Said(_bus, ("LN202", "LN203"), r"stray|after"),),
    ),
    Case(
        "N2 ringing after everybody's frames",
        _with_n2(faults=(_ringing,)),
        (Said(_bus, ("LN202", "LN203"), r"stray|after"),),
    ),
    # somebody with another protocol
    Case(
        "RTU one drive still speaks BACnet",
        _beside_bacnet,
        (Said(_bus, ("LN204",), _OTHER),),
        also=("LN003",),
        never=("MB203",),
        seeds=1,
    ),
    Case(
        "RTU one drive still speaks BACnet, heard for a short time",
        _beside_bacnet,
        (Said(_bus, ("LN303",)),),
        seconds=20,
        never=("MB202", "MB203"),
        seeds=1,
    ),
    # a converter that gives back what the master sends
    Case("ASCII echo", _ascii, (("LN205", "bus"),), hear=partial(echoing, 0), never=("MB203", "MB201"), seeds=1),
    Case(
        "ASCII echo cut short",
        _ascii,
        (Said(("bus", "master", "adapter"), ("LN205",), _COPY),),
        hear=partial(echoing, 3),
        never=("MB203", "MB201", "MB202"),
        seeds=1,
    ),
    Case("N2 echo", _n2, (("LN205", "bus"),), hear=partial(echoing, 0), never=("N2007", "N2008"), seeds=1),
    # a busy computer, or one that hides how late it was, beside a fault
    Case("busy host, station absent", partial(modbus, absent=(4,)), (("MB001", "station 4"),), FTDI, hear=busy_host),
    Case(
        "busy host, answers lost",
        partial(modbus, (LostResponse(0.1, ("unit 2",)),)),
        (("MB002", "station 2"),),
        hear=busy_host,
    ),
    Case(
        "busy host, N2 answers lost",
        partial(n2, (LostResponse(0.1, ("drive 2",)),)),
        (("N2005", "station 2"),),
        hear=busy_host,
        seconds=120,
    ),
    Case(
        "busy host, MS/TP silent drive",
        partial(mstp, node_faults={9: {"silent": True}}),
        (("MS301", "MAC 9"),),
        FTDI,
        hear=busy_host,
        seconds=30,
    ),
    Case(
        "hidden latency, N2 answers lost",
        partial(n2, (LostResponse(0.1, ("drive 2",)),)),
        (("N2005", "station 2"),),
        FTDI,
        hear=hidden_latency,
        seconds=120,
    ),
    Case(
        "hidden latency, MS/TP silent drive",
        partial(mstp, node_faults={9: {"silent": True}}),
        (("MS301", "MAC 9"),),
        FTDI,
        hear=hidden_latency,
        seconds=30,
    ),
    # who uses the line
    Case(
        "RTU bus near its limit",
        Modbus(
            tuple(read_holding(unit, 0, 60) for unit in _FOUR),
            usual_stations(_FOUR, unit_1=5 * MS, unit_2=5 * MS, unit_3=5 * MS, unit_4=5 * MS),
            pause=5 * MS,
            line=LineSettings.parse("9600,8E1"),
        ),
        (Said(("bus", "master"), words=_LOAD),),
        seeds=1,
    ),
    Case(
        "ASCII bus near its limit",
        Modbus(
            tuple(read_holding(unit, 0, 60) for unit in _FOUR),
            usual_stations(_FOUR, is_ascii=True, unit_1=5 * MS, unit_2=5 * MS, unit_3=5 * MS, unit_4=5 * MS),
            pause=5 * MS,
            is_ascii=True,
        ),
        (Said(("bus", "master"), words=_LOAD),),
        seeds=1,
    ),
    Case(
        "N2 bus near its limit",
        N2(
            partial(by_turns, 1, 2),
            {"drive 1": partial(follower, 1, 2 * MS), "drive 2": partial(follower, 2, 2 * MS)},
            pause=2 * MS,
        ),
        (Said(("bus", "master"), words=_LOAD),),
        seeds=1,
    ),
    Case(
        "RTU mostly broadcasts",
        Modbus(
            (*(write_register(0, k, 7) for k in range(9)), read_holding(1, 0, 4)),
            usual_stations((1,)),
            pause=10 * MS,
            turnaround=20 * MS,
        ),
        (Said(("bus", "master"), words="broadcast"),),
        seeds=1,
    ),
    # the capture's settings
    Case(
        "listens with 7 data bits",
        partial(modbus, line=RTU_8N1),
        (Said(_bus, words=r"(7|seven) data bits|data bits", own_words=True),),
        also=("LN003",),
        hear=partial(other_settings, "19200,7E1"),
        seconds=20,
        seeds=1,
    ),
    Case(
        "listens twice as fast",
        modbus,
        (Said(_bus, words=r"19200|half", own_words=True),),
        also=("LN003",),
        hear=partial(other_settings, "38400,8E1"),
        seconds=20,
        seeds=1,
    ),
    Case(
        "pair swapped, and it says so",
        modbus,
        (Said(_bus, words=r"swap|revers", own_words=True),),
        also=("LN003",),
        hear=swapped,
        seconds=20,
        seeds=1,
    ),
    Case(
        "N2 heard as RTU",
        n2,
        (Said(_bus, words=r"\bn2\b", own_words=True),),
        also=("LN003",),
        hear=partial(as_protocol, "modbus-rtu"),
        seeds=1,
    ),
    Case(
        "MS/TP heard as RTU",
        mstp,
        (Said(_bus, words=r"ms/?tp|bacnet", own_words=True),),
        also=("LN003",),
        hear=partial(as_protocol, "modbus-rtu"),
        seconds=20,
        seeds=1,
    ),
    Case(
        "RTU heard as MS/TP",
        modbus,
        (Said(_bus, words=r"rtu", own_words=True),),
        also=("LN003",),
        hear=partial(as_protocol, "mstp"),
        seeds=1,
    ),
    Case(
        "ASCII heard as RTU",
        partial(modbus, is_ascii=True),
        (Said(_bus, words=r"ascii", own_words=True),),
        also=("LN003",),
        hear=partial(as_protocol, "modbus-rtu"),
        seeds=1,
    ),
    Case(
        "RTU heard as N2",
        modbus,
        (Said(_bus, words=r"rtu", own_words=True),),
        also=("LN003",),
        hear=partial(as_protocol, "n2"),
        seeds=1,
    ),
)
