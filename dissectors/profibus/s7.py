"""Programs of S7 controllers on the same line: PPI (S7-200) and MPI carry them in FDL telegrams (from general knowledge
of the protocol; no specification of it is public).

    32 kind 00 00 reference(2) parameters(2) data(2)  [error class and code, of answers]  parameters…  data…

`kind` 1 is a request, 2 and 3 its answer, 7 what concerns the system. On PPI the request is acknowledged by E5, and
fetched with a request without data; on MPI it stands behind F1 and a number.
"""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.profibus.telegram import Telegram

_TRANSPORT = b"\xf1"
ID = 0x32
KINDS = {1: "request", 2: "acknowledgement", 3: "answer", 7: "system"}
_HAS_ERROR = (2, 3)
LEAST = 10
_FUNCTIONS = {
    0x04: "read",
    0x05: "write",
    0x1A: "download begins",
    0x1B: "download",
    0x1C: "download ends",
    0x1D: "upload begins",
    0x1E: "upload",
    0x1F: "upload ends",
    0x28: "control of the program",
    0x29: "stop",
    0xF0: "set up",
}


@dataclass(frozen=True, slots=True)
class Program:
    """One message. `reference`: the number that request and answer share. `function`: None where it says none; of a
    system message it is none. `error`: class and code, of answers."""

    kind: int
    reference: int
    function: int | None
    error: tuple[int, int] | None

    @property
    def words(self) -> str:
        """All of it in one line."""
        said = f"{KINDS[self.kind]} {self.reference}"
        if self.function is not None and self.kind != 7:
            said = f"{_FUNCTIONS.get(self.function, f'function {self.function:02X}h')}, {said}"
        if self.error is not None and any(self.error):
            said += f", refused: error class {self.error[0]:02X}h, code {self.error[1]:02X}h"
        return said


def program_of(telegram: Telegram) -> Program | None:
    """The message in a telegram: alone without access points (PPI), behind two octets between others than those of DP
    (MPI); None where there is none."""
    if telegram.dsap is None and telegram.ssap is None:
        return parse_program(telegram.data)
    return parse_program(telegram.data[2:]) if telegram.data[:1] == _TRANSPORT else None


def parse_program(data: bytes) -> Program | None:
    """The message that these octets are; None where they are none: its lengths must agree with what is there."""
    if len(data) < LEAST or data[0] != ID or data[1] not in KINDS or any(data[2:4]):
        return None
    kind, begin = data[1], LEAST + 2 * (data[1] in _HAS_ERROR)
    parameters, carried = (int.from_bytes(data[at : at + 2]) for at in (6, 8))
    if len(data) != begin + parameters + carried:
        return None
    error = (data[10], data[11]) if kind in _HAS_ERROR else None
    return Program(kind, int.from_bytes(data[4:6]), data[begin] if parameters else None, error)
