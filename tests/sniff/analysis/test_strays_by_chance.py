"""Stray octets beside one sender alone are its own only where chance would seldom have struck it alone."""

from __future__ import annotations

from collections import Counter

import pytest

from dissectors.findings import Tally
from dissectors.line import LineSettings, Timing
from sniff.analysis.sender_findings import MASTER, Senders
from sniff.analysis.stray_findings import strays_found

FRAMES = {MASTER: 240, "station 1": 40, "station 2": 40, "station 3": 40, "station 4": 40}


@pytest.mark.parametrize(("name", "count", "whose"), [(MASTER, 3, "bus"), (MASTER, 12, MASTER), ("station 2", 3, "")])
def test_who_sends_most_is_struck_alone_now_and_then(name: str, count: int, whose: str) -> None:
    senders = Senders(Timing(LineSettings()), packets=False)
    for sender, frames in FRAMES.items():
        senders.of(sender).frames = frames
        senders.frames += frames
    stray = senders.of(name).stray["LN202"] = Tally()
    for no in range(count):
        stray.add(no, no)
    (finding,) = strays_found(senders, Counter(), Counter(), lambda count, of: None)
    assert (finding.code, finding.subject) == ("LN202", whose or name)
