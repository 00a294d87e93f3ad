"""Guests: screens that are shown at another machine, and write nothing here."""

from __future__ import annotations

import os

GUEST = "SNIFF485_GUEST"
"""Set in the environment of screens that are shown elsewhere: they write no files here."""


def is_guest() -> bool:
    """Whether this screen is for somebody at another machine (`serve --allow-remote` says so)."""
    return bool(os.environ.get(GUEST))
