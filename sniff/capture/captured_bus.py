"""One bus of a capture: its source, where what comes of it is kept, and how both are doing."""

from __future__ import annotations

from dataclasses import dataclass, field

from dissectors.frame import Chunk
from dissectors.line import NS_PER_S
from sniff.capture.disk_watch import DiskWatch
from sniff.capture.frame_counter import FrameCounter
from sniff.capture.ipc import Status
from sniff.capture.trigger_ring import TriggerRing
from sniff.engine.session import Item
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.writer import Recorder
from sniff.sources import Source

FAR = 1 << 62
"""ns; when nothing is due."""


@dataclass(slots=True)
class CapturedBus:
    """`index`: its place among the buses. `recorder`, `ring`, `counter`: None where nothing is recorded, all is, or
    nobody counts.

    `seeks_line`, `is_unknown`: whether its line settings, and anything of it, are searched for. `fd`: what is waited on
    for it; `due`: when it is looked at without, ns. `octets`: that came. `ended`: nothing more comes.
    """

    index: int
    source: Source
    recorder: Recorder | None = None
    ring: TriggerRing | None = None
    counter: FrameCounter | None = None
    seeks_line: bool = False
    is_unknown: bool = False
    fd: int | None = None
    due: int = FAR
    octets: int = 0
    ended: bool = False
    _disk: DiskWatch = field(default_factory=DiskWatch)

    def keep(self, item: Item) -> None:
        """Have what came recorded and counted."""
        if self.ring is not None:
            self.ring.take(item)
        elif self.recorder is not None:
            if isinstance(item, Chunk):
                self.recorder.chunk(item)
            else:
                self.recorder.line(item)
        if self.counter is not None:
            self.counter.item(item)

    def keep_derived(self, derived: DerivedMessage) -> None:
        """Have a result recorded, where what it is of is."""
        if self.recorder is not None and (self.ring is None or self.ring.keeps(derived.log_time)):
            self.recorder.derived(derived)

    def file_news(self, now: int, was_held_up: bool) -> list[str]:
        """What is new about its file and the disk. `was_held_up`: this process was not let run, and so is behind."""
        recorder = self.recorder
        if recorder is None:
            return []
        told = [recorder.notices.popleft() for _ in range(len(recorder.notices))]
        if recorder.trouble is not None or was_held_up:  # is said, and explains that nothing is written
            self._disk.excuse(recorder.lost_octets)
            return told
        slow = self._disk.see(now, recorder.behind(now), recorder.syncing, recorder.lost_octets)
        return told if slow is None else [*told, slow]

    def status(self, dropped: int, priority: str, closing: bool) -> Status:
        """How it is doing; the rest is known to the loop: octets dropped on the way to the main process, what priority
        was granted, whether files are being closed."""
        recorder = self.recorder
        if recorder is None:
            return Status(self.index, octets=self.octets, dropped=dropped, priority=priority)
        return Status(
            self.index,
            "" if recorder.gone else str(recorder.path),
            recorder.size,
            self.octets,
            dropped,
            recorder.lost_octets,
            priority,
            recorder.trouble or "",
            self._disk.behind / NS_PER_S,
            recorder.unwritten,
            closing,
            0 if self.ring is None else self.ring.omitted,
            recorder.taken_away,
        )
