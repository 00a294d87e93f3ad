"""`profile import`: register maps as tables and as Home Assistant has them, to profiles that can be read."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.modbus.map_home_assistant import read_home_assistant
from dissectors.modbus.map_tables import read_csv
from dissectors.profiles.model import Access, Kind, Profile
from dissectors.profiles.packaged import parse_text
from dissectors.register_maps import NUMBERINGS, document, kind_of, order_of

Run = Callable[..., Any]

METER = """Example meter;list 1.2;;;;;;
Register;Parameter;Data type;Scale factor;Unit;R/W;Range;States;Page
30001;Volts L1;Float (CDAB);1;V;R;;;7
30003;Volts L2;Float (CDAB);1;V;R;;;7
30343;Total energy;UINT32;0,01;kWh;R;;;8
40013;Demand period;uint16;;min;R/W;0…60;;9
40019;Parity;uint16;;;R/W;;0=none, 1=even;9
40021;Serial;string;;;R;;;9
40025;Old;BCD16;1/10;V;R;;;9
abc;;;;;;;;
"""


def imported(run: Run, folder: Path, text: str, *options: object, suffix: str = ".csv") -> tuple[Profile, str]:
    source = folder / f"map{suffix}"
    source.write_text(text, encoding="utf-8")
    ran = run("profile", "import", source, *options)
    assert ran.code == 0, ran.err
    return parse_text(ran.out, "imported"), ran.err


def test_a_table_becomes_a_profile_that_says_what_is_missing(sniff485: Run, tmp_path: Path) -> None:
    profile, said = imported(sniff485, tmp_path, METER)
    volts, parity, energy = (profile.at(*at) for at in (("input", 2), ("holding", 18), ("input", 342)))
    assert volts is not None
    assert (volts.name, volts.kind, volts.swapped, volts.unit) == ("volts-l2", Kind.F32, True, "V")
    assert volts.access is Access.READ
    assert energy is not None
    assert (energy.kind, energy.scale) == (Kind.U32, 0.01)
    assert parity is not None
    assert parity.states == {0: "none", 1: "even"}
    period = profile.at("holding", 12)
    assert period is not None
    assert (period.low, period.high, period.access) == (0, 60, Access.BOTH)
    old = profile.at("holding", 24)
    assert old is not None
    assert (old.scale, "BCD16" in old.doubt) == (0.1, True)
    assert "6 registers imported; numbers are 40001-style" in said
    for left_out in ("columns Page (1)", "texts (1)", "rows without a number that can be read (1)", "type 'BCD16' (1)"):
        assert f"left out: {left_out}" in said


def test_numbers_are_of_the_wire_where_not_all_are_40001_style(sniff485: Run, tmp_path: Path) -> None:
    text = "address,name,function\n0,a,3\n0x10,b,FC04\n40001,c,holding register\n5,d,coil\n"
    profile, said = imported(sniff485, tmp_path, text)
    assert [(entry.space, entry.address) for entry in profile.entries] == [
        ("holding", 0), ("holding", 40001), ("input", 16), ("coil", 5),
    ]  # fmt: skip
    assert "of the wire, from 0" in said


@pytest.mark.parametrize(("numbering", "address"), [("auto", 1), ("0", 1), ("1", 0)])
def test_numbering_is_said(sniff485: Run, tmp_path: Path, numbering: str, address: int) -> None:
    profile, _ = imported(sniff485, tmp_path, "Register,Name\n1,a\n2,b\n", "--numbering", numbering)
    assert profile.entries[0].address == address
    assert profile.entries[0].space == "holding"


def test_a_table_may_be_said(sniff485: Run, tmp_path: Path) -> None:
    profile, said = imported(sniff485, tmp_path, "Register\tName\n1\ta\n", "--table", "input")
    assert profile.entries[0].space == "input"
    assert "do not say which table" not in said


def test_sizes_make_types_wide(sniff485: Run, tmp_path: Path) -> None:
    text = "address,name,type,length\n0,a,int,2\n2,b,uint16,4\n10,c,,2\n20,d,float,4\n"
    profile, _ = imported(sniff485, tmp_path, text)
    assert [entry.kind for entry in profile.entries] == [Kind.S32, Kind.U64, Kind.U32, Kind.F64]
    assert [bool(entry.doubt) for entry in profile.entries] == [False, False, True, False]


@pytest.mark.parametrize(
    ("number", "space", "address", "width"),
    [
        ("40,001", "holding", 0, 1),  # a spreadsheet's thousands
        ("40 001", "holding", 0, 1),
        ("300,002", "input", 1, 1),
        ("40001-40002", "holding", 0, 2),
        ("40001,40002", "holding", 0, 2),
        ("40001/2", "holding", 0, 1),
    ],
)
def test_a_number_is_read_as_people_write_it(number: str, space: str, address: int, width: int) -> None:
    found = read_csv(f"Register;Name\n{number};a\n40100;b\n")
    assert found is not None
    one = found.entries[0]
    assert (one.space, one.address, one.kind.registers, one.title) == (space, address, width, "a")


def test_two_registers_are_no_thousands() -> None:
    found = read_csv("Register;Name\n99,100;a\n300,301;b\n1,002;c\n")
    assert found is not None
    assert [(one.address, one.kind.registers) for one in found.entries] == [(99, 2), (300, 2), (1002, 1)]


@pytest.mark.parametrize(
    ("text", "limits"),
    [
        ("0-65,535", (None, None)),  # or 65.535
        ("1,000 … 2,000", (None, None)),
        ("0,005-1,250", (0.005, 1.25)),
        ("0-1,5", (0, 1.5)),
        ("0...100", (0, 100)),
    ],
)
def test_limits_that_may_be_thousands_are_not_guessed(text: str, limits: tuple[float | None, float | None]) -> None:
    for table in (f"Register;Range\n1;{text}\n", f"Register;Min;Max\n1;{re.sub('-|…|[.]{3}', ';', text)}\n"):
        found = read_csv(table)
        assert found is not None
        assert [(one.low, one.high) for one in found.entries] == [limits]


def test_what_cannot_be_read_is_counted(sniff485: Run, tmp_path: Path) -> None:
    text = (
        "Register;Name;Range;States;Offset;Max\n"
        "0-19;block;;;;\n"
        "20;load;0 - 110 %;;;\n"
        "21;mode;see page 3;off when 0;minus 40;none\n"
        "22;spare;-;-;-;n/a\n"
    )
    profile, said = imported(sniff485, tmp_path, text)
    block, load = profile.at("holding", 0), profile.at("holding", 20)
    assert block is not None
    assert block.doubt == "the map gives it 20 registers"
    assert load is not None
    assert (load.low, load.high) == (0, 110)
    for left_out in ("20 registers as no type", *(f"{what} that cannot be read" for what in (
        "ranges", "lists of states", "offsets", "limits",
    ))):  # fmt: skip
        assert f"left out: {left_out} (1)" in said


def test_no_number_is_larger_than_a_profile_may_say() -> None:
    little = "0." + 200 * "0" + "1"
    found = read_csv(f"Register;Scale;Divisor;Offset\n1;1/{little};{little};1{301 * '0'}\n2;x;10;\n")
    assert found is not None
    assert [(one.scale, one.offset) for one in found.entries] == [(1, 0), (1, 0)]
    assert found.left_out == {"scales that cannot be read": 2, "offsets that cannot be read": 1}
    house = read_home_assistant({"modbus": [{"sensors": [{"address": 1, "scale": 1e300, "offset": -1e300}]}]})
    assert house is not None
    assert [(one.scale, one.offset) for one in house.entries] == [(1, 0)]


def test_what_is_described_twice_is_counted(sniff485: Run, tmp_path: Path) -> None:
    text = "address,name,type\n0,a,u32\n1,b,u16\n2,a,u16\n70000,x,u16\n65535,y,u32\n"
    profile, said = imported(sniff485, tmp_path, text)
    assert [(entry.address, entry.name) for entry in profile.entries] == [(0, "a"), (2, "a-2")]
    assert "described twice (1)" in said
    assert "numbers beyond 0 … 65535 (2)" in said


HOUSE = """
password: !secret modbus
modbus:
  - name: hub
    type: serial
    sensors:
      - {name: Outdoor, slave: 1, address: 100, input_type: input, unit_of_measurement: °C, scale: 0.1}
      - {name: Energy, slave: 1, address: 0x200, data_type: float32, swap: word, unit_of_measurement: kWh}
      - {name: Total, slave: 1, address: 0x210, data_type: uint64, swap: word_byte}
      - {name: Text, slave: 1, address: 900, data_type: string, count: 8}
      - !include more.yaml
    switches:
      - {name: Pump, slave: 1, address: 13, write_type: coil}
    climates:
      - {name: Room, slave: 1, address: 117, target_temp_register: 205, hvac_mode_register: {address: 1}}
