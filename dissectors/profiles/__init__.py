"""Devices by name: profiles give registers and objects names, units, ranges and words. README.md has the format."""

from __future__ import annotations

from dissectors.profiles.checked import ProfileError
from dissectors.profiles.model import Access, Bit, BitField, Devices, Entry, EntryRole, Kind, Limits, Profile, Sign
from dissectors.profiles.packaged import packaged, parse_text
from dissectors.profiles.parsing import parse

__all__ = [
    "Access",
    "Bit",
    "BitField",
    "Devices",
    "Entry",
    "EntryRole",
    "Kind",
    "Limits",
    "Profile",
    "ProfileError",
    "Sign",
    "packaged",
    "parse",
    "parse_text",
]
