"""Content that cannot be right: reply bits, dates, types; and what must not be called odd."""

from __future__ import annotations

from datetime import date

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scapy.packet import Raw

from dissectors.bacnet import MSTP, codec, npdu, services
from dissectors.bacnet import apdu as apdus
from dissectors.bacnet.content import Odd, ReplyFlaw, oddities
from dissectors.bacnet.content_findings import ContentFindings
from dissectors.bacnet.dates import Date, Time, WhenFlaw
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.station_address import mac_text, remote
from dissectors.bacnet.text import text
from dissectors.bacnet.values import ConstructedValue, ObjectId
from dissectors.frame import Chunk, Frame, Role
from dissectors.line import LineSettings, Timing
from sniff.analysis.packet_tree import fields_of
from tests.dissectors.bacnet.samples import every_alternative, every_answer, every_property, every_service
from tests.seeds import some

TIMING = Timing(LineSettings(38400))


def frame_of(octets: bytes) -> Frame:
    framer = MSTP.framer(TIMING)
    (event,) = [*framer.feed(Chunk(10**18, octets)), *framer.close()]
    assert isinstance(event, Frame)
    return event


def kinds(octets: bytes) -> list[Odd]:
    return [oddity.kind for oddity in oddities(frame_of(octets))]


# Dates and times


@given(st.dates(date(1900, 1, 1), date(2154, 12, 31)), st.integers(1, 7))
def test_the_weekday_is_that_of_the_calendar(day: date, weekday: int):
    sent = Date(day.year - 1900, day.month, day.day, weekday)
    assert sent.true_weekday == day.isoweekday()
    assert (sent.flaw is None) == (weekday == day.isoweekday())
    assert day.isoformat() in str(sent)
    assert day.strftime("%A") in str(sent)


@given(*(st.integers(0, 255) for _ in range(4)))
def test_any_date_has_words(year: int, month: int, day: int, weekday: int):
    sent = Date(year, month, day, weekday)
    assert str(sent).startswith(sent.plain)
    assert (sent.flaw is None) == ("(" not in str(sent))


@pytest.mark.parametrize(
    ("sent", "flaw", "words"),
    [
        (Date(124, 4, 5, 4), WhenFlaw.OTHER_WEEKDAY, "2024-04-05 Thursday (it is a Friday)"),
        (Date(124, 4, 5, 5), None, "2024-04-05 Friday"),
        (Date(124, 4, 5, 255), None, "2024-04-05"),
        (Date(124, 2, 29, 255), None, "2024-02-29"),
        (Date(123, 2, 29, 255), WhenFlaw.NO_SUCH_DAY, "2023-02-29 (no such day)"),
        (Date(255, 2, 29, 255), None, "*-02-29"),
        (Date(255, 2, 30, 255), WhenFlaw.NO_SUCH_DAY, "*-02-30 (no such day)"),
        (Date(255, 255, 255, 1), None, "*-*-* Monday"),
        (Date(124, 13, 32, 255), None, "2024-odd-last"),
        (Date(124, 14, 34, 7), None, "2024-even-even Sunday"),
        (Date(124, 0, 5, 255), WhenFlaw.NO_SUCH_DAY, "2024-00-05 (no such day)"),
        (Date(124, 15, 5, 255), WhenFlaw.NO_SUCH_DAY, "2024-15-05 (no such day)"),
        (Date(124, 4, 0, 255), WhenFlaw.NO_SUCH_DAY, "2024-04-00 (no such day)"),
        (Date(124, 4, 5, 0), WhenFlaw.NO_SUCH_WEEKDAY, "2024-04-05 weekday 0 (no such weekday)"),
        (Time(24, 0, 0, 0), WhenFlaw.NO_SUCH_TIME, "24:00:00.00 (no such time)"),
        (Time(23, 59, 60, 0), WhenFlaw.NO_SUCH_TIME, "23:59:60.00 (no such time)"),
        (Time(255, 30, 255, 255), None, "*:30:*.*"),
    ],
)
def test_dates_and_times(sent: Date | Time, flaw: WhenFlaw | None, words: str):
    assert (sent.flaw, str(sent)) == (flaw, words)


# Reply bits

READ = apdus.encode(0, bytes.fromhex("0c020004d2194d"), invoke_id=1, service=12)
WHO_IS = apdus.encode(1, service=8)
ACK = apdus.encode(2, invoke_id=1, service=15)
SEGMENT = apdus.encode(3, b"abc", invoke_id=1, service=14, flags=12, sequence=0)
FURTHER = apdus.encode(0, b"abc", invoke_id=1, service=14, flags=14, sequence=2)


