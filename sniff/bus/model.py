"""A bus as all faces see it: one set of observers, fed once, whoever asks: screen, recording, report, command line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

from dissectors.findings import Finding
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from sniff.analysis.health import HealthReport, health_of
from sniff.analysis.judging import Judging, LineJudging
from sniff.analysis.load import KEPT_SECONDS
from sniff.analysis.summary import Summary
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, Session

if TYPE_CHECKING:
    from dissectors.token_ring import RingWindow
    from sniff.analysis.point_columns import TableSamples
    from sniff.analysis.point_reader import PointReader, Sample
    from sniff.analysis.points import PointTable
    from sniff.analysis.polls import Polls
    from sniff.analysis.register_series import RegisterSeries
    from sniff.engine.table import Table


NOTHING_HEARD = "LN002"


def _never() -> bool:
    return False


def _nobody() -> None:
    return None


class BusModel:
    """What is counted, found and measured on one bus.

    `summary`: counts, stations, load. `judging`: the rules. `version` changes whenever anything changed.
    `reads_points`: whether values and requests are read at all. `is_early`: of a live bus, whether it was listened to
    for so short a time that silence says nothing of it; `listened_until`: ns, up to when, None where nobody listens.
    """

    def __init__(
        self,
        session: Session,
        dissector: Dissector,
        devices: Devices | None = None,
        kept_seconds: int = KEPT_SECONDS,
        with_points: bool = True,
    ) -> None:
        """`with_points`: else neither values nor requests are read, which costs as much as a third of the judging."""
        self.reads_points = with_points
        self.devices = devices or Devices()
        self.summary = Summary(session.line, kept_seconds=kept_seconds)
        self._fresh: list[Sample] | TableSamples = []
        self.is_early: Callable[[], bool] = _never
        self.listened_until: Callable[[], int | None] = _nobody
        self.version = 0
        self._use(session, dissector)

    def _use(self, session: Session, dissector: Dissector) -> None:
        self.session = session
        self.dissector = dissector
        self.judging = Judging(session, dissector, self.devices)
        for name in ("reader", "polls"):  # those of other settings
            vars(self).pop(name, None)
        if self.reads_points:
            self.read_points()
        self._found: tuple[int, tuple[Finding, ...]] = (-1, ())

    # what is made, and imported, only where values and requests are read

    @cached_property
    def reader(self) -> PointReader:
        """Values by device, as they come."""
        from sniff.analysis.point_reader import PointReader

        return PointReader(self.dissector, self.devices)

    @cached_property
    def points(self) -> PointTable:
        """The latest of them."""
        from sniff.analysis.points import PointTable

        return PointTable()

    @cached_property
    def series(self) -> RegisterSeries:
        """What the registers of stations without a profile did."""
        from sniff.analysis.register_series import RegisterSeries

        return RegisterSeries()

    @cached_property
    def polls(self) -> Polls:
        """The master's programme."""
        from sniff.analysis.polls import Polls

        return Polls(self.dissector)

    def settle(self, session: Session, dissector: Dissector) -> None:
        """Go on with settings that were found; what was heard during their search says nothing of the bus."""
        self.summary.use(session.line)
        self._use(session, dissector)
        self.version += 1

    def read_points(self) -> None:
        """From now on values and requests are read, too."""
        self.reads_points = True
        _ = self.reader, self.points, self.series, self.polls  # now: others may look at them from threads of their own

    def add(self, output: Output) -> None:
        """Take what the engine gave."""
        self.version += 1
        self.summary.add(output)
        self.judging.add(output)
        if self.reads_points:
            self._fresh = self.reader.add(output)
            self.points.add(self._fresh)
            self.series.add(one for one in self._fresh if self._is_undescribed(one))
            self.polls.add(output)

    def add_table(self, table: Table) -> None:
        """Take many rows at once."""
        self.version += 1
        self.summary.add_table(table)
        self.judging.add_table(table)
        if self.reads_points:
            from sniff.analysis.point_columns import TableSamples, add_to
            from sniff.analysis.table_points import samples_of

            self._fresh = samples = samples_of(self.reader, table)
            add_to(self.points, samples)
            undescribed = [one for one in samples.others if self._is_undescribed(one[1])]
            self.series.add_samples(TableSamples(samples.plain, undescribed))
            self.polls.add_table(table)

    @property
    def samples(self) -> Sequence[Sample]:
        """Values that the newest rows completed, in their order."""
        if not isinstance(self._fresh, list):
            self._fresh = list(self._fresh.in_order())
        return self._fresh

    def _is_undescribed(self, sample: Sample) -> bool:
        return self.devices.at(sample.device) is None

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        self.version += 1
        self.summary.add_line_event(event)
        self.judging.add_line_event(event)
        if self.reads_points:
            self.polls.add_line_event(event)
            if event.kind.is_hole:
                self.points.miss(event.time)

    def lend(self) -> LineJudging:
        """What judges the line, which somebody else feeds until it is taken back (`two_processes.py`)."""
        lent = self.judging.of_line
        assert lent is not None
        self.judging.of_line = None
        return lent

    def take_back(self, part: LineJudging) -> None:
        """The same as it has become."""
        self.judging.of_line = part

    def findings(self) -> tuple[Finding, ...]:
        """What the rules found so far, the gravest first."""
        version, found = self._found
        if version != self.version:
            found = self.judging.findings()
            self._found = self.version, found
        if found and not self.summary.octets and self.is_early():
            return tuple(one for one in found if one.code != NOTHING_HEARD)
        now = self.listened_until()
        silent = None if now is None else self.judging.line.lasting_silence(now)
        return found if silent is None else _among(found, silent)

    def health(self) -> HealthReport:
        """How the bus and its stations fare."""
        return health_of(self.summary, self.findings(), self.dissector.noun)

    def ring(self) -> Any:
        """The token ring so far, a value of the protocol's own; None where no token is passed."""
        return self.judging.ring()

    def ring_window(self) -> RingWindow | None:
        """What is new in it since this was called the last time; the first time is not told of. None where no token is
        passed."""
        return self.judging.ring_window()


def _among(found: tuple[Finding, ...], one: Finding) -> tuple[Finding, ...]:
    """Findings with one more at its place, which takes that of one about the same."""
    others = [other for other in found if other.key != one.key]
    place = next((at for at, other in enumerate(others) if other.severity < one.severity), len(others))
    return (*others[:place], one, *others[place:])
