"""A fact of a device's manual: what is put on the line, and what must be said of it. `facts.tsv` has all of them.

    device  section  how it is asked  place on the wire  value on the wire  what must be said of it

`!` before what must be said: it must not be. Of what is judged: `fine`, or the rule that speaks.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

FACTS = Path(__file__).with_name("facts.tsv")
UNSEEN = "unseen"
"""How a fact is asked that nobody can see on a line; what must be said is why."""


class Fact(NamedTuple):
    """One line of the table."""

    device: str
    section: str
    how: str
    place: str
    raw: float
    said: str

    @property
    def whole(self) -> int:
        """The value as it is on the wire."""
        return int(self.raw)


class Exchange(NamedTuple):
    """Frames of one exchange, the question first. `told`: the place of the frame whose row must say it; `after`:
    ms from the question's end to the answer's begin."""

    frames: tuple[bytes, ...]
    told: int = 1
    after: float = 8.0


Craft = Callable[[Fact], Exchange]


class Asked(NamedTuple):
    """A way to ask: the line settings and the protocol of the capture, and what makes the frames."""

    line: str
    protocol: str
    craft: Craft


def facts() -> list[Fact]:
    """All lines of the table."""
    lines = [line for line in FACTS.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    cells = (line.split("\t") for line in lines)
    return [Fact(*words[:4], float(words[4]), words[5] if len(words) > 5 else "") for words in cells]
