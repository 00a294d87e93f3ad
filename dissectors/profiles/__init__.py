"""Devices by name: profiles give registers and objects names, units, ranges and words. README.md has the format."""

from __future__ import annotations

from dissectors.profiles.checked import ProfileError
from dissectors.profiles.model import Access, Bit, Devices, Entry, Kind, Limits, Part, Profile, Role, Sign
from dissectors.profiles.packaged import packaged, parse_text
from dissectors.profiles.parsing import parse

__all__ = [
    "Access",
    "Bit",
    "Devices",
    "Entry",
    "Kind",
    "Limits",
    "Part",
    "Profile",
    "ProfileError",
    "Role",
    "Sign",
    "packaged",
    "parse",
    "parse_text",
]
