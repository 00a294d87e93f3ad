"""What comes onto the line from outside, by its own clock: mains hum, contactors, sparks. Parties that hear nothing."""

from __future__ import annotations

from random import Random

from dissectors.simulated import Send

S = 1_000_000_000


class Interference:
    """Octets of rubbish: every `every` ns within `jitter`, `share` of the times; at any time, on average `every` ns
    apart, when `jitter` is None. `octets`: fewest and most at a time."""

    def __init__(
        self, every: int, *, jitter: int | None, octets: tuple[int, int], share: float = 1.0, seed: int = 0
    ) -> None:
        self.every, self.jitter, self.octets, self.share = every, jitter, octets, share
        self.dice = Random(f"interference {seed}")
        self.tick = self.dice.randrange(every)
        self.due = self.tick

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        if now < self.due:
            return ()
        if self.jitter is None:
            self.due = now + max(1, int(self.dice.expovariate(1 / self.every)))
        else:
            self.tick += self.every
            self.due = max(now + 1, self.tick + self.dice.randrange(-self.jitter, self.jitter + 1))
        if self.dice.random() >= self.share:
            return ()
        count = self.dice.randint(*self.octets)
        return (Send(now, bytes(self.dice.randrange(256) for _ in range(count))),)

    def next_wake(self) -> int | None:
        return self.due
