"""The status of a box: values that cross to whoever asks as JSON. Pure.

Times are ns since the epoch by the wall clock as it is now, also of what happened before the clock was set.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from enum import Enum
from typing import Any

from sniff.analysis.json_text import iso


class State(Enum):
    """How a bus is. HEARD: octets come. SILENT: its port is there, and nothing comes. DOWN: its port is not there.
    OVER: nobody listens, because the capture is not running."""

    HEARD = "heard"
    SILENT = "silent"
    DOWN = "down"
    OVER = "over"


@dataclass(frozen=True, slots=True)
class FindingLine:
    """A finding that has no other as its cause. `last`: None where it is about no moment."""

    code: str
    severity: str
    subject: str
    seen: str
    last: int | None


@dataclass(frozen=True, slots=True)
class BusStatus:
    """One bus. `since`: of its state; `why`: of DOWN and OVER, in words. `heard_at`: when octets came last, None for
    never. `octets`, `lost`, `unseen`: since the box was started: heard, never to be in a file, not looked at. `downs`,
    `away`: how often its port was gone, and for how many ns altogether. `load`: of the last seconds, 0 … 1.
    `searching`: whether its settings are still looked for."""

    name: str
    port: str
    line: str
    protocol: str
    state: State
    since: int
    why: str = ""
    heard_at: int | None = None
    octets: int = 0
    lost: int = 0
    unseen: int = 0
    downs: int = 0
    away: int = 0
    frames: int = 0
    damaged: int = 0
    load: float = 0.0
    health: float | None = None
    searching: bool = False
    findings: tuple[FindingLine, ...] = ()
    more_findings: int = 0

    @property
    def is_well(self) -> bool:
        """Whether nothing is lost and somebody speaks."""
        return self.state is State.HEARD and not self.lost


@dataclass(frozen=True, slots=True)
class Recovered:
    """A part that an earlier run left cut. `text`: what was wrong with it; `closed`: whether it is whole now, else
    `why_not`."""

    name: str
    text: str
    closed: bool
    why_not: str = ""


@dataclass(frozen=True, slots=True)
class OutletLine:
    """Who is told what is heard. `where`: whom, in words without secrets. `connected`: whether that gets through now,
    `trouble`: why not. `sent`, `dropped`: how much was delivered and never will be; None where others come and ask."""

    name: str
    where: str
    connected: bool = True
    trouble: str = ""
    sent: int | None = None
    dropped: int | None = None


@dataclass(frozen=True, slots=True)
class BoxStatus:
    """The box. `recording`: whether a capture runs now; `trouble`: what is wrong with it or with the disk, in words, ""
    while all is well. `restarts`: how often the capture had to be started anew, and `last_restart`: why. `current`: the
    part being written; `parts`, `parts_size`: how many there are, and their octets. `free`, `keep_free`: octets of the
    disk. `behind`: s by which the disk is late. `clock_offset`: ns by which the clock was set since this capture began.
    `site`: what its buses say together. `outlets`: who else is told.
    """

    name: str
    version: str
    pid: int
    now: int
    since: int
    recording: bool
    trouble: str = ""
    capture_pid: int | None = None
    capture_since: int | None = None
    priority: str = ""
    restarts: int = 0
    last_restart: str = ""
    folder: str = ""
    current: str = ""
    parts: int = 0
    parts_size: int = 0
    free: int | None = None
    keep_free: int | None = None
    behind: float = 0.0
    clock_offset: int = 0
    alerts_failed: int = 0
    alerts_dropped: int = 0
    recovered: tuple[Recovered, ...] = ()
    site: tuple[FindingLine, ...] = ()
    outlets: tuple[OutletLine, ...] = ()
    buses: tuple[BusStatus, ...] = field(default_factory=tuple)

    @property
    def is_well(self) -> bool:
        """Whether everything that ought to be heard and kept is."""
        return self.recording and not self.trouble and all(bus.is_well for bus in self.buses)

    def to_json(self) -> dict[str, Any]:
        """Plain values; times twice: as they are, and for people."""
        value = asdict(self)
        for bus in value["buses"]:
            bus["state"] = bus["state"].value
            bus["since_t"] = iso(bus["since"])
            bus["heard_at_t"] = None if bus["heard_at"] is None else iso(bus["heard_at"])
        return {"well": self.is_well, "t": iso(self.now), "since_t": iso(self.since), **value}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> BoxStatus:
        """What `to_json` gave, also of another version of this program. Raises ValueError, KeyError or TypeError."""
        buses = tuple(
            BusStatus(
                **{
                    **_known(BusStatus, bus),
                    "state": State(bus["state"]),
                    "findings": tuple(FindingLine(**_known(FindingLine, one)) for one in bus["findings"]),
                }
            )
            for bus in value["buses"]
        )
        site = tuple(FindingLine(**_known(FindingLine, one)) for one in value.get("site", ()))
        recovered = tuple(Recovered(**_known(Recovered, one)) for one in value["recovered"])
        outlets = tuple(OutletLine(**_known(OutletLine, one)) for one in value.get("outlets", ()))
        told = {"buses": buses, "recovered": recovered, "site": site, "outlets": outlets}
        return cls(**{**_known(cls, value), **told})


def _known(kind: type, value: Mapping[str, Any]) -> dict[str, Any]:
    names = {one.name for one in fields(kind)}
    return {name: each for name, each in value.items() if name in names}
