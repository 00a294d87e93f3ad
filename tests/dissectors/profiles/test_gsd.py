"""GSD files as profiles."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.profiles import ProfileError
from dissectors.profiles.packaged import packaged, parse_text
from sniff.devices import devices

PUMP = """; made up
#Profibus_DP
GSD_Revision = 1
Vendor_Name = "Example; makers" ; quoted
Model_Name  = "Pump 7"
IDENT_NUMBER = 0x80AB
MaxTsdr_9.6 = 60
MaxTsdr_12M = 800
Max_Input_Len = 4
User_Prm_Data = 0x00,\\
  0x00
Module = "2 words in" 0x51
EndModule
"""


def test_what_a_gsd_file_says() -> None:
    profile = parse_text(PUMP, "pump.gsd")
    assert (profile.name, profile.title, profile.protocols) == ("pump-7", "Example; makers Pump 7", ("profibus",))
    assert profile.facts["Ident_Number"] == 0x80AB
    assert profile.facts["Max_Input_Len"] == 4
    assert profile.facts["Module_1"] == '"2 words in" 0x51'
    assert profile.limits_on("profibus").responses == {9_600: 6_250_000, 12_000_000: 66_666}  # 60 and 800 bits
    assert profile.document == PUMP


def test_control_characters_and_long_lines_are_no_matter() -> None:
    text = PUMP.replace("Pump 7", "Pump\x1b[2J 7").replace("2 words", "2\twords") + "User = 1,\\\n" * 20_000
    profile = parse_text(text, "pump.gsd")
    assert profile.models == ("Pump [2J 7",)
    assert profile.facts["Module_1"] == '"2 words in" 0x51'


def test_a_gsd_file_is_found_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "PUMP.GSD"
    path.write_text(PUMP.replace("Example", "Müller"), encoding="latin-1")
    profile = devices({"5": str(path)}).at(5)
    assert profile is not None
    assert profile.vendor == "Müller; makers"


@pytest.mark.parametrize(
    "text", ["#Profibus_DP\n", '#Profibus_DP\nModel_Name = "x"\n', "#Profibus_DP\nModel_Name = x\n"]
)
def test_a_gsd_file_without_name_or_ident_is_no_profile(text: str) -> None:
    with pytest.raises(ProfileError, match="Ident_Number"):
        parse_text(text, "x.gsd")


def test_words_of_the_drive_have_its_own_lists() -> None:
    from dissectors.profiles.packaged import packaged

    drive = packaged("teco-f510")
    fault, alarm = drive.at("dp-input", 1), drive.at("dp-input", 8)
    assert fault is not None
    assert alarm is not None
    assert 39 in fault.reserved_codes  # low flow fault on Modbus
    assert fault.states[44] == "PID feedback loss"
    assert 37 in alarm.reserved_codes
    assert {entry.address for entry in drive.in_space("dp-output")} == set(range(16))
    assert {entry.address for entry in drive.in_space("dp-input")} == set(range(16))


def test_the_gsd_in_a_document_says_how_long_answers_take_as_the_file_does() -> None:
    f510 = packaged("teco-f510")
    told = f510.limits_on("profibus").responses
    assert (told[9_600], told[1_500_000], told[12_000_000]) == (6_250_000, 100_000, 66_666)  # 60, 150 and 800 bits
    (sign,) = parse_text(PUMP, "pump.gsd").signs
    assert (sign.space, sign.value, sign.title) == ("dp-ident", 0x80AB, "ident number")
