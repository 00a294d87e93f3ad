"""The profile that fits a station, from what it answers and refuses. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from dissectors.manifest import Dissector
from dissectors.profiles.decoding import decode, in_range
from dissectors.profiles.model import Profile, Sign
from dissectors.readings import Reading
from dissectors.tracker import Verdict
from sniff.analysis.point_reader import PointReader
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent

LEAST = 0.3
"""Score under which a profile is not proposed."""

MOST_PLACES = 4096
_RESERVED_WEIGHT = 0.3  # a block read over a reserved register says little
_SIGN_WEIGHT = 4.0
_CONSTANT_WEIGHT = 2.0  # of a property of the device object: people may change its name
_SPACES = {"read-holding-registers": "holding", "read-input-registers": "input"}
Place = tuple[str, int, str]


@dataclass(slots=True)
class HeardPlaces:
    """What a station answered (place → newest reading), and what it refused to give."""

    station: int
    answered: dict[Place, Reading] = field(default_factory=dict)
    refused: set[tuple[str, int]] = field(default_factory=set)


@dataclass(frozen=True, slots=True)
class Guess:
    """A profile for a station. `score`: 0 … 1; `why`: in words."""

    station: int
    profile: Profile
    score: float
    why: str


class Guessing:
    """Fed what the engine gives."""

    def __init__(self, dissector: Dissector) -> None:
        self.protocol = dissector.name
        self.heard: dict[int, HeardPlaces] = {}
        self._reader = PointReader(dissector)
        self._asked: dict[int, tuple[str, int]] = {}

    def add(self, output: Output) -> None:
        """Take rows and closed transactions."""
        for row in output.rows:
            if row.header is not None and row.header.address is not None and row.header.kind in _SPACES:
                self._asked[row.no] = _SPACES[row.header.kind], row.header.address
        for sample in self._reader.add(output):
            if sample.device is not None:
                reading = sample.value.reading
                self._of(sample.device).answered[reading.space, reading.address, reading.part] = reading
        for transaction in output.transactions:
            place = self._asked.pop(transaction.request or 0, None)
            if transaction.verdict is Verdict.EXCEPTION and transaction.station is not None and place is not None:
                self._of(transaction.station).refused.add(place)
        while len(self._asked) > MOST_PLACES:
            del self._asked[next(iter(self._asked))]

    def add_line_event(self, event: LineEvent) -> None:
        """It says nothing of a station."""

    def guesses(self, profiles: Iterable[Profile]) -> Iterator[Guess]:
        """Profiles for every station, the best first."""
        candidates = [profile for profile in profiles if self.protocol in profile.protocols]
        for station in sorted(self.heard):
            found = (guess(self.heard[station], profile) for profile in candidates)
            yield from sorted((one for one in found if one.score >= LEAST), key=lambda one: -one.score)

    def _of(self, station: int) -> HeardPlaces:
        return self.heard.setdefault(station, HeardPlaces(station))


def guess(heard: HeardPlaces, profile: Profile) -> Guess:
    """How well a profile fits what a station answered.

    The share of answered places that the profile knows, lowered by values out of its range, by places that it should
    have and that were refused; signs of identity weigh four places, a wrong one rules it out.
    """
    total = weight = 0.0
    known = strange = 0
    for (space, address, part), reading in heard.answered.items():
        if part:
            continue
        total += 1
        entry = profile.at(space, address)
        if entry is None or entry.reserved:
            weight += _RESERVED_WEIGHT if profile.is_reserved(space, address) else 0
            continue
        known += 1
        fits = all(value.bit or in_range(entry, value.value) for value in decode(profile, (reading,)))
        strange += not fits
        weight += 1.0 if fits else 0.3
    refused = sum(profile.at(*place) is not None for place in heard.refused)
    words = [f"{known} of {int(total)} places known"]
    words += [f"{strange} out of range"] if strange else []
    words += [f"{refused} refused that it should have"] if refused else []
    total += refused
    for (space, _, part), reading in heard.answered.items():
        if space == "device" and part in profile.constants:
            same = reading.value == profile.constants[part]
            total += _CONSTANT_WEIGHT
            weight += _CONSTANT_WEIGHT if same else 0
            words.append(f"{part} {'fits' if same else 'is another'}")
    for sign in profile.signs:
        verdict = _check(sign, heard)
        if verdict is False:
            return Guess(heard.station, profile, 0.0, f"{_name(sign)} says otherwise")
        if verdict:
            total += _SIGN_WEIGHT
            weight += _SIGN_WEIGHT
            words.append(f"{_name(sign)} fits")
    return Guess(heard.station, profile, weight / total if total else 0.0, ", ".join(words))


def _check(sign: Sign, heard: HeardPlaces) -> bool | None:
    """Whether a sign was seen and right; None when it was not seen. A device object may have any instance."""
    for (space, address, part), reading in heard.answered.items():
        here = space == sign.space and part == sign.part and (address == sign.address or space == "device")
        if here:
            return sign.value is None or reading.value == sign.value
    return None


def _name(sign: Sign) -> str:
    return f"{sign.space} {sign.address}" + (f" {sign.part}" if sign.part else "")
