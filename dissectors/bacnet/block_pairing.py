"""The bulk form of the MS/TP tracker, as the engine asks for it (`dissectors.columns.Pairing`)."""

from __future__ import annotations

from dissectors.bacnet.pairing import Pairing, prepare
from dissectors.bacnet.tracker import MstpTracker
from dissectors.columns import FrameColumns, Octets, Run, Times
from dissectors.line import Timing
from dissectors.tracker import Tracker


class MstpBlockPairing:
    """Runs of some frames."""

    def __init__(
        self, tracker: MstpTracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times
    ) -> None:
        self._tracker = tracker
        self._pairing = Pairing(frames, octets, timing, prepare(tracker), slack)

    def run(self, begin: int, no: int) -> Run | None:
        """See `dissectors.columns.BlockPairing`."""
        made = self._pairing.run(self._tracker, begin, no) if begin else None
        if made is None:
            return None
        closing = self._pairing.rows.closing
        first, beyond = closing.searchsorted((made.begin, made.end)).tolist()
        return Run(made.begin, made.end, made.placements, made.transactions, closing[first:beyond])


def pairing(tracker: Tracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times) -> MstpBlockPairing:
    """For the manifest."""
    assert isinstance(tracker, MstpTracker)
    return MstpBlockPairing(tracker, frames, octets, timing, slack)
