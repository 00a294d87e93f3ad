"""JSON for the command line: one object a line, text as it is, except for what a terminal obeys or nobody sees."""

from __future__ import annotations

import json
from typing import Any


def dumps(value: Any) -> str:
    """The value on one line. Characters that are not printable (controls, bidi, zero width) are escaped, as JSON may.

    Raises TypeError for what JSON does not know.
    """
    text = json.dumps(value, ensure_ascii=False)
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() else json.dumps(one)[1:-1] for one in text)
