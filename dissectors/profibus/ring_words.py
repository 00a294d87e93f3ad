"""The PROFIBUS ring in words and table rows, one row a master; its slaves in sentences."""

from __future__ import annotations

from dissectors.line import MS, NS_PER_S
from dissectors.profibus.ring import Ring, SlaveRow
from dissectors.token_ring import Cell

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
    told = ", ".join(f"{(time - first) / NS_PER_S:.3f} s {state.value}" for time, state in steps)
    more = "… " if slave.changed > len(steps) else ""
    return f"slave {address}: {slave.state.value}, {slave.exchanges} exchanges of data ({more}{told})"
