"""The scope of a filter, which it may ask beside the row: when the capture began, who is who, what was found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from dissectors.profiles import Devices
from sniff.engine.engine import Row

if TYPE_CHECKING:
    from dissectors.columns import Masks


class ToldPoint(NamedTuple):
    """One value of a frame: the name of its point, what it is, its unit, and that in words."""

    name: str
    value: int | float | str
    unit: str
    words: str


@dataclass(frozen=True, slots=True)
class Scope:
    """`started`: ns, what `frame.time_relative` counts from; None: the first row. `devices`: stations are named by
    their profiles. `names`: other names of stations. `findings`: codes by the numbers of the rows that show them; None
    where nothing was judged. `begin_of`: when a row began, ns, by its number, for `frame.time_delta`; None where rows
    come in order. `told`: the values of points that a row carries, by its number; None where nobody knows them.
    `telling`: which of so many rows from a number on carry any; None where that is not known beforehand. `says`: the
    line that says what a row is, where that knows more than the row. `answered`: fields of an answer that only its
    request tells. `has_times`: whether the capture says when anything came. `zone`: by how many ns the clocks of people
    are ahead of UTC at a time, where times are shown to them so; None: written times are UTC.
    """

    started: int | None = None
    devices: Devices = field(default_factory=Devices)
    names: Mapping[str, int] = field(default_factory=dict)
    findings: Mapping[int, frozenset[str]] | None = None
    begin_of: Callable[[int], int | None] | None = None
    told: Callable[[int], Sequence[ToldPoint]] | None = None
    telling: Callable[[int, int], Masks] | None = None
    says: Callable[[Row], str] | None = None
    answered: Callable[[Row], Mapping[str, int | float | str]] | None = None
    has_times: bool = True
    zone: Callable[[int], int] | None = None

    def stations(self) -> dict[str, tuple[int, ...]]:
        """Addresses by name."""
        found: dict[str, tuple[int, ...]] = {name.lower(): (address,) for name, address in self.names.items()}
        for address, profile in sorted(self.devices.by_address.items()):
            found[profile.name.lower()] = (*found.get(profile.name.lower(), ()), address)
        return found
