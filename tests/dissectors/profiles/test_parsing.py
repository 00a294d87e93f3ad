"""Documents to profiles: what they may say, and that every mistake is told with file and key."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import dissectors.profiles
from dissectors.profiles import ProfileError
from dissectors.profiles.model import Access, EntryRole, Kind, Limits, Profile
from dissectors.profiles.packaged import parse_text
from dissectors.profiles.parsing import parse

HEAD = 'name = "pump"\ntitle = "A pump"\nprotocols = ["modbus-rtu"]\n'


def pump(text: str) -> Profile:
    return parse_text(HEAD + text, "pump.toml")


def register(text: str, before: str = "") -> Profile:
    return pump(f'{before}\n[[modbus.register]]\naddress = 16\nname = "flow"\n{text}')


def test_a_register_says_where_it_is_and_what_it_means() -> None:
    entry = register('type = "s16"\nscale = 0.1\noffset = -5\nunit = "m3/h"\nrange = [0, 90]\naccess = "r"').at(
        "holding", 16
    )
    assert entry is not None
    assert (entry.number, entry.kind, entry.scale, entry.offset) == ("0010h", Kind.S16, 0.1, -5)
    assert (entry.unit, entry.low, entry.high, entry.access) == ("m3/h", 0, 90, Access.READ)
    assert entry.title == "flow"
    assert not entry.access.writable


def test_the_manuals_numbers_may_lie_beside_the_wire() -> None:
    profile = register("", "[modbus]\naddress-offset = -1\ntables = ['holding', 'input']")
    assert profile.at("holding", 15) is profile.entries[0]
    assert profile.at("input", 15) is profile.entries[1]
    assert profile.at("holding", 16) is None
    assert profile.entries[0].number == "0010h"


def test_one_number_may_mean_two_things_in_two_tables() -> None:
    profile = pump("""
[modbus]
tables = ["holding", "input"]
[[modbus.register]]
address = 0
name = "flow-limit"
tables = ["holding"]
[[modbus.register]]
address = 0
name = "flow"
tables = ["input"]
type = "f32"
[[modbus.register]]
address = 9
name = "both"
""")
    places = [(entry.space, entry.address, entry.name) for entry in profile.entries]
    assert places == [("holding", 0, "flow-limit"), ("input", 0, "flow"), ("holding", 9, "both"), ("input", 9, "both")]
    with pytest.raises(ProfileError, match=r"nowhere: expected holding, input, coil or discrete"):
        register('tables = ["nowhere"]')


def test_orders_of_the_whole_map_and_of_one_register() -> None:
    document = """
[modbus]
word-order = "low-first"
[[modbus.register]]
address = 0
name = "a"
type = "u32"
[[modbus.register]]
address = 2
name = "b"
type = "f32"
word-order = "high-first"
octet-order = "low-first"
"""
    profile = pump(document)
    a, b = profile.entries
    assert (a.swapped, a.little, b.swapped, b.little) == (True, False, False, True)
    assert profile.at("holding", 1) is a


GONG = 'name = "bell"\ntitle = "A bell"\nprotocols = ["gong"]\n[[gong.object]]\nobject = "place 7"\nname = "level"\n'


def test_objects_of_a_plug_in_stand_under_its_name() -> None:
    bell = parse_text(f'{GONG}unit = "m"\nscale = 0.1\n[gong.limits]\nframe = 13\n[gong.errors]\n3 = "cracked"\n', "x")
    entry = bell.at("place", 7)
    assert entry is not None
    assert (entry.name, entry.unit, entry.scale, entry.number) == ("level", "m", 0.1, "place 7")
    assert bell.limits_on("gong").frame == 13
    assert bell.exception("gong", 3) == "cracked"
    for wrong in (
        GONG.replace("[[gong", "[[going"),
        *(GONG.replace("place 7", place) for place in ("place", "place ²", "place " + "9" * 5000)),
        GONG + "colour = 3\n",
    ):
        with pytest.raises(ProfileError):
            parse_text(wrong, "x")


def test_a_group_of_parameters() -> None:
    profile = pump(
        '[[modbus.parameters]]\nprefix = "P."\nbase = 0x100\npresent = "0-2 9"\nabsent = "3"\n'
        "elsewhere = { 9 = 0x110 }\n[modbus.parameters.titles]\n2 = 'ramp'"
    )
    assert [(e.name, e.address, e.title) for e in profile.entries] == [
        ("P.00", 0x100, "parameter P.00"),
        ("P.01", 0x101, "parameter P.01"),
        ("P.02", 0x102, "ramp"),
        ("P.09", 0x110, "parameter P.09"),
    ]
    assert profile.absent == ("P.03",)


def test_bits_states_parts_and_shared_states() -> None:
    profile = pump("""
