"""What DP services carry: as a tree, in fields, in one line; and what is too short or strange says so."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Check, FoundBy, Frame, Role
from dissectors.meaning import Node
from dissectors.profibus import PROFIBUS
from dissectors.profibus.configuration import parse_configuration
from dissectors.profibus.diagnosis import parse_blocks
from dissectors.profibus.dpv1 import device_block, parse_acyclic
from dissectors.profibus.outline import outline
from dissectors.profibus.parameters import parse_parameters
from dissectors.profibus.telegram import telegram


def framed(octets: bytes) -> Frame:
    return Frame("profibus", octets, 0, 1, Check.GOOD, FoundBy.DELIMITER)


def request(point: int, data: bytes) -> Frame:
    return framed(telegram(8, 2, 0x5D, data, point, 62 if point > 51 else point))


def answer(point: int, data: bytes, control: int = 0x08) -> Frame:
    return framed(telegram(2, 8, control, data, 62 if point > 51 else point, point))


def lines(frame: Frame) -> dict[str, str]:
    """Every line of the tree by its path."""
    nodes = outline(frame.octets)
    assert nodes is not None
    found: dict[str, str] = {}

    def walk(some: tuple[Node, ...], path: str) -> None:
        for node in some:
            found[path + node.name] = node.text
            walk(node.children, f"{path}{node.name}/")

    walk(nodes, "")
    return found


def said(frame: Frame) -> str:
    return PROFIBUS.text(frame, PROFIBUS.peek(frame), Role.REQUEST)


def test_a_diagnosis_octet_by_octet() -> None:
    frame = answer(60, bytes((0x4A, 0x0D, 0x80, 2, 0xF5, 0x10, 0x42, 0x05, 0x83, 0x41, 0xA6)))
    told = lines(frame)
    assert told["Slave_Diag/station status 1/parameter fault"] == "yes"
    assert told["Slave_Diag/station status 2/watchdog on"] == "yes"
    assert told["Slave_Diag/station status 3/diagnosis overflow"] == "yes"
    assert (told["Slave_Diag/master"], told["Slave_Diag/ident number"]) == ("2", "F510h")
    assert told["Slave_Diag/modules"] == "modules with a diagnosis: 0, 2"
    assert told["Slave_Diag/channel"] == "module 3, input channel 1 (word): line break"
    fields = PROFIBUS.fields(frame, Role.RESPONSE)
    assert (fields["pb.diag.prm_fault"], fields["pb.diag.cfg_fault"], fields["pb.diag.wd_on"]) == (1, 0, 1)
    assert (fields["pb.diag.module"], fields["pb.diag.channel"], fields["pb.diag.error"]) == (3, 1, "line break")


def test_parameters_and_configuration_octet_by_octet() -> None:
    told = lines(request(61, bytes((0xB8, 30, 1, 11, 0xF5, 0x10, 5, 0, 0))))
    assert told["Set_Prm/watchdog"] == "300 ms (30 × 1)"
    assert told["Set_Prm/min TSDR"] == "11 bit times"
    assert told["Set_Prm/user parameters"] == "00 00"
    told = lines(request(62, bytes.fromhex("7f 00 c1 07 05 aa 43")))
    assert told["Chk_Cfg/module 0"] == "7f: 16 words in and out, consistent by units"
    assert told["Chk_Cfg/module 1"] == "00: empty slot"
    assert told["Chk_Cfg/module 2"] == "c1 07 05 aa: 6 octets in, 8 octets out, consistent by units, maker's aa"
    assert told["Chk_Cfg/cut off"] == "43"
    told = lines(request(62, bytes.fromhex("4f 03 21")))  # 15: no octets of the maker's follow, any will do
    assert told["Chk_Cfg/module 0"] == "4f 03: 4 octets in, consistent by units"
    assert told["Chk_Cfg/module 1"] == "21: 2 octets out, consistent by units"


@pytest.mark.parametrize(
    ("user", "watchdogs", "words"),
    [
        (b"", (300, 300), "300 ms (30 × 1)"),
        (b"\x80", (300, 300), "300 ms (30 × 1)"),
        (b"\x84", (30, 30), "30 ms (30 × 1)"),
        (b"\x04", (30, 300), "300 ms, 30 ms if the slave is of DP-V1 (30 × 1)"),  # else the octet is its maker's
    ],
)
def test_what_a_watchdog_counts_in_only_dp_v1_says(user: bytes, watchdogs: tuple[int, int], words: str) -> None:
    frame = request(61, bytes((0xB8, 30, 1, 11, 0xF5, 0x10, 5)) + user)
    given_ = parse_parameters(bytes((0xB8, 30, 1, 11, 0xF5, 0x10, 5)) + user)
    assert given_ is not None
    assert given_.watchdogs_ms == watchdogs
    assert lines(frame)["Set_Prm/watchdog"] == words
    sure = watchdogs[0] if watchdogs[0] == watchdogs[1] else None
    assert PROFIBUS.fields(frame, Role.REQUEST).get("pb.prm.watchdog_ms") == sure


def test_a_command_to_all_and_to_groups() -> None:
    assert lines(framed(telegram(127, 2, 0x46, b"\x08\x05", 58, 62)))["Global_Control/groups"] == "1, 3"
    assert lines(framed(telegram(127, 2, 0x46, b"\x20\x00", 58, 62)))["Global_Control/groups"] == "all"


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (answer(60, b"\x02\x05"), "Slave_Diag: 2 octets, 6 expected"),
        (request(61, b"\xb8"), "Set_Prm: 1 octet, 7 expected"),
        (request(58, b"\x02"), "Global_Control: 1 octet, 2 expected"),
        (request(55, b"\x02"), "Set_Slave_Add: 1 octet, 4 expected"),
        (request(62, b"\x7f\xc0\x01"), "configuration cut off"),
        (request(51, b"\x11\x22"), "no function of DP-V1"),
        (request(51, b"\x5f\x01\x02\x09\x00"), "DP-V1: cut off"),
    ],
)
def test_what_is_too_short_says_so(frame: Frame, words: str) -> None:
    assert PROFIBUS.fields(frame, Role.REQUEST)["pb.malformed"] == words
    assert said(frame)


DPV1 = [
    (request(51, b"\x5e\x01\x2f\x20"), "DP-V1 read or write: read, slot 1, index 47, 32 octets"),
    (answer(51, b"\x5e\x01\x2f\x02\xab\xcd"), "DP-V1 read or write: read, slot 1, index 47, 2 octets: ab cd"),
    (answer(51, b"\xde\x80\xb0\x00"), "DP-V1 read or write: read refused: invalid index"),
    (answer(51, b"\xdf\x80\xc2\x05"), "DP-V1 read or write: write refused: busy (maker's code 05h)"),
    (request(51, b"\x5f\x00\x10\x01\x07"), "DP-V1 read or write: write, slot 0, index 16, 1 octet: 07"),
    (
        request(50, b"\x5c\x04\x01\x09"),
        "DP-V1 alarm: alarm acknowledgement, slot 4, diagnosis alarm, appears, number 1",
    ),
    (request(49, b"\x56\x10\x00\x64"), "DP-V1 resource manager: resource manager: 10 00 64"),
    (request(16, b"\x57\x00\x00"), "DP-V1 connection: initiate: 00 00"),
    (request(16, b"\x48"), "DP-V1 connection: idle"),
]


@pytest.mark.parametrize(("frame", "words"), DPV1)
def test_dp_v1(frame: Frame, words: str) -> None:
    assert words in said(frame)
    assert "pb.v1.function" in PROFIBUS.fields(frame, Role.REQUEST)


def test_a_service_of_others_below_access_point_49_is_not_taken_for_dp_v1() -> None:
    assert PROFIBUS.peek(request(16, b"\x01\x02")).kind == "fdl-data"


def test_alarms_in_a_device_block_are_said_with_a_doubt() -> None:
    frame = answer(60, bytes((0x08, 0x0C, 0, 2, 0xF5, 0x10, 0x05, 0x01, 0x04, 0x0D, 0x77)))
    assert "device: 01 04 0d 77 (if of DP-V1: diagnosis alarm, slot 4, appears, with a further" in said(frame)
    assert device_block(b"\x82\x00\x00\x06") == "module status: slot 1 wrong module, slot 2 data invalid"
    assert device_block(b"\x83\x00\x00\x05\x80") == "state of links between slaves, slot 0: 05 80"
    assert device_block(b"\x9f\x00\x01") == "redundancy state, slot 0, appears"


@given(
    st.binary(max_size=60), st.sampled_from([None, 16, 49, 50, 51, 53, 55, 56, 57, 58, 59, 60, 61, 62]), st.booleans()
)
def test_any_content_is_told(data: bytes, point: int | None, is_request: bool) -> None:
    octets = telegram(8, 2, 0x5D if is_request else 0x08, data, point, None if point is None else 62)
    if not is_request:
        octets = telegram(2, 8, 0x08, data, None if point is None else 62, point)
    frame = framed(octets)
    nodes = outline(octets)
    assert nodes is not None

    def within(some: tuple[Node, ...]) -> bool:
        return all(
            node.begin is not None
            and node.end is not None
            and 0 <= node.begin <= node.end <= len(octets)
            and within(node.children)
            for node in some
        )

    assert within(nodes)
    assert said(frame).isprintable()
    PROFIBUS.fields(frame, Role.REQUEST)


@given(st.binary(max_size=40))
def test_parts_of_content_are_total_and_in_order(data: bytes) -> None:
    for parts in (parse_configuration(data), parse_blocks(data)):
        at = 0
        for one in parts:
            assert one.begin == at < one.end <= len(data)
            at = one.end
    parse_acyclic(data, is_request=True)
    parse_acyclic(data, is_request=False)
    device_block(data)


@given(st.binary(max_size=40))
def test_any_octets_have_a_tree_or_none(octets: bytes) -> None:
    if octets:
        outline(octets)
