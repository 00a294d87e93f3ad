"""What a request asks for, in the words of the table of polls."""

from __future__ import annotations

import pytest

from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.questions import question
from dissectors.frame import Check, FoundBy, Frame


@pytest.mark.parametrize(
    ("npdu", "where"),
    [
        ("0120FFFF00FF1008", "all networks"),
        ("0120000D00FF1008", "network 13"),
        ("0120000D0110FF1008", "network 13:16"),
        ("01001008", ""),
    ],
)
def test_a_broadcast_to_all_networks_is_for_no_network_of_its_own(npdu: str, where: str) -> None:
    octets = npdu_frame(255, 1, bytes.fromhex(npdu), expects_reply=False)
    frame = Frame("mstp", octets, 0, 1, Check.GOOD, FoundBy.LENGTH)
    assert question(frame).behind == where
