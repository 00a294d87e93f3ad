"""The catalogue of PROFIBUS rules, PB001 …"""

from __future__ import annotations

from dissectors.findings import Rule, Severity

_LINE = ("LN1", "LN2")

RULES: dict[str, Rule] = {
    rule.code: rule
    for rule in (
        Rule(
            "PB001",
            Severity.ERROR,
            "no answer",
            "A station is asked at least three times and never answers, with silence where the answer should be. Only "
            "noted where that was one request and its repeats, or where the master counts on (frame count bit) as it "
            "does after an answer: then it had one, and only this tap did not hear it. Polls for stations (FDL status) "
            "do not count: nobody need be there.",
            "no station at this address: off, set to another address, cut off, or without the bus's rate",
            "its supply, address switches, connector and terminators; if it is gone, take it out of the configuration; "
            "where the master counts on, move the tap",
            explains=("PB003", "PB007"),
        ),
        Rule(
            "PB002",
            Severity.NOTE,
            "some requests without answer",
            "A station answers, but not always. A warning from 3 and 1 in 100 requests on; those do not count after "
            "which the master counts on (frame count bit): it had the answer. An error where none of the last five and "
            "more was answered, up to the end.",
            "a loose connector, a station that is reset or too busy, disturbances that only it hears",
            "connector, shield and terminators at this station; whether it happens at certain times",
            explains=("PB003", "PB007"),
        ),
        Rule(
            "PB003",
            Severity.NOTE,
            "telegrams repeated",
            "The frame count bit shows that a request is the one directly before it once more, although that was "
            "answered well here: the master did not understand the answer. A warning from 3 and 1 in 100 requests on; "
            "about the bus where it is so of most stations. Repeats after no answer or a damaged one are counted "
            "there. Nothing is counted where octets were damaged in between: the request between may have been lost "
            "here.",
            "answers that reach this place of the bus and not the master, or none",
            "what is between the station and the master: connectors, terminators, a repeater; measure at the master",
        ),
        Rule(
            "PB004",
            Severity.ERROR,
            "parameter fault",
            "A slave's diagnosis says that it does not take its parameters (Prm_Fault). Only noted where that was told "
            "before the master gave any here, and not since: it speaks of an earlier start.",
            "parameters of another device or version: the GSD file of the project is not that of the device",
            "compare the parameters and the ident number of the project with the device",
            explains=("PB009",),
        ),
        Rule(
            "PB005",
            Severity.ERROR,
            "configuration fault",
            "A slave's diagnosis says that its modules are not those that the master configures (Cfg_Fault). Only "
            "noted where that was told before the master gave it anything here, and not since.",
            "modules missing, plugged otherwise or of another length than in the project",
            "compare the modules of the project, slot by slot, with those in the device",
            explains=("PB009",),
        ),
        Rule(
            "PB006",
            Severity.ERROR,
            "wrong ident number",
            "The ident number that the master gives with Set_Prm is not the one that the slave tells in its diagnosis.",
            "another kind of device than the project has at this address, or two addresses interchanged",
            "the type of the device, and its address switches",
            explains=("PB004", "PB009"),
        ),
        Rule(
            "PB007",
            Severity.WARNING,
            "dropped out of data exchange",
            "A slave that exchanged data wants new parameters, or refuses data, although nobody unlocked it. An error "
            "from three times on. Only noted where its master had asked nothing for longer than the watchdog (than "
            "ever before, where that was not heard), octets were damaged since its last answer, or the log has no "
            "times.",
            "its watchdog expired because requests did not reach it, its supply failed, or it restarted",
            "whether its master was silent before; the watchdog time in Set_Prm; the supply of the slave",
            explains=("PB002", "PB003", "PB009", "PB017"),
        ),
        Rule(
            "PB008",
            Severity.NOTE,
            "damaged telegrams",
            "Telegrams with a wrong sum, start or end. A warning from 3 and 1 in 100 on, tokens not counted; about "
            "one station, and 1 in 100 of its answers, where nine in ten damaged answers are its, although others "
            "answer too.",
            "reflections (terminators missing or too many), spurs, disturbances, two stations that send at once",
            "terminators at both ends and nowhere else, their supply, spurs, shields",
            explains=("PB002", "PB003", "PB007", "PB013", "PB014", *_LINE),
        ),
        Rule(
            "PB009",
            Severity.WARNING,
            "diagnosis",
            "A slave's newest diagnosis has something to tell (Ext_Diag), or it announced one with answers of high "
            "priority that its master does not fetch (20 in a row). A note where it is gone again.",
            "what the device says is wrong with itself or with what is connected to it",
            "the words of the diagnosis; what device blocks mean the maker's manual tells",
        ),
        Rule(
            "PB010",
            Severity.ERROR,
            "answered twice",
            "A second, different good answer came to one request, with nothing damaged between. An error from 3 and 1 "
            "in 100 requests on.",
            "two stations have the same address",
            "switch the station off and see whether something still answers",
            explains=("PB002", "PB003", "PB007", "PB008", *_LINE, "LN303"),
        ),
        Rule(
            "PB011",
            Severity.WARNING,
            "belongs to another master",
            "A master gives parameters to a slave, and the diagnosis that it fetches then names another master, or "
            "says that the slave is locked by one. Who only reads a diagnosis does not count.",
            "two masters have the same slave in their projects",
            "decide which master the slave belongs to, and take it out of the other one's project",
            explains=("PB017",),
        ),
        Rule(
            "PB012",
            Severity.WARNING,
            "master in Clear",
            "Data is exchanged for more than five seconds while the master's last Global_Control to all says Clear, "
            "and all outputs are zero. Only noted where octets were damaged since: its end may be lost there.",
            "the controller is in stop, or one of its slaves is missing and it clears the others (auto clear)",
            "the controller's mode switch and its fault list",
        ),
        Rule(
            "PB013",
            Severity.WARNING,
            "token lost",
            "A master made a token of its own in a ring that was running, after its holder had been silent. That the "
            "old holder then goes on as if nothing had been is part of it.",
            "the token was damaged, or its holder fell silent: switched off, restarted, disturbed",
            "who held the token before; terminators; whether that master restarted",
            explains=("PB007", "PB014"),
        ),
        Rule(
            "PB014",
            Severity.NOTE,
            "token sent again",
            "A token was sent once more because its taker did not show itself. A warning from 3 and 1 in 100 tokens "
            "to it on. Only noted where its taker was never heard: a ring does not keep one that is not there, so it "
            "is this tap that does not hear it.",
            "a master that is slower than the slot time, disturbed, or gone",
            "slot time in both projects; connector and terminators at that master",
        ),
        Rule(
            "PB015",
            Severity.ERROR,
            "speaks without the token",
            "A master sends requests while another one holds the token, at least three times, with nothing damaged "
            "between token and request, and the other one then goes on with the token, which had not come back to it: "
            "else a token may have been missed at this tap. Only noted where it is fewer than 1 in 100 of what that "
            "master sends.",
            "two masters that do not see each other, one with other bus parameters, or a master's address twice",
            "the bus parameters and addresses of all masters; take off the one that was added last",
            explains=("PB002", "PB003", "PB007", "PB008", "PB013", "PB014", *_LINE, "LN302", "LN303"),
        ),
        Rule(
            "PB016",
            Severity.INFO,
            "GAP polls find nobody",
            "A master looks for other masters at addresses where none is. That is its duty, and costs time. One that "
            "passes no token looks for its slaves so; noted where it finds none.",
            "the usual case; the highest station address is larger than it need be",
            "a lower highest station address (HSA) in the project saves the time",
        ),
        Rule(
            "PB017",
            Severity.NOTE,
            "requests refused",
            "A station answers with an error: service not activated (RS), no resources (RR), user error (UE). A "
            "warning from 3 and 1 in 100 requests for data exchange on, without those that show that it left data "
            "exchange and need not be at fault (PB007); other services a device need not have.",
            "a service that the device does not have, or one that it cannot do in its present state",
            "which service is refused, and in which state the slave is",
        ),
        Rule(
            "PB018",
            Severity.NOTE,
            "slower than usual",
            "Even the smallest reading of one answer in ten or more is above the longest station delay (max TSDR) of "
            "the device's GSD, or where none is given above the usual one: 60 bit times up to 187.5 kBd, 100 at 500 "
            "kBd, 150 at 1.5 MBd, 250 at 3 MBd, 450 at 6 MBd, 800 at 12 MBd. Only where the adapter tells times that "
            "exactly.",
            "a slow device, a repeater or a converter in between",
            "MaxTsdr in the GSD file of the device, and the slot time of the project",
        ),
        Rule(
            "PB019",
            Severity.WARNING,
            "master silent for too long",
            "A master asked nothing for longer than the watchdog that it had given its slaves, by the smallest reading "
            "of the time and with nothing damaged, and a slave had left data exchange by then, as it must. A single "
            "time it is only noted.",
            "the controller was stopped, restarted or too busy, or the token came round too late",
            "what the controller did then; the watchdog time of the project against the time of a round",
            explains=("PB007", "PB017"),
        ),
        Rule(
            "PB020",
            Severity.WARNING,
            "damaged always in the same way",
            "Answers of one station that are right but for their sum (FCS): at least five, and 3 in 4 of its damaged "
            "ones, with no line error, differ from the right one by the same number though they say different things, "
            "are made by another rule each time (exclusive or, a complement, zeros or ones), or are octet for octet "
            "the same; or so many lack one and the same octet, or have it spoilt. Noise changes other bits each time.",
            "the device computes its sum otherwise; or a driver that is switched too late or too soon",
            "the device's firmware; whether something on the way changes or swallows octets",
            explains=("PB001", "PB002", "PB003", "PB007", "PB008", *_LINE),
        ),
        Rule(
            "PB021",
            Severity.ERROR,
            "keeps the token",
            "A master that used to pass the token on asks on for more than a second, and ten times the longest round "
            "before, up to the end, and passes no token, with nothing damaged. The others cannot speak meanwhile.",
            "its firmware hangs in one task, or it has begun to work as the only master",
            "restart that master; its bus parameters (target rotation time, highest station address)",
            explains=("PB013", "PB019"),
        ),
        Rule(
            "PB022",
            Severity.ERROR,
            "does not come into data exchange",
            "A slave took its parameters, three times and more led to no data exchange, or to a single answer, with "
            "nothing damaged, and it is still so; its newest diagnosis names no reason that another finding has "
            "(parameters, configuration, ident number, another master). A warning where it was configured once and has "
            "said for ten seconds and more that it is not ready, or has no valid data (static diagnosis).",
            "the device waits for something of its own (a module, a supply, a setting), or takes other lengths of data "
            "than the project has",
            "what the device itself shows; its modules and their lengths in the project; its power and its settings",
            explains=("PB002", "PB009", "PB017"),
        ),
    )
}
"""The catalogue, by code."""

USUAL_TSDR = ((187_500, 60), (500_000, 100), (1_500_000, 150), (3_000_000, 250), (6_000_000, 450), (12_000_000, 800))
"""Up to which rate, how many bit times."""


def usual_tsdr(baud: int) -> int:
    """The usual longest station delay, bit times."""
    return next((bits for most, bits in USUAL_TSDR if baud <= most), USUAL_TSDR[-1][1])
