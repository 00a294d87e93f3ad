"""The words of what two taps tell, for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from dissectors.columns import NONE
from dissectors.words import milliseconds
from sniff.taps.verdict import FaultPlace, SegmentFault, SegmentFaultKind, Traffic

_WHAT = {
    SegmentFaultKind.DEAD: "does not arrive",
    SegmentFaultKind.LOST: "is lost now and then",
    SegmentFaultKind.BEGIN: "arrives without its first octets",
    SegmentFaultKind.END: "arrives without its last octets",
    SegmentFaultKind.BITS: "arrives damaged",
    SegmentFaultKind.CHANGED: "arrives with other octets and a good check",
}
_LOOK = {
    SegmentFaultKind.DEAD: "look for a broken wire, a repeater that does not drive this side, a dead isolator",
    SegmentFaultKind.LOST: "look for a repeater or gateway that is overrun or switches its direction too late",
    SegmentFaultKind.BEGIN: "look for a driver that is switched on late: a repeater's direction control",
    SegmentFaultKind.END: "look for a driver that is switched off early: a repeater's direction control",
    SegmentFaultKind.BITS: "look at termination, bias and shield on this stretch, and for what disturbs beside it",
    SegmentFaultKind.CHANGED: "look for a gateway that rewrites what it passes on",
}


def sender(name: int) -> str:
    """Who sent: a station, or whoever asks where frames do not name him."""
    return "master" if name == NONE else f"station {name}"


def senders(names: Sequence[int]) -> str:
    """Several of them."""
    stations = [str(name) for name in names if name != NONE]
    said = ["the master"] if NONE in names else []
    if stations:
        said.append(f"station{'s' if len(stations) > 1 else ''} {', '.join(stations)}")
    return " and ".join(said)


def sentence(fault: SegmentFault) -> str:
    """A fault, where it is, and what to look for."""
    here, there = TAPS[fault.tap], TAPS[1 - fault.tap]
    everybody = fault.place is FaultPlace.EITHER and len(fault.senders) > 2
    who = "everybody" if everybody else senders(fault.senders)
    verb = "sends" if everybody else _send(fault.senders)
    share = f"{fault.hit} of {fault.heard} frames"
    what = f"what {who} {verb} {_WHAT[fault.kind]} at {here} ({share})"
    if fault.kind is not SegmentFaultKind.CHANGED:
        what += f" and is whole at {there}"
    if fault.place is FaultPlace.TAP:
        where = f"it passed {here} before: the fault is at {here} itself, its adapter or its wiring to the line"
    elif fault.place is FaultPlace.BETWEEN:
        whole = f"what {senders(fault.spared)} {_send(fault.spared)} is whole at both"
        where = f"{whole}: the fault lies between the taps, on the way from {there} to {here}"
        if len(fault.senders) == 1 and fault.senders[0] != NONE and len(fault.spared) > 1:
            where += f"; or station {fault.senders[0]} drives the line too weakly to reach it"
    else:
        where = (
            f"nobody is spared, so it lies on the way from {there} to {here} or at {here} itself; "
            f"exchange the adapters to tell"
        )
    return f"{what}; {where}; {_LOOK[fault.kind]}"


def _send(names: Sequence[int]) -> str:
    return "sends" if len(names) == 1 else "send"


TAPS = ("A", "B")
"""What the two taps are called, in the order of the command line."""

HEADINGS = (
    "sender",
    "frames",
    "at both",
    "damaged at A",
    "at B",
    "missing at A",
    "at B",
    "changed at A",
    "at B",
    "delay ms",
    "median",
    "95 %",
    "most",
)
KEYS = (
    "sender",
    "frames",
    "both",
    "damaged_at_a",
    "damaged_at_b",
    "missing_at_a",
    "missing_at_b",
    "changed_at_a",
    "changed_at_b",
    "delay_min_ms",
    "delay_p50_ms",
    "delay_p95_ms",
    "delay_max_ms",
)
"""Of the table of senders: for people, and for programs."""


def rows(found: Mapping[int, Traffic]) -> list[tuple[str | int | float | None, ...]]:
    """The table of senders. Delays run from the first tap to the second, ms; those of whom stands behind the second
    are negative."""
    return [
        (sender(name), one.heard, one.both, *one.damaged, *one.missing, *one.changed, *_delays(one.delays))
        for name, one in found.items()
    ]


def _delays(delays: np.ndarray) -> list[float | None]:
    if not len(delays):
        return [None] * 4
    if np.median(delays) < 0:  # from the second to the first
        least, median, most, high = (-np.percentile(-delays, share) for share in (0, 50, 100, 95))
    else:
        least, median, most, high = (np.percentile(delays, share) for share in (0, 50, 100, 95))
    return [round(float(each) / 1e6, 3) for each in (least, median, high, most)]


def certainty(doubt: int, is_one_clock: bool) -> str:
    """What the delays are worth."""
    clocks = "" if is_one_clock else ", if one clock stamped both"
    off = f"± {milliseconds(doubt)}{clocks}"
    return f"delays run from A to B, negative from B to A; they are right to {off}, as far as the adapters allow"


def as_value(fault: SegmentFault) -> dict[str, object]:
    """A fault for programs; the master, whom frames do not name, is null among the senders."""
    return {
        "fault": fault.kind.name.lower(),
        "place": fault.place.name.lower(),
        "at": TAPS[fault.tap],
        "senders": [None if name == NONE else name for name in fault.senders],
        "spared": [None if name == NONE else name for name in fault.spared],
        "hit": fault.hit,
        "heard": fault.heard,
        "text": sentence(fault),
    }
