"""Readings to values: types, orders, scale, words, quality."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dissectors.meaning import Meaning
from dissectors.profiles import Devices
from dissectors.profiles.decoding import Quality, bare_range, decode, plain_name, range_words, say
from dissectors.profiles.packaged import packaged, parse_text
from dissectors.readings import Origin, Reading, plain_place

E510 = packaged("teco-e510")
F510 = packaged("teco-f510")
ACN = packaged("automationdirect-acn")


def holding(first: int, *values: int, how: Origin = Origin.READ) -> tuple[Reading, ...]:
    return tuple(Reading("holding", first + step, value, value, how) for step, value in enumerate(values))


def device(text: str) -> object:
    return parse_text(f'name = "x"\ntitle = "x"\nprotocols = []\n{text}', "x.toml")


def one(text: str, *words: int) -> float | int | str:
    profile = device(f'[[modbus.register]]\naddress = 0\nname = "a"\n{text}')
    (value,) = decode(profile, holding(0, *words))  # type: ignore[arg-type]
    return value.value


@pytest.mark.parametrize(
    ("text", "words", "expected"),
    [
        ('type = "u16"', (0xFFFF,), 65535),
        ('type = "s16"', (0xFFFF,), -1),
        ('type = "s16"\nscale = 0.1', (0x8000,), -3276.8),
        ('type = "u32"', (1, 2), 0x10002),
        ('type = "u32"\nword-order = "low-first"', (1, 2), 0x20001),
        ('type = "u32"\noctet-order = "low-first"', (0x0102, 0x0304), 0x02010403),
        ('type = "s32"', (0xFFFF, 0xFFFE), -2),
        ('type = "f32"', struct.unpack(">HH", struct.pack(">f", 12.5)), 12.5),
        ('type = "f32"\nword-order = "low-first"', struct.unpack(">HH", struct.pack(">f", 12.5))[::-1], 12.5),
        ('type = "u64"', (1, 2, 3, 4), 0x1000200030004),
        ('type = "u64"\nword-order = "low-first"', (1, 2, 3, 4), 0x4000300020001),
        ('type = "s64"', (0xFFFF, 0xFFFF, 0xFFFF, 0xFFFE), -2),
        ('type = "f64"', struct.unpack(">HHHH", struct.pack(">d", -12.5)), -12.5),
        ('type = "f64"\noctet-order = "low-first"', struct.unpack("<HHHH", struct.pack(">d", 7.25)), 7.25),
        ("scale = 0.01", (5003,), 50.03),
        ("scale = 0.1\noffset = -40", (651,), 25.1),
    ],
)
def test_types_and_orders(text: str, words: tuple[int, ...], expected: float) -> None:
    assert one(text, *words) == expected


@given(st.integers(0, 0xFFFF))
def test_hundredths_are_exact_decimals(raw: int) -> None:
    value = one("scale = 0.01", raw)
    assert str(value) == str(float(f"{raw // 100}.{raw % 100:02d}"))


def test_half_of_a_long_value_is_said_to_be_half() -> None:
    profile = device('[[modbus.register]]\naddress = 8\nname = "a"\ntype = "u32"')
    assert [value.name for value in decode(profile, holding(8, 1))] == ["a.high"]  # type: ignore[arg-type]
    assert [value.name for value in decode(profile, holding(9, 1))] == ["a.low"]  # type: ignore[arg-type]
    assert [value.name for value in decode(profile, holding(7, 1, 2, 3, 4))] == [  # type: ignore[arg-type]
        "holding/40008",
        "a",
        "holding/40011",
    ]


def test_half_of_a_long_value_has_the_bits_that_stand_in_it_and_no_code() -> None:
    text = """
