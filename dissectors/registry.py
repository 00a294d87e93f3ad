"""The protocols: built-in ones and those that other packages bring (entry points, group `sniff485.dissectors`).

A new protocol is one folder and one line in BUILT_IN. Nothing is imported before it is asked for. What a plug-in's
functions raise is shown at the frame it was about (`plugin_guard.py`); where there is no such frame the command ends
and names the plug-in (`plugin_at`).
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

from dissectors.installed import entry_points

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from dissectors.manifest import Dissector

GROUP = "sniff485.dissectors"

BUILT_IN: Mapping[str, str] = {
    "modbus-rtu": "dissectors.modbus:RTU",
    "modbus-ascii": "dissectors.modbus:ASCII",
    "n2": "dissectors.n2:N2",
    "mstp": "dissectors.bacnet:MSTP",
    "profibus": "dissectors.profibus:PROFIBUS",
}

RELATIVES: Mapping[str, str] = {
    "modbus-tcp": "dissectors.modbus.tcp_manifest:TCP",
    "bacnet-ip": "dissectors.bacnet.ip_manifest:BACNET_IP",
}
"""Relatives on networks of the protocols of lines: known by name, looked for in captures of networks, on no line."""

DEFAULT = next(iter(BUILT_IN))
"""What is taken for the protocol of a bus of which nobody says it."""


class UnknownProtocol(LookupError):
    """No such protocol; the message lists those there are."""


class BrokenPlugin(UnknownProtocol):
    """A plug-in that is installed and cannot be used; the message names it, its package and why."""


def names() -> tuple[str, ...]:
    """Names of all protocols, built-in first."""
    plugged = sorted(point.name for point in _plugged_points() if point.name not in BUILT_IN)
    return (*BUILT_IN, *plugged)


def known() -> tuple[str, ...]:
    """Names of all protocols and of their relatives on networks."""
    return (*names(), *RELATIVES)


def is_of_lines(name: str) -> bool:
    """Whether `names` has it. For a built-in one nobody looks what other packages bring."""
    return name in BUILT_IN or (name != "" and name in names())


def is_known(name: str) -> bool:
    """Whether `known` has it."""
    return name in RELATIVES or is_of_lines(name)


def relatives() -> tuple[Dissector, ...]:
    """The relatives on networks."""
    return tuple(get(name) for name in RELATIVES)


def get(name: str) -> Dissector:
    """The protocol of that name. Raises UnknownProtocol."""
    target = BUILT_IN.get(name) or RELATIVES.get(name)
    if target is not None:
        found = _built_in(target)
    else:
        for point in _plugged_points():
            if point.name == name:
                return _plugged(point)
        else:
            raise UnknownProtocol(f"protocol {name!r} is not installed: expected one of {', '.join(known())}")
    return found


@cache
def _built_in(target: str) -> Dissector:
    from dissectors.manifest import Dissector  # by now the protocol's own import; none for whoever wants the names

    module, _, name = target.partition(":")
    found = getattr(import_module(module), name)
    assert isinstance(found, Dissector)
    return found


def _plugged_points() -> tuple[EntryPoint, ...]:
    """What other packages bring, as long as the same places are looked at."""
    return _points(entry_points, tuple(sys.path))


@cache
def _points(read: Callable[..., Iterable[EntryPoint]], path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Reads the metadata of every installed package, which takes milliseconds: whoever has a row may ask."""
    return tuple(read(group=GROUP))


def neighbours(octets: bytes) -> Iterator[str]:
    """What octets are of that no protocol here reads, by those with frames of the same form."""
    return filter(None, (one.neighbour(octets) for one in usable()))


def usable() -> tuple[Dissector, ...]:
    """All protocols, built-in first; plug-ins that cannot be used are left out."""
    found = []
    for name in names():
        try:
            found.append(get(name))
        except BrokenPlugin:
            continue
    return tuple(found)


_guarded: dict[str, tuple[Dissector, Dissector]] = {}
"""Name of a plug-in → what it brought, and the same with its functions guarded."""


def _named(point: EntryPoint) -> str:
    package = f" of package {point.dist.name}" if point.dist is not None else ""
    return f"plug-in {point.name!r}{package}"


def _plugged(point: EntryPoint) -> Dissector:
    """The protocol of another package. Raises BrokenPlugin."""
    where = _named(point)
    from dissectors.manifest import Dissector
    from dissectors.plugin_guard import guarded

    try:
        found = point.load()
    except Exception as error:  # its module is imported: anything may happen
        raise BrokenPlugin(f"{where}: {str(error) or type(error).__name__}") from error
    if not isinstance(found, Dissector):
        raise BrokenPlugin(f"{where}: {point.value} is no Dissector")
    known = _guarded.get(point.name)
    if known is None or known[0] is not found:
        known = _guarded[point.name] = (found, guarded(found))
    return known[1]


def plugin_at(file: str) -> str | None:
    """The plug-in whose code a file holds, as messages name it; None where it is nobody's."""
    for point in _plugged_points():
        module = sys.modules.get(point.value.partition(":")[0].partition(".")[0])
        folders = tuple(f"{folder}{slash}" for folder in getattr(module, "__path__", ()) for slash in "/\\")
        if file == getattr(module, "__file__", None) or file.startswith(folders):
            return _named(point)
    return None
