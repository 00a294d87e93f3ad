"""One case of the matrix."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from sniff.session import Item, Session
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.tap import EXACT, TapModel

Heard = tuple[Session, Iterable[Item]]


@dataclass(frozen=True, slots=True)
class Case:
    """One fault. `make(seed=…)`: the bus. `expect`: code and subject that must be found, all of them.

    `struck`: further subjects that may be named; `also`: further codes that may be errors.
    `never`: codes that must not be found, not even as a note.
    `hear`: what the sniffer gets of the bus, `simulate` unless the fault is in the sniffer itself.
    """

    name: str
    make: Callable[..., Scenario]
    expect: tuple[tuple[str, str], ...]
    tap: TapModel = EXACT
    seconds: float = 60
    hear: Callable[[Scenario, float, TapModel], Heard] = simulate
    struck: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    never: tuple[str, ...] = ()

    @property
    def about(self) -> frozenset[str]:
        """Subjects that may be named at warning or above: those struck, and what they share."""
        return frozenset(("bus", "master", "adapter", *self.struck, *(subject for _, subject in self.expect)))
