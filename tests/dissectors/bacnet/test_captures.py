"""Real traffic, frame by frame, against Wireshark's stored reading of it."""

from __future__ import annotations

from typing import Any

import pytest

from dissectors.bacnet import MSTP, fields, packet, peek, text
from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import message as messages
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.findings import judge
from dissectors.bacnet.names import CONFIRMED
from dissectors.bacnet.ring_observer import MstpRingObserver
from dissectors.bacnet.values import ObjectId
from dissectors.checksums import crc8_mstp
from dissectors.frame import Check, Chunk, Damage, Event, Frame, Noise, Reason, Role
from dissectors.tracker import Verdict
from tests.dissectors.bacnet.captures import (
    PCAPS,
    TIMING,
    drive,
    folder,
    frame_of,
    pcap_records,
    rows,
    trees,
)

Capture = tuple[str, list[tuple[int, bytes]], list[list[Event]]]


COMPARED = (  # noqa: SIM905
    "bacnet.version bacnet.control bacnet.dnet bacnet.dadr_eth bacnet.snet bacnet.hopc bacnet.mesgtyp "
    "bacapp.type bacapp.confirmed_service bacapp.unconfirmed_service bacapp.invoke_id bacapp.objectType "
    "bacapp.instance_number bacapp.property_identifier bacapp.error_class bacapp.error_code"
).split()


def test_each_record_is_one_frame_as_wireshark_reads_it(capture: Capture):
    name, _, by_record = capture
    table = rows(name)
    assert len(table) == len(by_record)
    for row, events in zip(table, by_record, strict=True):
        if row["frame.number"] == "8" and name == "mstp-md5-2018-good1":
            continue  # the damaged record: see the test of its own
        (frame,) = events
        assert isinstance(frame, Frame)
        assert frame.ok == (set(row["mstp.checksum.status"].split(",")) == {"1"})
        header = peek(frame)
        assert header.function == int(row["mstp.frame_type"])
        assert header.destination == int(row["mstp.dst"])
        assert header.source == int(row["mstp.src"])
        found = fields(frame, header.role)
        assert found["mstp.len"] == int(row["mstp.len"])
        assert found["mstp.hdr_crc"] == int(row["mstp.hdr_crc"], 16)
        for column in COMPARED if len(frame.octets) > 8 else ():
            theirs = row[column]
            ours = found.get(column, "")
            if column == "bacnet.control" and theirs:
                theirs = str(int(theirs, 16))
            assert str(ours) == theirs, (row["frame.number"], column)
        if row["bacapp.present_value.real"]:
            ours = str(found["bacapp.present_value.real"]).split(",")
            theirs = row["bacapp.present_value.real"].split(",")
            assert [float(v) for v in ours] == pytest.approx([float(v) for v in theirs], rel=1e-5)
        _check_info(row["_ws.col.Info"].replace("\\", ""), header.kind)


def _check_info(info: str, kind: str) -> None:
    """Wireshark's summary names the same service."""
    squeezed = info.lower().replace("-", "").replace(" ", "")
    if kind == "reject":
        assert squeezed.startswith("reject")
    elif kind in ("token", "poll-for-master"):
        assert squeezed == "bacnetms/tp" + kind.replace("-", "")
    else:
        assert kind.replace("-", "") in squeezed


def test_every_npdu_says_what_wireshark_says(capture: Capture):
    """All fields that both name, in the same order, repeated ones too."""
    name, compared = capture[0], 0
    for number, layers in trees(name).items():
        (frame,) = capture[2][number - 1]
        assert isinstance(frame, Frame)
        theirs = _leaves([layers[layer] for layer in ("mstp", "bacnet", "bacapp") if layer in layers])
        ours = fields(frame, peek(frame).role)
        for field, values in theirs.items():
            if field in ours and field != "mstp.checksum.status":
                mine = str(ours[field]).split(",") if field != "bacapp.object_name" else [str(ours[field])]
                assert [_number(v) for v in mine] == [_number(v) for v in values], (number, field)
                compared += 1
        missing = {f for f in theirs if f.startswith(("bacapp.", "bacnet."))} - set(ours) - _NOT_OURS
        assert not missing, (number, missing)
        if "bacapp" in layers:
            _check_values(frame, layers["bacapp"])
    assert compared > 10 * len(trees(name))


_NOT_OURS = {
    "bacnet.control_res1",
    "bacnet.control_res2",
    "bacnet.control_prio_high",
    "bacnet.control_prio_low",
    "bacapp.pduflags",
    "bacapp.LVT",
    "bacapp.tag_class",
    "bacapp.application_tag_number",
    "bacapp.context_tag_number",
    "bacapp.named_tag",
    "bacapp.string_character_set",
    "bacapp.bit",
    "bacapp.unused_bits",
}


