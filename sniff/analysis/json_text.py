"""JSON on one line, and instants as texts, the same wherever this program writes them. Pure."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from typing import Any

from dissectors.line import NS_PER_S


def dumps(value: Any) -> str:
    """The value on one line. Characters that are not printable (controls, bidi, zero width) are escaped, as JSON may.

    A number that JSON has none for is a text: "nan", "inf", "-inf". Raises TypeError for what JSON does not know.
    """
    try:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    except ValueError:
        text = json.dumps(finite(value), ensure_ascii=False)
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() else json.dumps(one)[1:-1] for one in text)


def finite(value: Any) -> Any:
    """The value, with texts in place of numbers that JSON has none for."""
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, dict):
        return {name: finite(one) for name, one in value.items()}
    return [finite(one) for one in value] if isinstance(value, list | tuple) else value


def iso(time: int) -> str:
    """ns since the epoch as ISO 8601 in UTC with nine decimals."""
    seconds, rest = divmod(time, NS_PER_S)
    try:
        stamp = datetime.fromtimestamp(seconds, UTC)
    except (OverflowError, ValueError, OSError):  # a hostile file's time
        return f"{time} ns"
    return f"{stamp:%Y-%m-%dT%H:%M:%S}.{rest:09d}Z"
