"""Lost tokens: whether a silence lost one, and who had it.

Who makes a token looks for a successor first (GenerateToken, 9.5.6), so a ring that goes on with anything else has lost
none: all of it was silent, or only the tap was. The master with the lowest address is the first to make one, T_slot per
address after T_no_token; a silence far longer than that has no master alive in it, and proves nothing of the holder.
"""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.bacnet.frame_types import PREAMBLE, FrameType
from dissectors.bacnet.limits import T_ALL_SILENT, T_NO_TOKEN, T_SLOT
from dissectors.frame import Damage, Frame

_POLL = int(FrameType.POLL_FOR_MASTER)
_SOURCE = 4  # place of the address of who sends

PATIENT = 2
"""Times its own wait that a master may let pass, by its clock and its load, before it makes a token."""


def makes_token(frame: Frame) -> bool:
    """Whether this is how a station begins that has made a token."""
    return frame.octets[2] == _POLL


def breaks_off(frame: Frame, holder: int | None) -> bool:
    """Whether this is the begin of a frame that the holder of the token sent, and no more."""
    octets = frame.octets
    names_it = octets[:2] == PREAMBLE and len(octets) > _SOURCE and octets[_SOURCE] == holder
    return names_it and frame.damage in (Damage.SHORT, Damage.RESTARTED)


def longest_wait(masters: Iterable[int]) -> int:
    """The silence (ns) from which on none of these masters can have been alive."""
    lowest = min(masters, default=None)
    return T_ALL_SILENT if lowest is None else min(T_ALL_SILENT, PATIENT * (T_NO_TOKEN + T_SLOT * lowest))
