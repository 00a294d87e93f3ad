"""The profile that fits a station, from what it answers and refuses. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from dissectors.manifest import Dissector
from dissectors.profiles.decoding import Value, decode, in_range
from dissectors.profiles.model import Entry, Profile, Sign
from dissectors.readings import Reading
from dissectors.tracker import Verdict
from sniff.analysis.point_reader import PointReader
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent

LEAST = 0.3
"""Score under which a profile is not proposed."""

MOST_PLACES = 4096
_RESERVED_WEIGHT = 0.3  # a block read over a reserved register says little
_ANY_WEIGHT = 0.3  # of a place that may hold any value
_STRANGE_SHARE = 0.3  # of what a place is worth that holds what the profile does not allow
_UNNAMED_WEIGHT = 2.0  # of what may be any other device, where nothing that names it was read
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

    The share of answered places that the profile knows, lowered by values that it does not allow, by reserved places
    that hold something, by places that it should have and that were refused, and as long as nothing was read that names
    the device: other devices have numbers like these too. What may hold any value tells little. Signs of identity weigh
    four places, a wrong one rules it out.
    """
    for sign in profile.signs:
        if _check(sign, heard) is False:
            return Guess(heard.station, profile, 0.0, f"{_name(sign, profile)} says otherwise")
    weighing = _Weighing(heard, profile)
    weighing.weigh_places()
    weighing.weigh_refusals()
    weighing.weigh_constants()
    weighing.weigh_signs()
    weighing.weigh_silence()
    return Guess(heard.station, profile, weighing.share, ", ".join(weighing.words))


class _Weighing:
    """What speaks for a profile (`_weight`) of all that could (`_total`), in words too."""

    def __init__(self, heard: HeardPlaces, profile: Profile) -> None:
        self.words: list[str] = []
        self._heard, self._profile = heard, profile
        self._total = self._weight = 0.0
        self._is_named = False

    @property
    def share(self) -> float:
        """0 … 1."""
        return self._weight / self._total if self._total else 0.0

    def weigh_places(self) -> None:
        """Registers and objects that were answered: known ones, with what they hold, reserved and unknown ones."""
        places = known = strange = 0
        for (space, address, part), reading in self._heard.answered.items():
            if part or any(sign.value is not None and sign.is_of(reading) for sign in self._profile.signs):
                continue
            places += 1
            entry = self._profile.at(space, address)
            if self._profile.is_reserved(space, address):
                self._add(_RESERVED_WEIGHT, 1.0 if reading.raw else _RESERVED_WEIGHT)
            elif entry is None:
                self._add(0, 1)
            else:
                known += 1
                worth = _worth(entry)
                fits = all(value.bit or _is_allowed(entry, value) for value in decode(self._profile, (reading,)))
                strange += not fits
                self._add(worth if fits else _STRANGE_SHARE * worth, worth)
        self.words.append(f"{known} of {places} places known")
        self.words += [f"{strange} not allowed"] if strange else []

    def weigh_refusals(self) -> None:
        """Places that the device should have, and refused to give."""
        refused = sum(self._profile.at(*place) is not None for place in self._heard.refused)
        self.words += [f"{refused} refused that it should have"] if refused else []
        self._add(0, refused)

    def weigh_constants(self) -> None:
        """Properties of the device itself."""
        for (space, _, part), reading in self._heard.answered.items():
            if space == "device" and part in self._profile.constants:
                same = reading.value == self._profile.constants[part]
                self._is_named |= same and part.endswith("-name")  # a version or a place may be anybody's
                self._add(_CONSTANT_WEIGHT if same else 0, _CONSTANT_WEIGHT)
                self.words.append(f"{part} {'fits' if same else 'is another'}")

    def weigh_signs(self) -> None:
        """Signs of identity that were seen; none of them is wrong."""
        for sign in self._profile.signs:
            if _check(sign, self._heard):
                self._is_named |= sign.value is not None
                self._add(_SIGN_WEIGHT, _SIGN_WEIGHT)
                self.words.append(f"{_name(sign, self._profile)} {'is there' if sign.value is None else 'fits'}")

    def weigh_silence(self) -> None:
        """Nothing names the device: others have numbers like these, too."""
        if not self._is_named:
            self._add(0, _UNNAMED_WEIGHT)
            self.words.append("nothing was read that names it")

    def _add(self, weight: float, total: float) -> None:
        self._weight += weight
        self._total += total


def _check(sign: Sign, heard: HeardPlaces) -> bool | None:
    """Whether a sign was seen and right; None when it was not seen."""
    return next((sign.fits(reading) for reading in heard.answered.values() if sign.is_of(reading)), None)


def _worth(entry: Entry) -> float:
    """How much it tells that a place answers as the profile has it: little where any value would do, nothing of a
    parameter of which only its number is known."""
    if entry.states or entry.reserved_bits or entry.parts or entry.low is not None or entry.high is not None:
        return 1.0
    return 0.0 if entry.title.endswith(f" {entry.name}") else _ANY_WEIGHT


def _is_allowed(entry: Entry, value: Value) -> bool:
    """Whether the profile allows a value: of a list of codes or states, whether it has that one."""
    raw = value.raw or 0
    is_listed = not entry.states or entry.low is not None or raw in entry.states or entry.written != ""
    return in_range(entry, value.value) and is_listed and not entry.reserved_in(raw)


def _name(sign: Sign, profile: Profile) -> str:
    return sign.title or " ".join(filter(None, (profile.number_of(sign.space, sign.address), sign.part)))
