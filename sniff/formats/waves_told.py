"""Kind of a logic analyser's file, told by its first octets. Pure."""

from __future__ import annotations

import re

from sniff.formats import saleae, scope, sigrok

REMARKS_MOST = 24
"""Lines in which the first rows of a table of levels are."""

_DECLARATION = re.compile(rb"\s*\$(?:date|version|timescale|comment|scope|var)\b")


def is_sigrok(start: bytes) -> bool:
    """Whether it is a zip with the entries of a session (or of DSView, which the reader refuses with a way out)."""
    return start.startswith(sigrok.MAGIC) and any(
        start[30:].startswith(name) for name in (b"version", b"metadata", b"logic-1", b"header")
    )


def is_vcd(start: bytes) -> bool:
    """Whether it is a value change dump."""
    return _DECLARATION.match(start) is not None


def is_levels(start: bytes) -> bool:
    """Whether it is a table of levels over time."""
    lines = start[:8192].decode("utf-8", "replace").removeprefix("\ufeff").splitlines()
    return saleae.is_digital_csv(lines[:REMARKS_MOST])


def is_voltages(start: bytes) -> bool:
    """Whether it is a table of voltages over time."""
    lines = start[:16384].decode("utf-8", "replace").removeprefix("\ufeff").splitlines()
    return scope.is_voltages(lines[: scope.HEADING + 2 * scope.LEAST_ROWS][:-1])


def is_saleae_binary(start: bytes) -> bool:
    """Whether it is a binary export of Saleae Logic."""
    return start.startswith(saleae.MAGIC)
