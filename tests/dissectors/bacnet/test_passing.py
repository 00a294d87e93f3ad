"""Tokens and polls for a master go by the names that every token-passing protocol shares."""

from dissectors.bacnet.frame_types import NAMES, FrameType
from dissectors.tracker import PASSING, Passing


def test_what_passes_on_the_right_to_send_has_the_shared_names() -> None:
    assert (NAMES[FrameType.TOKEN], NAMES[FrameType.POLL_FOR_MASTER]) == (Passing.TOKEN, Passing.POLL)
    assert {name for name in NAMES.values() if name in PASSING} == {"token", "poll-for-master"}
