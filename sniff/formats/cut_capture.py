"""A capture whose file was cut or damaged around it (in its packing): what it gives, and that it is not all."""

from __future__ import annotations

from sniff.engine.capture import Capture
from sniff.engine.session import Completeness


def cut_short(capture: Capture, damage: str) -> Capture:
    """The same capture, which says that it is not whole, and why."""
    said = capture.completeness

    def completeness() -> Completeness:
        own = said()
        return Completeness(False, damage if own.whole else f"{damage}; {own.text}")

    capture.completeness = completeness  # type: ignore[method-assign]
    return capture
