"""JSON on one line, and instants as texts, the same wherever this program writes them. Pure."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from typing import Any

from dissectors.line import NS_PER_S


def dumps(value: Any) -> str:
    """The value on one line. Characters that are not printable (controls, bidi, zero width) are escaped, as JSON may.

    Raises TypeError for what JSON does not know.
    """
    text = json.dumps(value, ensure_ascii=False)
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() else json.dumps(one)[1:-1] for one in text)


def iso(time: int) -> str:
    """ns since the epoch as ISO 8601 in UTC with nine decimals."""
    seconds, rest = divmod(time, NS_PER_S)
    try:
        stamp = datetime.fromtimestamp(seconds, UTC)
    except (OverflowError, ValueError, OSError):  # a hostile file's time
        return f"{time} ns"
    return f"{stamp:%Y-%m-%dT%H:%M:%S}.{rest:09d}Z"
