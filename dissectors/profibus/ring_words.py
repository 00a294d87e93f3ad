"""The PROFIBUS ring in words and table rows, one row a master; its slaves in sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dissectors.findings import counted
from dissectors.histogram import Histogram
from dissectors.line import MS, NS_PER_S
from dissectors.token_ring import Cell
from dissectors.words import percent

if TYPE_CHECKING:
    from dissectors.profibus.ring import Ring, SlaveRow

HEADINGS = (
    "master",
    "next",
    "tokens",
    "repeats",
    "claims",
    "rotation p50 ms",
    "rotation max ms",
    "requests",
    "GAP polls",
    "GAP answers",
)
SLAVE_HEADINGS = (
    "slave",
    "state",
    "exchanges",
    "cycle p50 ms",
    "cycle max ms",
    "lost",
    "syncs",
    "repeats",
    "repeats max",
    "illegal",
    "rejects",
    "diagnoses",
    "with a fault",
)
"""As bus monitors of PROFIBUS count. Lost: gone from data exchange without any answer. Syncs: requests that begin the
frame count anew, so first ones and those after a loss. Repeats: requests again at once, and how often in a row.
Illegal: something damaged where an answer should be. Rejects: answers that refuse."""

_CHANGES_TOLD = 8


def rows(ring: Ring) -> list[tuple[Cell, ...]]:
    """One row a master, in the order of the ring, then those outside it by address."""
    order = ring.order
    outside = tuple(sorted(address for address in ring.masters if address not in order))
    return [_row(ring, address) for address in order + outside]


def _row(ring: Ring, address: int) -> tuple[Cell, ...]:
    view = ring.masters[address]
    return (
        address,
        view.following,
        view.tokens,
        view.repeats,
        view.claims,
        *_middle_and_most(ring, view.rotation),
        view.requests,
        view.polls,
        view.answered,
    )


def slave_rows(ring: Ring) -> list[tuple[Cell, ...]]:
    """One row a slave, by address; those never heard of but asked for too."""
    return [_slave_row(ring, address, ring.slaves[address]) for address in sorted(ring.slaves)]


def _middle_and_most(ring: Ring, times: Histogram) -> tuple[Cell, Cell]:
    """ms, of half of them at most and of the longest; None where there are none, or nobody knows when anything came."""
    middle, most = (times.quantile(0.5), times.quantile(1)) if ring.has_times else (None, None)
    return None if middle is None else round(middle / MS, 2), None if most is None else round(most / MS, 2)


def _slave_row(ring: Ring, address: int, slave: SlaveRow) -> tuple[Cell, ...]:
    counts = slave.counts
    return (
        address,
        slave.state.value,
        slave.exchanges,
        *_middle_and_most(ring, slave.cycle),
        counts.lost,
        counts.syncs,
        counts.repeats,
        counts.longest,
        counts.illegal,
        counts.rejects,
        counts.diagnoses,
        counts.faults,
    )


def sentences(ring: Ring) -> list[str]:
    """The ring as a whole, then each slave with its states and when it came into them."""
    order = ring.order
    said = [f"ring of {len(order)}: {' → '.join(map(str, (*order, order[0])))}" if order else "no closed ring seen"]
    if not ring.has_times:
        said.append("when anything came is not known")
    elif ring.wasted_share is None:
        said.append("how much time GAP polls take that nobody answers, this adapter does not tell")
    else:
        said.append(f"GAP polls that nobody answers take {percent(ring.wasted_share)} of the time")
    return said + [_slave(ring, address, ring.slaves[address]) for address in sorted(ring.slaves)]


def _slave(ring: Ring, address: int, slave: SlaveRow) -> str:
    steps = slave.changes[-_CHANGES_TOLD:]
    at = [f" at {(time - ring.first) / NS_PER_S:.3f} s" if ring.has_times else "" for time, _ in steps]
    told = ", ".join(f"{state.value}{when}" for when, (_, state) in zip(at, steps, strict=True))
    more = "… " if slave.changed > len(steps) else ""
    return f"slave {address}: {slave.state.value}, {counted(slave.exchanges, 'exchange')} of data ({more}{told})"
