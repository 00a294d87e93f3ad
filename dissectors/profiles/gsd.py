"""A profile out of a GSD file, in which makers of PROFIBUS devices describe them (EN 50170).

    #Profibus_DP
    Model_Name = "F510-P"          the name of the profile: f510-p
    Ident_Number = 0xF510
    MaxTsdr_1.5M = 150             bit times until it answers, at most, by rate
    Module = "16 Word In" 0x7F     what it may be configured to
    EndModule

Keywords are not bound to case. It says who the device is and how long it takes, not what its words mean; so such a
profile has no entries.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from dissectors.line import NS_PER_S
from dissectors.profiles.checked import ProfileError
from dissectors.profiles.model import Limits, Profile, Sign

FIRST = "#profibus_dp"
_LINE = re.compile(r"(?P<key>[A-Za-z0-9_.]+)\s*(?:\([^)]*\))?\s*=\s*(?P<value>.+)")
_RATES = {
    "9.6": 9_600,
    "19.2": 19_200,
    "31.25": 31_250,
    "45.45": 45_450,
    "93.75": 93_750,
    "187.5": 187_500,
    "500": 500_000,
    "1.5m": 1_500_000,
    "3m": 3_000_000,
    "6m": 6_000_000,
    "12m": 12_000_000,
}
_KEPT = (
    "Ident_Number",
    "Vendor_Name",
    "Model_Name",
    "Revision",
    "Hardware_Release",
    "Software_Release",
    "Max_Input_Len",
    "Max_Output_Len",
    "Max_Data_Len",
    "Max_Diag_Data_Len",
    "Min_Slave_Intervall",
    "Freeze_Mode_supp",
    "Sync_Mode_supp",
    "Auto_Baud_supp",
    "Set_Slave_Add_supp",
    "Fail_Safe",
)
_MOST_LINES, _MOST_MODULES = 100_000, 1000


def is_gsd(text: str) -> bool:
    """Whether a text is a GSD file: its first line that is no comment says so."""
    return next(_lines(text[:65_536]), "").lower().startswith(FIRST)


def parse_gsd(text: str, origin: str) -> Profile:
    """The profile of a GSD file; `origin` is what errors call it. Raises ProfileError."""
    said: dict[str, str] = {}
    modules: list[str] = []
    for line in _lines(text):
        match = _LINE.match(line)
        if match is None:
            continue
        if match["key"].lower() == "module":
            modules.append(match["value"].strip())
        else:
            said.setdefault(match["key"].lower(), match["value"].strip())
    model = _text(said.get("model_name", ""))
    ident = _number(said.get("ident_number", ""))
    if not model or ident is None or not 0 <= ident <= 0xFFFF:
        raise ProfileError(f"{origin}: a GSD file names Model_Name and Ident_Number 0 … 0xFFFF")
    name = re.sub(r"[^a-z0-9]+", "-", model.lower()).strip("-") or "gsd"
    vendor = _text(said.get("vendor_name", ""))
    return Profile(
        name=name,
        title=f"{vendor} {model}".strip(),
        vendor=vendor,
        models=(model,),
        noun="slave",
        protocols=("profibus",),
        entries=(),
        limits={"profibus": Limits(responses=response_times(_numbers(said)))},
        signs=(Sign("dp-ident", 0, value=ident, title="ident number"),),
        facts={key: _kept(said[key.lower()]) for key in _KEPT if key.lower() in said} | _modules(modules),
        source=f"GSD file, revision {_text(said.get('revision', '')) or 'not said'}",
        origin=origin,
    )


def _lines(text: str) -> Iterator[str]:
    """Lines without comments; a line that ends with a backslash goes on in the next one."""
    held: list[str] = []
    for raw in text.splitlines()[:_MOST_LINES]:
        line = _without_comment(raw).strip()
        if not line.isprintable():
            line = "".join(c if c.isprintable() else " " for c in line)
        if line.endswith("\\"):
            held.append(line[:-1])
            continue
        whole = "".join((*held, line))
        held.clear()
        if whole:
            yield whole


def _without_comment(line: str) -> str:
    quoted = False
    for at, character in enumerate(line):
        quoted ^= character == '"'
        if character == ";" and not quoted:
            return line[:at]
    return line


def response_times(said: Mapping[str, int]) -> dict[int, int]:
    """ns that a device may take to answer, by rate, from its keywords in small letters."""
    times: dict[int, int] = {}
    for key, bits in said.items():
        rate = _RATES.get(key.removeprefix("maxtsdr_"))
        if key.startswith("maxtsdr_") and rate is not None and bits > 0:
            times[rate] = bits * NS_PER_S // rate
    return times


def _numbers(said: Mapping[str, str]) -> dict[str, int]:
    return {key: number for key, value in said.items() if (number := _number(value)) is not None}


def _modules(modules: list[str]) -> dict[str, str | int]:
    return {f"Module_{at}": value for at, value in enumerate(modules[:_MOST_MODULES], 1)}


def _kept(value: str) -> str | int:
    number = _number(value)
    return _text(value) if number is None else number


def _text(value: str) -> str:
    match = re.match(r'"([^"]*)"', value)
    return match[1].strip() if match else ""


def _number(value: str) -> int | None:
    match = re.match(r"0[xX]([0-9A-Fa-f]{1,8})\b|(\d{1,9})\b", value)
    if match is None:
        return None
    return int(match[1], 16) if match[1] else int(match[2])
