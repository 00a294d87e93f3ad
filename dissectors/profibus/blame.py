"""Whose damage it is: a slave's own where noise, which falls on whatever is sent, would seldom strike one so often."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from dissectors.chances import is_by_chance
from dissectors.frame import Frame, Role
from dissectors.tracker import Placement

ONE_STATION: Final = 0.9
"""The part of all damage that one slave's own is at least."""


@dataclass(slots=True)
class SentOctets:
    """Octets of telegrams but tokens, whose damage does not show: of all, and of each slave's answers."""

    total: int = 0
    answers: Counter[int] = field(default_factory=Counter)

    def see(self, frame: Frame, placement: Placement | None) -> None:
        """Take a telegram that is no token."""
        self.total += len(frame.octets)
        if placement is not None and placement.role is Role.RESPONSE and placement.source is not None:
            self.answers[placement.source] += len(frame.octets)

    def count(self, total: int, answers: Mapping[int, int]) -> None:
        """Take many."""
        self.total += total
        self.answers.update(answers)

    def is_its_own(self, address: int, struck: int, damaged: int) -> bool:
        """Whether `struck` of all `damaged` telegrams are answers of one slave, and that is no chance."""
        if struck < ONE_STATION * damaged:
            return False
        share = self.answers[address] / max(1, self.total)
        return not is_by_chance(struck, damaged, min(1.0, share), len(self.answers) + 1)  # any of them, or the master
