"""The frozen values that everything speaks: Chunk in; Frame, Noise and Header out.

Times are integer nanoseconds on one clock; the origin is the capture's (normally the Unix epoch). A read's time
bounds its *last* octet from above: an adapter may have held the octets back (`Timing.latency`), never the reverse.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, Flag, auto

from dissectors.quick_values import quickly_made


class LineError(Flag):
    """What a UART reported about one octet.

    A driver that cannot tell parity from framing (Linux PARMRK) sets both bits, which reads "parity or framing".
    """

    PARITY = auto()
    FRAMING = auto()
    BREAK = auto()
    OVERRUN = auto()  # octets were lost just before this one


@dataclass(frozen=True, slots=True)
class Mark:
    """A line error at one octet: `offset` counts from the first octet of what carries the mark."""

    offset: int
    error: LineError


@quickly_made
@dataclass(frozen=True, slots=True)
class Chunk:
    """What one read returned: the only evidence; everything else is computed from it.

    `time`: ns, when the read returned; its last octet had ended by then.
    `octets`: as they came, never empty in a recording (an empty chunk only says that time passed).
    `marks`: line errors, ascending by offset.
    """

    time: int
    octets: bytes
    marks: tuple[Mark, ...] = ()


class Check(Enum):
    """The verdict of a frame's own check (CRC, LRC, sum)."""

    GOOD = "good"
    BAD = "bad"
    ABSENT = "absent"  # the frame type has none, or the frame ended before it


class FoundBy(Enum):
    """How a frame's limits were found."""

    GAP = "gap"  # silence proved at both ends
    DELIMITER = "delimiter"  # start and end characters
    LENGTH = "length"  # predicted length and check, not both gaps proved
    SPLIT = "split"  # cut out of a run of octets that held several frames or noise
    JOINED = "joined"  # put together over a silence that should not have been inside it


class Damage(Enum):
    """Why a frame is not good."""

    CHECK = "check"  # right length, wrong CRC/LRC/sum
    SHORT = "short"  # ended before its predicted length
    LONG = "long"  # more octets than its length allows before the silence
    HEADER = "header"  # header check wrong (MS/TP)
    FORM = "form"  # characters or structure that the framing does not allow
    TIMEOUT = "timeout"  # silence inside the frame longer than the framing allows
    RESTARTED = "restarted"  # a new start delimiter before the end


class Flaw(Enum):
    """What is wrong with a damaged frame whose check agrees once that one thing is put right."""

    FIRST_MISSING = "first octet missing"
    FIRST_SPOILT = "first octet spoilt"
    FIRST_TWO_MISSING = "first two octets missing"
    FIRST_TWO_SPOILT = "first two octets spoilt"
    LAST_MISSING = "last octet missing"
    LAST_TWO_MISSING = "last two octets missing"
    LAST_SPOILT = "last octet spoilt"
    CHECK_SWAPPED = "check octets swapped"
    ONE_SPOILT = "one octet spoilt"
    ONE_MISSING = "one octet missing"


@dataclass(frozen=True, slots=True)
class Repair:
    """What a damaged frame was, if only `flaw` happened to it: `octets` is the whole frame with a good check.

    Given only where the check of what is put together agrees, or, where check octets themselves are missing, where all
    that is left of it does. What the octets say may be shown, marked as repaired; the frame stays damaged.
    """

    flaw: Flaw
    octets: bytes


@dataclass(frozen=True, slots=True)
class Assembly:
    """A message that came in several frames, of which this frame brought the last part.

    `octets`: the whole message as if it had come in one piece, in the form of its protocol; b"" while parts are
    missing. `frames`: numbers of the frames that brought its parts, in the order of the parts. `missing`: places, from
    0, of parts that were not seen (the first of them, where there are many).
    """

    octets: bytes
    frames: tuple[int, ...] = ()
    missing: tuple[int, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether every part was seen."""
        return not self.missing


@quickly_made
@dataclass(frozen=True, slots=True)
class Frame:
    """One frame as it was on the wire, good or damaged; `octets` include delimiters and check.

    `start`, `end`: ns, latest possible begin of its first octet and end of its last octet.
    `slack`: ns by which `end` may in truth be earlier (0 … `Timing.latency`, more where the computer read late).
    `expected`: total octets predicted from its first octets, None where nothing predicts it.
    `skipped`: octets of noise directly before it since the frame before.
    `flags`: protocol-specific oddities in words ("lower-case", "trailing-pad"), ascending.
    `repair`: of a damaged frame, what it was if one thing at one of its ends went wrong.
    `assembly`: of the frame that brings the last part of a longer message, that message: what the tracker knows of the
    frames before it (`Tracked.assembly`); no framer sets it.
    """

    protocol: str
    octets: bytes
    start: int
    end: int
    check: Check
    found: FoundBy
    damage: Damage | None = None
    expected: int | None = None
    skipped: int = 0
    slack: int = 0
    marks: tuple[Mark, ...] = ()
    flags: tuple[str, ...] = ()
    repair: Repair | None = None
    assembly: Assembly | None = None

    @property
    def ok(self) -> bool:
        """Whether nothing is damaged and the check is good, where this kind of frame has one (N2's `A` has none)."""
        return self.damage is None and self.check is not Check.BAD


class Place(Enum):
    """Where noise lay: its place tells the cause (bias, late or early driver release, collision)."""

    BEFORE = "before"  # directly before a frame
    BETWEEN = "between"  # silence on both sides, or unknown
    AFTER = "after"  # directly after a frame


class Reason(Enum):
    """Why octets are no frame."""

    NO_FRAME = "no frame begins here"
    ZEROS = "zeros after a complete frame"
    NO_DELIMITER = "outside start and end characters"
    FALSE_START = "start characters without a header"
    PAD = "filler between frames"
    BREAK = "break"


@quickly_made
@dataclass(frozen=True, slots=True)
class Noise:
    """Octets that are no frame; every octet of a capture is in exactly one Frame or Noise."""

    octets: bytes
    start: int
    end: int
    place: Place
    reason: Reason
    marks: tuple[Mark, ...] = ()


Event = Frame | Noise
"""What a framer gives."""


class Role(Enum):
    """What a frame is in its exchange. `peek` says EITHER where the octets alone cannot tell; the tracker decides."""

    REQUEST = "request"
    RESPONSE = "response"
    EITHER = "either"
    BROADCAST = "broadcast"
    TOKEN = "token"
    POLL = "poll"
    DATA = "data"  # unconfirmed data, nobody answers
    UNKNOWN = "unknown"


@quickly_made
@dataclass(frozen=True, slots=True)
class Header:
    """What one quick look (`peek`) finds in a frame. None where the frame has no such thing or ended before it.

    `source`, `destination`: station addresses on this bus. `kind`: a stable lower-case name with hyphens
    ("read-holding-registers"). `function`: function code, frame type or service number. `address`, `count`: the
    first register, object instance … named and how many. `error`: an exception, reject or abort in words (the frame
    itself may be good), or why the frame is damaged.
    """

    protocol: str
    source: int | None
    destination: int | None
    role: Role
    kind: str
    function: int | None = None
    address: int | None = None
    count: int | None = None
    ok: bool = True
    error: str | None = None
