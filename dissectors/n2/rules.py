"""The rules of N2: what each finds, against which limit and from which source, and what to check next."""

from __future__ import annotations

from dissectors.findings import Rule, Severity

RULES: dict[str, Rule] = {
    rule.code: rule
    for rule in (
        Rule(
            "N2001",
            Severity.WARNING,
            "station has reset",
            "A station answers N00 to everything after power-up or reset, until it is identified (TECO F510 manual "
            "1.2.4). Answers N00 without an identify between them count as one reset.",
            "power loss, watchdog or a warm reset; its overrides may be lost",
            "look at its supply and its fault memory at that time",
        ),
        Rule(
            "N2002",
            Severity.WARNING,
            "point does not exist",
            "A station refuses a read, write or override with N11: undefined object, or an attribute that is reserved "
            "or absent (TECO F510 manual 1.2.4; Danfoss MG.11.G1).",
            "the master's point list does not fit this device",
            "compare the master's object numbers with the device's table; some count from 0, some from 1",
        ),
        Rule(
            "N2003",
            Severity.WARNING,
            "slow station",
            "Time from the end of a command to the begin of its answer, over 250 ms even when all that the adapter may "
            "have added is taken off. 250 ms is the shortest message timeout of an NAE; the standard's own limit is "
            "not public.",
            "a station busy with other work, or a gateway in between",
            "raise the master's message timeout, or relieve the station",
        ),
        Rule(
            "N2004",
            Severity.WARNING,
            "damaged frames",
            "Frames of or to a station whose checksum is wrong or whose form is spoilt. An answer carries no address: "
            "it is counted at the station that was asked. A single one, or fewer than 1 in 100 and at most two a "
            "minute, is only noted: Johnson Controls calls up to two a minute tolerable.",
            "noise, wrong termination or bias, or two stations that talk at once",
            "if one station only: its stub, its connector; if all: termination, bias, ground",
        ),
        Rule(
            "N2005",
            Severity.WARNING,
            "no answer",
            "Commands that no answer followed before the next command. An error where none of several got one; a "
            "single one, or fewer than 1 in 100 and at most two a minute, is only noted.",
            "station off, wrong address or wrong baud rate, or a broken wire",
            "check its supply, address and wiring; take it out of the master's list when it is gone",
        ),
        Rule(
            "N2006",
            Severity.NOTE,
            "override left on a point",
            "A point was overridden and acknowledged, and for over 10 minutes neither overridden again nor released. "
            "Seen from the first override in the capture; a reset of the station ends it.",
            "someone commanded the point by hand and forgot it; the station's own control does not act on it",
            "release it at the master if it is not meant; an F510 keeps the value even then",
        ),
        Rule(
            "N2007",
            Severity.ERROR,
            "two masters",
            "Commands that break into another command, or follow an unanswered one sooner than 100 ms although it is "
            "no repeat: no master gives up so soon. At least two such.",
            "two masters on one bus, or a commissioning tool beside the controller",
            "find the second master and take it off",
            explains=("N2004", "N2005", "N2008", "N2010", "N2011", "LN1", "LN2"),
        ),
        Rule(
            "N2008",
            Severity.ERROR,
            "answered twice",
            "A second answer came to one command that was sent once.",
            "two stations have the same address",
            "switch the station off and see whether something still answers",
            explains=("N2004", "N2011", "LN101", "LN103", "LN2"),
        ),
        Rule(
            "N2009",
            Severity.NOTE,
            "command refused",
            "A station refuses commands with an error code other than N00 and N11.",
            "the master asks for what the device does not do",
            "look at the error code and at the command that was refused",
        ),
        Rule(
            "N2010",
            Severity.NOTE,
            "identified again",
            "A station was identified anew although it had not reported a reset.",
            "the master has restarted, or had lost the station",
            "look at the master's log at that time",
        ),
        Rule(
            "N2011",
            Severity.WARNING,
            "answer that nobody asked for",
            "Answers without a command before them, or after the master had gone on.",
            "a master that is not heard at this place of the bus, or a station far slower than the master's timeout",
            "compare the answer times with the master's timeout; move the tap",
        ),
    )
}
"""The catalogue, by code."""