def _leaves(trees_: list[Any]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}

    def walk(pairs: Any) -> None:
        for key, value in pairs:
            if isinstance(value, list):
                walk(value)
            elif key.startswith(("mstp.", "bacnet.", "bacapp.")):
                found.setdefault(key, []).append(value)

    for tree in trees_:
        walk(tree)
    return found


def _number(text_: str) -> Any:
    try:
        return int(text_, 16) if text_.startswith("0x") else float(f"{float(text_):.5g}")
    except ValueError:
        return text_


def _check_values(frame: Frame, tree: Any) -> None:
    """What Wireshark puts in words: array indexes and unsigned values among the property values."""
    message = messages.read(frame)
    assert message is not None
    assert message.apdu is not None
    decoded = messages.decode_parameters(message.apdu, message.parameters)
    if decoded is None:
        return
    assert decoded.error is None
    assert decoded.rest == ()
    for key, _ in tree:
        if key.startswith("property Array Index (Unsigned) "):
            assert decoded.record["property-array-index"] == int(key.split()[-1])
    named = [key.removeprefix("ObjectIdentifier: ") for key, _ in tree if key.startswith("ObjectIdentifier: ")]
    if named and message.apdu.service == 12:
        kind, instance = named[0].split(", ")
        assert decoded.record["object-identifier"] == ObjectId.parse(f"{kind},{instance}")


def _records(name: str) -> list[tuple[int, bytes]]:
    return list(pcap_records(folder(name) / PCAPS[name]))


def test_the_record_with_a_doubled_preamble_is_bad_and_the_frame_in_it_is_found():
    """Its writer took 55 FF 55 FF for preamble and type, and never stored the header CRC of the frame inside."""
    octets = _records("mstp-md5-2018-good1")[7][1]
    events = drive([Chunk(10**18, octets)])
    assert b"".join(e.octets for e in events) == octets
    assert not any(isinstance(e, Frame) and e.ok for e in events)
    preamble, inner = events[0], events[1]
    assert isinstance(preamble, Noise)
    assert (preamble.octets, preamble.reason) == (b"\x55\xff", Reason.FALSE_START)
    assert isinstance(inner, Frame)
    assert inner.damage is Damage.HEADER
    assert (peek(inner).kind, peek(inner).source, peek(inner).destination) == ("poll-for-master", 2, 15)


def test_the_same_frame_with_its_header_crc_is_good():
    octets = _records("mstp-md5-2018-good1")[7][1]
    wire = octets[:8] + b"\x00" + bytes((crc8_mstp(octets[4:9]),))
    preamble, inner = drive([Chunk(10**18, wire)])
    assert preamble.octets == b"\x55\xff"
    assert isinstance(inner, Frame)
    assert inner.ok
    assert text(inner, peek(inner), Role.POLL) == "2 → 15 poll-for-master"


def test_the_ip_side_of_a_router_says_the_same():
    """67 of 68 APDUs on the Ethernet side equal one on the MS/TP side octet for octet, and decode alike."""
    name = "mstp-cimetrics-snap-mixed"
    ours = set()
    for _, octets in _records(name):
        message = messages.read(frame_of(octets))
        if message is not None and message.apdu is not None and message.npdu is not None:
            ours.add(message.data[message.npdu.body :])
    theirs = []
    for _, packet_ in pcap_records(folder(name) / "BACnet-MSTP-SNAP-Mixed.cap"):
        if packet_[12:14] != b"\x08\x00" or packet_[23] != 17:
            continue
        size = int.from_bytes(packet_[38:40], "big") - 8
        bvlc = packet_[42 : 42 + size]
        npdu = npdus.decode(bvlc[10 if bvlc[1] == 4 else 4 :])
        assert npdu is not None
        theirs.append(bvlc[10 if bvlc[1] == 4 else 4 :][npdu.body :])
    same = [apdu for apdu in theirs if apdu in ours]
    assert (len(theirs), len(same)) == (68, 67)
    for octets in theirs:
        apdu = apdus.decode(octets)
        assert apdu is not None
        decoded = messages.decode_parameters(apdu, octets[apdu.body :])
        assert decoded is not None
        assert (decoded.error, decoded.rest) == (None, ())


def test_packets_fields_and_header_agree_on_every_frame(capture: Capture):
    """The two dissections are one: same type, addresses, check; the packet gives the frame back."""
    _, _, by_record = capture
    frames = [e for events in by_record for e in events if isinstance(e, Frame)]
    for frame in [f for f in frames if len(f.octets) > 8][:120] + frames[:100]:
        header = peek(frame)
        found = packet(frame, header.role)
        assert (found.frame_type, found.destination, found.source) == (
            header.function,
            header.destination,
            header.source,
        )
        found.clear_cache()
        for layer in found.iterpayloads():
            layer.clear_cache()
        assert bytes(found) == frame.octets
        if frame.ok and header.kind in CONFIRMED.values():
            assert CONFIRMED[found.lastlayer().underlayer.service] == header.kind


