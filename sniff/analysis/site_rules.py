"""The rules of a site: what several buses, heard on one clock, say together that none says alone. SB0xx."""

from __future__ import annotations

from dissectors.findings import Rule, Severity

SITE = "site"
"""What these findings are about, in words."""

_ALL = (
    Rule(
        "SB001",
        Severity.WARNING,
        "buses stopped at one moment",
        "Every bus that was heard fell silent (LN304), or lost all its stations (LN305), and as far as the traffic of "
        "each tells it may have been one and the same moment, known to 2 s and to a hundredth of the time listened. An "
        "error where a bus did not come back.",
        "what all buses share failed: the supply of the plant or of a cabinet, one controller with all of them on it",
        "supply, fuses and the controller's log at that moment; the single buses are most likely well",
        explains=("LN304", "LN305", "MB001", "MB002", "MB003", "MB020", "MB104", "MB105", "N2005", "N2010", "N2015"),
    ),
    Rule(
        "SB002",
        Severity.WARNING,
        "adapters unplugged at one moment",
        "The ports of two buses or more went away within 2 s of each other.",
        "a hub that lost its power, or the computer's USB was reset: nothing of the buses",
        "the hub's supply and cable; what else hangs on it",
        explains=("LN006", "LN002", "LN304"),
    ),
    Rule(
        "SB003",
        Severity.NOTE,
        "two adapters on one line",
        "Nine in ten frames of either bus, requests and answers, come on the other as well, octet by octet, each after "
        "the same time; that time varies less than a third of what the master's intervals vary by themselves, and "
        "those vary by more than the adapters hold back. Of at least 60 frames.",
        "both adapters hear one line, or two halves of it with a repeater between",
        "whether that is meant; then `taps` compares the two",
    ),
    Rule(
        "SB004",
        Severity.NOTE,
        "one master on two buses",
        "Nine in ten requests of either bus come on the other as well, each after the same time, within the limits of "
        "SB003, while the answers do not. Of at least 30 requests.",
        "one master runs the same programme on both buses, in step: a slow station on one may hold up the other",
        "whether both buses are meant to be polled alike",
    ),
    Rule(
        "SB005",
        Severity.INFO,
        "a gateway between two buses",
        "Eight in ten answered requests to a station are asked again on another bus, of the same kind, address and "
        "number, and answered there, all before the answer comes on the first; and eight in ten requests of that kind "
        "on the second bus are such. Of at least 20.",
        "a gateway or router hands requests on from bus to bus",
        "where answers are slow: whether the gateway takes the time, or the station behind it",
    ),
)

SITE_RULES: dict[str, Rule] = {rule.code: rule for rule in _ALL}
"""The catalogue by code."""
