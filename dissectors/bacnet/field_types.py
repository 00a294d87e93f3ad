"""The types of the fields of an MS/TP frame: what `fields.py` may give."""

from __future__ import annotations

from dataclasses import replace

from dissectors.bacnet import names, npdu
from dissectors.bacnet.apdu import TITLES as PDU_TITLES
from dissectors.bacnet.frame_types import NAMES, TITLES
from dissectors.field_types import FieldType, FieldTypes, Kind, named, plain_word, station, table, texts, whole

_SAYS = """
mstp.frame_type number8 frame type
mstp.dst station8 MAC of the receiver
mstp.src station8 MAC of the sender
mstp.len number16 octets of data
mstp.hdr_crc number8 header check as sent
mstp.data_crc number32 data check as sent
mstp.checksum.status truth whether both checks are right
mstp.vendorid number16 vendor of a proprietary frame
bacnet.version number8
bacnet.control number8 control octet
bacnet.control_net truth a network message
bacnet.control_dest truth a destination network is named
bacnet.control_src truth a source network is named
bacnet.control_expect truth a reply is expected
bacnet.dnet number16 destination network
bacnet.dlen number8 octets of the destination address
bacnet.dadr_mstp number8 destination address, one octet
bacnet.dadr_eth octets destination address, six octets
bacnet.dadr_tmp octets destination address of another length
bacnet.snet number16 source network
bacnet.slen number8 octets of the source address
bacnet.sadr_mstp number8 source address, one octet
bacnet.sadr_eth octets source address, six octets
bacnet.sadr_tmp octets source address of another length
bacnet.hopc number8 hops left
bacnet.mesgtyp number8 network message
bacnet.vendor number16 vendor of a network message
bacnet.rejectreason number8 why a message was rejected by the network
bacnet.perf number8
bacnet.term_time_value number8
bacnet.netno_status number8
bacnet.portid number8
bacnet.pinfolen number8
bacnet.pinfo octets
bacapp.type number4 kind of APDU
bacapp.segmented_request truth comes in segments
bacapp.more_segments truth more segments follow
bacapp.SA truth segments are accepted
bacapp.NAK truth segments are asked for again
bacapp.SRV truth sent by the server
bacapp.response_segments number3 code of the segments accepted
bacapp.max_adpu_size number4 code of the octets accepted
bacapp.invoke_id number8
bacapp.sequence_number number8 of a segment
bacapp.window_size number8 segments at a time
bacapp.confirmed_service number8
bacapp.unconfirmed_service number8
bacapp.reject_reason number8
bacapp.abort_reason number8
bacapp.error_class number32
bacapp.error_code number32
bacapp.objectType number32 type of each object named
bacapp.instance_number number22 instance of each object named
bacapp.property_identifier number32
bacapp.event_type number32
bacapp.notify_type number32
bacapp.restart_reason number32
bacapp.from_state number32
bacapp.to_state number32
bacapp.processId number32
bacapp.vendor_identifier number32
bacapp.object_name text
bacapp.who_is.low_limit number32
bacapp.who_is.high_limit number32
bacapp.fragment number frames that brought the parts of a message
bacapp.fragment.count number how many they are
bacapp.reassembled.length number octets of the whole message
bacapp.present_value.null text
bacapp.present_value.boolean truth
bacapp.present_value.uint number64
bacapp.present_value.int number
bacapp.present_value.real number
bacapp.present_value.double number
bacapp.present_value.octet_string octets
bacapp.present_value.char_string text
bacapp.present_value.bit_string text
bacapp.present_value.enum_index number32
bacapp.present_value.date text
bacapp.present_value.time text
bacapp.present_value.object_id text
"""

_ENUMERATIONS = {
    "bacapp.confirmed_service": "ConfirmedServiceChoice",
    "bacapp.unconfirmed_service": "UnconfirmedServiceChoice",
    "bacapp.reject_reason": "RejectReason",
    "bacapp.abort_reason": "AbortReason",
    "bacapp.error_class": "ErrorClass",
    "bacapp.error_code": "ErrorCode",
    "bacapp.objectType": "ObjectType",
    "bacapp.property_identifier": "PropertyIdentifier",
    "bacapp.event_type": "EventType",
    "bacapp.notify_type": "NotifyType",
    "bacapp.restart_reason": "RestartReason",
    "bacapp.from_state": "EventState",
    "bacapp.to_state": "EventState",
}

_PDUS = {"Confirmed-REQ": 0, "Unconfirmed-REQ": 1, "Simple-ACK": 2, "Complex-ACK": 3, "Segment-ACK": 4}
"""Wireshark's names, where ours differ."""

_OPEN_KINDS = r"((reserved|proprietary|service)-|(vendor|reserved)-network-message-)\d+"


def types() -> FieldTypes:
    """By name."""
    found = table("", _SAYS)
    for name, enumeration in _ENUMERATIONS.items():
        found[name] = replace(found[name], words=named(names.numbered(enumeration)))
    frame_types = named(TITLES, {name: number for number, name in NAMES.items()})
    checks: dict[str, int | str] = {"Bad": 0, "Good": 1}
    found["mstp.frame_type"] = replace(found["mstp.frame_type"], words=frame_types, octet=2)
    found["mstp.dst"] = replace(found["mstp.dst"], octet=3)
    found["mstp.src"] = replace(found["mstp.src"], octet=4)
    found["mstp.checksum.status"] = replace(found["mstp.checksum.status"], words=checks)
    found["bacapp.type"] = replace(found["bacapp.type"], words=named(dict(enumerate(PDU_TITLES)), _PDUS))
    found["bacnet.mesgtyp"] = replace(found["bacnet.mesgtyp"], words=named(npdu.MESSAGES))
    found["bacnet.rejectreason"] = replace(found["bacnet.rejectreason"], words=named(npdu.REJECTIONS))
    kinds = [
        *NAMES.values(),
        *map(plain_word, names.numbered("ConfirmedServiceChoice").values()),
        *map(plain_word, names.numbered("UnconfirmedServiceChoice").values()),
        *npdu.MESSAGES.values(),
        *("segment-ack", "reject", "abort", "error", "unknown"),
    ]
    found["kind"] = FieldType(Kind.TEXT, "what a frame is", texts(dict.fromkeys(kinds)), True, _OPEN_KINDS)
    found["func"] = whole(8, "frame type", frame_types)
    found["addr"] = station()
    found["count"] = FieldType(Kind.NUMBER, never=True)
    found["register"] = whole(22, "instance of the first object named")
    return found
