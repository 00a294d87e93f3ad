"""Which station is which device. Most buses are read without profiles: what those are made of is imported with one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dissectors.profiles.model import Profile


@dataclass(frozen=True, slots=True)
class Devices:
    """Which station is which device. `default`: for every station without a profile of its own."""

    by_address: Mapping[int, Profile] = field(default_factory=dict)
    default: Profile | None = None

    def at(self, address: int | None) -> Profile | None:
        """The profile of a station; None stands for all of them: what the rest have, else what each of several has. Of
        one station alone nobody knows whether a broadcast is meant for it."""
        if address is not None:
            return self.by_address.get(address, self.default)
        if self.default is not None or len(self.by_address) < 2 or len(self.profiles) != 1:
            return self.default
        return self.profiles[0]

    def exception(self, address: int, family: str, code: int) -> str:
        """The maker's words for an exception code of a station; empty when there are none."""
        profile = self.at(address)
        return "" if profile is None else profile.exception(family, code)

    def says_numbers(self, address: int, family: str) -> bool:
        """Whether the manual of the device there says which numbers it can be given."""
        profile = self.at(address)
        return profile is not None and profile.limits_on(family).stations is not None

    def ignores(self, address: int, family: str, kind: str, space: str) -> bool:
        """Whether the device there acknowledges an exchange of that kind and does not do it (`Limits.ignores`)."""
        profile = self.at(address)
        return profile is not None and profile.limits_on(family).ignores(kind, space)

    def response_at(self, address: int, family: str, baud: int) -> int | None:
        """ns that a station may take to answer at a rate, by its manual; None where it does not say."""
        profile = self.at(address)
        return None if profile is None else profile.limits_on(family).responses.get(baud)

    def __bool__(self) -> bool:
        return bool(self.by_address) or self.default is not None

    @property
    def profiles(self) -> tuple[Profile, ...]:
        """All profiles in force, each once."""
        found = {profile.name: profile for profile in self.by_address.values()}
        if self.default is not None:
            found.setdefault(self.default.name, self.default)
        return tuple(found.values())

    @property
    def documents(self) -> dict[str, str]:
        """What the profiles in force were read from, by name."""
        return {profile.name: profile.document for profile in self.profiles}

    def over(self, behind: Devices) -> Devices:
        """These, and where they say nothing what stands `behind`; a default here leaves nothing unsaid."""
        if self.default is not None:
            return self
        return Devices({**behind.by_address, **self.by_address}, behind.default)

    def text(self) -> str:
        """As on the command line: "1=teco-e510,*=teco-f510"."""
        words = [f"{address}={profile.name}" for address, profile in sorted(self.by_address.items())]
        return ",".join([*words, *([f"*={self.default.name}"] if self.default else [])])
