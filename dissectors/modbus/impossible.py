"""Requests that nobody can carry out, and what became of them: is the master wrong, or is this no Modbus at all?

01 03 00 00 00 00 ── 01 83 03            refused: the master asks wrongly
01 04 03 00 00 00 ── 01 04 03 00 13 88   answered in kind: a maker's own protocol in frames of Modbus
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from dissectors.findings import Tally, together

_WORDS_KEPT: Final = 16
_LEAST: Final = 3


@dataclass(slots=True)
class Impossible:
    """Those to one station. `words`: what is wrong with them. `codes`: the exceptions that they got. `unanswered`: how
    many got nothing. `in_kind`: those that a good frame answered which is no exception, and does not fit either."""

    tally: Tally = field(default_factory=Tally)
    words: Counter[str] = field(default_factory=Counter)
    codes: Counter[int] = field(default_factory=Counter)
    unanswered: int = 0
    in_kind: Tally = field(default_factory=Tally)

    def add(self, why: str, time: int, *frames: int | None) -> None:
        """Take the next one that was refused, not answered, or contradicts itself."""
        self.tally.add(time, *frames)
        if why in self.words or len(self.words) < _WORDS_KEPT:
            self.words[why] += 1

    def is_own_protocol(self, answered: int) -> bool:
        """Whether the station speaks a maker's own protocol: it never refuses such a request, and 3 in 4 of its answers
        are to them."""
        return self.in_kind.count >= _LEAST and not self.codes and 4 * self.in_kind.count >= 3 * answered


def all_of(each: Iterable[Impossible]) -> Impossible:
    """Those to several stations."""
    every = list(each)
    words, codes = Counter[str](), Counter[int]()
    for one in every:
        words.update(one.words)
        codes.update(one.codes)
    unanswered = sum(one.unanswered for one in every)
    return Impossible(
        together(one.tally for one in every), words, codes, unanswered, together(one.in_kind for one in every)
    )