[[modbus.register]]
address = 0
name = "fault"
title = "fault"
type = "u32"
role = "fault"
states = { 0 = "no fault", 17 = "dry run" }
[[modbus.register]]
address = 2
name = "status"
type = "u32"
reserved-bits = "4 20"
bits = { 0 = ["run", "run", "stop"], 16 = ["hot", "overheated"] }
part = [{ name = "step", bits = [24, 27], states = { 3 = "third" } }, { name = "both", bits = [15, 17] }]
"""
    profile: Any = device(f'[modbus]\nword-order = "high-first"\n{text}')
    assert [say(profile, holding(at, 0)) for at in (0, 1)] == ["fault, high word 0", "fault, low word 0"]
    assert say(profile, holding(2, 0x0311)) == "status, high word overheated, third, reserved bit 4"
    assert say(profile, holding(3, 0x0011)) == "status, low word run, reserved bit 4"
    names = [value.name for value in decode(profile, holding(2, 1))]
    assert names == ["status.high", "status.high.hot", "status.high.step"]
    entry = profile.at("holding", 2)
    assert [entry.reserved_in(entry.held(0x10, at)) for at in (2, 3)] == [(20,), (4,)]
    swapped = device(f'[modbus]\nword-order = "low-first"\noctet-order = "low-first"\n{text}').at("holding", 2)  # type: ignore[attr-defined]
    assert [swapped.reserved_in(swapped.held(0x1000, at)) for at in (2, 3)] == [(4,), (20,)]
    (item,) = Meaning(3, profile, holding(2, 1)).items(plain_place)
    assert item.parts == (("bit 0 hot", "1 (overheated)"), ("bits B-8 step", "0"))


@pytest.mark.parametrize(
    ("text", "form", "value", "said"),
    [
        ('type = "f32"\nunit = "bar"\nrange = [-0.1, 0.1]', ">f", 0.1, "a 0.1 bar"),
        ('type = "f32"\nunit = "bar"\nrange = [-0.1, 0.1]', ">f", 0.1001, "a 0.1001 bar (out of range)"),
        ('type = "f32"\nscale = 100\nunit = "kPa"', ">f", 1.2345, "a 123.45 kPa"),
        ('type = "f64"\nunit = "kWh"', ">d", 123456789.25, "a 123456789.25 kWh"),
        ('scale = 0.000001\nunit = "m³/h"', ">H", 37, "a 0.000037 m³/h"),
        ('scale = 0.000001\nunit = "m³/h"', ">H", 0, "a 0.0000 m³/h"),
        ('scale = 0.00390625\nunit = "V"', ">H", 25, "a 0.0977 V"),
        ('scale = 0.1\noffset = -273.15\nunit = "°C"', ">H", 2982, "a 25.05 °C"),
    ],
)
def test_a_number_keeps_the_digits_that_it_has(text: str, form: str, value: float, said: str) -> None:
    profile: Any = device(f'[[modbus.register]]\naddress = 0\nname = "a"\n{text}')
    octets = struct.pack(form, value)
    assert say(profile, holding(0, *struct.unpack(f">{len(octets) // 2}H", octets))) == said


def test_values_out_of_range_are_bad_and_doubtful_ones_uncertain() -> None:
    good, bad = decode(E510, holding(0x2502, 59_900)), decode(E510, holding(0x2502, 59_901))
    assert (good[0].quality, bad[0].quality) == (Quality.GOOD, Quality.BAD)
    assert decode(E510, holding(0x0102, 6000))[0].quality == Quality.UNCERTAIN
    unsure = Reading("holding", 0x2524, 1, 1, Origin.READ, sure=False)
    assert decode(E510, (unsure,))[0].quality == Quality.UNCERTAIN
    nan = Reading("AI", 10, 0x7FC00000, math.nan, Origin.READ)
    assert decode(packaged("teco-f510"), (nan,))[0].quality == Quality.BAD


def test_a_doubt_is_marked_once() -> None:
    drive = packaged("teco-f510")
    for word, said in (
        (0x2001, "status running, forward, preparing, frequency reference from Profibus (?)"),
        (0x0001, "status running, forward, preparing (?)"),
    ):
        assert say(drive, (Reading("dp-input", 0, word, word, Origin.READ),)) == said


def test_cyclic_words_have_a_sign_and_may_be_two_of_one_value() -> None:
    profile: Any = device("""
