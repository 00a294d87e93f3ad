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
            "1.2.4). Answers N00 without an identify between them count as one reset. Only noted where the master "
            "had sent a warm reset (0/8) within a minute before.",
            "power loss, watchdog or a warm reset; its overrides may be lost",
            "look at its supply and its fault memory at that time",
        ),
        Rule(
            "N2002",
            Severity.WARNING,
            "point does not exist",
            "A station refuses a read, write or override with N11: undefined object, or an attribute that is reserved "
            "or absent (TECO F510 manual 1.2.4; Danfoss MG.11.G1). Four points of one station or more are one finding.",
            "the master's point list does not fit this device",
            "compare the master's object numbers with the device's table; some count from 0, some from 1",
        ),
        Rule(
            "N2003",
            Severity.WARNING,
            "slow station",
            "Time from the end of a command to the begin of its answer, over 250 ms even when all that the adapter may "
            "have added is taken off. 250 ms is the shortest message timeout of an NAE; the standard's own limit is "
            "not public. Only a note where no answer of it came too late for the master, or only one, or so few as in "
            "N2004, or where so few are slow: a busy computer, or one pause of the whole bus, explains those.",
            "a station busy with other work, or a gateway in between",
            "raise the master's message timeout, or relieve the station",
            explains=("N2005", "N2011"),
        ),
        Rule(
            "N2004",
            Severity.WARNING,
            "damaged frames",
            "Frames whose checksum is wrong or whose form is spoilt, counted at who sent them: an answer carries no "
            "address and is counted at the station that was asked. A sender is named that has over four times the "
            "damage that noise at the rate of all others would have done while it sends, or all of it where chance "
            "would seldom have struck it alone; up to four in a row with no whole answer between count as one, for a "
            "master repeats into the same disturbance. Else it is the bus's. One alone, or fewer than 1 in 100 and "
            "not surely over two a minute, is only noted: Johnson Controls calls up to two a minute tolerable.",
            "noise, wrong termination or bias, or two that talk at once",
            "if one station only: its stub, its connector; if all: termination, bias, ground",
            explains=("N2005", "LN101", "LN103", "LN204"),
        ),
        Rule(
            "N2005",
            Severity.WARNING,
            "no answer",
            "Commands that no answer followed, not even a late one. An error where the master turned to a station "
            "several times, or over 11 times at once, and got none, or none to the last five and more, up to the end. "
            "A single turn is only noted, or fewer than 1 in "
            "100 and not surely over two a minute; and so are many addresses that are only asked who they are: a scan. "
            "Where several are asked and nobody but the master is heard, one finding names the bus.",
            "station off, wrong address or wrong baud rate, or a broken wire; all of them: one between them and here",
            "check its supply, address and wiring, and whether the master has its values: then only this tap does not "
            "hear it",
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
            "Commands that begin in the middle of another one, or follow one within 100 ms and sooner than the station "
            "asked ever answered; answers in their usual time, within 100 ms, and yet after the next command. No "
            "master does that. At least two such, and one for 20 damaged commands; or at least three damaged commands "
            "within 100 ms behind one that nothing followed, far more than of all commands, or five other commands, "
            "sooner behind it than three in four come behind an answer (chance under 1 in 500).",
            "two masters on one bus, or a commissioning tool beside the controller",
            "find the second master and take it off",
            explains=(
                *("N2004", "N2005", "N2008", "N2010", "N2011", "N2013", "N2014", "N2015", "N2016", "N2017"),
                *("LN1", "LN2", "LN302", "LN303"),
            ),
        ),
        Rule(
            "N2008",
            Severity.ERROR,
            "answered twice",
            "A second, different good answer came to one command that was sent once, sooner than a command that was "
            "missed at this tap would let one come; not soon behind commands to a station "
            "that is late as often, whose answers they may be. A single time it is only noted.",
            "two stations have the same address",
            "switch the station off and see whether something still answers",
            explains=("N2004", "N2011", "N2013", "N2014", "N2016", "LN101", "LN103", "LN2", "LN303"),
        ),
        Rule(
            "N2009",
            Severity.NOTE,
            "command refused",
            "A station refuses commands with an error code other than N00 and N11. A warning where it refuses all, "
            "five or more.",
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
            "Answers without a command before them, or after the master had gone on. A single one, or fewer than 1 in "
            "100 and not surely over two a minute, is only noted.",
            "a master that is not heard at this place of the bus, or a station far slower than the master's timeout",
            "compare the answer times with the master's timeout; move the tap",
            explains=("N2005", "N2003", "N2015", "N2016", "LN1", "LN201", "LN202", "LN203", "LN204"),
        ),
        Rule(
            "N2012",
            Severity.ERROR,
            "damaged always in the same way",
            "At least three damaged frames of one sender, and 4 in 5 of all its damaged ones, are right but for one "
            "and the same thing: the first or the last octet missing or spoilt, the two checksum digits swapped, or "
            "(six at least) the checksum wrong by one and the same number. "
            "What they were follows from the checksum and from what was asked, and is shown, marked as repaired. Where "
            "all stations have it, or the only one that is heard lacks its first or last octet, one finding names "
            "the bus. A warning where fewer than half of its frames have it.",
            "first octet: a driver or converter that is switched on too late; last octet: one that lets go too soon; "
            "checksum: the program of the device",
            "the direction control of that station and of the converter in between; the same with another adapter",
            explains=("N2004", "N2005", "LN003", "LN1", "LN2"),
        ),
        Rule(
            "N2013",
            Severity.WARNING,
            "answer repeated",
            "The same good answer came again to one command, later than an echo would. A single one, or fewer than 1 "
            "in 100 and not surely over two a minute, is only noted. It proves no second station: the octets are the "
            "same. Where half of the answers of each of several stations do so, one finding names the bus.",
            "a repeater or converter that gives back what it hears, a station that sends twice, or two stations with "
            "one address that hold the same",
            "switch the station off and see whether something still answers; then the repeater",
            explains=("N2011", "LN204"),
        ),
        Rule(
            "N2014",
            Severity.WARNING,
            "answers into what comes next",
            "Damage that stands while the answer of one station is overdue, at least three times, and far more often "
            "then than in frames of the same senders elsewhere (chance under 1 in 500); or commands of which so many "
            "are damaged directly behind one to it that nothing followed. An answer after the master's "
            "timeout falls on the next command or on the answer to it, and two senders at once are no frame. Where "
            "nearly all damage stands there, but so little that chance may have put it there, the bus is told of and "
            "nobody named.",
            "the station answers when its master has given up; those whose frames are hit are not to blame",
            "raise the message timeout of the master, or find out why this station is slow; nobody else's cable",
            explains=("N2003", "N2004", "N2005", "N2006", "N2011", "N2012", "LN1", "LN2"),
        ),
        Rule(
            "N2015",
            Severity.WARNING,
            "answers not heard here",
            "Commands without an answer, behind which the master asks something else after one try, within three "
            "quarters of the shortest time that it waited before it repeated one (of 250 ms, the least that an NAE can "
            "be given, where it repeated none). So it had an answer. Asking who is there does not count; nor does "
            "anything of a master that surely sends by a clock, whose commands follow each other in steadier steps "
            "than its pauses behind answers are: such a station is N2005. A single one, "
            "or fewer than 1 in 100 and not surely over two a minute, is only noted.",
            "a tap that does not hear what the master does: behind a repeater, on one pair of a four-wire line, loose; "
            "no station is to blame",
            "move the tap towards the stations that are not heard; where none is, listen on the other pair",
            explains=("N2005",),
        ),
        Rule(
            "N2016",
            Severity.WARNING,
            "answers without what was asked for",
            "A station acknowledges reads of attributes whose length is known, and gives no value or one of another "
            "length: at least three times, and 1 in 10 of its reads. Not behind a command that nothing followed, "
            "whose late answer it may be. What it always gives at a length of its own is only noted.",
            "a fault in the program of the device, or a master and a station that are out of step, so that one "
            "takes the answer to another command",
            "what the master shows for these points; the device's list of points",
        ),
        Rule(
            "N2017",
            Severity.WARNING,
            "master gives up too soon",
            "Good answers of two stations or more that come when the master has gone on, three at least; where half of "
            "the stations answer late or have damage directly behind waits for them in vain, 1 in 3 times not the same "
            "one; and where 3 in 4 damaged frames, if any are, stand while an answer is overdue.",
            "the master's message timeout is shorter than its stations need; late answers fall on what it sends next",
            "raise the master's message timeout above the slowest answer, with room; then look at what is left",
            explains=(
                *("N2003", "N2004", "N2005", "N2006", "N2010", "N2011", "N2012", "N2013", "N2014", "N2015", "N2016"),
                *("LN1", "LN2", "LN303"),
            ),
        ),
    )
}
"""The catalogue, by code."""
