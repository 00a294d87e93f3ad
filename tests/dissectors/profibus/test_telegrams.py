"""Worked telegrams: what they are, in one line, in fields, as packets."""

from __future__ import annotations

import pytest

from dissectors.frame import Check, Chunk, Damage, Flaw, FoundBy, Frame, Role
from dissectors.line import LineSettings, Timing
from dissectors.profibus import PROFIBUS, ProfibusFramer
from dissectors.profibus.telegram import telegram

TIMING = Timing(LineSettings.parse("19200,8E1"))
SEEN = telegram(8, 2, 0x49)


def frame(hexed: str) -> Frame:
    octets = bytes.fromhex(hexed)
    check = Check.GOOD if len(octets) > 3 else Check.ABSENT
    return Frame("profibus", octets, 0, 1, check, FoundBy.DELIMITER)


def read(*parts: bytes) -> list[Frame]:
    framer, now, events = ProfibusFramer(TIMING), 10**18, []
    for octets in parts:
        now += 200_000_000 + len(octets) * TIMING.char
        events += framer.feed(Chunk(now, octets))
    return [event for event in (*events, *framer.close()) if isinstance(event, Frame)]


WORKED = [
    ("10 08 02 49 53 16", "2 → 8 FDL status"),
    ("10 02 08 00 0A 16", "8 → 2 done (slave)"),
    ("10 02 03 20 25 16", "3 → 2 done (master, ready for the ring)"),
    ("10 02 03 30 35 16", "3 → 2 done (master in the ring)"),
    ("DC 03 02", "2 → 3 token"),
    ("E5", "SC"),
    ("10 02 08 03 0D 16", "8 → 2 service not activated (RS)"),
    ("68 05 05 68 88 82 6D 3C 3E F1 16", "2 → 8 Slave_Diag [first]"),
    (
        "A2 82 88 08 3E 3C 00 04 00 FF 00 00 8F 16",
        "8 → 2 Slave_Diag: nothing to report; no master; ident 0000h",
    ),
    (
        "68 0B 0B 68 82 88 08 3E 3C 02 05 00 02 F5 10 9A 16",
        "8 → 2 Slave_Diag: not ready, wants parameters; master 2; ident F510h",
    ),
    (
        "68 0D 0D 68 82 88 08 3E 3C 0A 0C 00 02 F5 10 02 01 AC 16",
        "8 → 2 Slave_Diag: not ready, extended diagnosis, watchdog on; master 2; ident F510h; device: 01",
    ),
    (
        "68 11 11 68 88 82 5D 3D 3E B8 1E 01 00 F5 10 01 00 00 00 00 00 BF 16",
        "2 → 8 Set_Prm: watchdog, freeze, sync, lock; ident F510h; watchdog 300 ms; groups 01h; "
        "user 00 00 00 00 00 [FCB 0]",
    ),
    ("68 06 06 68 88 82 7D 3E 3E 7F 82 16", "2 → 8 Chk_Cfg: 16 words in and out [FCB 1]"),
    ("68 05 05 68 88 82 5D 3B 3E E0 16", "2 → 8 Get_Cfg [FCB 0]"),
    ("68 06 06 68 82 88 08 3E 3B 7F 0A 16", "8 → 2 Get_Cfg: 16 words in and out"),
    ("68 07 07 68 08 02 5D 01 00 17 70 EF 16", "2 → 8 Data_Exchange: out 01 00 17 70 [FCB 0]"),
    ("68 07 07 68 02 08 0A 00 03 17 70 9E 16", "8 → 2 Data_Exchange: in 00 03 17 70, diagnosis pending"),
    ("10 08 02 7D 87 16", "2 → 8 Data_Exchange: no outputs [FCB 1]"),
    ("68 07 07 68 FF 82 46 3A 3E 20 00 5F 16", "2 → all Global_Control: sync"),
    ("68 07 07 68 FF 82 46 3A 3E 08 01 48 16", "2 → all Global_Control: freeze, groups 01h"),
    ("68 07 07 68 FF 82 46 3A 3E 02 00 41 16", "2 → all Global_Control: clear"),
]


@pytest.mark.parametrize(("hexed", "said"), WORKED)
def test_a_telegram_in_one_line(hexed: str, said: str) -> None:
    one = frame(hexed)
    assert PROFIBUS.text(one, PROFIBUS.peek(one), Role.REQUEST) == said


@pytest.mark.parametrize(("hexed", "said"), WORKED)
def test_packets_give_the_octets_back(hexed: str, said: str) -> None:
    one = frame(hexed)
    packet = PROFIBUS.packet(one, Role.REQUEST)
    assert bytes(packet) == one.octets
    assert "Raw" not in type(packet).__name__


