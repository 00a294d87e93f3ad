"""Every service against bacpypes3: what we make it reads to the same values, what it makes we read."""

from __future__ import annotations

import math
import struct
from typing import Any

import bacpypes3.apdu as theirs
import bacpypes3.basetypes as basetypes
import bacpypes3.constructeddata as constructed
import bacpypes3.primitivedata as primitive
import pytest
from bacpypes3.pdu import PDU
from hypothesis import given
from hypothesis import strategies as st

from dissectors.bacnet import codec, layout, names, services, tags
from dissectors.bacnet.choices import CHOICES
from dissectors.bacnet.dates import Date, Time
from dissectors.bacnet.values import BitString, ConstructedValue, Enumerated, ObjectId, show
from tests.dissectors.bacnet.generate_tables import kebab
from tests.dissectors.bacnet.samples import LAYOUTS, SEEDS, WITH_PARAMETERS, apdu_of, parameters_of

KINDS = {
    0: (theirs.confirmed_request_types, services.CONFIRMED),
    1: (theirs.unconfirmed_request_types, services.UNCONFIRMED),
    3: (theirs.complex_ack_types, services.ACK),
    5: (theirs.error_types, services.ERROR),
}
THEIRS_CANNOT = {(5, 8), (5, 9)}
"""bacpypes3 raises on its own ChangeListError (0.0.110)."""

CASES = [case for case in WITH_PARAMETERS if case[1] in KINDS[case[0]][0] and case not in THEIRS_CANNOT]

THEIRS_WANTS_ALL = {(0, 19), (0, 24), (1, 5), (3, 23)}
"""Parameters that the standard makes optional and bacpypes3 does not."""

THEIRS_OTHERWISE = {
    *("authentication-factor", "change-of-status-flags", "extended", "complex-event-type"),
    *("change-of-discrete-value", "change-of-timer"),
    *(field.name for field in layout.parse(CHOICES["PropertyStates"]) if (field.tag or 0) > 40 or field.tag == 37),
}
"""Parts of events whose layouts are corrected in generate_tables.py; tshark reads ours (test_tshark.py)."""

THEIR_NAMES = {"exceeding-limit": "exceeded-limit"}
"""Names of parts of theirs that are not the standard's."""


def decode_theirs(kind: int, choice: int, octets: bytes) -> Any:
    found = theirs.APDU.decode(PDU(octets))
    return KINDS[kind][0][choice].decode(found)


def plain(value: Any) -> Any:
    """A value of theirs as ours would be compared: nested tuples of (name, value)."""
    if value is None or isinstance(value, primitive.Null):
        return None
    if isinstance(value, constructed.Any):
        held = tags.read(b"".join(_tag_octets(tag) for tag in value.tagList)).tags
        if len(held) == 1 and held[0].children is not None:  # they keep the tags round it
            held = held[0].children
        values = tuple(ours(codec.plain(tag)) for tag in held)
        return values[0] if len(values) == 1 else values
    if isinstance(value, constructed.Sequence):
        chosen = getattr(value, "_choice", None) if isinstance(value, constructed.Choice) else None
        found = []
        for name in [chosen] if chosen else value._order or value._elements:
            item = getattr(value, name, None)
            if item is not None or chosen:
                found.append((THEIR_NAMES.get(kebab(name), kebab(name)), plain(item)))
        return tuple(found)
    if isinstance(value, (list, constructed.Array)):
        return tuple(plain(item) for item in value)
    if isinstance(value, primitive.ObjectIdentifier):
        return ("object", int(value[0]), int(value[1]))
    if isinstance(value, primitive.BitString):
        return tuple(bool(bit) for bit in value)
    if isinstance(value, (primitive.Date, primitive.Time)):
        return tuple(value)
    if isinstance(value, primitive.Boolean):
        return bool(value)
    if isinstance(value, (bool, str, bytes)):
        return bytes(value) if isinstance(value, bytes) else value
    if isinstance(value, int):
        return int(value)
    return float(value)


def _tag_octets(tag: Any) -> bytes:
    number, cls, data = tag.tag_number, tag.tag_class, bytes(tag.tag_data or b"")
    if cls == primitive.TagClass.opening:
        return bytes((number << 4 | 14,))
    if cls == primitive.TagClass.closing:
        return bytes((number << 4 | 15,))
    if cls == primitive.TagClass.application and number == 1:
        return bytes((0x10 | tag.tag_lvt,))
    return tags.head(number, cls == primitive.TagClass.context, len(data)) + data