"""


def test_home_assistant(sniff485: Run, tmp_path: Path) -> None:
    pytest.importorskip("yaml", reason="needs PyYAML, the extra yaml")
    profile, said = imported(sniff485, tmp_path, HOUSE, suffix=".yaml")
    by_name = {entry.name: entry for entry in profile.entries}
    outdoor, energy, total, pump = (by_name[name] for name in ("outdoor", "energy", "total", "pump"))
    assert (outdoor.space, outdoor.kind, outdoor.scale, outdoor.unit) == ("input", Kind.S16, 0.1, "°C")
    assert (energy.address, energy.kind, energy.swapped) == (0x200, Kind.F32, True)
    assert (total.kind, total.swapped, total.little) == (Kind.U64, True, True)
    assert (pump.space, pump.states) == ("coil", {0: "off", 1: "on"})
    assert by_name["room-target-temperature"].access is Access.BOTH
    assert "left out: data type string (1)" in said
    assert "included from elsewhere (1)" in said
    assert "hvac mode registers of climates (1)" in said


def test_several_stations_are_asked_for(sniff485: Run, tmp_path: Path) -> None:
    pytest.importorskip("yaml", reason="needs PyYAML, the extra yaml")
    text = "modbus:\n- sensors:\n  - {name: a, slave: 1, address: 0}\n  - {name: b, slave: 2, address: 0}\n"
    source = tmp_path / "map.yml"
    source.write_text(text)
    ran = sniff485("profile", "import", source)
    assert ran.code == 2
    assert "stations 1, 2" in ran.err
    assert "b" in sniff485("profile", "import", source, "--station", 2).out
    assert sniff485("profile", "import", source, "--station", 3).code == 2


@pytest.mark.parametrize(
    ("name", "octets", "code", "said"),
    [
        ("map.mbp", b"\x00", 3, "Modbus Poll"),
        ("map.xlsx", b"PK\x03\x04", 3, "save the sheet as CSV"),
        ("map.csv", b"a,b\n1,2\n", 3, "heading"),
        ("map.csv", b"address,name\n,\n", 3, "no register"),
        ("map.yaml", b"modbus: [", 3, "map.yaml"),
        ("map.yaml", b"light: 1\n", 3, "no modbus:"),
        ("map.yaml", b"[" * 5000, 3, "map.yaml"),
        ("none.csv", None, 3, "No such file"),
    ],
)
def test_what_is_no_map_says_why(
    sniff485: Run, tmp_path: Path, name: str, octets: bytes | None, code: int, said: str
) -> None:
    if name.endswith(".yaml"):
        pytest.importorskip("yaml", reason="needs PyYAML, the extra yaml")
    source = tmp_path / name
    if octets is not None:
        source.write_bytes(octets)
    ran = sniff485("profile", "import", source)
    assert (ran.code, ran.out) == (code, "")
    assert said in ran.err


def test_nothing_is_overwritten_unasked(sniff485: Run, tmp_path: Path) -> None:
    source, target = tmp_path / "map.csv", tmp_path / "map.toml"
    source.write_text(METER)
    target.write_text("mine")
    assert sniff485("profile", "import", source, "-w", target).code == 2
    assert target.read_text() == "mine"
    assert sniff485("profile", "import", source, "-w", source, "-f").code == 2
    assert sniff485("profile", "import", source, "-w", target, "-f").code == 0
    assert sniff485("profile", "check", target).code == 0


def test_hostile_words_reach_no_terminal(sniff485: Run, tmp_path: Path) -> None:
    text = "address,name,unit,evil\x1b[2J\n1,\x1b[31mred\x07\"'\\,\u202eV,\n"
    profile, said = imported(sniff485, tmp_path, text)
    assert all(c.isprintable() for c in profile.entries[0].title + profile.entries[0].unit)
    assert "\x1b" not in said
    assert os.linesep in said


@pytest.mark.parametrize(
    ("word", "kind", "order"),
    [
        ("FLOAT32", Kind.F32, None),
        ("Float (ABCD)", Kind.F32, (False, False)),
        ("float32 CDAB", Kind.F32, (True, False)),
        ("32-bit unsigned", Kind.U32, None),
        ("signed int 16", Kind.S16, None),
        ("UINT32 swapped", Kind.U32, (True, False)),
        ("BCD", None, None),
    ],
)
def test_words_for_types(word: str, kind: Kind | None, order: tuple[bool, bool] | None) -> None:
    assert kind_of(word) is kind
    assert order_of(word) == order


@given(st.text(max_size=300), st.sampled_from(NUMBERINGS))
def test_any_text_gives_a_document_or_nothing(text: str, numbering: str) -> None:
    for whole in (text, "address,name,type,unit,scale,states,length\n" + text):
        found = read_csv(whole, numbering)
        if found is not None:
            said, count = document("some", "somewhere", found, "modbus", ["modbus-rtu"])
            assert len(parse_text(said, "some").entries) == count


def test_values_that_nobody_can_write_down_are_none() -> None:
    long = 1 << 20_000  # of YAML: as hexadecimal digits these can be read, and not be printed
    laughs: list[object] = ["ha"]
    for _ in range(60):
        laughs = [laughs, laughs]  # as YAML's names for lists make it
    things = [
        {"name": long, "address": 1, "slave": long, "unit_of_measurement": [long], "scale": long},
        {"name": laughs, "address": 2, "unit_of_measurement": laughs, "slave_count": long},
        {"name": "far", "address": long},
    ]
    switch = {"name": "lamp", "address": 3, "command_on": long}
    found = read_home_assistant({"modbus": [{"sensors": things, "switches": [switch]}]})
    assert found is not None
    profile = parse_text(document("some", "somewhere", found, "modbus", ["modbus-rtu"])[0], "some")
    assert [entry.address for entry in profile.entries] == [1, 2, 3]
    assert profile.entries[2].states == {0: "off"}


plain_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["modbus", "sensors", "switches", "climates", "covers", "address", "slave", "scale"]), inner
        )
    ),
    max_leaves=20,
)


@given(plain_values)
def test_any_values_give_a_map_or_nothing(data: object) -> None:
    found = read_home_assistant(data)
    if found is not None:
        parse_text(document("some", "somewhere", found, "modbus", ["modbus-rtu"])[0], "some")
