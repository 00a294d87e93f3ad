"""A token ring drawn as one: who passes the token to whom, along the upper edge and back along the lower one. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sniff.tui.charts import bar

ARROWS = {True: " ──▶ ", False: " ◀── "}
CLOSE = {True: "▶", False: "◀"}
LONGEST_BAR = 60


def ring_picture(order: Sequence[int], noun: str, width: int, said: str = "") -> list[str]:
    """Lines of at most `width` cells; none where no closed ring was seen. The token goes clockwise. `said`: what
    stands inside the ring."""
    if len(order) < 2:
        return [f"{noun} {order[0]} alone passes the token to itself: {order[0]} ↻"] if order else []
    half = (len(order) + 1) // 2
    there, back = list(map(str, order[:half])), list(map(str, reversed(order[half:])))
    for arrows in (ARROWS, CLOSE):
        upper, lower = arrows[True].join(there), arrows[False].join(back)
        inner = max(len(upper) + 8, len(lower) + 8, len(said) + 2)
        if inner + 2 <= width:
            break
    else:
        return ["ring: " + " ▶ ".join(map(str, (*order, order[0])))]
    return [
        f"┌──▶ {upper} {'─' * (inner - len(upper) - 6)}─┐",
        "│" + said.center(inner) + "│",
        f"└─── {lower} ◀{'─' * (inner - len(lower) - 7)}─┘",
    ]


def share_bars(shares: Mapping[int, float], noun: str, width: int) -> list[str]:
    """How much of the time each master has the token, a bar each, the longest first."""
    room = max(8, min(LONGEST_BAR, width - 16))
    ordered = sorted(shares.items(), key=lambda item: -item[1])
    return [f"{noun} {mac:<4}{bar(share, room)} {share:>5.1%}" for mac, share in ordered]
