"""A simulated F510 follower and a simulated N2 master: pure stations of a virtual bus (dissectors/simulated.py).

Life cycle of the follower: after power-up or warm reset it answers everything but `identify` with N00; after
`identify` the first polls report all points, later ones what changed. Error codes and commands follow the TECO F510
manual 1.2.2 and 1.2.4. Two things no public source describes, so that here they are this simulation's own: the layout
of a report (region, object, status, value) and the status octet (bit 6 the state of a binary object).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from dissectors.frame import Check
from dissectors.line import MS, LineSettings
from dissectors.n2.commands import VENDOR_DEVICE, Command, fields_of, parse_command
from dissectors.n2.envelope import make_answer, make_command
from dissectors.n2.f510 import POINTS, F510Point
from dissectors.n2.framing import MAX_LENGTH, judge
from dissectors.n2.objects import ATTRIBUTES, REGIONS, Encoding, decode, encode, holds_current_value
from dissectors.simulated import Send

REPORT_MAX = 200
"""Most characters of a change report (Danfoss MG.11.G1); the rest waits for the next poll."""

_STATE = 0x40
_NAMELESS = frozenset(("poll", "poll-acknowledge", "warm-reset", "identify"))


def command(address: int, body: str) -> bytes:
    """A command frame: `body` begins with the command character."""
    return make_command(f"{address:02X}{body}")


def refusal(code: str) -> bytes:
    """A negative acknowledgement; `code`: two characters."""
    return b"N%s\r" % code.encode("ascii")


@dataclass(slots=True)
class _Object:
    """A point and what the follower holds of it."""

    point: F510Point
    value: float
    configuration: int = 0x01
    reported: float | None = None
    times: tuple[int, int, int] = (0, 0, 0)  # of a binary output: minimum on, minimum off, cycles an hour


class Follower:
    """An F510 on N2.

    `address` 1 … 255. `delay`: ns from the end of a command to its answer. `status_in_front`: whether the current
    value is preceded by the object status octet (as digimat.n2 expects).
    """

    def __init__(
        self,
        address: int,
        *,
        points: Iterable[F510Point] = POINTS,
        delay: int = 10 * MS,
        status_in_front: bool = True,
    ) -> None:
        self.address = address
        self.delay = delay
        self.silent = False
        self._status_in_front = status_in_front
        self._identified = False
        self._report: list[_Object] = []
        self._objects = {(p.region, p.number): _Object(p, p.initial) for p in points}
        if (1, 5) in self._objects:
            self.set(1, 5, address)

    def value(self, region: int, number: int) -> float:
        """What the follower holds, as a read would give it. Raises KeyError for a point it has not."""
        held = self._objects[region, number]
        if REGIONS[region].value is Encoding.FLOAT:
            sent = decode(encode(held.value, Encoding.FLOAT), Encoding.FLOAT)
            return float(sent) if sent is not None else held.value
        return self._status(held)

    def set(self, region: int, number: int, value: float) -> None:
        """Let the process change a point."""
        self._objects[region, number].value = value

    def reset(self) -> None:
        """Lose everything that power-up loses: it waits for identify again."""
        self._identified = False
        self._report = []
        for held in self._objects.values():
            held.reported = None

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """Answer a command for this address."""
        reply = None if self.silent else self._reply(octets)
        return () if reply is None else (Send(now + self.delay, reply),)

    def wake(self, now: int) -> tuple[Send, ...]:
        """Never speaks unasked."""
        return ()

    def next_wake(self) -> int | None:
        """Waits for traffic only."""
        return None

    def _reply(self, octets: bytes) -> bytes | None:
        begin = octets.rfind(b">")
        octets = octets[begin:] if begin >= 0 else b""
        asked = parse_command(octets)
        if not octets.endswith(b"\r") or asked.address != self.address:
            return None
        if len(octets) > MAX_LENGTH:
            return refusal("03")
        check, damage = judge(octets)
        if check is Check.ABSENT:
            return refusal("05")
        if damage is not None:
            return refusal("02")
        if asked.type.kind in _NAMELESS and asked.data:
            return refusal("05")
        if asked.type.kind == "identify":
            self._identified = True
            return make_answer(f"{VENDOR_DEVICE:02X}")
        return self._obey(asked) if self._identified else refusal("00")

    def _obey(self, asked: Command) -> bytes:
        kind = asked.type.kind
        if kind in ("poll", "poll-acknowledge"):
            return self._poll(acknowledged=kind == "poll-acknowledge")
        if kind == "read-attribute":
            return self._read(asked)
        if kind == "write-attribute":
            return self._write(asked)
        if kind == "override":
            return self._override(asked)
        if kind == "warm-reset":
            self.reset()
            return make_answer()
        if kind in ("synchronise-time", "release-override"):  # answered without action
            return make_answer()
        return refusal("01")

    def _held(self, asked: Command) -> _Object | None:
        return self._objects.get((asked.region or 0, -1 if asked.object is None else asked.object))

    def _read(self, asked: Command) -> bytes:
        held, region = self._held(asked), asked.region or 0
        if asked.attribute is None or asked.data:
            return refusal("05")
        if held is None:
            return refusal("11")
        if asked.attribute == 1:
            return make_answer(encode(held.configuration, Encoding.BYTE))
        if asked.attribute == 2:
            return make_answer(encode(self._status(held), Encoding.BYTE))
        if holds_current_value(region, asked.attribute):
            front = encode(self._status(held), Encoding.BYTE) if self._status_in_front else ""
            return make_answer(front + encode(held.value, Encoding.FLOAT))
        if region == 4 and 3 <= asked.attribute <= 5:
            return make_answer(encode(held.times[asked.attribute - 3], Encoding.INTEGER))
        return refusal("11")

    def _write(self, asked: Command) -> bytes:
        held = self._held(asked)
        if asked.attribute is None:
            return refusal("05")
        if held is None or (asked.region or 0, asked.attribute) not in ATTRIBUTES:
            return refusal("11")
        if asked.attribute == 1:
            value = decode(asked.data, Encoding.BYTE)
            if value is None:
                return refusal("05")
            held.configuration = int(value)
            return make_answer()
        if asked.region == 4 and 3 <= asked.attribute <= 5:
            value = decode(asked.data, Encoding.INTEGER)
            if value is None:
                return refusal("05")
            times = list(held.times)
            times[asked.attribute - 3] = int(value)
            held.times = (times[0], times[1], times[2])
            return make_answer()
        return refusal("12" if asked.attribute <= 3 else "11")

    def _override(self, asked: Command) -> bytes:
        held = self._held(asked)
        if asked.region in (1, 2):  # answered without action
            return make_answer()
        if held is None:
            return refusal("11")
        value = asked.value
        if value is None:
            return refusal("05")
        if not held.point.writable:
            return refusal("12")
        if not held.point.low <= value <= held.point.high:
            return refusal("10")
        held.value = value
        self._run()
        return make_answer()

    def _run(self) -> None:
        """Let the drive follow its commands: run, direction and frequency."""
        objects = self._objects
        if not {(3, 1), (4, 1), (4, 2), (1, 9), (1, 10), (1, 11), (2, 1), (2, 2)} <= objects.keys():
            return
        running = bool(objects[4, 1].value)
        self.set(1, 9, objects[3, 1].value)
        self.set(1, 10, objects[3, 1].value if running else 0.0)
        self.set(1, 11, round(objects[1, 10].value * 0.15, 1))
        self.set(2, 1, running)
        self.set(2, 2, objects[4, 2].value)

    def _status(self, held: _Object) -> int:
        return _STATE if held.point.region in (2, 4) and held.value else 0

    def _poll(self, *, acknowledged: bool) -> bytes:
        """The next report: what the last one had, unless that is acknowledged, then what changed since."""
        if acknowledged:
            for held in self._report:
                held.reported = held.value
            self._report = []
        if not self._report:
            room = REPORT_MAX
            for held in self._objects.values():
                if held.value != held.reported and len(self._record(held)) <= room:
                    room -= len(self._record(held))
                    self._report.append(held)
        return make_answer("".join(map(self._record, self._report)))

    def _record(self, held: _Object) -> str:
        point = held.point
        value = encode(held.value, Encoding.FLOAT) if point.region in (1, 3) else ""
        return f"{point.region:X}{point.number:02X}{self._status(held):02X}{value}"


@dataclass(frozen=True, slots=True)
class Job:
    """Something that the master asks once or in turn."""

    address: int
    octets: bytes


def reading(address: int, region: int, number: int, attribute: int | None = None) -> Job:
    """Read an attribute, the current value unless named."""
    attribute = REGIONS[region].current if attribute is None else attribute
    return Job(address, command(address, f"1{region:X}{number:02X}{attribute:02X}"))


def overriding(address: int, region: int, number: int, value: float) -> Job:
    """Override a point."""
    return Job(address, command(address, f"72{region:02X}{number:02X}{encode(value, REGIONS[region].value)}"))


def releasing(address: int, region: int, number: int) -> Job:
    """Release an override."""
    return Job(address, command(address, f"73{region:02X}{number:02X}"))


def readings(address: int, points: Sequence[F510Point] = POINTS) -> tuple[Job, ...]:
    """Read the current values of points."""
    return tuple(reading(address, p.region, p.number) for p in points)


class Master:
    """An N2 master: identifies each station, then in turn polls it and asks one of its jobs.

    `jobs`: asked round and round, a poll of their station before each. `delay`: ns from an answer to the next
    command (NAE default 100 ms). `timeout`: ns that it waits (250 ms). `retries`: after which it goes on (3).
    """

    def __init__(
        self,
        jobs: Sequence[Job],
        *,
        line: LineSettings | None = None,
        delay: int = 100 * MS,
        timeout: int = 250 * MS,
        retries: int = 3,
        start: int = 0,
    ) -> None:
        self._char = (line or LineSettings()).char
        self._delay = delay
        self._timeout = timeout
        self._retries = retries
        self._jobs = deque(jobs)
        self._once: deque[Job] = deque()
        self._polled: dict[int, bool] = {}  # address → whether its last report waits for an acknowledgement
        self._asked: Job | None = None
        self._tries = 0
        self._due: int | None = start
        self._poll_next = True

    def ask(self, *jobs: Job) -> None:
        """Ask these once, before the next of those asked in turn."""
        self._once.extend(jobs)

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """Take an answer; the next command goes out after the delay."""
        asked = self._asked
        if asked is None or octets[:1] not in (b"A", b"N") or not octets.endswith(b"\r"):
            return ()
        _, damage = judge(octets)
        if damage is not None:
            return ()  # the timeout will repeat the command
        kind = parse_command(asked.octets).type.kind
        if octets[:1] == b"N":
            if octets == refusal("00"):
                self._polled.pop(asked.address, None)
        elif kind == "identify":
            self._polled[asked.address] = False
        elif kind in ("poll", "poll-acknowledge"):
            self._polled[asked.address] = bool(fields_of(octets))
        self._asked, self._due = None, now + self._delay
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        """Send what is due: a repeat, or the next command."""
        if self._due is None or now < self._due:
            return ()
        if self._asked is None or self._tries > self._retries:
            self._asked, self._tries = self._choose(), 0
        if self._asked is None:
            self._due = None
            return ()
        self._tries += 1
        octets = self._asked.octets
        self._due = now + len(octets) * self._char + self._timeout
        return (Send(now, octets),)

    def next_wake(self) -> int | None:
        """When the next command is due, ns."""
        if self._due is None and (self._once or self._jobs):
            return 0
        return self._due

    def _choose(self) -> Job | None:
        queue = self._once or self._jobs
        if not queue:
            return None
        address = queue[0].address
        if address not in self._polled:
            if queue is self._jobs:
                self._jobs.rotate(-1)  # a silent station must not hold up the others
            return Job(address, command(address, "F"))
        if self._poll_next:
            self._poll_next = False
            return Job(address, command(address, "05" if self._polled[address] else "04"))
        self._poll_next = True
        if queue is self._once:
            return self._once.popleft()
        self._jobs.rotate(-1)
        return self._jobs[-1]