[[modbus.register]]
address = 0
name = "command"
role = "command"
[modbus.register.bits]
0 = ["run", "run", "stop"]
5 = "Low Flow"
[[modbus.register]]
address = 1
name = "fault"
role = "fault"
reserved-codes = "2 4-6"
[modbus.register.states]
0 = "no fault"
0x10 = "dry"
[[modbus.register.part]]
name = "motion"
bits = [4, 7]
[modbus.register.part.states]
1 = "fast"
[[modbus.register]]
address = 2
name = "last-fault"
states-from = "fault"
""")
    command, fault, last = profile.entries
    assert [(bit.number, bit.name, bit.on, bit.off) for bit in command.bits] == [
        (0, "run", "run", "stop"),
        (5, "low-flow", "Low Flow", ""),
    ]
    assert (command.role, fault.role) == (EntryRole.COMMAND, EntryRole.FAULT)
    assert (fault.states, fault.reserved_codes) == ({0: "no fault", 16: "dry"}, {2, 4, 5, 6})
    assert last.states == fault.states
    assert fault.parts[0].of(0xFF1F) == 1


def test_objects_signs_limits_and_the_rest() -> None:
    profile = pump("""
[[sign]]
register = 3
value = 7
[[sign]]
object = "device 0"
part = "model-name"
value = "P1"
[modbus]
address-offset = 1
[modbus.exceptions]
0x52 = "no"
[modbus.limits]
frame = 80
response-ms = 2.5
[[modbus.reserved]]
first = 10
last = 12
[[n2.object]]
object = "BI 3"
name = "running"
[n2.errors]
10 = "range"
[[bacnet.object]]
object = "analog-value 0"
name = "gain"
label = "P – Gain"
[bacnet.properties]
units = ["analog-value"]
[bacnet.device]
max-master = 127
vendor-name = "X"
""")
    assert profile.limits_on("modbus") == Limits(80, 2_500_000)
    assert profile.limits_on("n2") == profile.limits_on("whatever") == Limits()
    assert [(s.space, s.address, s.part, s.value) for s in profile.signs] == [
        ("holding", 4, "", 7),
        ("device", 0, "model-name", "P1"),
    ]
    assert profile.exception("modbus", 0x52) == "no"
    assert profile.exception("modbus", 1) == ""
    assert profile.exceptions["n2"] == {10: "range"}
    assert [profile.is_reserved("holding", address) for address in (10, 11, 13, 14)] == [False, True, True, False]
    assert [(e.space, e.address, e.kind, e.label) for e in profile.entries] == [
        ("BI", 3, Kind.BIT, ""),
        ("analog-value", 0, Kind.REAL, "P – Gain"),
    ]
    assert profile.constants == {"max-master": 127, "vendor-name": "X"}


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("scale = 'x'", "modbus.register[1].scale"),
        ("scael = 1", "modbus.register[1].scael: unknown key; did you mean 'scale'?"),
        ("range = [3, 1]", "modbus.register[1].range"),
        ("range = 3", "modbus.register[1].range"),
        ("type = 'u24'", "modbus.register[1].type: 'u24': expected one of u16"),
        ("access = 'x'", "modbus.register[1].access"),
        ("unit = 3", "modbus.register[1].unit"),
        ('states = { 3 = "a\\u001b" }', "modbus.register[1].states.3: has a control character"),
        ("states = { 3 = 3 }", "modbus.register[1].states.3"),
        ('bits = { 3 = ["a", "\\u0007"] }', "modbus.register[1].bits.3"),
        ('title = "a\\u001b[2J"', "modbus.register[1].title: has a control character"),
        ("reserved = 1", "modbus.register[1].reserved"),
        ("bits = { 40 = 'x' }", "modbus.register[1].bits.40"),
        ("bits = { a = 'x' }", "modbus.register[1].bits.a"),
        ("bits = { 1 = 7 }", "modbus.register[1].bits.1"),
        ("states = { 1 = 'a', 0x1 = 'b' }", "modbus.register[1].states.0x1: is there twice"),
        ("states = { 1 = 'a' }\nreserved-codes = '1'", "modbus.register[1].reserved-codes"),
        ("reserved-codes = '1-x'", "modbus.register[1].reserved-codes"),
        ("states-from = 'none'", "0010h: states-from"),
        ("[[modbus.register]]\naddress = 16\nname = 'b'", "0010h: is already 'flow'"),
        ("[[modbus.register]]\naddress = 17\nname = 'flow'", "0011h: name 'flow' is taken"),
        ("unit = 'm'\n[[n2.object]]\nobject = 'AI 1'\nname = 'flow'\nunit = 'bar'", "AI 1: 'flow' in 'bar'"),
        ("[[modbus.register]]\naddress = 70000\nname = 'b'", "modbus.register[2].address"),
        ("[[modbus.register]]\nname = 'b'", "modbus.register[2].address: is missing"),
        ("[[modbus.register]]\naddress = 3\nname = 'a b'", "modbus.register[2].name"),
        ("[[n2.object]]\nobject = 'XX 1'\nname = 'b'", "n2.object[1].object"),
        ("[[bacnet.object]]\nobject = 'analog-input'\nname = 'b'", "bacnet.object[1].object"),
        ("[n2.limits]\nframe = 0", "n2.limits"),
        ("[n2.limits]\nfraem = 3", "n2.limits.fraem: unknown key; did you mean 'frame'?"),
        ("[modbus.parameters]", "modbus.parameters"),
        ("scale = inf", "modbus.register[1].scale"),
        (f"scale = {10**400}", "modbus.register[1].scale"),
        ("range = [0, nan]", "modbus.register[1].range"),
        (f"default = {'1' * 5000}", "pump.toml"),
        ("reserved-bits = '9-3'", "modbus.register[1].reserved-bits: '9-3'"),
        (f"reserved-codes = '{' '.join(['0-65535'] * 2)}'", "modbus.register[1].reserved-codes: expected at most"),
        ("[[modbus.register.part]]\nname = 'a'\nbits = [0.5, 3]", "modbus.register[1].part[1].bits"),
        ("[modbus.limits]\nresponse-ms = inf", "modbus.limits.response-ms"),
        ("[modbus.limits]\nstations = [1, inf]", "modbus.limits.stations"),
        ("[[modbus.parameters]]\nprefix = 'P '\nbase = 0", "modbus.parameters[1].prefix"),
        ("[[modbus.parameters]]\nprefix = 'P'\nbase = 0\ndigits = -3", "modbus.parameters[1].digits"),
        ("[[n2.object]]\nobject = 'AI ²'\nname = 'b'", "n2.object[1].object"),
        (f"[[bacnet.object]]\nobject = 'device {'1' * 5000}'\nname = 'b'", "bacnet.object[1].object"),
        ('[[sign]]\nobject = "device 0"\nvalue = "a\\u001b"', "sign[1].value: has a control character"),
        ("[[modbus.parameters]]\nprefix = 'P'\nbase = 0\npresent = '1'\nabsent = '1'", "modbus.parameters[1].absent"),
        ("[whatever]", "whatever: unknown key"),
        ("x = ", "pump.toml"),
    ],
)
def test_a_mistake_is_told_with_file_and_key(text: str, key: str) -> None:
    with pytest.raises(ProfileError, match=r"pump\.toml") as told:
        register(text)
    assert key in str(told.value)


def test_a_list_of_texts_has_no_control_character() -> None:
    with pytest.raises(ProfileError, match="models: has a control character"):
        parse({"name": "x", "title": "x", "protocols": [], "models": ["\x1b[2J"]}, "x")


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3),
    max_leaves=8,
)
sections = st.fixed_dictionaries(
    {"name": st.just("x"), "title": st.just("x"), "protocols": st.just([])},
    optional={
        "limits": values,
        "sign": values,
        "modbus": st.fixed_dictionaries({}, optional={"register": values, "parameters": values, "reserved": values}),
        "n2": values,
        "bacnet": values,
    },
)


@given(sections)
def test_any_document_gives_a_profile_or_a_profile_error(document: dict[str, object]) -> None:
    try:
        told = str(parse(document, "x"))
    except ProfileError as error:
        told = str(error)
    assert told.startswith(("x: ", "Profile("))


def test_the_document_in_the_readme_is_a_profile() -> None:
    readme = Path(dissectors.profiles.__file__).with_name("README.md").read_text("utf-8")
    example = re.search(r"```toml\n(.*?)```", readme, re.DOTALL)
    assert example is not None
    profile = parse_text(example[1], "README.md")
    assert {"command", "flow", "fault", "P.03"} <= {entry.name for entry in profile.entries}