def ours(value: Any) -> Any:
    """The same of ours."""
    if isinstance(value, ConstructedValue):
        return tuple((name, ours(item)) for name, item in value)
    if isinstance(value, ObjectId):
        return ("object", value.type, value.instance)
    if isinstance(value, BitString):
        return value.bits
    if isinstance(value, Date):
        return (value.year, value.month, value.day, value.weekday)
    if isinstance(value, Time):
        return (value.hour, value.minute, value.second, value.hundredths)
    if isinstance(value, Enumerated):
        return value.value
    if isinstance(value, tuple):
        return tuple(ours(item) for item in value)
    return value


def same(a: Any, b: Any) -> bool:
    """Equal, reals nearly; a list property that holds one value is the value."""
    if isinstance(a, tuple) != isinstance(b, tuple):
        a, b = (
            a[0] if isinstance(a, tuple) and len(a) == 1 else a,
            b[0] if isinstance(b, tuple) and len(b) == 1 else b,
        )
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, float) and isinstance(b, float):
        return math.isclose(a, b, rel_tol=1e-6)
    return bool(a == b)


@pytest.mark.parametrize(("kind", "choice"), WITH_PARAMETERS, ids=lambda value: str(value))
def test_what_we_write_we_read_to_the_same_values(kind: int, choice: int):
    for seed in range(SEEDS):
        values = parameters_of(kind, choice, seed)
        read_back = codec.decode(LAYOUTS[kind][choice], codec.encode(LAYOUTS[kind][choice], values))
        assert read_back.error is None
        assert same(ours(read_back.record), ours(values))


@pytest.mark.parametrize(("kind", "choice"), CASES, ids=lambda value: str(value))
def test_what_we_write_bacpypes3_reads_to_the_same_values_and_writes_alike(kind: int, choice: int):
    compared = 0
    for seed in range(SEEDS):
        values = parameters_of(kind, choice, seed, complete=(kind, choice) in THEIRS_WANTS_ALL)
        if (kind, choice) == (1, 10):  # their reader stumbles over other kinds of value
            value = ConstructedValue("ChannelValue", (("real", 1.5),))
            values = _with(
                values, "change-list", (ConstructedValue("GroupChannelValue", (("channel", 9), ("value", value))),)
            )
        if _names(values) & THEIRS_OTHERWISE:
            continue
        octets = apdu_of(kind, choice, values)
        other = decode_theirs(kind, choice, octets)
        if (kind, choice) != (1, 7):  # they group the parameters of Who-Has in two choices
            assert same(plain_service(other), ours(values)), seed
        assert bytes(other.encode().encode().pduData) == octets
        compared += 1
    assert compared > SEEDS // 3


def _names(values: Any) -> set[str]:
    """Names of all parts, at every depth."""
    if isinstance(values, ConstructedValue):
        return {name for name, _ in values}.union(*(_names(value) for _, value in values))
    return set().union(*map(_names, values)) if isinstance(values, tuple) else set()


def _with(values: ConstructedValue, name: str, value: Any) -> ConstructedValue:
    return ConstructedValue(values.type, tuple((key, value if key == name else old) for key, old in values.entries))


def plain_service(value: Any) -> Any:
    found = []
    for name in value._order:
        item = getattr(value, name, None)
        if item is not None:
            found.append((THEIR_NAMES.get(kebab(name), kebab(name)), plain(item)))
    return tuple(found)


def test_every_service_of_theirs_has_a_layout():
    for kind, (known, table) in KINDS.items():
        for choice in known:
            assert services.parameters(kind, choice) is not None, (kind, choice)
            if kind != 5:
                assert choice in table


def test_every_type_of_the_tables_is_known():
    for table in (services.CONFIRMED, services.ACK, services.UNCONFIRMED, services.ERROR):
        for text in table.values():
            for field in layout.parse(text):
                assert layout.exists(field.type), field


def test_a_service_without_a_layout_is_a_tree_of_tags():
    decoded = codec.decode(services.parameters(0, 34), bytes.fromhex("09122e44429080002f"))
    assert decoded.error is None
    assert [tag.number for tag in decoded.rest] == [1 - 1, 2]
    assert decoded.rest[1].children is not None


@given(st.integers(0, 7), st.integers(0, 40), st.binary(max_size=80))
def test_decoding_stands_any_octets(kind: int, service: int, octets: bytes):
    decoded = codec.decode(services.parameters(kind, service), octets)
    assert decoded.error is None or decoded.error


@given(st.integers(1, 3000))
def test_nesting_is_bounded(depth: int):
    for octets in (b"\x0e" * depth, b"\x0e" * depth + b"\x0f" * depth, b"\x3e" * depth + b"\x00" + b"\x3f" * depth):
        codec.decode(services.ACK[14], octets)
        codec.decode(services.CONFIRMED[15], bytes.fromhex("0c004000011955") + octets)
        codec.decode(None, octets)


