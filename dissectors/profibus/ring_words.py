"""The PROFIBUS ring in words and table rows, one row a master; its slaves in sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dissectors.findings import counted
from dissectors.line import MS, NS_PER_S
from dissectors.token_ring import Cell

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
    middle, most = view.rotation.quantile(0.5), view.rotation.quantile(1)
    return (
        address,
        view.following,
        view.tokens,
        view.repeats,
        view.claims,
        None if middle is None else round(middle / MS, 2),
        None if most is None else round(most / MS, 2),
        view.requests,
        view.polls,
        view.answered,
    )


def slave_rows(ring: Ring) -> list[tuple[Cell, ...]]:
    """One row a slave, by address; those never heard of but asked for too."""
    return [_slave_row(address, ring.slaves[address]) for address in sorted(ring.slaves)]


def _slave_row(address: int, slave: SlaveRow) -> tuple[Cell, ...]:
    middle, most = slave.cycle.quantile(0.5), slave.cycle.quantile(1)
    counts = slave.counts
    return (
        address,
        slave.state.value,
        slave.exchanges,
        None if middle is None else round(middle / MS, 2),
        None if most is None else round(most / MS, 2),
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
    said = [
        f"ring of {len(order)}: {' → '.join(map(str, (*order, order[0])))}" if order else "no closed ring seen",
        f"GAP polls that nobody answers take {ring.wasted / ring.span if ring.span else 0:.1%} of the time",
    ]
    return said + [_slave(address, ring.slaves[address], ring.first) for address in sorted(ring.slaves)]


def _slave(address: int, slave: SlaveRow, first: int) -> str:
    steps = slave.changes[-_CHANGES_TOLD:]
    told = ", ".join(f"{state.value} at {(time - first) / NS_PER_S:.3f} s" for time, state in steps)
    more = "… " if slave.changed > len(steps) else ""
    return f"slave {address}: {slave.state.value}, {counted(slave.exchanges, 'exchange')} of data ({more}{told})"
