"""A status of a box that has seen trouble, for tests of how it is told."""

from __future__ import annotations

from sniff.box.status import BoxStatus, BusStatus, FindingLine, OutletLine, Recovered, State

S = 1_000_000_000
NOW = 1_772_359_200 * S
HOSTILE = "[red]\x1b[2J\x07 boom"

STATUS = BoxStatus(
    "site",
    "0.9",
    77,
    NOW,
    NOW - 7800 * S,
    True,
    capture_pid=78,
    capture_since=NOW - 3600 * S,
    priority="real-time",
    restarts=1,
    last_restart="capture process was ended by SIGKILL",
    folder="/var/lib/sniff485",
    current="site-0003.mcap",
    parts=3,
    parts_size=95_200,
    free=75_400_000_000,
    keep_free=10**9,
    clock_offset=86_400 * S,
    recovered=(Recovered("site-0002.mcap", "cut at octet 9", True),),
    outlets=(
        OutletLine("mqtt", "mqtts://broker:8883", False, "connection refused", 120, 9),
        OutletLine("metrics", "http://127.0.0.1:9485/metrics"),
    ),
    buses=(
        BusStatus("boiler", "/dev/ttyUSB0", "19200,8E1", "modbus-rtu", State.HEARD, NOW - 4 * S, "", NOW, 552, 7),
        BusStatus(
            "cellar",
            f"/dev/{HOSTILE}",
            "9600,8N1",
            "n2",
            State.DOWN,
            NOW - 90 * S,
            HOSTILE,
            downs=2,
            away=95 * S,
            findings=(FindingLine("LN006", "error", "adapter", HOSTILE, None),),
            more_findings=3,
        ),
    ),
)
