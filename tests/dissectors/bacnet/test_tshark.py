"""Everything we can say over MS/TP, read by tshark: no malformed packet, no error, and the same names and numbers.

One run of tshark reads all samples. What it is excused from is data below, each with its reason.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bacpypes3.basetypes as basetypes
import pytest
from bacpypes3.pdu import PDU
from bacpypes3.primitivedata import TagList

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import fields, peek
from dissectors.bacnet import message as messages
from dissectors.bacnet.reassembly import Reassembler
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.capture_writer import create
from sniff.engine.session import Session
from tests.dissectors.bacnet.captures import frame_of
from tests.dissectors.bacnet.samples import (
    SEEDS,
    WITH_PARAMETERS,
    Sample,
    every_alternative,
    every_answer,
    every_frame_type,
    every_network_message,
    every_property,
    every_segment,
    every_service,
    without_layout,
)

TSHARK = shutil.which("tshark")
pytestmark = pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")

WRONG: dict[str, str] = {
    r"Confirmed-Request authenticate #": "reads expected-invoke-id [1] as an octet without its tag",
    r"Error vt-close #": "reads on past the end when the optional list of sessions is absent",
    r"device list-of-session-keys": "reads on past the end of a SessionKey",
    r"NotificationParameters change-of-discrete-value": "takes the date-time [0] of a new value for a property value",
}
"""Samples that tshark 4.0.17 reads wrongly. bacpypes3 reads the first three (below and in test_services.py); the fourth
is as in clause 21 of the standard: `new-value [0] CHOICE {…, datetime [0] BACnetDateTime}`."""

UNKNOWN: dict[str, str] = {
    r"type 34": "IPv6 over MS/TP is not known: its end is taken for a CRC-16 and the checksum for bad",
}

APART: tuple[tuple[str, str, str], ...] = (
    (r"audit-notification #", r"bacapp\.(present_value\..*|object_name)", "it names values by the target's property"),
    (r"audit-notification #23", r"bacapp\.(objectType|instance_number)", "it shows the object in a value as a number"),
    (r"command-failure", r"bacapp\.present_value\..*", "it takes any value for a present value"),
    (r"PropertyStates event-type", r"bacapp\.event_type", "it has no field for the event type among states"),
    (r"PropertyStates notify-type", r"bacapp\.notify_type", "it has no field for the notify type among states"),
    (r"(type 3[234]|octets of a file)", r"mstp\.data_crc", "the end of an encoded frame is no CRC-16"),
)
"""(sample, field, why): values that the two do not show alike."""

COMPARED = (  # noqa: SIM905
    "mstp.frame_type mstp.dst mstp.src mstp.len mstp.hdr_crc mstp.data_crc mstp.vendorid mstp.checksum.status "
    "bacnet.version bacnet.control bacnet.control_net bacnet.control_dest bacnet.control_src bacnet.control_expect "
    "bacnet.dnet bacnet.dlen bacnet.dadr_mstp bacnet.dadr_eth bacnet.dadr_tmp bacnet.snet bacnet.slen bacnet.sadr_mstp "
    "bacnet.sadr_eth bacnet.sadr_tmp bacnet.hopc bacnet.mesgtyp bacnet.vendor bacnet.rejectreason bacnet.perf "
    "bacnet.netno_status bacnet.term_time_value bacnet.portid bacnet.pinfolen bacnet.pinfo "
    "bacapp.type bacapp.segmented_request bacapp.more_segments bacapp.SA bacapp.response_segments "
    "bacapp.max_adpu_size bacapp.NAK bacapp.SRV bacapp.invoke_id bacapp.sequence_number bacapp.window_size "
    "bacapp.confirmed_service bacapp.unconfirmed_service bacapp.reject_reason bacapp.abort_reason bacapp.error_class "
    "bacapp.error_code bacapp.objectType bacapp.instance_number bacapp.property_identifier bacapp.object_name "
    "bacapp.vendor_identifier bacapp.who_is.low_limit bacapp.who_is.high_limit bacapp.processId bacapp.event_type "
    "bacapp.notify_type bacapp.from_state bacapp.to_state bacapp.present_value.null bacapp.present_value.boolean "
    "bacapp.present_value.uint bacapp.present_value.int bacapp.present_value.real bacapp.present_value.double "
    "bacapp.present_value.char_string bacapp.present_value.enum_index bacapp.present_value.bit_string"
).split()
_TEXT = {"bacapp.object_name", "bacapp.present_value.char_string"}
_SEPARATOR = "\x1f"


@dataclass(frozen=True, slots=True)
class Reading:
    """What tshark says of a frame."""

    malformed: str
    expert: str
    values: dict[str, list[str]]


@pytest.fixture(scope="module")
def readings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[tuple[Sample, Reading]]]:
    """All samples with tshark's reading of each, by the kind of sample; the file is written by our own writer."""
    kinds = {
        "service": list(every_service()),
        "alternative": list(every_alternative()),
        "answer": list(every_answer()),
        "network": list(every_network_message()),
        "type": list(every_frame_type()),
        "no layout": list(without_layout()),
        "segment": list(every_segment()),
        "property": list(every_property()),
    }
    samples = [sample for kind in kinds.values() for sample in kind]
    path = tmp_path_factory.mktemp("tshark") / "samples.pcap"
    _write(path, samples)
    read = list(_tshark(path))
    assert len(read) == len(samples)
    pairs = iter(zip(samples, read, strict=True))
    return {kind: [next(pairs) for _ in of_kind] for kind, of_kind in kinds.items()}


