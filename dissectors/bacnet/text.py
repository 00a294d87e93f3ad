"""One line a frame: `0 → 12 read-property device,2 object-list[241]`."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

from dissectors.bacnet import message as messages
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.apdu import Apdu, PduType, reason_text
from dissectors.bacnet.content import reply_flaw
from dissectors.bacnet.frame_types import PROPRIETARY, FrameType
from dissectors.bacnet.header import error_text
from dissectors.bacnet.limits import BROADCAST
from dissectors.bacnet.station_address import remote
from dissectors.bacnet.values import ConstructedValue, escape, show_held, show_part, show_tag

if TYPE_CHECKING:
    from dissectors.bacnet.codec import Decoded
    from dissectors.bacnet.message import Message
    from dissectors.frame import Assembly, Frame, Header, Role
    from dissectors.meaning import Meaning

LENGTH_MAX = 160
"""Longest line; longer ones end with an ellipsis."""


def text(frame: Frame, header: Header, role: Role) -> str:
    """One line for the frame list, without control characters. Total."""
    return f"{_parties(header)} {_rest(frame, header)}"


def meant(frame: Frame, header: Header, role: Role, meaning: Meaning) -> str:
    """The same, what it means to its device first: `10 → 2 output frequency 30.00 Hz — complex-ack …`. Total."""
    said, plain = meaning.about, text(frame, header, role)
    parties = _parties(header)
    return f"{parties} {escape(said)} —{plain.removeprefix(parties)}" if said else plain


def _parties(header: Header) -> str:
    return f"{_party(header.source)} → {_party(header.destination)}"


def _rest(frame: Frame, header: Header) -> str:
    message = messages.read(frame)
    line = header.kind
    if message is not None:
        flaw = reply_flaw(message)
        if flaw is not None:
            line += f" ({flaw.value})"
        detail = _detail(frame, message)
        if detail:
            line += " " + detail
    if not header.ok:
        line += f" [{header.error}]"
    line = escape(line)
    longest = LENGTH_MAX - len(_parties(header)) - 1
    return line if len(line) <= longest else line[: longest - 1] + "…"


def _party(address: int | None) -> str:
    if address is None:
        return "?"
    return "*" if address == BROADCAST else str(address)


def _detail(frame: Frame, message: Message) -> str:
    npdu = message.npdu
    if npdu is None:
        return _plain_data(message)
    parts = []
    if npdu.dnet is not None:
        parts.append("to " + remote(npdu.dnet, npdu.dadr))
    if npdu.snet is not None:
        parts.append("from " + remote(npdu.snet, npdu.sadr))
    if npdu.message is not None:
        parts.append(_network(message, npdu))
    elif message.apdu is not None:
        parts.append(apdu_text(message.apdu, message.parameters))
        if frame.assembly is not None:
            parts.append(_assembled(frame.assembly, message))
    return " ".join(part for part in parts if part)


def _assembled(assembly: Assembly, message: Message) -> str:
    """What all segments say together, behind the last one."""
    if message.whole is not None:
        last = message.apdu is not None and not message.apdu.more_follows
        so_far = f"of {len(assembly.frames)}" if last else f"(all {len(assembly.frames)} seen)"
        return f"{so_far}: {_whole_text(*message.whole)}"
    lost = len(assembly.missing)
    which = ", ".join(map(str, assembly.missing[:4])) + (" …" if lost > 4 else "")
    return f"({'segment' if lost == 1 else 'segments'} {which} not seen)"


@lru_cache(maxsize=64)
def _whole_text(apdu: Apdu, parameters: bytes) -> str:
    """As much of a long message as a line can hold; a list asks for its lines again and again."""
    decoded = messages.decode_parameters(apdu, parameters)
    return parameters_text(apdu, decoded)[:LENGTH_MAX] if decoded is not None else ""


def _plain_data(message: Message) -> str:
    data = message.data
    if message.frame_type >= PROPRIETARY and len(data) >= 2:
        return f"vendor {data[0] << 8 | data[1]}, {len(data) - 2} octets"
    if message.frame_type in (FrameType.TEST_REQUEST, FrameType.TEST_RESPONSE) or data:
        return f"{len(data)} octets"
    return ""


def _network(message: Message, npdu: npdus.Npdu) -> str:
    found = npdus.networks(npdu, message.data)
    payload = message.data[npdu.body :]
    words = " ".join(str(number) for number in found)
    if npdu.message == 0x03 and payload:
        words += f": {npdus.REJECTIONS.get(payload[0], f'reason {payload[0]}')}"
    elif npdu.message == 0x02 and len(payload) >= 3:
        words += f" performance {payload[2]}"
    elif npdu.message == 0x13 and len(payload) >= 3:
        words += " configured" if payload[2] else " learned"
    elif npdu.vendor is not None:
        words = f"vendor {npdu.vendor}, {len(payload)} octets"
    return words


def apdu_text(apdu: Apdu, parameters: bytes) -> str:
    """What an APDU says, without the name of its service."""
    if apdu.error is not None:
        return apdu.error
    if apdu.segmented:
        return f"{_pdu_word(apdu)}segment {apdu.sequence}{', more follow' if apdu.more_follows else ', last'}"
    match apdu.type:
        case PduType.ERROR:
            return "error " + error_text(parameters, 0)
        case PduType.REJECT | PduType.ABORT:
            return f"{reason_text(apdu.type, apdu.reason or 0)} of request {apdu.invoke_id}"
        case PduType.SEGMENT_ACK:
            return f"{'negative ' if apdu.flags & 2 else ''}up to segment {apdu.sequence}, window {apdu.window}"
        case PduType.SIMPLE_ACK:
            return "ack"
    decoded = messages.decode_parameters(apdu, parameters)
    return (_pdu_word(apdu) + parameters_text(apdu, decoded)).strip() if decoded is not None else ""


def _pdu_word(apdu: Apdu) -> str:
    return "ack " if apdu.type == PduType.COMPLEX_ACK else ""


def parameters_text(apdu: Apdu, decoded: Decoded) -> str:
    """The parameters of a service in one line."""
    record = decoded.record
    writer = _WRITERS.get((apdu.type == PduType.UNCONFIRMED_REQUEST, apdu.service or 0))
    line = ""
    if writer is not None:
        try:
            line = writer(record)
        except (KeyError, TypeError, AttributeError):  # not all parameters are there
            line = ""
    if not line:
        line = " ".join(f"{name}={show_part(name, value)}" for name, value in record)
    if decoded.wrong:
        line += f" ({decoded.wrong[0].found}, not {decoded.wrong[0].expected})"
    if decoded.rest:
        line += " " + " ".join(show_tag(tag) for tag in decoded.rest[:8])
    if decoded.error is not None:
        line += f" ({decoded.error})"
    return line.strip()


def reference(record: ConstructedValue) -> str:
    """`present-value` or `object-list[3]` from a record with a property identifier."""
    index = record.get("property-array-index")
    return f"{record['property-identifier']}" + (f"[{index}]" if index is not None else "")


def _property(record: ConstructedValue) -> str:
    line = f"{record['object-identifier']} {reference(record)}"
    if "property-value" in record:
        line += f" = {_held(record, record['property-value'])}"
    if record.get("priority") is not None:
        line += f" priority {record['priority']}"
    return line


def _held(record: ConstructedValue, value: Any) -> str:
    return show_held(record["property-identifier"].value, record.get("property-array-index"), value)


def _read_multiple(record: ConstructedValue) -> str:
    if "list-of-read-access-specs" in record:
        return "; ".join(
            f"{spec['object-identifier']} {', '.join(reference(item) for item in spec['list-of-property-references'])}"
            for spec in record["list-of-read-access-specs"]
        )
    return "; ".join(
        f"{result['object-identifier']} {', '.join(_result(item) for item in result.get('list-of-results', ()))}"
        for result in record["list-of-read-access-results"]
    )


def _result(item: ConstructedValue) -> str:
    ((kind, value),) = item["read-result"].entries
    shown = _held(item, value)
    if kind == "property-access-error":
        shown = f"error {value['error-class']} {value['error-code']}"
    return f"{reference(item)}={shown}"


def _write_multiple(record: ConstructedValue) -> str:
    return "; ".join(
        f"{spec['object-identifier']} "
        + ", ".join(f"{reference(item)}={_held(item, item['value'])}" for item in spec["list-of-properties"])
        for spec in record["list-of-write-access-specs"]
    )


def _who_is(record: ConstructedValue) -> str:
    low = record.get("device-instance-range-low-limit")
    return "all" if low is None else f"{low}…{record['device-instance-range-high-limit']}"


def _i_am(record: ConstructedValue) -> str:
    return (
        f"{record['i-am-device-identifier']} vendor {record['vendor-id']} "
        f"max-apdu {record['max-apdu-length-accepted']} {record['segmentation-supported']}"
    )


def _cov(record: ConstructedValue) -> str:
    values = ", ".join(f"{reference(item)}={_held(item, item['value'])}" for item in record["list-of-values"])
    remaining = record["time-remaining"]
    until = ("remaining " if remaining else "") + show_part("time-remaining", remaining)
    return f"{record['initiating-device-identifier']} {record['monitored-object-identifier']} {values} {until}"


_WRITERS: dict[tuple[bool, int], Any] = {
    (False, 12): _property,
    (False, 14): _read_multiple,
    (False, 15): _property,
    (False, 16): _write_multiple,
    (False, 1): _cov,
    (True, 0): _i_am,
    (True, 2): _cov,
    (True, 8): _who_is,
}