def test_the_tracker_pairs_the_object_list_walk():
    tracker = MSTP.tracker(TIMING)
    closed = []
    for no, event in enumerate(drive([Chunk(time, octets) for time, octets in _records("mstp-kargs-2009")])):
        header = peek(event) if isinstance(event, Frame) else None
        closed += tracker.track(no, event, header).closed
    closed += tracker.close()
    reads = [t for t in closed if t.kind == "read-property"]
    assert len(reads) == 202
    assert sum(t.verdict is Verdict.ANSWERED for t in reads) == 200
    (refused,) = [t for t in reads if t.verdict is Verdict.EXCEPTION]
    assert refused.error == "reject buffer-overflow"
    (silent,) = [t for t in reads if t.verdict is Verdict.NO_RESPONSE]
    assert silent.response is None
    assert silent.station == 27
    slowest = max(t.latency.nominal for t in reads if t.latency is not None)
    assert 60_000_000 < slowest < 65_000_000
    # 27 then misses its token twice: its neighbour repeats it once
    lost, again = [t for t in closed if t.kind == "token" and t.verdict is Verdict.NO_RESPONSE]
    assert (lost.station, again.station) == (27, 27)
    assert (again.attempt, again.of) == (2, lost.id)


def test_the_ring_of_a_real_capture():
    """A workstation (0) and three controllers; 27 dies near the end and 12 looks for another neighbour."""
    observer = MstpRingObserver(TIMING)
    for no, event in enumerate(drive([Chunk(time, octets) for time, octets in _records("mstp-kargs-2009")])):
        observer.see(no, event, peek(event) if isinstance(event, Frame) else None)
    ring = observer.ring()
    assert ring.order == (0, 11, 12, 27)
    assert ring.nodes[0].most_in_a_hold == 20
    assert ring.nodes[27].highest_polled == 127
    assert ring.edges[12, 27].retries == 1
    found = {(f.code, f.subject) for f in judge(ring)}
    assert {("MS106", "MAC 27"), ("MS301", "0 → 27")} <= found
    assert not {"MS101", "MS104", "MS501"} & {code for code, _ in found}


def test_a_long_capture_raises_no_false_alarm(capture: Capture):
    """No real capture here has a lost token, a second one, or two stations with one address."""
    observer, no = MstpRingObserver(TIMING), 0
    for events in capture[2]:
        for event in events:
            observer.see(no, event, peek(event) if isinstance(event, Frame) else None)
            no += 1
    codes = {finding.code for finding in judge(observer.ring())}
    assert not codes & {"MS101", "MS104", "MS105", "MS202", "MS302", "MS401", "MS402", "MS404", "MS501"}
    if capture[0] != "mstp-kargs-2009":
        assert codes == {"MS201"}


def _listed(name: str) -> list[tuple[bytes, str]]:
    lines = (folder(name) / "frames.txt").read_text(encoding="utf-8").splitlines()
    found = []
    for line in lines:
        if line and not line.startswith("#"):
            octets, _, note = line.partition(";")
            found.append((bytes.fromhex(octets.split(" ", 1)[1]), note))
    return found


def test_the_log_with_replies_to_polls_and_postponed_replies():
    tracker, closed, kinds = MSTP.tracker(TIMING), [], []
    now = 10**18
    framer = MSTP.framer(TIMING)
    listed = _listed("mstp-chipkin-cas-log")
    events: list[Event] = []
    for octets, _ in listed:
        now += 10_000_000 + len(octets) * TIMING.char
        events += framer.feed(Chunk(now, octets))
    events += framer.close()
    for no, event in enumerate(events):
        assert isinstance(event, Frame)
        assert event.ok
        header = peek(event)
        kinds.append(header.kind)
        closed += tracker.track(no, event, header).closed
    closed += tracker.close()
    assert len(events) == len(listed) == 21
    assert {"reply-to-poll-for-master", "reply-postponed", "i-am"} <= set(kinds)
    assert any(t.kind == "poll-for-master" and t.verdict is Verdict.ANSWERED for t in closed)
    postponed = kinds.index("reply-postponed")
    assert any(t.request == postponed - 1 for t in closed)


def test_the_vectors_of_other_programs():
    frames = [(frame_of(octets), note) for octets, note in _listed("vectors-mstp-misc")]
    assert len(frames) == 6
    for frame, note in frames:
        good = "hcrc=True dcrc=True" in note
        assert frame.ok == good
        if not good:
            assert frame.check is Check.BAD