def _write(path: Path, samples: list[Sample]) -> None:
    session = Session("bus", LineSettings(115200), "mstp", 10**18)
    with create(path, session) as writer:
        for number, sample in enumerate(samples):
            writer.write(Chunk(10**18 + number * 10**9, sample.octets))


def _tshark(path: Path) -> Iterator[Reading]:
    assert TSHARK is not None
    columns = ["_ws.malformed", "_ws.expert.severity", "_ws.expert.message", *COMPARED]
    shown = [argument for column in columns for argument in ("-e", column)]
    command = [TSHARK, "-n", "-r", str(path), "-T", "fields", "-E", "occurrence=a", "-E", f"aggregator={_SEPARATOR}"]
    ran = subprocess.run([*command, *shown], capture_output=True, timeout=120, check=True)
    for line in ran.stdout.decode("utf-8").splitlines():
        malformed, severity, message, *cells = line.split("\t")
        values = {name: cell.split(_SEPARATOR) for name, cell in zip(COMPARED, cells, strict=True) if cell}
        yield Reading(malformed, f"{severity} {message}".strip(), values)


def _excused(name: str, *tables: dict[str, str]) -> bool:
    return any(re.search(pattern, name) for table in tables for pattern in table)


def _apart(name: str, field: str) -> bool:
    return any(re.search(sample, name) and re.fullmatch(pattern, field) for sample, pattern, _ in APART)


def _plain(text: str) -> int | float | str:
    """0x10 → 16, 1.50 → 1.5; reals to five figures, as tshark prints them."""
    try:
        return int(text, 16) if text.startswith("0x") else float(f"{float(text):.5g}")
    except ValueError:
        return "" if text == "<MISSING>" else text


def _ours(sample: Sample) -> dict[str, list[str]]:
    frame = frame_of(sample.octets)
    found = fields(frame, peek(frame).role)
    return {name: [str(value)] if name in _TEXT else str(value).split(",") for name, value in found.items()}


def _same(field: str, theirs: list[str], ours: list[str]) -> bool:
    if field == "mstp.checksum.status":  # of the header, and of the data
        return set(theirs) == set(ours)
    if field in _TEXT:
        return ",".join(theirs) == ",".join(ours)
    return [_plain(value) for value in theirs] == [_plain(value) for value in ours]