@pytest.mark.parametrize(
    ("frame_type", "bit", "body", "flaw"),
    [
        (5, True, READ, None),
        (6, False, READ, ReplyFlaw.CONFIRMED_WITHOUT),
        (6, True, READ, ReplyFlaw.TYPE_WITHOUT),
        (5, False, READ, ReplyFlaw.BIT_WITHOUT),
        (33, False, READ, ReplyFlaw.CONFIRMED_WITHOUT),
        (32, True, READ, None),
        (6, False, WHO_IS, None),
        (6, True, WHO_IS, ReplyFlaw.TYPE_WITHOUT),
        (5, True, WHO_IS, ReplyFlaw.UNCONFIRMED_WITH),
        (5, False, WHO_IS, ReplyFlaw.BIT_WITHOUT),
        (6, False, ACK, None),
        (6, True, ACK, None),
        (6, True, SEGMENT, None),
        (6, True, FURTHER, None),
        (5, True, FURTHER, None),
    ],
)
def test_reply_bits(frame_type: int, bit: bool, body: bytes, flaw: ReplyFlaw | None):
    octets = frame(frame_type, 5, 2, npdu.encode(body, expects_reply=bit))
    found = oddities(frame_of(octets))
    assert [one.words for one in found] == ([flaw.words] if flaw else [])
    shown = str(fields_of(MSTP, frame_of(octets), Role.DATA))
    assert (flaw is not None and flaw.words in shown) or (flaw is None and "expects reply', value='1 (" not in shown)


# Types


def answer(target: str, number: int, value: object, index: int | None = None) -> bytes:
    values = {"object-identifier": target, "property-identifier": number, "property-value": value}
    if index is not None:
        values["property-array-index"] = index
    body = apdus.encode(3, codec.encode(services.ACK[12], values), invoke_id=1, service=12)
    return frame(6, 5, 2, npdu.encode(body))


@pytest.mark.parametrize(
    ("target", "number", "value", "index", "odd"),
    [
        ("analog-input,1", 85, 21.5, None, False),
        ("analog-input,1", 85, "21.5", None, True),
        ("analog-input,1", 85, 21, None, True),
        ("multi-state-value,1", 85, 2, None, False),
        ("multi-state-value,1", 85, 2.0, None, True),
        ("analog-output,1", 85, None, None, False),  # Null gives up
        ("schedule,1", 85, "anything", None, False),  # may be of any type
        ("device,1", 76, 60, 0, False),  # the length of an array
        ("device,1", 76, 1.5, 3, True),
        ("device,1", 76, 1.5, None, False),  # not one value in place of another
        ("200,1", 85, "21.5", None, False),  # a vendor's object
        ("analog-input,1", 600, "21.5", None, False),  # a vendor's property
    ],
)
def test_values_of_another_type(target: str, number: int, value: object, index: int | None, odd: bool):
    octets = answer(target, number, value, index)
    assert kinds(octets) == ([Odd.TYPE] if odd else [])
    shown = str(fields_of(MSTP, frame_of(octets), Role.RESPONSE))
    assert ("the property is" in shown) == odd


def test_writes_and_changes_of_value_are_looked_at_too():
    values = {"object-identifier": "analog-value,1", "property-identifier": 85, "property-value": True}
    body = apdus.encode(0, codec.encode(services.CONFIRMED[15], values), invoke_id=1, service=15)
    assert kinds(frame(5, 5, 2, npdu.encode(body, expects_reply=True))) == [Odd.TYPE]


def test_each_value_of_several_is_looked_at():
    results = [
        {
            "object-identifier": "analog-input,1",
            "list-of-results": [
                {"property-identifier": 85, "read-result": {"property-value": 1.5}},
                {"property-identifier": 77, "read-result": {"property-value": 7}},
            ],
        },
        {
            "object-identifier": "multi-state-input,2",
            "list-of-results": [{"property-identifier": 85, "read-result": {"property-value": 1.5}}],
        },
    ]
    body = codec.encode(services.ACK[14], {"list-of-read-access-results": results})
    found = oddities(frame_of(frame(6, 5, 2, npdu.encode(apdus.encode(3, body, invoke_id=1, service=14)))))
    assert [one.words for one in found] == [
        "analog-input,1 object-name is Unsigned, not CharacterString",
        "multi-state-input,2 present-value is Real, not Unsigned",
    ]


