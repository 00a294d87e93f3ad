"""Network headers and the heads of APDUs of many frames at once: where they are, and whose exchange they belong to."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.apdu import SEGMENTED, SERVER, PduType
from dissectors.bacnet.past_exchanges import NO_KEY

if TYPE_CHECKING:
    from dissectors.bacnet.past_exchanges import Nets
    from dissectors.columns import Masks, Octets, Times

_ROUTED = npdus.HAS_DESTINATION | npdus.HAS_SOURCE


class Heads(NamedTuple):
    """What stands at the front of the data of frames, one entry each.

    `asks`: a confirmed request in one piece. `answers`: what can answer one, in one piece. `unasked`: an unconfirmed
    request or a network message. `key`: of those that ask or answer, `NO_KEY` for others.
    """

    asks: Masks
    answers: Masks
    unasked: Masks
    key: Times


def bodies(octets: Octets, begin: Times, size: Times, control: Octets) -> tuple[Times, Masks]:
    """Where the APDU begins in each NPDU, and where the header is cut before."""
    at = np.full(len(control), 2, np.int64)
    cut = np.zeros(len(control), bool)
    for flag in (npdus.HAS_DESTINATION, npdus.HAS_SOURCE):
        rows = np.flatnonzero(control & flag)
        at[rows] += 3 + octets.take(begin[rows] + at[rows] + 2, mode="clip").astype(np.int64)
        cut[rows] |= at[rows] > size[rows]
    at += control & npdus.HAS_DESTINATION != 0  # hop count
    return at, cut


def heads(octets: Octets, begin: Times, size: Times, source: Times, destination: Times, nets: Nets) -> Heads:
    """The heads of NPDUs of `size` octets from `begin` on, sent from `source` to `destination`."""
    version, control = octets.take(begin, mode="clip"), octets.take(begin + 1, mode="clip")
    whole = (size >= 2) & (version == npdus.VERSION)
    network = whole & (control & npdus.NETWORK_MESSAGE != 0)
    at, cut = bodies(octets, begin, size, control)
    left = size - at
    spoken = whole & ~network & ~cut
    first = octets.take(begin + at, mode="clip")
    pdu = first >> 4
    one_piece = first & SEGMENTED == 0
    asks = spoken & (pdu == PduType.CONFIRMED_REQUEST) & one_piece & (left >= 4)
    answers = (pdu == PduType.SIMPLE_ACK) | (pdu == PduType.ERROR) | (pdu == PduType.REJECT)
    answers |= (pdu == PduType.COMPLEX_ACK) & one_piece | (pdu == PduType.ABORT) & (first & SERVER != 0)
    answers &= spoken & (left >= 3)
    unasked = network | spoken & (pdu == PduType.UNCONFIRMED_REQUEST) & (left >= 2)
    from_net, to_net = _nets(
        octets, begin, at, control, np.flatnonzero((asks | answers) & (control & _ROUTED != 0)), nets
    )
    invoke = octets.take(begin + at + 1 + asks, mode="clip")
    client, server = np.where(asks, source, destination), np.where(asks, destination, source)
    client_net, server_net = np.where(asks, from_net, to_net), np.where(asks, to_net, from_net)
    key = ((((client_net << 8 | client) << 15 | server_net) << 8) | server) << 8 | invoke
    known = (asks | answers) & (from_net >= 0) & (to_net >= 0)
    return Heads(asks & known, answers & known, unasked, np.where(known, key, NO_KEY))


def _nets(octets: Octets, begin: Times, at: Times, control: Octets, rows: Times, nets: Nets) -> tuple[Times, Times]:
    """The numbers of sender and receiver behind routers; negative where there are too many."""
    of_source, of_destination = np.zeros(len(begin), np.int64), np.zeros(len(begin), np.int64)
    known: dict[bytes, tuple[int, int]] = {}
    for row, start, end in zip(rows.tolist(), begin[rows].tolist(), (begin + at)[rows].tolist(), strict=True):
        header = octets[start:end].tobytes()
        numbers = known.get(header)
        if numbers is None:
            numbers = known[header] = _net_numbers(npdus.decode(header), nets)
        of_source[row], of_destination[row] = numbers
    return of_source, of_destination


def _net_numbers(npdu: npdus.Npdu | None, nets: Nets) -> tuple[int, int]:
    if npdu is None:
        return NO_KEY, NO_KEY
    numbers = nets.number((npdu.snet, npdu.sadr)), nets.number((npdu.dnet, npdu.dadr))
    return NO_KEY if numbers[0] is None else numbers[0], NO_KEY if numbers[1] is None else numbers[1]
