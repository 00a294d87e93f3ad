"""A plug-in's functions made total: what they raise is said at its frame, and the capture goes on. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

from dissectors.frame import Frame, Header, Role
from dissectors.pseudonyms import Pseudonyms

if TYPE_CHECKING:
    from dissectors.manifest import Dissector
    from dissectors.meaning import Meaning
    from dissectors.pseudonyms import Renamer
    from dissectors.simulated import SimulatedBus

_Given = TypeVar("_Given")

LONGEST = 120
"""Characters of an error that are shown."""


class FailedHeader(Header):
    """What stands for the header that a plug-in failed to give; its `error` says how."""

    __slots__ = ()


def _of_type(given: Any, wanted: type[_Given]) -> _Given:
    if not isinstance(given, wanted):
        raise TypeError(f"it gave {type(given).__name__}, no {wanted.__name__}")
    return given


def _of_values(given: Any) -> dict[str, int | float | str]:
    for name, value in _of_type(given, dict).items():
        if not isinstance(name, str) or not isinstance(value, int | float | str):
            raise TypeError(f"{name!r} is {type(value).__name__}, no number and no text")
    return dict(given)


def guarded(dissector: Dissector) -> Dissector:
    """The same protocol, whose `peek`, `text`, `fields` and `packet` never raise and give what they should."""
    guard = _Guard(dissector)
    return replace(
        dissector,
        peek=guard.peek,
        text=guard.text,
        meant=guard.meant,
        fields=guard.fields,
        packet=guard.packet,
        scenarios=guard.scenarios,
        renamer=None if dissector.renamer is None else guard.renamer,
    )


class _Guard:
    """The functions of a protocol, each with something to give where it fails."""

    def __init__(self, dissector: Dissector) -> None:
        self._dissector = dissector
        self._meaning = replace(dissector, text=self.text)

    def peek(self, frame: Frame) -> Header:
        name = self._dissector.name
        try:
            return _of_type(self._dissector.peek(frame), Header)
        except Exception as error:
            words = self._failed("peek", error)
            return FailedHeader(name, None, None, Role.UNKNOWN, "unknown", ok=frame.ok, error=words)

    def text(self, frame: Frame, header: Header, role: Role) -> str:
        if isinstance(header, FailedHeader):
            return header.error or ""
        try:
            return _of_type(self._dissector.text(frame, header, role), str)
        except Exception as error:
            return self._failed("text", error)

    def meant(self, frame: Frame, header: Header, role: Role, meaning: Meaning) -> str:
        try:
            return _of_type(self._meaning.line(frame, header, role, meaning), str)
        except Exception as error:
            return self._failed("meant", error)

    def fields(self, frame: Frame, role: Role) -> dict[str, int | float | str]:
        try:
            return _of_values(self._dissector.fields(frame, role))
        except Exception as error:
            return {f"{self._dissector.name}.error": self._failed("fields", error)}

    def packet(self, frame: Frame, role: Role) -> Any:
        try:
            return self._dissector.packet(frame, role)
        except Exception:
            from scapy.packet import Raw

            return Raw(frame.octets)

    def renamer(self) -> Renamer:
        assert self._dissector.renamer is not None
        return _Renaming(self._dissector.name, self._dissector.renamer())

    def scenarios(self) -> Mapping[str, SimulatedBus]:
        try:
            return self._dissector.scenarios()
        except Exception:
            return {}  # its buses cannot be had; those of others can

    def _failed(self, function: str, error: Exception) -> str:
        said = "".join(c if c.isprintable() else "." for c in str(error))[:LONGEST]
        words = f"{type(error).__name__}{': ' if said else ''}{said}"
        return f"{function} of plug-in {self._dissector.name!r} failed: {words}"


class _Renaming:
    """A plug-in's renamer that keeps the length of each frame, or says that it does not: octets would change places."""

    def __init__(self, name: str, rename: Renamer) -> None:
        self._name, self._rename = name, rename
        held = getattr(rename, "stations", None)
        self.stations = held if isinstance(held, Pseudonyms) else None

    def __call__(self, frame: Frame) -> bytes:
        octets = _of_type(self._rename(frame), bytes)
        if len(octets) != len(frame.octets):
            from dissectors.registry import BrokenPlugin

            was, now = len(frame.octets), len(octets)
            raise BrokenPlugin(f"plug-in {self._name!r} renames a frame of {was} octets to one of {now}")
        return octets
