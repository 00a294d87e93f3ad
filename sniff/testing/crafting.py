"""Whole frames from their parts, checks included. For whole layouts use the scapy classes (`dissectors.*.packets`)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from inspect import Parameter, signature

from dissectors import registry


def makers() -> dict[str, Callable[..., bytes]]:
    """What makes frames, by kind, of all protocols (`Dissector.makers`)."""
    return {kind: make for dissector in registry.usable() for kind, make in dissector.makers.items()}


def craft(kind: str, **parts: object) -> bytes:
    """A frame of a kind in `makers` from its parts, by keyword. Raises ValueError that says what there is."""
    known = makers()
    maker = known.get(kind)
    if maker is None:
        raise ValueError(f"craft {kind!r}: expected one of {', '.join(known)}")
    takes = ", ".join(_part(part) for part in signature(maker).parameters.values())
    try:
        signature(maker).bind(**parts)
    except TypeError as error:
        raise ValueError(f"craft {kind!r}: {error}; its parts are {takes}") from None
    try:
        return maker(**parts)
    except (AttributeError, TypeError, ValueError, struct.error, OverflowError) as error:
        raise ValueError(f"craft {kind!r}: {error}; its parts are {takes}") from error


def _part(part: Parameter) -> str:
    shown = f"{part.name}: {part.annotation}"
    return shown if part.default is Parameter.empty else f"{shown} = {part.default!r}"
