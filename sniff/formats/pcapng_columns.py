"""Packets of a pcapng file that are read alike: times as columns, interfaces of one kind as one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import gcd
from typing import TYPE_CHECKING

import numpy as np

from sniff.formats.linktypes import protocol_of
from sniff.formats.packet_columns import BARE, Packets
from sniff.formats.pcapng_walk import HEADER, PlainPackets

if TYPE_CHECKING:
    from dissectors.columns import Times
    from sniff.formats.pcapng_interface import Interface

_MOST = 1 << 62


def alike(
    packets: PlainPackets, interfaces: Sequence[Interface], protocol: str, latest: int
) -> Iterator[tuple[int, int, Packets | None]]:
    """Runs [first, end) of packets that are read alike, None for those whose interface or times need a look each.

    `protocol`: of what is wanted; interfaces of bare frames that may be of it are one. `latest`: ns; times are kept
    within it, before and after the epoch.
    """
    heads = packets.heads.astype(np.int64)
    numbers, kinds = np.unique(heads[:, 2], return_inverse=True)
    known: dict[object, int] = {}
    kind_of: list[int] = []
    for index, number in enumerate(numbers.tolist()):
        key: object = None
        if number < len(interfaces):
            one = interfaces[number]
            is_bare = one.link_type in BARE and protocol_of(one.link_type) in (None, protocol)
            key = ("bare" if is_bare else one.link_type, one.resolution, one.offset)
        kind_of.append(known.setdefault(key, index))
    kinds = np.array(kind_of)[kinds.reshape(-1)]
    bounds = [0, *(np.flatnonzero(np.diff(kinds)) + 1).tolist(), len(packets)]
    for first, end in pairwise(bounds):
        number = int(heads[first, 2])
        times = _times(heads[first:end], interfaces[number], latest) if number < len(interfaces) else None
        if times is None:
            yield first, end, None
        else:
            begins, kept = packets.begins[first:end] + HEADER, heads[first:end, 5]
            on_wire = heads[first:end, 6]
            yield first, end, Packets(packets.window, begins, kept, times, interfaces[number].link_type, on_wire)


def _times(heads: Times, interface: Interface, latest: int) -> Times | None:
    """ns since the epoch; None where 64 bits do not hold what they are computed with."""
    factor, ticks = interface.resolution
    shared = gcd(factor, ticks)
    factor, ticks = factor // shared, ticks // shared
    offset = interface.offset * 1_000_000_000
    if ((int(heads[:, 3].max()) + 1) << 32) * factor > _MOST or ticks > _MOST or abs(offset) > _MOST:
        return None
    stamps = (heads[:, 3] << 32) | heads[:, 4]
    times: Times = np.clip(stamps * factor // ticks + offset, -latest, latest)
    return times
