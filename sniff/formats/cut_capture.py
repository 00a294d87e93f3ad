"""A capture whose file was cut or damaged around it (in its packing): what it gives, and that it is not all.

Such a file ends early as any cut file does, without an exception, so that a command tells all that was before. The
command has not read what it was given all the same: who ends the program asks `unsaid` and `was_cut`.
"""

from __future__ import annotations

from pathlib import Path

from sniff.engine.capture import Capture
from sniff.engine.session import Completeness
from sniff.formats.several_buses import SeveralBuses

_cut: dict[str, str] = {}  # file → damage, of this run
_said: set[str] = set()


def cut_short(path: Path, capture: Capture, damage: str) -> Capture:
    """The same capture, which says that it is not whole, and why."""
    _cut[str(path)] = damage
    for bus in capture.buses if isinstance(capture, SeveralBuses) else (capture,):
        _cut_one(bus, damage)
    return capture


def _cut_one(capture: Capture, damage: str) -> None:
    said = capture.completeness

    def completeness() -> Completeness:
        own = said()
        return Completeness(False, damage if own.whole else f"{damage}; {own.text}")

    capture.completeness = completeness  # type: ignore[method-assign]


def was_cut() -> bool:
    """Whether a file that was opened was cut."""
    return bool(_cut)


def said(path: str) -> None:
    """Somebody was told of that file."""
    _said.add(path)


def unsaid() -> list[tuple[str, str]]:
    """Files and damage of which nobody was told yet; each once."""
    found = [(path, damage) for path, damage in _cut.items() if path not in _said]
    _said.update(_cut)
    return found


def forget() -> None:
    """A new run begins."""
    _cut.clear()
    _said.clear()
