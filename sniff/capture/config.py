"""The orders of a capture process: what it is asked to do; they cross to it as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from dissectors import registry
from dissectors.line import LineSettings


@dataclass(frozen=True, slots=True)
class SourceSpec:
    """One bus to listen to. `spec`: as `open_source` takes it; `protocol`: a registry name; `bus`: its short name.

    `notes`: of the session, for the recording. `unknown`: "line", "protocol" or both, when they are searched for:
    what stands there is only where the search begins. `profiles`: in force, name → document, for the recording.
    `patient`: a port that cannot be had is waited for, and said, instead of ending the capture.
    """

    spec: str
    line: LineSettings = field(default_factory=LineSettings)
    protocol: str = registry.DEFAULT
    bus: str = "bus"
    notes: Mapping[str, str] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()
    profiles: Mapping[str, str] = field(default_factory=dict)
    patient: bool = False


@dataclass(frozen=True, slots=True)
class RecordSpec:
    """Where to record. `rotation`, `keep`: as the recorder takes them ("size:64MB", "time:1h"; parts to keep).

    `before`, `after`: ns round a trigger that are kept, and nothing else is; None: everything is kept. `keep_free`:
    octets of the disk that stay free; the oldest parts go for them. `keep_of_all`: `keep` counts the parts of earlier
    recordings of this name, too.
    """

    path: str
    rotation: str | None = None
    keep: int | None = None
    before: int | None = None
    after: int | None = None
    keep_free: int | None = None
    keep_of_all: bool = False


@dataclass(frozen=True, slots=True)
class CaptureConfig:
    """Everything the capture process is told. Its limits: `duration`, ns, and `count`, frames; None for no end.

    `watched`: whether somebody looks at what comes as it comes; else it is sent less often.
    """

    sources: tuple[SourceSpec, ...]
    record: RecordSpec | None = None
    duration: int | None = None
    count: int | None = None
    watched: bool = True

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        value = asdict(self)
        for source, spec in zip(value["sources"], self.sources, strict=True):
            source["line"] = str(spec.line)
        return value

    @classmethod
    def from_json(cls, value: dict[str, Any]) -> CaptureConfig:
        """Read what `to_json` gave. Raises ValueError, KeyError or TypeError."""
        sources = tuple(
            SourceSpec(
                source["spec"],
                LineSettings.parse(source["line"]),
                source["protocol"],
                source["bus"],
                dict(source.get("notes", {})),
                tuple(source.get("unknown", ())),
                dict(source.get("profiles", {})),
                bool(source.get("patient", False)),
            )
            for source in value["sources"]
        )
        record = value["record"]
        return cls(
            sources,
            None if record is None else RecordSpec(**record),
            value["duration"],
            value["count"],
            value["watched"],
        )
