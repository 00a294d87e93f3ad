"""A result of the engine on its way into a recording: a value, /bus, /nodes or /findings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class DerivedMessage:
    """One message before it is in a file; not for /raw and /line, which hold no results.

    `schema`: a name of `topics.SCHEMAS`. `log_time`: when it was so, ns; `publish_time`: since when it had been.
    `metadata`: of the channel, taken when the topic is new in a file.
    """

    topic: str
    schema: str
    log_time: int
    publish_time: int
    data: bytes
    metadata: Mapping[str, str] = field(default_factory=dict)
