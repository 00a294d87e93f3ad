"""The answer to Slave_Diag: six standard octets, then blocks of device, module and channel diagnosis.

    octet 0  station status 1     1  station status 2     2  station status 3     3  master     4 5  ident, high first
    then blocks, each with a header: 00nnnnnn device, n octets with the header
                                     01nnnnnn modules, a bit each
                                     10mmmmmm one channel of module m: channel, error type
                                     11rrrrrr revision number

The first octets come from IEC 61158-6-3, Slave_Diag, and agree with pyprofibus; what device blocks mean only the
maker's GSD tells.
"""

from __future__ import annotations

from dataclasses import dataclass

STANDARD = 6
NO_MASTER = 255

NOT_READY, CONFIGURATION_FAULT, EXTENDED, NOT_SUPPORTED = 0x02, 0x04, 0x08, 0x10
PARAMETER_FAULT, LOCKED = 0x40, 0x80
PARAMETERS_WANTED, STATIC, WATCHDOG, FREEZE, SYNC = 0x01, 0x02, 0x08, 0x10, 0x20
OVERFLOW = 0x80

_FIRST = (
    (0x01, "station does not exist"),
    (NOT_READY, "not ready"),
    (CONFIGURATION_FAULT, "configuration fault"),
    (EXTENDED, "extended diagnosis"),
    (NOT_SUPPORTED, "not supported"),
    (0x20, "invalid response"),
    (PARAMETER_FAULT, "parameter fault"),
    (LOCKED, "locked by another master"),
)
_SECOND = (
    (PARAMETERS_WANTED, "wants parameters"),
    (STATIC, "static diagnosis: no valid data"),
    (WATCHDOG, "watchdog on"),
    (FREEZE, "freeze"),
    (SYNC, "sync"),
    (0x80, "deactivated"),
)
_CHANNEL_TYPES = ("?", "bit", "2 bits", "4 bits", "octet", "word", "2 words", "?")
_ERRORS = {
    1: "short circuit",
    2: "undervoltage",
    3: "overvoltage",
    4: "overload",
    5: "overtemperature",
    6: "line break",
    7: "upper limit exceeded",
    8: "lower limit exceeded",
    9: "error",
}
_DIRECTIONS = ("", "input ", "output ", "input and output ")


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """A diagnosis. `master`: who has parameterised the slave, NO_MASTER for nobody. `ident`: its ident number.
    `extended`: the octets after the standard ones."""

    first: int
    second: int
    third: int
    master: int
    ident: int
    extended: bytes = b""

    @property
    def is_ready(self) -> bool:
        """Whether the slave may exchange data."""
        return not self.first & (NOT_READY | CONFIGURATION_FAULT | PARAMETER_FAULT | 0x01) and not (
            self.second & PARAMETERS_WANTED
        )

    @property
    def wants_parameters(self) -> bool:
        """Whether it must be parameterised anew."""
        return bool(self.second & PARAMETERS_WANTED)

    @property
    def status_words(self) -> tuple[str, ...]:
        """The bits of the status octets that are set, in words."""
        words = [word for bit, word in _FIRST if self.first & bit] + [
            word for bit, word in _SECOND if self.second & bit
        ]
        return (*words, "diagnosis overflow") if self.third & OVERFLOW else tuple(words)

    @property
    def block_words(self) -> tuple[str, ...]:
        """The blocks behind the standard octets, in words."""
        return blocks(self.extended)


def parse_diagnosis(data: bytes) -> Diagnosis | None:
    """The diagnosis in the data of an answer; None where it is too short."""
    if len(data) < STANDARD:
        return None
    return Diagnosis(data[0], data[1], data[2], data[3], data[4] << 8 | data[5], data[STANDARD:])


def blocks(octets: bytes) -> tuple[str, ...]:
    """Blocks of extended diagnosis in words; total."""
    words, at = [], 0
    while at < len(octets):
        header = octets[at]
        kind, low = header >> 6, header & 0x3F
        if kind == 2:
            words.append(_channel(octets[at : at + 3]))
            at += 3
        elif kind == 3:
            words.append(f"revision {low}")
            at += 1
        else:
            content = octets[at + 1 : at + max(low, 1)]
            words.append(_device(content) if not kind else _modules(content))
            at += max(low, 1)
    return tuple(words)


def _device(content: bytes) -> str:
    return f"device: {content.hex(' ')}" if content else "device: nothing"


def _modules(content: bytes) -> str:
    faulty = [str(8 * at + bit) for at, octet in enumerate(content) for bit in range(8) if octet >> bit & 1]
    return f"modules with a diagnosis: {', '.join(faulty)}" if faulty else "no module with a diagnosis"


def _channel(block: bytes) -> str:
    if len(block) < 3:
        return f"channel: cut off ({block.hex(' ')})"
    direction, channel = _DIRECTIONS[block[1] >> 6], block[1] & 0x3F
    code = block[2] & 0x1F
    error = _ERRORS.get(code, f"error {code}" if code < 16 else f"maker's error {code}")
    return f"module {block[0] & 0x3F}, {direction}channel {channel} ({_CHANNEL_TYPES[block[2] >> 5]}): {error}"
