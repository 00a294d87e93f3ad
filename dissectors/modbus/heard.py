"""What the rows of a transaction told of it, beside its verdict."""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.frame import Flaw, Frame
from dissectors.modbus.asked import AskedRequest


@dataclass(frozen=True, slots=True)
class Heard:
    """The request of a transaction and what came for it.

    `asked`: None where its request is not known any more, or it has none. `code`: of an exception. `answer`: the octets
    of a good answer, b"" without one. `stray`: octets behind the request that are no good frame. `flaw`: in what way a
    frame of it is damaged. `ended`: station, row and frame of a damaged answer.
    """

    asked: AskedRequest | None
    code: int | None = None
    answer: bytes = b""
    stray: bytes = b""
    flaw: Flaw | None = None
    ended: tuple[int, int, Frame] | None = None
