"""The tables of the manuals (../shared/manuals beside the checkout): a second reading of them, beside the profiles."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

MANUALS = Path(__file__).parents[3] / "../shared/manuals"

E510_TABLES = "e510-communication-addendum-tables.txt"
E510_PRINTED = "e510-communication-addendum-as-printed.txt"
F510 = "f510-communication-addendum.txt"
ACN = "acn-rs485-communication.txt"


def text(name: str) -> str:
    """A manual; skips the test where there is none."""
    path = MANUALS / name
    if not path.is_file():
        pytest.skip("the manuals are not here")
    return path.read_text(encoding="utf-8")


def teco_parameters(name: str) -> dict[str, int | None]:
    """1.0.3: parameter → register, None for a dash. The first of rows that are printed twice."""
    rows: dict[str, int | None] = {}
    part = text(name).split("1.0.3 Parameter Data")[-1].split("1.1 BACnet Protocol Desc")[0]
    for group, number, register in re.findall(r"(?<![\dA-F])(\d{1,2}) ?[-–] ?(\d{2})\s+(-|[0-9A-F]{4}H)(?=\s|$)", part):
        rows.setdefault(f"{int(group):02d}-{number}", None if register == "-" else int(register[:-1], 16))
    return rows


def teco_registers(name: str) -> set[int]:
    """1.0.2: every register number at the begin of a line of the command and monitor tables."""
    part = text(name).split("Command Data (Read / Write)")[1].split("Read Holding Register [03H]")[0]
    return {int(number, 16) for number in re.findall(r"^(25[0-9A-F]{2})H", part, re.M)}


def teco_codes(name: str, register: str, until: str) -> dict[int, str]:
    """Codes of 2521H or 2528H: number → name, empty where the table has none."""
    part = text(name).split("Monitor Data (Read-only)")[1].split("\n" + register)[1].split("\n" + until)[0]
    part = re.sub(r"--- page ---|Register No\..*|^\d-\d+$", "", part, flags=re.M)
    part = re.sub(r"\bCode\b|[\t ]+", " ", part)
    found: dict[int, str] = {}
    for number, words in re.findall(
        r"(?<![\w-])(\d{1,2})(?![\w)])((?: [^\d\s]\S*(?: [^\d\s]\S*| 0\d| 2(?=\s|$))*)?)", part
    ):
        found.setdefault(int(number), words.strip())
    return found


def bacnet_objects(name: str) -> set[tuple[str, int]]:
    """1.1: every object of the property lists, as ("AI", 0)."""
    part = text(name).split("Analog input property list")[1].split("1.2 MetaSys")[0]
    return {(kind, int(number)) for kind, number in re.findall(r"^(AI|AO|AV|BI|BO|BV)(\d+)\s", part, re.M)}


def bacnet_properties(name: str) -> set[str]:
    """The rows of the table of objects and properties, in lower case without signs."""
    part = text(name).split("Object and property supporting list")[1].split("BACnet Object Properties")[0]
    part = part.replace("Supporte\nd", "Supported")
    return {
        plain(row)
        for row in re.findall(
            r"^([A-Z]\w+_ ?\w*(?:_\w+)*|Units|Reliability|Relibility|Polarity|Location)\b", part, re.M
        )
    }


def plain(name: str) -> str:
    """A property's name without case and signs."""
    return re.sub(r"[^a-z]", "", name.lower())


def n2_points() -> set[tuple[str, int]]:
    """1.2.4: every point of the property lists, as ("AI", 1)."""
    part = text(F510).split("1.2.4. MetaSys")[1].split("MetaSys N2 Error Code List")[0]
    return {(kind, int(number)) for kind, number in re.findall(r"^(AI|AO|BI|BO)(\d+) ", part, re.M)}


def n2_errors() -> dict[int, str]:
    """The list of N2 error codes."""
    part = text(F510).split("MetaSys N2 Error Code List")[1].split("--- page ---")[0]
    return {int(code): words for code, words in re.findall(r"^(\d\d) (.+)$", part, re.M)}


def acn_parameters() -> list[tuple[str, int | None, int | None]]:
    """Parameter, hex address, decimal number, of all groups; a nameless row has the name "-"."""
    part = text(ACN).split("Drive Parameter Modbus Communication Addresses")[1]
    rows = re.findall(
        r"(?<!\S)([A-Za-z]+2?\.\d+|0\.00|ACC|dEC|drv|Fr9|St[123]|Cur|RPM|dCL|vOL|nOn|drC|-) "
        r"(-|[0-9A-F]{4,5}) (-|\d{5}) (?:-|\d{5})(?=\s)",
        part,
    )
    return [(name, None if at == "-" else int(at, 16), None if no == "-" else int(no)) for name, at, no in rows]


def acn_common() -> set[int]:
    """Every address of the common areas, spans expanded."""
    part = text(ACN).split("Monitoring Area Parameter (Read Only)", 1)[1].split("Drive Parameter Modbus Comm")[0]
    found: set[int] = set()
    pattern = r"^0h(0[0-9A-F]{3})(?:(?: ?-)\s*\n?0h(0[0-9A-F]{3})$| \d{5} \d{5})"
    for first, last in re.findall(pattern, part, re.M):
        found |= set(range(int(first, 16), int(last or first, 16) + 1))
    return found