[[profibus.word]]
word = "input 0"
name = "speed"
type = "s16"
scale = 0.1
unit = "rpm"
[[profibus.word]]
word = "input 1"
name = "energy"
type = "u32"
unit = "kWh"
""")
    words = tuple(Reading("dp-input", at, raw, raw, Origin.READ) for at, raw in enumerate((0xFFF6, 1, 2)))
    assert say(profile, words) == "speed -1.0 rpm; energy 65538 kWh"
    assert say(profile, words[:2]) == "speed -1.0 rpm; energy, high word 1"


def test_cyclic_outputs_are_sent_whole_and_what_is_reserved_in_them_as_0() -> None:
    drive = packaged("teco-f510")
    zeros = tuple(Reading("dp-output", at, 0, 0, Origin.WRITE) for at in range(16))
    assert not any(value.entry is None for value in decode(drive, zeros))
    assert [drive.forbids("dp-output", 2, raw) for raw in (0, 1)] == [False, True]
    assert not drive.forbids("dp-output", 1, 1)


def test_bits_are_points_of_their_own() -> None:
    values = {value.name: value for value in decode(E510, holding(0x2520, 0b1001))}
    assert values["status"].text.startswith("running, forward, not ready, fault")
    assert (values["status.running"].value, values["status.reverse"].value, values["status.fault"].value) == (1, 0, 1)
    assert values["status.fault"].words == "fault"
    assert "status" in values
    assert all(value.bit for name, value in values.items() if name != "status")


def test_parts_of_a_register() -> None:
    values = {value.name: value for value in decode(ACN, holding(0x0304, 0x8041))}
    assert values["state"].text == "fault, decelerating, forward"
    assert (values["state.condition"].value, values["state.motion"].value, values["state.direction"].value) == (8, 4, 1)


def test_codes_in_the_manuals_words() -> None:
    (fault,) = decode(E510, holding(0x2521, 49))
    assert (fault.value, fault.text) == (49, "MtrSw (DI motor switch fault)")
    assert decode(E510, holding(0x2521, 11))[0].text == "code 11, reserved"
    assert decode(E510, holding(0x2521, 99))[0].text == "code 99"


def test_bits_that_must_be_zero_are_said() -> None:
    (command, *_) = decode(E510, holding(0x2501, 0x3001, how=Origin.WRITE))
    assert command.text == "run, forward, reserved bit C, reserved bit D"


def test_a_parameter_says_what_the_same_point_says_elsewhere() -> None:
    frequency, voltage, lock = (
        decode(F510, holding(at, raw))[0] for at, raw in ((0x0C11, 1234), (0x0204, 4000), (0x0B00, 2))
    )
    assert (frequency.name, frequency.text) == ("12-17", "12.34 Hz")
    assert (voltage.name, voltage.text) == ("motor-rated-voltage", "400.0 V")
    assert lock.text == "reverse only"
    assert decode(F510, holding(0x0C2D, 17))[0].text == "external fault 01"


def test_long_whole_numbers_keep_their_digits() -> None:
    (display,) = decode(E510, holding(0x2510, 0x1234, 0x5678))
    assert display.text == "305419896"


def test_the_scale_of_the_torque_is_exact() -> None:
    assert [decode(E510, holding(0x2503, raw))[0].value for raw in (0x2000, 0xE000, 0x1000)] == [100.0, -100.0, 50.0]


def test_a_version_is_told_as_people_write_it() -> None:
    (version,) = decode(ACN, holding(0x0302, 0x0101))
    assert version.text == "1.01"


def test_a_register_read_along_with_its_neighbours_is_no_point() -> None:
    assert [value.name for value in decode(E510, holding(0x2524, 6000, 7, 3100))] == ["output-frequency", "dc-voltage"]


@pytest.mark.parametrize(
    ("readings", "said"),
    [
        (holding(0x2502, 6000, how=Origin.WRITE), "frequency command 60.00 Hz"),
        (holding(0x2501, 1, how=Origin.WRITE), "run, forward"),
        (holding(0x2501, 3, how=Origin.WRITE), "run, reverse"),
        (holding(0x2501, 0, how=Origin.WRITE), "stop, forward"),
        (holding(0x2501, 1, 6000, how=Origin.WRITE), "run, forward; frequency command 60.00 Hz"),
        (holding(0x2521, 0, how=Origin.READ), "no fault"),
        (holding(0x2521, 17, how=Origin.READ), "fault external fault 01"),
        (holding(0x0064, 1), ""),
    ],
)
def test_what_an_exchange_says(readings: tuple[Reading, ...], said: str) -> None:
    assert say(E510, readings) == said


def test_acn_commands_in_words() -> None:
    assert say(ACN, holding(0x0381, 3, how=Origin.WRITE)) == "run, forward"
    assert say(ACN, holding(0x0381, 1, how=Origin.WRITE)) == "run, reverse"


@pytest.mark.parametrize(
    ("space", "address", "name"),
    [
        ("holding", 107, "holding/40108"),
        ("holding", 0, "holding/40001"),
        ("holding", 9998, "holding/49999"),
        ("holding", 9999, "holding/410000"),
        ("holding", 65535, "holding/465536"),
        ("input", 5, "input/30006"),
        ("coil", 0, "coil/00001"),
        ("discrete", 12, "discrete/10013"),
        ("AI", 9, "AI/9"),
        ("analog-input", 4, "analog-input/4"),
    ],
)
def test_names_without_a_profile(space: str, address: int, name: str) -> None:
    if space == "discrete":
        name = "discrete/10013"
    assert plain_name(space, address) == name


readings = st.builds(
    Reading,
    st.sampled_from(["holding", "input", "coil", "AI", "BO", "analog-input", "device", "x"]),
    st.integers(0, 0xFFFF) | st.integers(0x2500, 0x2530) | st.integers(0, 40),
    st.none() | st.integers(0, 2**64),
    st.integers(-(2**63), 2**64) | st.floats() | st.text(max_size=5),
    st.sampled_from(list(Origin)),
    st.sampled_from(["", "units"]),
    st.booleans(),
)


@given(st.sampled_from(["teco-e510", "teco-f510", "automationdirect-acn"]), st.lists(readings, max_size=8))
@example("teco-e510", [Reading("holding", 9475, None, 0, Origin.READ)])  # a signed register without its bits
def test_any_readings_decode(name: str, given_readings: list[Reading]) -> None:
    for value in decode(packaged(name), given_readings):
        assert value.text
        assert value.text.isprintable()
    assert say(packaged(name), given_readings).isprintable()


def test_all_devices_have_a_profile_where_each_has_the_same() -> None:
    assert Devices({1: E510, 2: E510}).at(None) is E510
    assert Devices({1: E510, 2: F510}).at(None) is None
    assert Devices({1: E510}).at(None) is None  # others that nobody described may be meant
    assert Devices({1: E510}, F510).at(None) is F510
    assert Devices({}, F510).at(None) is F510


@pytest.mark.parametrize(
    ("limits", "bare", "with_unit"),
    [
        ("range = [0, 4294967295]", "0 … 4294967295", "0 … 4294967295 Wh"),
        ("range = [-2147483648, 1234567.5]", "-2147483648 … 1234567.5", "-2147483648 … 1234567.5 Wh"),
        ("range = [0, 400]", "0 … 400", "0 … 400 Wh"),
        ("", "", ""),
    ],
)
def test_a_range_is_said_with_all_its_digits(limits: str, bare: str, with_unit: str) -> None:
    profile = device(f'[[modbus.register]]\naddress = 0\nname = "a"\nunit = "Wh"\ntype = "s32"\n{limits}')
    (entry,) = profile.entries  # type: ignore[attr-defined]
    assert (bare_range(entry), range_words(entry)) == (bare, with_unit)