def test_packets_are_made_from_parts() -> None:
    from dissectors.profibus.packets import PBRequest, PBShort, PBToken

    assert bytes(PBRequest(da=8, sa=2, fc=0x49)).hex(" ") == "10 08 02 49 53 16"
    assert bytes(PBRequest(da=8, sa=2, fc=0x6D, dsap=60, ssap=62)).hex(" ") == "68 05 05 68 88 82 6d 3c 3e f1 16"
    assert bytes(PBToken(da=3, sa=2)) == b"\xdc\x03\x02"
    assert bytes(PBShort()) == b"\xe5"


def test_fields_of_a_diagnosis() -> None:
    one = frame("68 0D 0D 68 82 88 08 3E 3C 0A 0C 00 02 F5 10 02 01 AC 16")
    told = PROFIBUS.fields(one, Role.RESPONSE)
    assert (told["pb.da"], told["pb.sa"], told["pb.ssap"], told["pb.status"]) == (2, 8, 60, "DL")
    assert told["pb.diag.ident"] == 0xF510
    assert told["pb.diag.master"] == 2
    assert "extended diagnosis" in str(told["pb.diag.words"])


def test_channel_diagnosis_in_words() -> None:
    octets = bytes((0x08, 0x0C, 0, 2, 0xF5, 0x10, 0x42, 0x05, 0x83, 0x41, 0xA6))
    made = telegram(2, 8, 0x08, octets, dsap=62, ssap=60)
    said = PROFIBUS.text(frame(made.hex()), PROFIBUS.peek(frame(made.hex())), Role.RESPONSE)
    assert "modules with a diagnosis: 0, 2" in said
    assert "module 3, input channel 1 (word): line break" in said


@pytest.mark.parametrize(
    ("damage", "octets", "flaw"),
    [
        (Damage.CHECK, "10 08 02 49 54 16", None),
        (Damage.FORM, "11 08 02 49 53 16", Flaw.FIRST_SPOILT),
        (Damage.FORM, "08 02 49 53 16", Flaw.FIRST_MISSING),
        (Damage.FORM, "10 08 02 49 53 17", Flaw.LAST_SPOILT),
        (Damage.SHORT, "10 08 02 49 53", Flaw.LAST_MISSING),
        (Damage.FORM, "68 07 06 68 08 02 5D 01 00 17 70 EF 16", Flaw.ONE_SPOILT),
        (Damage.CHECK, "68 07 07 68 08 02 5D 01 00 17 71 EF 16", None),
        (Damage.SHORT, "68 07 07 68 08 02 5D 01", None),
    ],
)
def test_damaged_telegrams_are_told(damage: Damage, octets: str, flaw: Flaw | None) -> None:
    found = read(SEEN, bytes.fromhex(octets))
    assert [one.octets for one in found] == [SEEN, bytes.fromhex(octets)]
    assert found[1].damage is damage
    assert (found[1].repair.flaw if found[1].repair else None) is flaw
    assert not PROFIBUS.peek(found[1]).ok


def test_before_any_good_telegram_nothing_is_a_damaged_one() -> None:
    assert read(bytes.fromhex("68 07 07 68 08 02 5D 01 00 17 71 EF 16")) == []


@pytest.mark.parametrize(
    "octets",
    [
        "68 00 09 00 09 68 80 7F 06 06 01 01 00 01 01 0F 16",  # a display bus with lengths of 16 bits
        "68 0F 0F 68 08 05 72 78 56 34 12 01 06 05 07 55 00 00 00 46 16",  # M-Bus
        "68 04 04 68 53 FE 51 00 A2 16",
        "10 5B 01 5C 16",
    ],
)
def test_others_with_a_like_envelope_are_not_claimed(octets: str) -> None:
    assert read(bytes.fromhex(octets) * 3) == []


def test_renamed_telegrams_stay_good_and_damaged_ones_damaged() -> None:
    renamer = PROFIBUS.renamer() if PROFIBUS.renamer else None
    assert renamer is not None
    good, bad = read(SEEN, bytes.fromhex("10 08 02 49 54 16"))
    first, second = renamer(good), renamer(bad)
    assert first != good.octets
    renamed = read(first, second)
    assert [one.damage for one in renamed] == [None, Damage.CHECK]
    assert renamed[0].octets[1:3] == renamed[1].octets[1:3]


def test_a_stray_octet_in_front_of_the_answer_is_no_acknowledgement() -> None:
    asked, answer = telegram(8, 2, 0x5D, b"\1"), telegram(2, 8, 0x08, b"\2")
    assert [one.octets for one in read(asked, b"\xe5" + answer)] == [asked, answer]
    assert [one.octets for one in read(asked, b"\xe5\x55" + answer)] == [asked, answer]
    assert [one.octets for one in read(asked, b"\xe5", telegram(9, 2, 0x5D, b"\1"))][1] == b"\xe5"


def test_every_rate_of_a_bus_can_be_named() -> None:
    rates = (9600, 19_200, 45_450, 93_750, 187_500, 500_000, 1_500_000, 3_000_000, 6_000_000, 12_000_000)
    assert [LineSettings.parse(f"{rate},8E1").baud for rate in rates] == list(rates)