def test_a_real_of_three_octets_is_none():
    octets = bytes.fromhex("0c00000001 1955 3e 43 41c800 3f".replace(" ", ""))
    found = oddities(frame_of(frame(6, 5, 2, npdu.encode(apdus.encode(3, octets, invoke_id=1, service=12)))))
    assert [one.words for one in found] == ["analog-input,1 present-value is Real of 3 octets, not Real"]


def test_nothing_that_the_standard_allows_is_odd():
    """Every event, answer and property of every object with its own type; only their dates are drawn at random."""
    for sample in [*every_alternative(), *every_answer(), *every_property()]:
        found = [one for one in oddities(frame_of(sample.octets)) if one.kind is Odd.TYPE]
        assert found == [], sample.name


@given(st.binary(max_size=60))
def test_any_octets_are_looked_at_without_harm(body: bytes):
    oddities(frame_of(frame(6, 5, 2, b"\x01\x00" + body)))
    oddities(frame_of(frame(6, 5, 2, b"\x01\x00\x30\x01\x0c" + body)))


# What is found


def test_who_is_behind_a_router_is_named():
    found = ContentFindings()
    octets = frame(6, 5, 2, npdu.encode(READ, snet=13, sadr=b"\x3d"))
    event = frame_of(octets)
    found.see(4, event, MSTP.peek(event))
    (finding,) = found.findings()
    assert (finding.code, finding.subject, finding.evidence) == ("MS701", "MAC 2", (4,))
    assert "network 13:61 behind it" in finding.seen


def test_findings_are_bounded():
    found = ContentFindings()
    for no in range(2000):
        event = frame_of(answer("analog-input,1", 85, str(no)))
        found.see(no, event, MSTP.peek(event))
    (finding,) = found.findings()
    assert finding.count == 2000
    assert len(finding.seen) < 300


# Addresses of other networks


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("10", "16"),
        ("3d", "61"),
        ("00", "0"),
        ("c0a80114bac0", "192.168.1.20:47808"),
        ("5db8d822bac1", "93.184.216.34:47809"),
        ("0a0000011f40", "10.0.0.1:8000"),
        ("00e0c9123456", "00-E0-C9-12-34-56"),
        ("01e240", "0x01E240"),
        ("0105", "0x0105"),
        ("", ""),
    ],
)
def test_addresses_are_written_as_their_network_writes_them(address: str, words: str):
    assert mac_text(bytes.fromhex(address)) == words
    assert remote(13, bytes.fromhex(address)) == (f"network 13:{words}" if words else "network 13")


@pytest.mark.parametrize(
    ("mac", "words"), [(b"\x3d", "61"), (b"", "broadcast"), (bytes.fromhex("c0a80114bac0"), "192.168.1.20:")]
)
def test_addresses_in_parameters_are_written_alike(mac: bytes, words: str):
    binding = ConstructedValue(
        "AddressBinding",
        (
            ("device-object-identifier", ObjectId(8, 61)),
            ("device-address", ConstructedValue("DeviceAddress", (("network-number", 13), ("mac-address", mac)))),
        ),
    )
    event = frame_of(answer("device,1", 30, (binding,)))
    line = text(event, MSTP.peek(event), Role.RESPONSE)
    assert f"network-number=13 mac-address={words}" in line
    assert f"name='mac-address', value='{words}" in str(fields_of(MSTP, event, Role.RESPONSE))


def test_the_tree_goes_on_behind_a_null():
    values = {
        "object-identifier": "analog-output,1",
        "property-identifier": 85,
        "property-value": None,
        "priority": 8,
    }
    body = apdus.encode(0, codec.encode(services.CONFIRMED[15], values), invoke_id=1, service=15)
    shown = str(fields_of(MSTP, frame_of(frame(5, 5, 2, npdu.encode(body, expects_reply=True))), Role.REQUEST))
    assert "name='property-value', value='null'" in shown
    assert "name='priority', value='8'" in shown
    assert "Raw" not in shown


def test_every_tree_is_read_to_its_end():
    others = [*every_alternative(), *every_answer(), *every_property()]
    for sample in [*some(list(every_service()), 3), *some(others, 2)]:
        found = MSTP.packet(frame_of(sample.octets), Role.DATA)
        tags = found["Parameters"].tags if found.haslayer("Parameters") else []
        assert not found.haslayer(Raw), sample.name
        assert not [tag for tag in tags if isinstance(tag, Raw)], sample.name
