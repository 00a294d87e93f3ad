"""The protocols: built-in ones and those that other packages bring (entry points, group `sniff485.dissectors`).

A new protocol is one folder and one line in BUILT_IN. Nothing is imported before it is asked for. What a plug-in's
functions raise is shown at the frame it was about (`plugin_guard.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from dissectors.frame import Frame, Header, Role
from dissectors.framer import Framer
from dissectors.line import Timing
from dissectors.tracker import Tracker

GROUP = "sniff485.dissectors"

BUILT_IN: Mapping[str, str] = {
    "modbus-rtu": "dissectors.modbus:RTU",
    "modbus-ascii": "dissectors.modbus:ASCII",
    "n2": "dissectors.n2:N2",
    "mstp": "dissectors.bacnet:MSTP",
}


@dataclass(frozen=True, slots=True)
class Dissector:
    """Everything the application needs to know of one protocol.

    `name`: as on the command line ("modbus-rtu"); `title`: for people.
    `framer`, `tracker`: make a new one for a bus with the given timing.
    `peek(frame)`: the quick look, total, a few µs.
    `text(frame, header, role)`: one line for the frame list, without control characters, role as the tracker gave it.
    `fields(frame, role)`: Wireshark field names (ours where it has none) to int, float or str, in frame order.
    `packet(frame, role)`: the scapy packet, imported on first use; never raises, keeps what does not parse as Raw.
    `default_line`: what such a bus normally runs ("19200,8E1").
    `extras`: what only some protocols have: "findings", a function Timing → `dissectors.findings.Judge`, and "rules",
    its catalogue, code → `dissectors.findings.Rule`.
    """

    name: str
    title: str
    framer: Callable[[Timing], Framer]
    peek: Callable[[Frame], Header]
    tracker: Callable[[Timing], Tracker]
    text: Callable[[Frame, Header, Role], str]
    fields: Callable[[Frame, Role], dict[str, int | float | str]]
    packet: Callable[[Frame, Role], Any]
    default_line: str = "9600,8N1"
    extras: Mapping[str, Any] = field(default_factory=dict)


def on_first_use(target: str) -> Callable[..., Any]:
    """The function "module:name", whose module is imported when it is first called; for `packet`, which needs scapy."""

    def call(*arguments: Any) -> Any:
        return _load(target)(*arguments)

    return call


@cache
def _load(target: str) -> Any:
    module, _, name = target.partition(":")
    return getattr(import_module(module), name)


class UnknownProtocol(LookupError):
    """No such protocol; the message lists those there are."""


class BrokenPlugin(UnknownProtocol):
    """A plug-in that is installed and cannot be used; the message names it, its package and why."""


def names() -> tuple[str, ...]:
    """Names of all protocols, built-in first."""
    plugged = sorted(point.name for point in entry_points(group=GROUP) if point.name not in BUILT_IN)
    return (*BUILT_IN, *plugged)


def get(name: str) -> Dissector:
    """The protocol of that name. Raises UnknownProtocol."""
    target = BUILT_IN.get(name)
    if target is not None:
        found = _load(target)
    else:
        for point in entry_points(group=GROUP):
            if point.name == name:
                return _plugged(point)
        else:
            raise UnknownProtocol(f"protocol {name!r}: expected one of {', '.join(names())}")
    assert isinstance(found, Dissector)
    return found


_guarded: dict[str, tuple[Dissector, Dissector]] = {}
"""Name of a plug-in → what it brought, and the same with its functions guarded."""


def _plugged(point: EntryPoint) -> Dissector:
    """The protocol of another package. Raises BrokenPlugin."""
    package = f" of package {point.dist.name}" if point.dist is not None else ""
    where = f"plug-in {point.name!r}{package}"
    try:
        found = point.load()
    except Exception as error:  # its module is imported: anything may happen
        raise BrokenPlugin(f"{where}: {str(error) or type(error).__name__}") from error
    if not isinstance(found, Dissector):
        raise BrokenPlugin(f"{where}: {point.value} is no Dissector")
    known = _guarded.get(point.name)
    if known is None or known[0] is not found:
        from dissectors.plugin_guard import guarded

        known = _guarded[point.name] = (found, guarded(found))
    return known[1]
