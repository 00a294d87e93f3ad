"""Files of register maps: their kind by what is in them, and what they say. Pure; raises MapError with the way out."""

from __future__ import annotations

import re

from dissectors.modbus.map_home_assistant import read_home_assistant
from dissectors.modbus.map_tables import read_csv
from dissectors.register_maps import MapError, RegisterMap

_YAML = (".yaml", ".yml")
_WORKSPACES = (".mbp", ".mbw", ".mbs")
_SPREADSHEETS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")


def read_map(name: str, octets: bytes, numbering: str, table: str | None) -> RegisterMap:
    """See `dissectors.register_maps.MapReader`."""
    suffix = name[name.rfind(".") :].lower() if "." in name else ""
    if suffix in _WORKSPACES:
        raise MapError(
            "the form of a Modbus Poll workspace is not published; copy its table, or log it as text, and import that "
            "with a heading line such as address,name,type"
        )
    if octets.startswith(_SPREADSHEETS):
        raise MapError("a spreadsheet file; save the sheet as CSV and import that")
    text = _text(octets)
    if suffix in _YAML or re.search(r"^modbus:", text, re.MULTILINE):
        return _home_assistant(text)
    found = read_csv(text, numbering, table)
    if found is None:
        raise MapError(
            "no line has a heading for the number of a register (address, register …), with commas, semicolons, tabs "
            "or bars between the columns"
        )
    return found


def _text(octets: bytes) -> str:
    for encoding in ("utf-16",) if octets[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8-sig", "cp1252"):
        try:
            return octets.decode(encoding)
        except UnicodeDecodeError:
            continue
    return octets.decode("latin-1")


def _home_assistant(text: str) -> RegisterMap:
    try:
        import yaml
    except ImportError:
        raise MapError("YAML needs PyYAML: pip install 'sniff485[yaml]'") from None

    class Loader(yaml.SafeLoader):
        """As safe as its parent; `!include`, `!secret` and other tags of Home Assistant stand for nothing."""

    Loader.add_multi_constructor("!", lambda loader, suffix, node: f"!{suffix}")
    try:
        data = yaml.load(text, Loader)  # a SafeLoader makes nothing but plain values
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise MapError(str(error).replace("\n", " ") or "nested too deeply") from None
    found = read_home_assistant(data)
    if found is None:
        raise MapError("no modbus: with sensors, switches or the like")
    return found