def test_there_are_samples_of_all_kinds(readings: dict[str, list[tuple[Sample, Reading]]]):
    assert len(readings["service"]) == SEEDS * len(WITH_PARAMETERS)
    assert len(WITH_PARAMETERS) > 60
    assert len(readings["property"]) > 1500
    assert all(readings.values())


def test_nothing_is_malformed_and_nothing_is_an_error(readings: dict[str, list[tuple[Sample, Reading]]]):
    """Nor does tshark say anything milder: it has no notes, chats or warnings about any of them."""
    said = [
        (sample.name, reading.malformed, reading.expert, sample.octets.hex())
        for kind in readings.values()
        for sample, reading in kind
        if (reading.malformed or reading.expert) and not _excused(sample.name, WRONG, UNKNOWN)
    ]
    assert said == []


@pytest.mark.parametrize("kind", ["service", "alternative", "answer", "network", "type", "no layout"])
def test_tshark_and_we_say_the_same(readings: dict[str, list[tuple[Sample, Reading]]], kind: str):
    """Every field that tshark finds has the same values here; where it finds none, we may know more."""
    differ = []
    for sample, reading in readings[kind]:
        if _excused(sample.name, WRONG, UNKNOWN):
            continue
        ours = _ours(sample)
        differ += [
            (sample.name, field, theirs, ours.get(field))
            for field, theirs in reading.values.items()
            if not _apart(sample.name, field) and not _same(field, theirs, ours.get(field, []))
        ]
    assert differ == []


def test_services_and_objects_are_compared_at_all(readings: dict[str, list[tuple[Sample, Reading]]]):
    for sample, reading in readings["service"]:
        assert {"bacapp.confirmed_service", "bacapp.unconfirmed_service"} & set(reading.values), sample.name
    found = {field for kind in readings.values() for _, reading in kind for field in reading.values}
    assert set(COMPARED) - found == {"bacnet.dadr_tmp"}  # no sample has a destination of an odd length


def test_properties_of_every_object_are_those_that_tshark_reads(readings: dict[str, list[tuple[Sample, Reading]]]):
    """Service, invoke id, object and property; values of many later types are octets to tshark 4.0."""
    for sample, reading in readings["property"]:
        ours = _ours(sample)
        for field in ("bacapp.type", "bacapp.confirmed_service", "bacapp.invoke_id"):
            assert reading.values[field] == ours[field], sample.name
        for field in ("bacapp.objectType", "bacapp.instance_number", "bacapp.property_identifier"):
            assert reading.values[field][0] == ours[field][0], sample.name


def test_segments_are_gathered_to_what_tshark_gathers(readings: dict[str, list[tuple[Sample, Reading]]]):
    reassembler, gathered = Reassembler(), []
    for number, (sample, reading) in enumerate(readings["segment"]):
        ours = _ours(sample)
        for field in ("bacapp.type", "bacapp.invoke_id", "bacapp.sequence_number", "bacapp.window_size", "bacapp.NAK"):
            assert reading.values.get(field) == ours.get(field), (sample.name, field)
        whole = reassembler.add(number, frame_of(sample.octets))
        if whole is not None:
            gathered.append(whole)
            header = apdus.decode(whole.octets)
            assert header is not None
            found = messages.decode_parameters(header, whole.octets[header.body :])
            assert found is not None
            assert found.error is None
            (_, items) = found.record.entries[0]
            instances = [str(item["object-identifier"].instance) for item in items]
            assert instances == reading.values["bacapp.instance_number"]
    assert len(gathered) == 2


def test_bacpypes3_reads_the_session_key_that_tshark_does_not():
    octets = bytes.fromhex("6126217f60")
    key = basetypes.SessionKey.decode(TagList.decode(PDU(octets)))
    assert (bytes(key.sessionKey), int(key.peerAddress.networkNumber), bytes(key.peerAddress.macAddress)) == (
        b"\x26",
        127,
        b"",
    )
    assert octets in next(s.octets for s in every_property() if s.name == "device list-of-session-keys")
