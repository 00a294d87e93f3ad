"""One case of the matrix."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from dissectors.findings import Finding, Rule, Severity
from sniff.engine.session import Item, Session
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.tap import EXACT, TapModel

Heard = tuple[Session, Iterable[Item]]


def subject_of(finding: Finding) -> str:
    """Whom a finding names, without what follows a comma ("station 2, function 3")."""
    return finding.subject.split(",")[0]


@dataclass(frozen=True, slots=True)
class Said:
    """Something that must be said: a finding about any of `subjects` that has one of `codes`, or whose text `words`
    (a regular expression, letter case aside) fits, at note or above.

    `own_words`: only what the finding itself says counts, not what its rule says each time (a general hint is no
    answer).
    """

    subjects: tuple[str, ...]
    codes: tuple[str, ...] = ()
    words: str = ""
    own_words: bool = False

    def fits(self, finding: Finding, rule: Rule | None) -> bool:
        """Whether that finding says it."""
        if subject_of(finding) not in self.subjects:
            return False
        if finding.code in self.codes:
            return True
        if not self.words or finding.severity < Severity.NOTE:
            return False
        return re.search(self.words, " ".join(self._texts(finding, rule)), re.IGNORECASE) is not None

    def _texts(self, finding: Finding, rule: Rule | None) -> Iterable[str]:
        yield finding.seen
        usual = (rule.title, rule.means, rule.next) if rule is not None else ()
        if rule is not None and not self.own_words:
            yield rule.title
        for text in (finding.means, finding.next):
            if not self.own_words or text not in usual:
                yield text

    def __str__(self) -> str:
        words = [f"/{self.words}/"] if self.words else []
        return f"{' or '.join((*self.codes, *words))} about {' or '.join(self.subjects)}"


@dataclass(frozen=True, slots=True)
class Case:
    """One fault. `make(seed=…)`: the bus. `expect`: what must be said, all of it; a code with its subject is enough.

    `struck`: further subjects that may be named; whoever is neither struck nor expected is innocent.
    `also`: further codes that may be errors. `never`: codes that must not be found, not even as a note.
    `hear`: what the sniffer gets of the bus, `simulate` unless the fault is in the sniffer itself.
    `seeds`: how many runs; 1 where nothing is drawn by chance.
    """

    name: str
    make: Callable[..., Scenario]
    expect: tuple[tuple[str, str] | Said, ...]
    tap: TapModel = EXACT
    seconds: float = 60
    hear: Callable[[Scenario, float, TapModel], Heard] = simulate
    struck: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    never: tuple[str, ...] = ()
    seeds: int = 3

    @property
    def wanted(self) -> tuple[Said, ...]:
        """What must be said."""
        return tuple(one if isinstance(one, Said) else Said((one[1],), (one[0],)) for one in self.expect)

    @property
    def about(self) -> frozenset[str]:
        """Subjects that may be named at warning or above: those struck, and what they share."""
        named = (subject for said in self.wanted for subject in said.subjects)
        return frozenset(("bus", "adapter", *self.struck, *named))