@given(st.sampled_from([b"\xfd\xff\xff\xff\xff", b"\x0d\xff\xff\xff\xff\xff", b"\x3d\xfe\xff\xff", b"\x65\xff"]))
def test_hostile_lengths_end_the_reading(octets: bytes):
    tree = tags.read(octets)
    assert tree.error is not None
    assert tree.tags == ()


@given(st.binary(max_size=60))
def test_what_reads_as_tags_is_written_back(octets: bytes):
    tree = tags.read(octets)
    again = tags.read(tags.write(tree.tags))
    assert again.error is None
    assert [_shape(t) for t in again.tags] == [_shape(t) for t in tree.tags]


def _shape(tag: tags.Tag) -> Any:
    inner = None if tag.children is None else [_shape(child) for child in tag.children]
    return (tag.number, tag.context, tag.octets, inner)


def test_names_and_vendor_ranges():
    assert str(ObjectId(8, 1234)) == "device,1234"
    assert str(ObjectId(200, 1)) == "vendor-200,1"
    assert str(ObjectId(8, 4194303)) == "device,*"
    assert names.property_name(85) == "present-value"
    assert names.property_name(600) == "vendor-600"
    assert names.property_name(4194320) == "sc-hub-function-binding"
    assert names.name("EngineeringUnits", 47823) == "per-day"
    assert names.name("ErrorCode", 31) == "unknown-object"
    assert names.name("AbortReason", 4) == "segmentation-not-supported"
    assert names.number("PropertyIdentifier", "vendor-600") == 600
    with pytest.raises(ValueError, match="no such name"):
        names.number("ObjectType", "toaster")


def test_property_values_have_the_type_of_their_property():
    decoded = codec.decode(services.ACK[12], bytes.fromhex("0c0000000119753e913e3f"))
    assert str(decoded.record["property-value"]) == "degrees-celsius"
    decoded = codec.decode(services.ACK[12], bytes.fromhex("0c00c0000119553e91013f"))
    assert str(decoded.record["property-value"]) == "active"
    decoded = codec.decode(services.ACK[12], bytes.fromhex("0c00000001196f3e8204403f"))
    assert str(decoded.record["property-value"]) == "{fault}"


def test_strings_in_every_character_set():
    for charset, octets, text in (
        (0, "Größe".encode(), "Größe"),
        (4, "Größe".encode("utf-16-be"), "Größe"),
        (3, "Größe".encode("utf-32-be"), "Größe"),
        (5, "Größe".encode("latin-1"), "Größe"),
        (2, bytes.fromhex("30214027"), "亜是"),
    ):
        body = bytes((charset,)) + octets
        found = codec.plain(tags.Tag(7, False, body))
        assert found == text
    assert codec.plain(tags.Tag(7, False, b"\x01" + struct.pack(">H", 850) + "é".encode("cp850"))) == "é"


def test_their_basetypes_are_all_in_our_tables():
    for name in ("TimeStamp", "DateRange", "Recipient", "NotificationParameters", "PriorityValue"):
        assert hasattr(basetypes, name)
        assert layout.exists(name)


@pytest.mark.parametrize("size", [0, 4, 5, 253, 254, 300, 65535, 65536, 70000])
def test_lengths_in_all_their_forms(size: int):
    content = b"\x00" + b"x" * (size - 1) if size else b""
    octets = tags.write([tags.Tag(7, False, content)])
    widths = {0: 1, 4: 1, 5: 2, 253: 2, 254: 4, 300: 4, 65535: 4, 65536: 6, 70000: 6}
    assert len(octets) == widths[size] + size
    if 254 <= size < 65536:
        assert octets[:4] == b"\x75\xfe" + struct.pack(">H", size)
    if size >= 65536:
        assert octets[:6] == b"\x75\xff" + struct.pack(">I", size)
    (tag,) = tags.read(octets).tags
    assert tag.octets == content
    their_tag = primitive.TagList.decode(PDU(octets))[0]
    assert bytes(their_tag.tag_data) == content


def test_a_query_of_an_audit_log_may_be_for_failures_only():
    octets = bytes.fromhex("0c0f400001 1e 0e 0c02000001 7902 0f 1f 3901")
    found = codec.decode(services.CONFIRMED[33], octets)
    assert not found.wrong
    query = found.record["query-parameters"]
    assert show(query["by-target"]["successful-actions-only"]) == "failures-only"
