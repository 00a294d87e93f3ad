"""Renaming keeps the error of a damaged frame: its octets change, what is wrong with them does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from dissectors.bacnet.renamer import MstpRenamer
from dissectors.checksums import crc8_mstp, crc16_modbus, crc16_x25, lrc
from dissectors.frame import Check, Chunk, Damage, Flaw, FoundBy, Frame, Repair
from dissectors.line import Timing
from dissectors.modbus.ascii_framing import AsciiFramer
from dissectors.modbus.envelope import make_ascii
from dissectors.modbus.renamer import AsciiRenamer, RtuRenamer
from dissectors.modbus.tcp import TcpRenamer
from dissectors.n2.envelope import judge, make_command
from dissectors.n2.renamer import N2Renamer
from dissectors.pseudonyms import inflicted

WHOLE = bytes.fromhex("55ff00090100000000")[:8]
RENAMED = bytes.fromhex("55ff0003020000aa")


def _frame(octets: bytes, check: Check, damage: Damage | None) -> Frame:
    return Frame("any", octets, 0, len(octets), check, FoundBy.LENGTH, damage)


@pytest.mark.parametrize(
    ("damaged", "expected"),
    [
        (WHOLE[1:], RENAMED[1:]),
        (WHOLE[2:], RENAMED[2:]),
        (WHOLE[:-1], RENAMED[:-1]),
        (WHOLE[:5] + bytes([WHOLE[5] ^ 4]) + WHOLE[6:], RENAMED[:5] + bytes([RENAMED[5] ^ 4]) + RENAMED[6:]),
    ],
)
def test_a_flaw_is_inflicted_again(damaged: bytes, expected: bytes) -> None:
    assert inflicted(damaged, WHOLE, RENAMED) == expected


def test_swapped_check_octets_are_swapped_again() -> None:
    assert inflicted(b"\x01\x02\x04\x03", b"\x01\x02\x03\x04", b"\x09\x02\x05\x06") == b"\x09\x02\x06\x05"


def test_check_octets_that_are_alike_are_wrong_all_the_same() -> None:
    made = inflicted(b"\x01\x02\x04\x03", b"\x01\x02\x03\x04", b"\x09\x02\x05\x05")
    assert made[:2] == b"\x09\x02"
    assert made[2:] != b"\x05\x05"


def test_the_error_of_a_header_check_stays_and_unheard_addresses_get_a_number_from_the_end() -> None:
    rename = MstpRenamer()
    header = bytes([0, 9, 17, 0, 0])
    rename.stations.of(5)
    new = rename.stations.of(9)
    renamed = rename(_frame(b"\x55\xff" + header + bytes([crc8_mstp(header) ^ 0x21]), Check.BAD, Damage.HEADER))
    assert (renamed[3], renamed[4]) == (new, 127)
    assert renamed[7] ^ crc8_mstp(renamed[2:7]) == 0x21


@pytest.mark.parametrize("size", range(8))
def test_a_header_that_is_cut_gives_no_address_away(size: int) -> None:
    cut = bytes.fromhex("55ff0009110000")[:size]
    assert MstpRenamer()(_frame(cut, Check.ABSENT, Damage.SHORT)) == bytes.fromhex("55ff007f7e0000")[:size]


def test_the_error_of_a_modbus_crc_stays() -> None:
    rename = RtuRenamer()
    new = rename.stations.of(17)
    body = bytes.fromhex("110300000002")
    sent = (crc16_modbus(body) ^ 0x0140).to_bytes(2, "little")
    renamed = rename(_frame(body + sent, Check.BAD, Damage.CHECK))
    assert renamed[0] == new
    assert int.from_bytes(renamed[-2:], "little") ^ crc16_modbus(renamed[:-2]) == 0x0140


NAME = b"Room 214, Mr Smith's own controller"


def test_a_damaged_mstp_frame_loses_its_texts_and_keeps_its_error() -> None:
    data = bytes.fromhex("010030010c02000007194d3e752400") + NAME + b"\x3f"
    header = bytes([6, 1, 2, 0, len(data)])
    front = b"\x55\xff" + header + bytes([crc8_mstp(header)])
    check = (crc16_x25(data) ^ 0x1248).to_bytes(2, "little")
    renamed = MstpRenamer()(_frame(front + data + check, Check.BAD, Damage.CHECK))
    assert NAME[:4] not in renamed
    assert int.from_bytes(renamed[-2:], "little") ^ crc16_x25(renamed[8:-2]) == 0x1248
    for torn in (front + data[:30], front + data[:30] + b"U\xff" + data[30:]):
        renamed = MstpRenamer()(_frame(torn, Check.BAD, Damage.RESTARTED))
        assert len(renamed) == len(torn)
        assert renamed.count(b"\x55\xff") == torn.count(b"\x55\xff")
        assert NAME[:4] not in renamed


def test_a_damaged_modbus_answer_loses_its_texts_and_keeps_its_error() -> None:
    answer = bytes([3, 17, len(NAME) + 1]) + NAME + b"\xff"
    check = (crc16_modbus(answer) ^ 0x0140).to_bytes(2, "little")
    renamed = RtuRenamer()(_frame(answer + check, Check.BAD, Damage.CHECK))
    assert renamed[1:3] == answer[1:3]
    assert NAME[:4] not in renamed
    assert int.from_bytes(renamed[-2:], "little") ^ crc16_modbus(renamed[:-2]) == 0x0140
    assert NAME[:4] not in RtuRenamer()(_frame(answer[:20], Check.BAD, Damage.SHORT))

    line = b":" + (answer + bytes([lrc(answer) ^ 1])).hex().upper().encode() + b"\r\n"
    renamed = AsciiRenamer()(_frame(line, Check.BAD, Damage.CHECK))
    body = bytes.fromhex(renamed[1:-2].decode())
    assert NAME[:4] not in body
    assert lrc(body[:-1]) + (lrc(answer) ^ 1) - lrc(answer) & 0xFF == body[-1]
    spoilt = line[:5] + b"?" + line[6:40]
    renamed = AsciiRenamer()(_frame(spoilt, Check.BAD, Damage.FORM))
    assert (len(renamed), renamed[3:7]) == (len(spoilt), spoilt[3:7])
    assert NAME[4:8].hex().upper().encode() not in renamed


def test_a_damaged_frame_of_tcp_loses_its_texts() -> None:
    octets = bytes([0, 1, 0, 0, 0, 60, 3, 43, 14, 1, 1, 0, 0, 1, 0, len(NAME)]) + NAME[:20]
    renamed = TcpRenamer()(_frame(octets, Check.ABSENT, Damage.SHORT))
    assert renamed == octets[:6] + renamed[6:7] + octets[7:16] + b"x" * 20


def _even(characters: bytes) -> bytes:
    return bytes(c | 0x80 * (c.bit_count() & 1) for c in characters)


@pytest.mark.parametrize("parity", [_even, lambda octets: bytes(c ^ 0x80 for c in _even(octets))], ids=["even", "odd"])
def test_an_ascii_frame_with_its_parity_in_bit_7_stays_good(parity: Callable[[bytes], bytes]) -> None:
    rename = AsciiRenamer()
    rename.stations.of(200)
    line = parity(make_ascii(17, bytes.fromhex("0300000002")))
    framer = AsciiFramer(Timing())
    (frame,) = [*framer.feed(Chunk(10**9, line)), *framer.close()]
    assert isinstance(frame, Frame)
    renamed = rename(frame)
    assert (frame.ok, renamed) == (True, parity(make_ascii(2, bytes.fromhex("0300000002"))))
    spoilt = line[:5] + bytes([line[5] ^ 0x81]) + line[6:]
    renamed = rename(_frame(spoilt, Check.BAD, Damage.CHECK))
    assert [at for at, c in enumerate(renamed) if parity(bytes([c & 0x7F])) != bytes([c])] == []
    spoilt = line[:5] + bytes([line[5] ^ 0x80]) + line[6:]
    renamed = rename(_frame(spoilt, Check.BAD, Damage.FORM))
    assert [at for at, c in enumerate(renamed) if parity(bytes([c & 0x7F])) != bytes([c])] == [5]


def test_a_damaged_n2_command_has_no_address_of_its_own_and_the_same_error() -> None:
    rename = N2Renamer()
    assert rename.stations.of(10) == 1
    asked, renamed = make_command("05110A03"), make_command("02110A03")
    swapped, wrong = asked[:-3] + b"B9\r", asked[:-3] + b"9C\r"
    for damaged, becomes, repair in (
        (asked[1:], renamed[1:], Repair(Flaw.FIRST_MISSING, asked)),
        (b"\x7f" + asked[1:], b"\x7f" + renamed[1:], Repair(Flaw.FIRST_SPOILT, asked)),
        (asked[:-2], renamed[:-2], Repair(Flaw.LAST_TWO_MISSING, asked)),
        (swapped, renamed[:-3] + b"89\r", Repair(Flaw.CHECK_SWAPPED, asked)),
        (wrong, renamed[:-3] + b"99\r", None),  # one too many, where the address is one less
        (b">051", b">021", None),
        (b"A05", b"A05", Repair(Flaw.LAST_MISSING, b"A05\r")),
    ):
        frame = replace(_frame(damaged, Check.BAD, Damage.CHECK), repair=repair)
        assert rename(frame) == becomes
    alike = make_command("05110A04")  # 9C; with another address 99
    frame = replace(_frame(alike[:-3] + b"C9\r", Check.BAD, Damage.CHECK), repair=Repair(Flaw.CHECK_SWAPPED, alike))
    assert judge(rename(frame))[1] is Damage.CHECK


def test_a_damaged_frame_before_the_first_good_one_names_nobody() -> None:
    body = bytes.fromhex("110300000002")
    rtu = body + crc16_modbus(body).to_bytes(2, "little")
    line, command = make_ascii(17, body[1:]), make_command("11110A03")
    for rename, good, spoilt, place in (
        (RtuRenamer(), rtu, rtu[:-1] + bytes([rtu[-1] ^ 1]), slice(0, 1)),
        (AsciiRenamer(), line, line[:-4] + b"00\r\n", slice(1, 3)),
        (N2Renamer(), command, command[:-3] + b"00\r", slice(1, 3)),
    ):
        first = rename(_frame(spoilt, Check.BAD, Damage.CHECK))[place]
        assert first != good[place]
        assert rename(_frame(good, Check.GOOD, None))[place] == first


def test_a_count_that_could_be_a_letter_stays_a_count() -> None:
    """Of a text of 32 characters and more the octet before it is printable, too."""
    server = bytes([3, 17, len(NAME) + 1]) + NAME + b"\xff"
    objects = bytes([0, len(NAME)]) + NAME + bytes([1, 5]) + b"M-400" + bytes([2, len(NAME)]) + NAME
    identity = bytes([3, 43, 14, 1, 1, 0, 0, 3]) + objects
    for answer in (server, identity):
        frame = _frame(answer + crc16_modbus(answer).to_bytes(2, "little"), Check.GOOD, None)
        renamed = RtuRenamer()(frame)
        blank = [number for number, octet in enumerate(answer) if renamed[number] == ord("x") != octet]
        assert NAME[:4] not in renamed
        assert len(blank) >= len(NAME) - 3
        counts = (2,) if answer is server else (8, 9, 10 + len(NAME), 11 + len(NAME), 17 + len(NAME), 18 + len(NAME))
        assert [renamed[at] for at in counts] == [answer[at] for at in counts]
