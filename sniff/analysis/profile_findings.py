"""Findings about a device by its own profile, row by row; `profile_rules.py` has the rules PR…. Pure.

Only what is certain is judged: no value whose layout is a guess (a fault told that way is a note), no response time
beyond what the adapter allows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from dissectors.findings import Finding
from dissectors.frame import Event, Frame, Header, Role
from dissectors.line import Timing
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.profiles.decoding import Value, bit_words, decode, in_range, number, range_words, state_words
from dissectors.profiles.model import Access, Entry, EntryRole, Profile
from dissectors.profiles.properties import due_property
from dissectors.readings import Origin, Reading
from dissectors.subject import About, Subject, station
from dissectors.tracker import Placement, Transaction
from dissectors.words import milliseconds
from sniff.analysis.device_remarks import MOST_TOLD, OF_STATUS, DeviceRemarks, Remark
from sniff.analysis.point_reader import ALL, WHOLE, PointReader, Sample
from sniff.engine.engine import Output, Row

CODES = {EntryRole.FAULT: "PR004", EntryRole.ALARM: "PR005"}

_READ_ONLY = "written, though it is read only"


@dataclass(frozen=True, slots=True)
class _InVain:
    """A command that the device acknowledges at most: its number and frame, what it asks, what it writes."""

    no: int
    frame: Frame
    words: str
    readings: tuple[Reading, ...]


class ProfileFindings:
    """Fed every row and every closed transaction of one bus (`dissectors.findings.Judge`).

    `remarks`: where what is found is told.
    """

    def __init__(
        self, timing: Timing, dissector: Dissector, devices: Devices, remarks: DeviceRemarks | None = None
    ) -> None:
        self._family = dissector.profile_family
        self._devices = devices
        self._reader = PointReader(dissector, devices)
        self._readings = dissector.readings
        self._remarks = DeviceRemarks() if remarks is None else remarks
        self._answers: dict[Subject, int] = {}
        self._asks = dissector.asks
        self._in_vain: dict[int, _InVain] = {}  # by transaction

    def see(self, no: int, event: Event, header: Header | None, placement: Placement | None) -> None:
        """Take the next row."""
        self._reader.add(Output(rows=(Row(no, event, header, placement),)))
        if not isinstance(event, Frame) or not event.ok or placement is None:
            return
        self._judge_length(no, event, placement)
        if placement.role is Role.RESPONSE:
            self._judge_number(no, event, placement.source)
        if placement.role is Role.REQUEST and header is not None and header.function is not None:
            self._judge_function(no, event, placement.destination, header.function)
        if placement.role is not Role.RESPONSE and self._readings is not None:
            station = None if placement.role is Role.BROADCAST else placement.destination
            readings = tuple(reading for reading in self._readings(event, None) if reading.how is Origin.WRITE)
            if not self._remember_vain(no, event, header, placement, readings) and readings:
                self._judge_writes(no, event, station, readings, "" if header is None else header.kind)

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed."""
        for sample in self._reader.add(Output(transactions=(transaction,))):
            if sample.value.how is not Origin.WRITE:
                self._judge_value(sample)
        self._judge_time(transaction)
        vain = self._in_vain.pop(transaction.id, None)
        profile = self._devices.at(transaction.station)
        if vain is None or profile is None:
            return
        if transaction.verdict in WHOLE:
            seen = f"{vain.words}: acknowledged, and not executed by this device"
            remark = Remark("PR010", _subject(profile, transaction.station), vain.words, seen)
            self._remarks.tell(remark, transaction.end, vain.no)
        elif vain.readings:
            self._judge_writes(vain.no, vain.frame, transaction.station, vain.readings, transaction.kind)

    def _remember_vain(
        self, no: int, frame: Frame, header: Header | None, placement: Placement, readings: tuple[Reading, ...]
    ) -> bool:
        """Whether it is a command that the device is known to acknowledge only: it is judged when it is answered."""
        profile = self._devices.at(placement.destination)
        if profile is None or header is None or len(self._in_vain) >= MOST_TOLD:
            return False
        limits = profile.limits_on(self._family)
        about = readings or (self._asks(frame) if self._asks is not None else ())
        if not any(limits.ignores(header.kind, space) for space in [one.space for one in about] or [""]):
            return False
        things = ", ".join(f"{one.space} {one.address}" for one in about)
        words = f"{header.kind.replace('-', ' ')} {things}".rstrip()
        self._in_vain[placement.tx] = _InVain(no, frame, words, readings)
        return True

    def subject_at(self, station: int | None) -> Subject | None:
        """The device there; None where none has a profile."""
        profile = self._devices.at(station)
        return None if profile is None else _subject(profile, station)

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far, in the order of first sight."""
        return self._remarks.findings(self._answers)

    # --- the rules ---

    def _judge_length(self, no: int, frame: Frame, placement: Placement) -> None:
        station = placement.source if placement.role is Role.RESPONSE else placement.destination
        profile = self._devices.at(station)
        longest = profile.limits_on(self._family).frame if profile is not None else None
        if profile is not None and longest is not None and len(frame.octets) > longest:
            way = "from" if placement.role is Role.RESPONSE else "to"
            seen = f"frames of {len(frame.octets)} octets {way} it, {longest} allowed"
            self._remarks.tell(Remark("PR006", _subject(profile, station), way, seen), frame.end, no)

    def _judge_number(self, no: int, frame: Frame, station: int | None) -> None:
        profile = self._devices.at(station)
        known = profile.limits_on(self._family).stations if profile is not None else None
        if profile is None or known is None or station is None or known[0] <= station <= known[1]:
            return
        seen = f"it answered as {station}; its manual has {known[0]} … {known[1]}"
        self._remarks.tell(Remark("PR012", _subject(profile, station), f"{station}", seen), frame.end, no)

    def _judge_function(self, no: int, frame: Frame, station: int | None, code: int) -> None:
        profile = self._devices.at(station)
        known = profile.limits_on(self._family).functions if profile is not None else None
        if profile is not None and known is not None and code not in known:
            listed = " ".join(f"{one:02X}" for one in sorted(known))
            seen = f"asked with function {code:02X} (hex); its manual lists {listed}"
            self._remarks.tell(Remark("PR009", _subject(profile, station), f"{code}", seen), frame.end, no)

    def _judge_writes(
        self, no: int, frame: Frame, station: int | None, readings: tuple[Reading, ...], kind: str
    ) -> None:
        profile = self._devices.at(station)
        if profile is None:
            return
        who = _subject(profile, station)
        before: Entry | None = None
        for reading in readings:
            entry = None if reading.part else profile.at(reading.space, reading.address)
            if entry is not None and entry is before:
                continue  # the next word of a number that is judged already
            before = entry
            if profile.is_reserved(reading.space, reading.address):
                place = profile.number_of(reading.space, reading.address)
                if profile.forbids(reading.space, reading.address, reading.raw):
                    seen = f"{reading.value} written to reserved {place}"
                    self._remarks.tell(Remark("PR002", who, place, seen, place), frame.end, no)
            elif not reading.part and f"{kind}:{reading.space}" in profile.limits_on(self._family).read_only:
                place = f"{reading.space} {reading.address}"
                self._remarks.tell(
                    Remark("PR003", who, place, f"{place} written by {kind}, which does not change it"), frame.end, no
                )
            elif f"{reading.space}:{reading.part}" in profile.limits_on(self._family).read_only:
                place = f"{reading.space} {reading.address} {reading.part}"
                self._remarks.tell(Remark("PR003", who, place, f"{place} {_READ_ONLY}", place), frame.end, no)
            elif entry is not None and not entry.access.writable:
                thing = f"{entry.title} ({entry.number})"
                self._remarks.tell(Remark("PR003", who, entry.name, f"{thing} {_READ_ONLY}", thing), frame.end, no)
            elif entry is not None and (bits := _reserved_bits(entry, reading)):
                words = " ".join(f"{bit:X}" for bit in bits)
                seen = f"{entry.title} ({entry.number}) written with reserved bits {words} set"
                self._remarks.tell(Remark("PR008", who, f"{entry.name} {words}", seen), frame.end, no)
            elif (
                entry is not None
                and entry.access is Access.STOPPED
                and (state := self._remarks.state_at(station, frame.end))
            ):
                seen = f"{entry.title} ({entry.number}) written while its state was {state}; it is taken while stopped"
                self._remarks.tell(Remark("PR013", who, entry.name, seen), frame.end, no)
            if entry is not None and entry.role is EntryRole.COMMAND:
                self._remarks.forget_state(station)
        for value in decode(profile, readings):
            self._judge_range(value, who, frame.end, no)

    def _note_state(self, entry: Entry, raw: int, sample: Sample) -> None:
        states = _running_states(entry, raw)
        if sample.device is None or not states:
            return
        self._remarks.note_state(sample.device, sample.time, next(filter(None, states), ""))

    def _judge_value(self, sample: Sample) -> None:
        profile = self._devices.at(sample.device)
        value = sample.value
        if profile is None:
            return
        who = _subject(profile, sample.device)
        self._judge_identity(profile, value.reading, who, sample)
        self._judge_range(value, who, sample.time, sample.frame)
        entry = value.entry
        if value.reading.part:
            self._judge_property(profile, value.reading, who, sample)
        if entry is None or value.bit or value.raw is None:
            return
        if entry.role in CODES:
            for words in _troubles(entry, value):
                self._add_trouble(CODES[entry.role], who, f"{entry.name} {words}", f"{entry.title}: {words}", sample)
        else:
            self._note_state(entry, value.raw, sample)
            for code, words in _told_by_bits(entry, value.raw):
                self._add_trouble(code, who, OF_STATUS, f"{entry.title}: {words}", sample)

    def _judge_identity(self, profile: Profile, reading: Reading, who: Subject, sample: Sample) -> None:
        sign = next((sign for sign in profile.signs if sign.is_of(reading) and sign.value is not None), None)
        if sign is None or sign.value is None or sign.fits(reading) is not False:
            return
        place = sign.title or reading.part or profile.number_of(reading.space, reading.address)
        shown, due = (f"{one:04X}h" if isinstance(one, int) else number(one) for one in (reading.value, sign.value))
        seen = f"{place} is {shown}, {profile.title} has {due}"
        self._remarks.tell(Remark("PR011", who, place, seen), sample.time, sample.frame)

    def _judge_property(self, profile: Profile, reading: Reading, who: Subject, sample: Sample) -> None:
        entry = profile.at(reading.space, reading.address)
        due = due_property(entry, reading) if entry is not None else None
        if entry is not None and due is not None:
            place = f"{entry.number} {reading.part}"
            shown = reading.words or number(reading.value)
            remark = Remark("PR011", who, place, f"{place} is {shown}, the manual has {due}")
            self._remarks.tell(remark, sample.time, sample.frame)

    def _add_trouble(self, code: str, who: Subject, which: str, seen: str, sample: Sample) -> None:
        remark = Remark(code, who, which, seen, sure=sample.value.reading.sure)
        self._remarks.tell(remark, sample.time, sample.frame)

    def _judge_range(self, value: Value, who: Subject, time: int, no: int) -> None:
        entry = value.entry
        if entry is None or value.bit or entry.doubt or not value.reading.sure or in_range(entry, value.value):
            return
        is_written = value.how is Origin.WRITE
        what = "written" if is_written else "answered"
        seen = f"{entry.title} {number(value.value, entry, value.unit)} {what}, range {range_words(entry)}"
        remark = Remark("PR001", who, f"{entry.name} {what}", seen, is_written=is_written)
        self._remarks.tell(remark, time, no)

    def _count_answer(self, who: Subject) -> None:
        self._answers[who] = self._answers.get(who, 0) + 1

    def _judge_time(self, transaction: Transaction) -> None:
        profile = self._devices.at(transaction.station)
        latency = transaction.latency
        if profile is None or latency is None or transaction.response is None:
            return
        who = _subject(profile, transaction.station)
        self._count_answer(who)
        limit = profile.limits_on(self._family).response
        if limit is not None and latency.low > limit:
            seen = f"took over {milliseconds(limit)}"
            remark = Remark("PR007", who, "", seen)
            self._remarks.tell(remark, transaction.end, transaction.response, latency.low)


def _reserved_bits(entry: Entry, reading: Reading) -> tuple[int, ...]:
    """The reserved bits that a write sets, as the whole value counts them."""
    return () if reading.raw is None else entry.reserved_in(entry.held(reading.raw, reading.address))


def _troubles(entry: Entry, value: Value) -> Iterator[str]:
    """What a fault or alarm register reports; nothing when all is well."""
    raw = value.raw or 0
    if entry.bits:
        yield from (bit.on for bit in entry.bits if raw >> bit.number & 1)
    elif value.value and (code := _whole(value.value)) is not None and in_range(entry, code):
        words = state_words(entry, code) or bit_words(entry, raw)
        unknown = "reserved in the manual" if code in entry.reserved_codes else "not in the manual"
        yield words if entry.high == 1 else f"code {code}, {words or unknown}"


def _whole(value: float | str) -> int | None:
    """A number as the code that it may be; what is no whole number is none."""
    if isinstance(value, int):
        return value
    return int(value) if isinstance(value, float) and value.is_integer() else None


def _running_states(entry: Entry, raw: int) -> list[str]:
    """Of each bit and number in several bits that tells whether the device runs: how it does, empty where it stands."""
    bits = [bit.on if raw >> bit.number & 1 else "" for bit in entry.bits if bit.role is EntryRole.RUNNING]
    parts = [part for part in entry.parts if EntryRole.RUNNING in part.roles.values()]
    held = [(part, part.of(raw)) for part in parts]
    return bits + [part.states.get(at, f"{at}") if part.roles.get(at) is EntryRole.RUNNING else "" for part, at in held]


def _told_by_bits(entry: Entry, raw: int) -> Iterator[tuple[str, str]]:
    """Rule and words of each bit, and of each number in several bits, that stands for a fault or a warning."""
    for bit in entry.bits:
        if bit.role in CODES and raw >> bit.number & 1:
            yield CODES[bit.role], bit.on
    for part in entry.parts:
        held = part.of(raw)
        role = part.roles.get(held, EntryRole.VALUE)
        if role in CODES:
            yield CODES[role], f"{part.name} {part.states.get(held, held)}"


def _subject(profile: Profile, address: int | None) -> Subject:
    if address is None:
        return Subject(About.OTHER, name=f"{ALL} {profile.noun}s")
    return station(address, profile.noun)
