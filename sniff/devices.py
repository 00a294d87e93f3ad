"""Profiles by name: those that come with the package, those of the project and of the user, those of other packages.

    teco-e510             by name: ./profiles and those above it, the user's folder, the package, other packages
    drives/pump.toml      a file by its path
    F510-P.GSD            a maker's description of a device, by its path

Other packages give theirs under the entry point group `sniff485.profiles`: the name of the profile to the text of a
TOML document, or to a path of one.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from dissectors import registry
from dissectors.installed import entry_points
from dissectors.profiles import Devices, ProfileError
from dissectors.profiles.model import Profile
from dissectors.profiles.packaged import SUFFIX, names, packaged, parse_text
from sniff.engine.session import DEVICES_NOTE, Session

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "sniff485.profiles"
FOLDER = "profiles"
GSD_SUFFIXES = (".gsd", ".gse", ".gsg")
"""Files in which makers of field devices describe them; the last letter is a language."""

LARGEST = 16 << 20
"""Octets of a profile that are read at most."""

FOREIGN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")
"""A profile's name as a file from somebody else may give it: never a path."""

EVERY = "*"
"""The address that stands for every station."""

MOST_NOTED = 256
"""Devices that a capture may name: as many as there are addresses."""


class UnknownProfile(LookupError):
    """No such profile; the message says which there are."""


@dataclass(frozen=True, slots=True)
class Listed:
    """A profile that can be had: where it is from, and what it is or why it cannot be used."""

    name: str
    origin: str
    profile: Profile | None
    error: str = ""


def find(name: str) -> Profile:
    """A profile by name or path. Raises UnknownProfile, ProfileError."""
    if name.endswith(SUFFIX) or os.sep in name or name.lower().endswith(GSD_SUFFIXES):
        return read(Path(name))
    for folder in folders():
        path = folder / (name + SUFFIX)
        if path.is_file():
            return read(path)
    if name in names():
        return packaged(name)
    for point in entry_points(group=GROUP):
        if point.name == name:
            return _plugged(point)
    from sniff.config import nearest  # for who made a mistake

    known = tuple(dict.fromkeys(listed.name for listed in available()))
    raise UnknownProfile(f"profile {name!r}: no such profile{nearest(name, known)}")


def read(path: Path) -> Profile:
    """The profile in a file. Raises ProfileError."""
    try:
        if path.stat().st_size > LARGEST:
            raise ProfileError(f"{path}: over {LARGEST >> 20} MiB is no profile")
        is_gsd = path.suffix.lower() in GSD_SUFFIXES
        text = path.read_text(encoding="latin-1" if is_gsd else "utf-8")
    except OSError as error:
        raise ProfileError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise ProfileError(f"{path}: {error}") from None
    return parse_text(text, str(path))


def available() -> Iterator[Listed]:
    """Every profile that a name finds, in the order of search; broken ones too."""
    seen: set[str] = set()
    for folder in folders():
        for path in sorted(folder.glob(f"*{SUFFIX}")) if folder.is_dir() else ():
            if path.stem not in seen:
                seen.add(path.stem)
                yield _listed(path.stem, str(path), path)
    for name in names():
        if name not in seen:
            seen.add(name)
            yield _listed(name, "package", None)
    for point in entry_points(group=GROUP):
        if point.name not in seen:
            seen.add(point.name)
            yield _listed(point.name, f"entry point {point.value}", point)


def folders() -> tuple[Path, ...]:
    """Where profiles of the project and of the user may be, nearest first."""
    here = Path.cwd()
    if sys.platform == "win32":
        user = Path(os.environ.get("APPDATA", Path.home()))
    else:
        user = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    return (*(folder / FOLDER for folder in (here, *here.parents)), user / "sniff485" / FOLDER)


def assignment(word: str) -> tuple[str, str]:
    """Address (or "*") and profile of "3=teco-e510". Raises ValueError."""
    station, equals, name = word.partition("=")
    if not equals or not name:
        raise ValueError(f"device {word!r}: expected ADDRESS=PROFILE, for instance 3=teco-e510")
    if station != EVERY:
        address(station)
    return station, name


