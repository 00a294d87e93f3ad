"""Every row of the manuals' tables is in the profiles; the counts hold also where the manuals are not."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from dissectors.profiles.model import Entry, Profile
from dissectors.profiles.packaged import packaged

E510, F510, ACN = "teco-e510", "teco-f510", "automationdirect-acn"
SHORT = {
    "AI": "analog-input",
    "AO": "analog-output",
    "AV": "analog-value",
    "BI": "binary-input",
    "BO": "binary-output",
    "BV": "binary-value",
}
RESERVED_WORDS = {"", "Reserved"}


@pytest.fixture(scope="module")
def manuals() -> ModuleType:
    path = Path(__file__).with_name("manual_tables.py")
    spec = importlib.util.spec_from_file_location("manual_tables", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def registers(profile: Profile, first: int, last: int) -> set[int]:
    """Registers of the profile as the manual numbers them (TECO: as on the wire)."""
    return {address for address in range(first, last + 1) if profile.at("holding", address) is not None}


def named(profile: Profile, name: str) -> Entry:
    return next(entry for entry in profile.entries if entry.name == name)


@pytest.mark.parametrize(
    ("name", "parameters", "absent", "fault", "alarm", "objects"),
    [(E510, 531, 147, 62, 77, 65), (F510, 792, 0, 47, 67, 65)],
)
def test_counts_of_the_teco_tables(
    name: str, parameters: int, absent: int, fault: int, alarm: int, objects: int
) -> None:
    profile = packaged(name)
    found = [entry for entry in profile.in_space("holding") if _is_parameter(entry)]
    in_tables = [entry for entry in found if entry.number != "0123h" and entry.name != "display"]
    assert len(in_tables) == parameters
    assert len(profile.absent) == absent
    assert len(registers(profile, 0x2500, 0x252F)) == 34
    assert codes_of(named(profile, "fault")) == fault
    assert codes_of(named(profile, "alarm")) == alarm
    assert len(list(profile.in_space(*SHORT.values()))) == objects
    assert len(profile.properties) == 33


def test_counts_of_the_n2_tables() -> None:
    profile = packaged(F510)
    counts = {space: len(list(profile.in_space(space))) for space in ("AI", "BI", "AO", "BO")}
    assert counts == {"AI": 15, "BI": 10, "AO": 34, "BO": 5}
    assert sorted(profile.exceptions["n2"]) == [0, 1, 2, 3, 5, 10, 11, 12]


def test_counts_of_the_acn_tables() -> None:
    profile = packaged(ACN)
    parameters = [entry for entry in profile.in_space("holding") if entry.address >= 0x1100 - 1]
    assert len(parameters) == 689 - len(profile.absent)  # 690 rows, one of them without a name
    assert len(profile.absent) == 22
    assert len(list(profile.in_space("input"))) == len(list(profile.in_space("holding")))


@pytest.mark.parametrize(("name", "manual"), [(E510, "E510_TABLES"), (E510, "E510_PRINTED"), (F510, "F510")])
def test_every_teco_register(manuals: ModuleType, name: str, manual: str) -> None:
    profile, source = packaged(name), getattr(manuals, manual)
    assert registers(profile, 0x2500, 0x252F) == manuals.teco_registers(source)
    misprint = {"20-07": 0x1407} if name == E510 else {}
    for parameter, register in manuals.teco_parameters(source).items():
        if register is None:
            assert parameter in profile.absent
            continue
        register = misprint.get(parameter, register)
        entry = profile.at("holding", register)
        assert entry is not None, parameter
        assert entry.name == parameter or parameter in entry.title
        assert entry.number == f"{register:04X}h"


def _is_parameter(entry: Entry) -> bool:
    """Named by its number, or with the number behind its name."""
    return re.fullmatch(r"\d\d-\d\d", entry.name) is not None or re.search(r"\(\d\d-\d\d\)$", entry.title) is not None


def codes_of(entry: Entry) -> int:
    """How many codes the manual lists, those without a word too."""
    return len(entry.states) + len(entry.reserved_codes)


@pytest.mark.parametrize(("name", "manual"), [(E510, "E510_TABLES"), (E510, "E510_PRINTED"), (F510, "F510")])
@pytest.mark.parametrize(("point", "register", "until"), [("fault", "2521H", "2522H"), ("alarm", "2528H", "2529H")])
def test_every_fault_and_alarm_code(
    manuals: ModuleType, name: str, manual: str, point: str, register: str, until: str
) -> None:
    codes = manuals.teco_codes(getattr(manuals, manual), register, until)
    entry = named(packaged(name), point)
    assert codes_of(entry) == len(codes)
    for code, words in codes.items():
        if words in RESERVED_WORDS and code != 49 and not (code == 0 and point == "fault"):
            assert code not in entry.states, code
        elif words not in RESERVED_WORDS:
            same = re.sub(r"[^a-z0-9]", "", entry.states[code].lower())
            assert same == re.sub(r"[^a-z0-9]", "", words.lower()) or (code, words) == (37, "LSCFT(Rtry)")


@pytest.mark.parametrize(("name", "manual"), [(E510, "E510_TABLES"), (E510, "E510_PRINTED"), (F510, "F510")])
def test_every_bacnet_object_and_property(manuals: ModuleType, name: str, manual: str) -> None:
    profile, source = packaged(name), getattr(manuals, manual)
    have = {(entry.space, entry.address) for entry in profile.in_space(*SHORT.values())}
    assert have == {(SHORT[kind], number) for kind, number in manuals.bacnet_objects(source)}
    corrected = {
        "applicationsoftwareversion": "applocationsoftwaresupported",
        "presentvalue": "presnentvalue",
        "protocolobjecttypessupported": "protocolobjecttypesupported",
        "maxmaster": "maxmasters",
        "reliability": "relibility" if manual == "E510_PRINTED" else "reliability",
    }
    ours = {corrected.get(manuals.plain(key), manuals.plain(key)) for key in profile.properties}
    assert ours == {row.replace("applcation", "applocation") for row in manuals.bacnet_properties(source)}


def test_every_n2_point_and_error(manuals: ModuleType) -> None:
    profile = packaged(F510)
    have = {(entry.space, entry.address) for entry in profile.in_space("AI", "AO", "BI", "BO")}
    assert have == manuals.n2_points()
    assert set(profile.exceptions["n2"]) == set(manuals.n2_errors())


def test_every_acn_parameter(manuals: ModuleType) -> None:
    profile = packaged(ACN)
    operation = {"0.00", "ACC", "dEC", "drv", "Fr9", "St1", "St2", "St3", "Cur", "RPM", "dCL", "vOL", "nOn", "drC"}
    misprints = {"dr.10": 0x110A}
    wrong_decimals = {"dr.89", "Cn.12", "Cn.13", "Cn.15", "Cn.16", "Pr.73", "Pr.74", "Pr.75"}
    seen = 0
    for parameter, printed, decimal in manuals.acn_parameters():
        if parameter == "-":
            continue
        group, _, number = parameter.partition(".")
        name = f"operation.{parameter}" if parameter in operation else f"{group}.{int(number):02d}"
        seen += 1
        if printed is None and decimal is None:
            assert name in profile.absent
            continue
        address = misprints.get(parameter, printed if printed is not None else (decimal or 0) - 40000)
        entry = profile.at("holding", address - 1)
        assert entry is not None, parameter
        assert (entry.name, entry.number) == (name, f"{address:04X}h")
        if parameter not in wrong_decimals:
            assert decimal == 40001 + entry.address
    assert seen == 689


def test_every_acn_common_register(manuals: ModuleType) -> None:
    profile = packaged(ACN)
    addresses = manuals.acn_common()
    assert len(addresses) == 120
    for address in addresses:
        assert profile.at("holding", address - 1) is not None or profile.is_reserved("holding", address - 1), address
    beyond = {entry.address + 1 for entry in profile.in_space("holding") if 0x300 <= entry.address + 1 < 0x1000}
    assert beyond <= addresses


@pytest.mark.parametrize("name", [E510, F510, ACN])
def test_words_are_short_and_plain(name: str) -> None:
    for entry in packaged(name).entries:
        for words in (entry.title, *entry.states.values(), *(bit.on for bit in entry.bits)):
            assert words.isprintable()
            assert 0 < len(words) <= 90
