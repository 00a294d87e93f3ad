"""The bulk form of the MS/TP tracker, as the engine asks for it (`dissectors.columns.Pairing`)."""

from __future__ import annotations

import numpy as np

from dissectors.bacnet.pairing import Pairing, prepare
from dissectors.bacnet.tracker import MstpTracker
from dissectors.columns import FrameColumns, Octets, Run, Times
from dissectors.line import Timing
from dissectors.tracker import Tracker


class MstpBlockPairing:
    """Runs of some frames; none where reads came late, since intervals are taken as wide as the adapter makes them."""

    def __init__(
        self, tracker: MstpTracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times
    ) -> None:
        self._tracker = tracker
        late = bool((slack > timing.latency).any())
        self._pairing = None if late else Pairing(frames, octets, timing, prepare(tracker))

    def run(self, begin: int, no: int) -> Run | None:
        """See `dissectors.columns.BlockPairing`."""
        if self._pairing is None or not begin:
            return None
        made = self._pairing.run(self._tracker, begin, no)
        if made is None:
            return None
        closing = self._pairing.rows.closing
        first, beyond = np.searchsorted(closing, (made.begin, made.end)).tolist()
        return Run(made.begin, made.end, made.placements, made.transactions, closing[first:beyond])


def pairing(tracker: Tracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times) -> MstpBlockPairing:
    """For the manifest."""
    assert isinstance(tracker, MstpTracker)
    return MstpBlockPairing(tracker, frames, octets, timing, slack)
