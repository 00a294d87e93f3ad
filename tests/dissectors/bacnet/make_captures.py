"""Makes the captures that show what BACnet messages say, rather than what the ring does.

python -m tests.dissectors.bacnet.make_captures captures && pytest --sniff-update captures

The same code gives the same files.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import codec, services
from dissectors.bacnet.dates import Date, Time
from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.values import ConstructedValue, Enumerated
from tests.dissectors.bacnet.segmented_bus import (
    READ,
    READ_MULTIPLE,
    WRITE_MULTIPLE,
    Party,
    SegmentedBus,
    Step,
    doubled,
    reads,
    results,
    save,
    spoilt,
    writes,
)

COV, I_AM, WRITE, TIME_SYNCHRONIZATION = 1, 0, 15, 6


def segments() -> list[Step]:
    """A list of objects and values read, setpoints written, each in segments; the last answer comes from a router."""
    bus = SegmentedBus(Party(2), Party(7))
    bus.rounds(2)
    body = codec.encode(services.CONFIRMED[READ], {"object-identifier": "device,70", "property-identifier": 76})
    objects = tuple(f"binary-input,{number}" for number in range(24))
    listed = {"object-identifier": "device,70", "property-identifier": 76, "property-value": _ids(objects)}
    bus.ask(90, READ, body)
    bus.answer_in_segments(90, READ, codec.encode(services.ACK[READ], listed), 48, 2)
    bus.ask_in_segments(91, WRITE_MULTIPLE, writes(9), 60, 4)
    bus.reply(91, WRITE_MULTIPLE)
    routed = SegmentedBus(Party(2), Party(7, 21, b"\x2a"), bus.steps)
    routed.ask(92, READ_MULTIPLE, reads(10))
    routed.answer_in_segments(92, READ_MULTIPLE, results(10), 50, 1)
    bus.rounds(2)
    return bus.steps


def _ids(names: tuple[str, ...]) -> tuple[Any, ...]:
    from dissectors.bacnet.values import ObjectId

    return tuple(ObjectId.parse(name) for name in names)


def segments_lost() -> list[Step]:
    """One segment is damaged, refused and sent again; the last acknowledgement is sent twice; another answer is
    aborted in the middle by the one that asked."""
    bus = SegmentedBus(Party(2), Party(7))
    bus.rounds(2)
    bus.ask(40, READ_MULTIPLE, reads(12))
    bus.answer_in_segments(40, READ_MULTIPLE, results(12), 50, 3)
    at = next(number for number, step in enumerate(bus.steps) if step.name == "ack 3")
    refusal = SegmentedBus(Party(2), Party(7))
    refusal.acknowledge(refusal.client, 40, 1, 3, negative=True)
    refusal.turn(7)
    again = [step for step in bus.steps if step.name in ("segment 2", "segment 3")]
    refusal.steps += again
    refusal.turn(2)
    steps = [*spoilt(bus.steps[:at], "segment 2"), *refusal.steps, *doubled(bus.steps[at:], "ack 3", 4.0)]
    rest = SegmentedBus(Party(2), Party(7))
    rest.ask(41, READ_MULTIPLE, reads(12))
    rest.answer_in_segments(41, READ_MULTIPLE, results(12), 50, 1)
    until = next(number for number, step in enumerate(rest.steps) if step.name == "ack 1")
    rest.steps = rest.steps[:until]
    rest.send("abort", rest.client, apdus.encode(7, invoke_id=41, reason=1), 6, False)
    rest.rounds(2)
    return [*steps, *rest.steps]


def segments_heard_damaged() -> list[Step]:
    """Of setpoints written in segments the sniffer hears the second one damaged, and once the last; the station
    acknowledges and answers as if nothing were."""
    steps: list[Step] = []
    for invoke, name in ((50, "request 1"), (51, "request 2")):
        bus = SegmentedBus(Party(4), Party(17))
        bus.rounds(2)
        bus.ask_in_segments(invoke, WRITE_MULTIPLE, writes(9), 60, 1)
        bus.reply(invoke, WRITE_MULTIPLE)
        bus.rounds(2)
        steps += spoilt(bus.steps, name)
    return steps


def behind_routers() -> list[Step]:
    """Reads from MS/TP, BACnet/IP, Ethernet and VMAC addresses behind a router."""
    steps: list[Step] = []
    places = (
        Party(9, 30, b"\x10"),
        Party(9, 30, b"\xc8"),
        Party(9, 1, bytes((10, 20, 30, 40, 0xBA, 0xC0))),
        Party(9, 2, bytes.fromhex("00e0c9123456")),
        Party(9, 4, bytes.fromhex("01e240")),
    )
    for invoke, place in enumerate(places, 1):
        bus = SegmentedBus(Party(2), place, steps)
        bus.rounds(1)
        body = codec.encode(
            services.CONFIRMED[READ], {"object-identifier": "analog-input,4", "property-identifier": 85}
        )
        value = {"object-identifier": "analog-input,4", "property-identifier": 85, "property-value": 19.5}
        bus.ask(invoke, READ, body)
        bus.reply(invoke, READ, codec.encode(services.ACK[READ], value), at_once=True)
    return steps


def no_reply_bit() -> list[Step]:
    """Confirmed changes of value without the reply bit; an I-Am to one station that asks for a reply; a read in the
    right frame type without the bit."""
    bus = SegmentedBus(Party(3), Party(8))
    bus.rounds(1)
    for invoke in (17, 18, 19):
        bus.send("request", bus.client, _cov(invoke), FrameType.DATA_NOT_EXPECTING_REPLY, False)
        bus.reply(invoke, COV)
    body = apdus.encode(1, codec.encode(services.UNCONFIRMED[I_AM], _I_AM), service=I_AM)
    bus.send("i-am", bus.client, body, FrameType.DATA_EXPECTING_REPLY, True)
    bus.say("token", bus.steps[0].octets, 300.0)
    bus.turn(3)
    body = codec.encode(services.CONFIRMED[READ], {"object-identifier": "analog-input,4", "property-identifier": 85})
    octets = apdus.encode(0, body, invoke_id=20, service=READ)
    bus.send("request", bus.client, octets, FrameType.DATA_EXPECTING_REPLY, False)
    value = {"object-identifier": "analog-input,4", "property-identifier": 85, "property-value": 19.5}
    bus.reply(20, READ, codec.encode(services.ACK[READ], value), at_once=True)
    bus.rounds(1)
    return bus.steps


_I_AM = {
    "i-am-device-identifier": "device,30",
    "max-apdu-length-accepted": 480,
    "segmentation-supported": "no-segmentation",
    "vendor-id": 999,
}


def _cov(invoke: int) -> bytes:
    values = {
        "subscriber-process-identifier": 2,
        "initiating-device-identifier": "device,30",
        "monitored-object-identifier": "binary-input,6",
        "time-remaining": 120,
        "list-of-values": [{"property-identifier": 85, "value": Enumerated(1, "BinaryPV")}],
    }
    return apdus.encode(0, codec.encode(services.CONFIRMED[COV], values), invoke_id=invoke, service=COV)


def wrong_dates() -> list[Step]:
    """A weekday that is another, a day that is none, an hour that is none; and dates that are right."""
    bus = SegmentedBus(Party(3), Party(8))
    bus.rounds(1)
    whens = (
        (Date(125, 12, 24, 2), Time(8, 15, 0, 0)),  # a Wednesday
        (Date(125, 2, 29, 255), Time(8, 15, 0, 0)),  # no leap year
        (Date(125, 12, 24, 3), Time(24, 0, 0, 0)),
        (Date(125, 12, 24, 3), Time(8, 15, 0, 0)),
        (Date(255, 12, 24, 5), Time(255, 255, 255, 255)),
    )
    for day, hour in whens:
        when = ConstructedValue("DateTime", (("date", day), ("time", hour)))
        body = codec.encode(services.UNCONFIRMED[TIME_SYNCHRONIZATION], {"time": when})
        octets = apdus.encode(1, body, service=TIME_SYNCHRONIZATION)
        bus.send("time", bus.client, octets, FrameType.DATA_NOT_EXPECTING_REPLY, False)
        bus.rounds(1)
    return bus.steps


def other_types() -> list[Step]:
    """Numbers that come as text, a count as a real, a state as a Boolean; a written Null, which is right."""
    bus = SegmentedBus(Party(3), Party(8))
    bus.rounds(1)
    asked = (("analog-input,11", 85, "21.5"), ("multi-state-value,2", 85, 3.0), ("binary-value,1", 85, True))
    for invoke, (target, number, value) in enumerate(asked, 1):
        about = {"object-identifier": target, "property-identifier": number}
        bus.ask(invoke, READ, codec.encode(services.CONFIRMED[READ], about))
        bus.reply(invoke, READ, codec.encode(services.ACK[READ], {**about, "property-value": value}), at_once=True)
    about = {"object-identifier": "analog-output,1", "property-identifier": 85, "property-value": None, "priority": 8}
    bus.ask(9, WRITE, codec.encode(services.CONFIRMED[WRITE], about))
    bus.reply(9, WRITE, at_once=True)
    bus.rounds(1)
    return bus.steps


def schedules() -> list[Step]:
    """A day with three times, days of a calendar, tags with and without values, a present value of a program."""
    bus = SegmentedBus(Party(3), Party(8))
    bus.rounds(1)
    day = tuple({"time": Time(hour, 0, 0, 0), "value": value} for hour, value in ((8, 21.0), (18, 16.5), (22, None)))
    calendar: tuple[tuple[str, object], ...] = (
        ("date", Date(126, 12, 25, 5)),
        ("week-n-day", bytes((255, 6, 5))),
        ("week-n-day", bytes((2, 1, 255))),
    )
    tags = ({"name": "floor", "value": 3}, {"name": "hidden"}, {"name": "zone", "value": "north"})
    told: tuple[tuple[str, int, int | None, object], ...] = (
        ("schedule,1", 123, 1, ConstructedValue("DailySchedule", (("day-schedule", day),))),
        ("calendar,1", 23, None, tuple(ConstructedValue("CalendarEntry", (entry,)) for entry in calendar)),
        ("device,8", 486, None, tuple(ConstructedValue("NameValue", tuple(tag.items())) for tag in tags)),
        ("program,1", 85, None, "stopped"),
    )
    for invoke, (target, number, index, value) in enumerate(told, 1):
        about: dict[str, object] = {"object-identifier": target, "property-identifier": number}
        about |= {} if index is None else {"property-array-index": index}
        bus.ask(invoke, READ, codec.encode(services.CONFIRMED[READ], about))
        bus.reply(invoke, READ, codec.encode(services.ACK[READ], {**about, "property-value": value}), at_once=True)
    bus.rounds(1)
    return bus.steps


CAPTURES: dict[str, Callable[[], list[Step]]] = {
    "mstp-segments": segments,
    "mstp-segments-lost": segments_lost,
    "mstp-behind-routers": behind_routers,
    "mstp-schedules": schedules,
    "findings/ms-tp-segments-heard-damaged": segments_heard_damaged,
    "findings/ms-tp-confirmed-without-reply-bit": no_reply_bit,
    "findings/ms-tp-dates-that-are-none": wrong_dates,
    "findings/ms-tp-values-of-another-type": other_types,
}


def make(folder: Path) -> None:
    """Write all of them."""
    for name, steps in CAPTURES.items():
        save(folder / f"{name}.cap.txt", [replace(step, silence=round(step.silence, 3)) for step in steps()])


if __name__ == "__main__":
    make(Path(sys.argv[1]))
