"""Text from the wire, made harmless for a terminal: nothing that moves the cursor, hides or reorders. Pure.

Rich and Textual read markup only in strings that are handed to them as markup; this program hands them `Text` and
segments. What is left to fear are characters that a terminal obeys, and those that a reader cannot see.
"""

from __future__ import annotations

import unicodedata

_HARMFUL = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp", "Mn", "Me"}
"""Controls, format characters (bidi, zero width), surrogates, private and unassigned ones, and marks that stack."""


def sanitized(text: object) -> str:
    """The text with every harmful character written out: "\\x1b", "\\u202e". Never raises."""
    string = text if isinstance(text, str) else str(text)
    if string.isascii() and string.isprintable():
        return string
    return "".join(_written(character) for character in string)


def _written(character: str) -> str:
    if unicodedata.category(character) not in _HARMFUL:
        return " " if character.isspace() else character
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def ascii_of(octets: bytes) -> str:
    """Octets as the right side of a hex dump: printable ASCII, dots for the rest."""
    return "".join(chr(octet) if 0x20 <= octet < 0x7F else "." for octet in octets)
