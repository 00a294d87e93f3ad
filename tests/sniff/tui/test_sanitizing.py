"""Nothing that a terminal obeys, or that a reader cannot see, gets through."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sniff.analysis.sanitizing import ascii_of, sanitized


@given(st.text(st.characters(exclude_categories=())))
def test_only_harmless_characters_come_out(text: str) -> None:
    harmless = sanitized(text)
    for character in harmless:
        assert unicodedata.category(character) not in {"Cc", "Cf", "Cs", "Zl", "Zp", "Mn", "Me"}
    assert sanitized(harmless) == harmless


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("read 1 ← 2 ×3 µs", "read 1 ← 2 ×3 µs"),
        ("[bold red]x[/]", "[bold red]x[/]"),
        ("\x1b[2J", "\\x1b[2J"),
        ("\x9b31m", "\\x9b31m"),
        ("a\nb\tc", "a\\x0ab\\x09c"),
        ("\u202egnp", "\\u202egnp"),
        ("x\u200by", "x\\u200by"),
        ("\ud800", "\\ud800"),
        ("e\u0301", "e\\u0301"),
        ("a\u00a0b", "a b"),
    ],
)
def test_what_is_written_out(text: str, wanted: str) -> None:
    assert sanitized(text) == wanted


def test_other_values_become_text() -> None:
    assert sanitized(ValueError("a\x00b")) == "a\\x00b"
    assert sanitized(7) == "7"


@given(st.binary())
def test_ascii_column_is_as_wide_as_the_octets(octets: bytes) -> None:
    text = ascii_of(octets)
    assert len(text) == len(octets)
    assert text.isascii()
    assert not text or text.isprintable()
