"""How many seeds a property is tried with: all where one searches (`HYPOTHESIS_PROFILE=thorough`), else some."""

from __future__ import annotations

import os


def seeds(many: int, usual: int = 1) -> range:
    """The seeds 0 … of a run: `many` in a search, `usual` in the suite."""
    return range(many if os.environ.get("HYPOTHESIS_PROFILE") == "thorough" else usual)