def devices(assigned: Mapping[str, str], documents: Mapping[str, str] | None = None) -> Devices:
    """Profiles by station, from address (or "*") → name. Raises ValueError, UnknownProfile, ProfileError.

    `documents`: what some names mean, as TOML documents; the others are looked for here.
    """
    by_address: dict[int, Profile] = {}
    default: Profile | None = None
    for word, name in assigned.items():
        profile = _meant(name, documents or {})
        if word.strip() == EVERY:
            default = profile
        else:
            by_address[address(word)] = profile
    return Devices(by_address, default)


def noted(session: Session) -> tuple[dict[str, str], tuple[str, ...]]:
    """The devices that a capture names: address (or "*") → name, and what it says that nobody here understands.

    The file may be from somebody else: only names of profiles that it holds or that can be found here count, never a
    path.
    """
    known: dict[str, str] = {}
    unknown: list[str] = []
    said = session.notes.get(DEVICES_NOTE, "")
    for token in said.split(",")[:MOST_NOTED] if said else ():
        word, _, name = (part.strip() for part in token.partition("="))
        try:
            if not FOREIGN_NAME.fullmatch(name):
                raise ValueError
            if word != EVERY:
                address(word)
            _meant(name, session.profiles)
        except (ValueError, UnknownProfile, ProfileError):
            unknown.append(token.strip())
        else:
            known[word] = name
    return known, tuple(unknown)


def noted_devices(session: Session) -> Devices:
    """The devices that a capture names, as far as it holds their profiles or they are known here."""
    return devices(noted(session)[0], session.profiles)


def with_devices(session: Session, chosen: Devices) -> Session:
    """The session saying who is which device, with the profiles in force."""
    if not chosen:
        return session
    return replace(session, notes={**session.notes, DEVICES_NOTE: chosen.text()}, profiles=chosen.documents)


def made_for(profile: Profile, protocol: str) -> Profile | None:
    """Another packaged profile of the same device, for a protocol that this one does not speak of."""
    if protocol in profile.protocols or not profile.models:
        return None
    others = (packaged(name) for name in names())
    same = (one for one in others if (one.vendor, one.models) == (profile.vendor, profile.models))
    return next((one for one in same if protocol in one.protocols), None)


def says_of(profile: Profile, protocol: str) -> bool:
    """Whether a profile can say something on a bus of that protocol: of it, or of one that has the same registers."""
    if protocol in profile.protocols:
        return True
    try:
        families = {registry.get(name).profile_family for name in profile.protocols}
        return registry.get(protocol).profile_family in families
    except registry.UnknownProtocol:  # somebody else's: nobody here can tell
        return True


def _meant(name: str, documents: Mapping[str, str]) -> Profile:
    """The profile that was in force when a capture was made, else that of this name here."""
    return parse_text(documents[name], f"{name} of the capture") if name in documents else find(name)


def address(word: str) -> int:
    """A station's address, decimal or 0x…. Raises ValueError."""
    try:
        number = int(word, 0)
    except ValueError:
        number = -1
    if not 0 <= number <= 255:
        raise ValueError(f"device {word!r}: expected an address 0 … 255, or * for every station")
    return number


def _listed(name: str, origin: str, where: Path | EntryPoint | None) -> Listed:
    try:
        if where is None:
            return Listed(name, origin, packaged(name))
        return Listed(name, origin, read(where) if isinstance(where, Path) else _plugged(where))
    except ProfileError as error:
        return Listed(name, origin, None, str(error))


def _plugged(point: EntryPoint) -> Profile:
    try:
        found = point.load()
    except Exception as error:  # somebody else's package
        raise ProfileError(f"entry point {point.value}: {error}") from None
    if isinstance(found, str) and "\n" in found:
        return parse_text(found, point.value)
    if isinstance(found, str | Path):
        return read(Path(found))
    raise ProfileError(f"entry point {point.value}: {found!r} is neither a text nor a path")
