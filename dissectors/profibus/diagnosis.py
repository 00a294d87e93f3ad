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

from dissectors.profibus.dpv1 import device_block

STANDARD = 6
NO_MASTER = 255

NOT_READY, CONFIGURATION_FAULT, EXTENDED, NOT_SUPPORTED = 0x02, 0x04, 0x08, 0x10
PARAMETER_FAULT, LOCKED = 0x40, 0x80
PARAMETERS_WANTED, STATIC, WATCHDOG, FREEZE, SYNC = 0x01, 0x02, 0x08, 0x10, 0x20
OVERFLOW = 0x80

FIRST = (
    (0x01, "station does not exist"),
    (NOT_READY, "not ready"),
    (CONFIGURATION_FAULT, "configuration fault"),
    (EXTENDED, "extended diagnosis"),
    (NOT_SUPPORTED, "not supported"),
    (0x20, "invalid response"),
    (PARAMETER_FAULT, "parameter fault"),
    (LOCKED, "locked by another master"),
)
SECOND = (
    (PARAMETERS_WANTED, "wants parameters"),
    (STATIC, "static diagnosis: no valid data"),
    (WATCHDOG, "watchdog on"),
    (FREEZE, "freeze"),
    (SYNC, "sync"),
    (0x80, "deactivated"),
)
DIAGNOSIS_BITS = {
    "not_existent": (0, 0x01, "station does not exist; the master sets it"),
    "not_ready": (0, NOT_READY, "slave is not ready for data"),
    "cfg_fault": (0, CONFIGURATION_FAULT, "configuration is not the slave's"),
    "ext_diag": (0, EXTENDED, "there is extended diagnosis that tells of a fault"),
    "not_supported": (0, NOT_SUPPORTED, "a function is not supported"),
    "invalid_response": (0, 0x20, "answer was not plausible; the master sets it"),
    "prm_fault": (0, PARAMETER_FAULT, "parameters are not the slave's"),
    "master_lock": (0, LOCKED, "another master has parameterised the slave"),
    "prm_req": (1, PARAMETERS_WANTED, "slave wants parameters"),
    "stat_diag": (1, STATIC, "slave has no valid data; ask until this is gone"),
    "wd_on": (1, WATCHDOG, "watchdog is on"),
    "freeze": (1, FREEZE, "inputs are frozen"),
    "sync": (1, SYNC, "outputs are held"),
    "deactivated": (1, 0x80, "slave is taken out; the master sets it"),
    "overflow": (2, OVERFLOW, "more diagnosis than fits"),
}
"""The bits of the status octets by name: octet, bit, meaning."""

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
        words = [word for bit, word in FIRST if self.first & bit] + [word for bit, word in SECOND if self.second & bit]
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


@dataclass(frozen=True, slots=True)
class DiagnosisBlock:
    """A block of extended diagnosis: octets [begin, end) of those behind the standard ones, and what they say.

    `module`, `channel`, `error`: of a channel's. `is_cut`: it is longer than what is there.
    """

    begin: int
    end: int
    title: str
    words: str
    module: int | None = None
    channel: int | None = None
    error: str | None = None
    is_cut: bool = False


def blocks(octets: bytes) -> tuple[str, ...]:
    """Blocks of extended diagnosis in words; total."""
    return tuple(block.words for block in parse_blocks(octets))


def parse_blocks(octets: bytes) -> tuple[DiagnosisBlock, ...]:
    """Blocks of extended diagnosis; total."""
    found: list[DiagnosisBlock] = []
    at = 0
    while at < len(octets):
        header = octets[at]
        kind, low = header >> 6, header & 0x3F
        size = 3 if kind == 2 else 1 if kind == 3 else max(low, 1)
        end = min(at + size, len(octets))
        found.append(_block(kind, low, octets[at:end], at, at + size > len(octets)))
        at = end
    return tuple(found)


def _block(kind: int, low: int, octets: bytes, at: int, is_cut: bool) -> DiagnosisBlock:
    end, cut = at + len(octets), " (cut off)" if is_cut else ""
    if kind == 2:
        return _channel(octets, at)
    if kind == 3:
        return DiagnosisBlock(at, end, "revision", f"revision {low}")
    title, words = ("modules", _modules(octets[1:])) if kind else ("device", _device(octets[1:]))
    return DiagnosisBlock(at, end, title, words + cut, is_cut=is_cut)


def _device(content: bytes) -> str:
    if not content:
        return "device: nothing"
    perhaps = device_block(content)
    return f"device: {content.hex(' ')}" + (f" (if of DP-V1: {perhaps})" if perhaps is not None else "")


def _modules(content: bytes) -> str:
    faulty = [str(8 * at + bit) for at, octet in enumerate(content) for bit in range(8) if octet >> bit & 1]
    return f"modules with a diagnosis: {', '.join(faulty)}" if faulty else "no module with a diagnosis"


def _channel(block: bytes, at: int) -> DiagnosisBlock:
    if len(block) < 3:
        return DiagnosisBlock(at, at + len(block), "channel", f"channel: cut off ({block.hex(' ')})", is_cut=True)
    direction, channel = _DIRECTIONS[block[1] >> 6], block[1] & 0x3F
    code = block[2] & 0x1F
    error = _ERRORS.get(code, f"error {code}" if code < 16 else f"maker's error {code}")
    words = f"module {block[0] & 0x3F}, {direction}channel {channel} ({_CHANNEL_TYPES[block[2] >> 5]}): {error}"
    return DiagnosisBlock(at, at + 3, "channel", words, block[0] & 0x3F, channel, error)
