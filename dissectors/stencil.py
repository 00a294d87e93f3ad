"""Stencils: what a frame's line of text reads of its octets, so that one line serves all frames that read alike.

A dissector may say of frames of a kind and length which octets its `text` never reads, and which it reads only as plain
numbers that stand in the line by themselves. Everything else is as `text` gives it: whoever uses a stencil asks `text`
about a frame and about the same with other numbers, and takes the stencil only where both lines are as it says.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from dissectors.frame import Role


class Form(Enum):
    """How a number stands in a line. `mask`: its bits on the wire, most significant octet first."""

    DECIMAL = "decimal", "FFFF"
    HEX = "four hexadecimal digits", "FFFF"
    INSTANCE = "number of a BACnet object, decimal; never all ones, which may be a word", "003FFFFF"
    REAL = "IEEE 754, finite, as `single_reals` writes it", "FFFFFFFF"

    @property
    def mask(self) -> bytes:
        """The bits that are the number."""
        return bytes.fromhex(self.value[1])

    @property
    def octets(self) -> int:
        """How many octets hold it."""
        return len(self.mask)


Needs = tuple[tuple[int, int, int], ...]
"""Bits of octets: place, mask, and what the octet under the mask is."""


@dataclass(frozen=True, slots=True)
class Stencil:
    """Of good frames of one kind and length. Places count from the first octet.

    `needs`: without these it does not fit. `unread`: octets that the text does not read. `numbers`: where numbers begin
    that are shown in this order, each with its form.
    """

    needs: Needs
    unread: tuple[int, ...] = ()
    numbers: tuple[tuple[int, Form], ...] = ()


Stencils = Callable[[Role, str, int], Stencil | None]
"""The stencil for good frames of a role, a kind (`Header.kind`) and a length in octets; None where there is none."""
