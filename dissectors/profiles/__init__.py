"""Devices by name: profiles give registers and objects names, units, ranges and words. README.md has the format.

What reads and holds a profile is imported from its file, since most captures are read without any: `model.py` what a
profile is, `packaged.py` those of the package, `parsing.py` the format.
"""

from __future__ import annotations

from dissectors.profiles.checked import ProfileError
from dissectors.profiles.devices import Devices

__all__ = ["Devices", "ProfileError"]
