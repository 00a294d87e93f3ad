"""Framer and peek for many telegrams at once; `dissectors/columns.py` has the contract.

    checked telegram (SD1, SD2, SD3)   wherever its start, lengths, sum, end and frame control are right
    short acknowledgement (SC)         directly behind a request that wants an answer, and no answer behind it
    token (SD4)                        between masters that earlier octets of the same block have shown; to a new one
                                       where that passes it on or sends a request directly behind it

Left out, and so doubtful: all other octets, marked reads, telegrams with a proved `SILENCE` inside, tokens before their
masters have shown themselves, and what more octets may change. The reference has read the block up to where a chain
begins, so it knows the masters that are known here, and perhaps more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import CHECKS, FOUNDS, FrameColumns, OctetTimes, disjoint, holds_any
from dissectors.frame import Check, FoundBy
from dissectors.profibus.control import Control
from dissectors.profibus.framing import SILENCE, STRAY_MOST
from dissectors.profibus.header_columns import headers
from dissectors.profibus.telegram import ED, FIXED, HIGHEST, LEAST_LE, MOST_LE, SC, SD1, SD2, SD3, SD4

if TYPE_CHECKING:
    from dissectors.columns import Masks, Octets, Reads, Times
    from dissectors.line import Timing

_KNOWN = np.array([Control(octet).is_known for octet in range(256)])
_ASKS = np.array([Control(octet).wants_answer for octet in range(256)])
_REQUEST = np.array([Control(octet).is_request for octet in range(256)])
_CHECKED = np.zeros(256, bool)
_CHECKED[[SD1, SD2, SD3]] = True
_TOKEN, _SHORT = FIXED[SD4], FIXED[SC]
_NEVER = np.iinfo(np.int64).max


def kernel(reads: Reads, timing: Timing) -> FrameColumns:
    """The telegrams of all clean stretches."""
    octets: Octets = np.ascontiguousarray(reads.octets)
    begins = reads.begins
    times = OctetTimes.of(reads, timing.char)
    pauses = begins[:-1][times.gaps() - timing.latency >= max(SILENCE, 2 * timing.char)]
    marked = np.flatnonzero(np.repeat(reads.marked, reads.lengths)) if reads.marked.any() else None
    offset, length = _candidates(octets)
    clean = ~holds_any(offset + 1, offset + length, pauses)
    if marked is not None:
        clean &= ~holds_any(offset, offset + length, marked)
    offset, length = offset[clean], length[clean]
    taken = _taken(octets, offset, length, pauses)
    return _columns(octets, times, offset[taken], length[taken])


def _columns(octets: Octets, times: OctetTimes, offset: Times, length: Times) -> FrameColumns:
    checked, count = length > _TOKEN, len(offset)
    said = headers(octets, offset, length)
    return FrameColumns(
        offset=offset,
        length=length.astype(np.int32),
        start=times.start(offset),
        end=times.end(offset + (length - 1)),
        check=np.where(checked, np.uint8(CHECKS.index(Check.GOOD)), np.uint8(CHECKS.index(Check.ABSENT))),
        found=np.where(checked, np.uint8(FOUNDS.index(FoundBy.DELIMITER)), np.uint8(FOUNDS.index(FoundBy.LENGTH))),
        damage=np.zeros(count, np.uint8),
        expected=length.astype(np.int32),
        source=said.source,
        destination=said.destination,
        role=said.role,
        kind=said.kind,
        function=said.function,
        address=said.address,
        count=said.count,
        ok=np.ones(count, bool),
        error=said.error,
        names=said.names,
    )


# What may be a telegram by itself


def _candidates(octets: Octets) -> tuple[Times, Times]:
    """Place and length of what may be telegrams, ascending, none overlapping another."""
    offset, length = _sound(octets)
    kept = disjoint(offset, offset + length)
    offset, length = offset[kept], length[kept]
    tokens, shorts = _tokens(octets), np.flatnonzero(octets == SC)
    tokens, shorts = tokens[_outside(tokens, offset, length)], shorts[_outside(shorts, offset, length)]
    if len(tokens):  # a telegram that begins inside one is none where the token is one: nobody says so here
        before = np.searchsorted(tokens, offset, "right") - 1
        hidden = (before >= 0) & (tokens[np.maximum(before, 0)] + _TOKEN > offset)
        offset, length = offset[~hidden], length[~hidden]
    offset = np.concatenate((offset, tokens, shorts))
    length = np.concatenate((length, np.full(len(tokens), _TOKEN), np.full(len(shorts), _SHORT)))
    order = np.argsort(offset, kind="stable")
    return offset[order], length[order]


def _sound(octets: Octets) -> tuple[Times, Times]:
    """Place and length of all checked telegrams, as `envelope.is_sound` tells them."""
    begins = np.flatnonzero(_CHECKED[octets])
    starts = octets[begins]
    heads = [octets.take(begins + at, mode="clip") for at in (1, 2, 3)]
    long = starts == SD2
    said = heads[0].astype(np.int64)
    fits = ~long | (heads[0] == heads[1]) & (heads[2] == SD2) & (said >= LEAST_LE) & (said <= MOST_LE)
    size = np.where(long, said, np.where(starts == SD3, FIXED[SD3] - 3, FIXED[SD1] - 3))  # of what is summed
    body = begins + np.where(long, 4, 1)
    fits &= body + size + 2 <= len(octets)
    begins, body, size = begins[fits], body[fits], size[fits]
    sums = np.concatenate((np.zeros(1, np.uint8), np.cumsum(octets, dtype=np.uint8)))
    right = (sums[body + size] - sums[body] == octets[body + size]) & (octets[body + size + 1] == ED)
    begins, body, size = begins[right], body[right], size[right]
    to, source = octets[body], octets[body + 1]
    sound = (
        _KNOWN[octets[body + 2]] & (source & 0x7F <= HIGHEST) & (size - 3 >= (to >> 7).astype(np.int64) + (source >> 7))
    )
    return begins[sound], (body + size + 2 - begins)[sound]


def _tokens(octets: Octets) -> Times:
    """Where three octets have the form of a token."""
    tokens = np.flatnonzero(octets[: max(0, len(octets) - 2)] == SD4)
    right: Masks = (octets[tokens + 1] <= HIGHEST) & (octets[tokens + 2] <= HIGHEST)
    return tokens[right]


def _outside(places: Times, offset: Times, length: Times) -> Masks:
    """Which places lie in none of the telegrams."""
    if not len(offset):
        return np.ones(len(places), bool)
    before = np.searchsorted(offset, places, "right") - 1
    outside: Masks = (before < 0) | (offset[before] + length[before] <= places)
    return outside


# What needs others to be believed


def _taken(octets: Octets, offset: Times, length: Times, pauses: Times) -> Masks:
    """Which candidates are telegrams: all that have a check, and of the others those that have their place."""
    taken: Masks = length > _TOKEN
    if len(offset):
        taken[_acknowledging(octets, offset, length)] = True
        taken[_passing(octets, offset, length, pauses)] = True
    return taken


def _body(octets: Octets, offset: Times) -> Times:
    return offset + np.where(octets[offset] == SD2, 4, 1)


def _acknowledging(octets: Octets, offset: Times, length: Times) -> Times:
    """Short acknowledgements: directly behind a request that wants an answer, and that answer does not follow."""
    rows = np.flatnonzero(length == _SHORT)
    rows = rows[rows > 0]
    before = rows - 1
    rows = rows[(length[before] > _TOKEN) & (offset[before] + length[before] == offset[rows])]
    body = _body(octets, offset[rows - 1])
    alone = _ASKS[octets[body + 2]] & (offset[rows] + STRAY_MOST + 8 <= len(octets))
    rows, body = rows[alone], body[alone]
    to, by = octets[body] & 0x7F, octets[body + 1] & 0x7F
    answered = np.zeros(len(rows), bool)
    for skip in range(STRAY_MOST + 1):
        at = offset[rows] + 1 + skip
        start = octets[at]
        begin = at + np.where(start == SD2, 4, 1)
        answers = (octets[begin] & 0x7F == by) & (octets[begin + 1] & 0x7F == to) & ~_REQUEST[octets[begin + 2]]
        answered |= _CHECKED[start] & answers
    acknowledging: Times = rows[~answered]
    return acknowledging


def _passing(octets: Octets, offset: Times, length: Times, pauses: Times) -> Times:
    """Tokens between masters that rows before have shown; to a new one where the next row proves it."""
    rows = np.flatnonzero(length == _TOKEN)
    if not len(rows):
        return rows
    to, source = octets[offset[rows] + 1].astype(np.int64), octets[offset[rows] + 2].astype(np.int64)
    known = _shown(octets, offset, length)
    proved = _proved(octets, offset, length, rows, to, source)
    proved &= ~np.isin(offset[rows] + _TOKEN, pauses)  # a silence decides before what follows it comes
    while True:  # a token to a new master makes it known: once each
        new = np.flatnonzero(proved & (known[source] < rows) & (known[to] > rows))
        if not len(new):
            break
        np.minimum.at(known, to[new], rows[new])
    passing = (known[source] < rows) & ((known[to] < rows) | ((known[to] == rows) & proved))
    believed: Times = rows[passing]
    return believed


def _shown(octets: Octets, offset: Times, length: Times) -> Times:
    """For each address the first row in which a checked telegram shows that it is a master's."""
    known = np.full(128, _NEVER)
    checked = np.flatnonzero(length > _TOKEN)
    body = _body(octets, offset[checked])
    master = np.where(_REQUEST[octets[body + 2]], octets[body + 1], octets[body]) & 0x7F
    found, first = np.unique(master, return_index=True)
    known[found] = checked[first]
    known[HIGHEST + 1 :] = _NEVER
    return known


def _proved(octets: Octets, offset: Times, length: Times, rows: Times, to: Times, source: Times) -> Masks:
    """Tokens behind which their taker passes it on, or sends a request, or which are said again."""
    proved = np.zeros(len(rows), bool)
    inner = np.flatnonzero(rows + 1 < len(offset))
    row, behind = rows[inner], rows[inner] + 1
    follows = offset[row] + _TOKEN == offset[behind]
    inner, row, behind = inner[follows], row[follows], behind[follows]
    is_token, is_checked = length[behind] == _TOKEN, length[behind] > _TOKEN
    at = offset[behind]
    next_to, next_by = octets.take(at + 1, mode="clip"), octets.take(at + 2, mode="clip")
    passes = is_token & ((next_by == to[inner]) | (next_to == to[inner]) & (next_by == source[inner]))
    body = _body(octets, at)
    by = octets.take(body + 1, mode="clip") & 0x7F
    asks = is_checked & _REQUEST[octets.take(body + 2, mode="clip")] & (by == to[inner])
    proved[inner] = passes | asks
    return proved
