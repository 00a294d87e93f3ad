"""The rules of answers (MS3), parts of `rules.py`: none, late, postponed, refused, misplaced."""

from __future__ import annotations

from dissectors.bacnet.findings_of_routers import ROUTER_RULES
from dissectors.findings import Rule, Severity

ANSWER_RULES = (
    Rule(
        "MS301",
        Severity.WARNING,
        "no answer",
        "A Data Expecting Reply was followed neither by data nor by Reply Postponed. A single one, or fewer than 1 "
        "in 100 and not surely over two a minute, is only noted, where no quarter of an hour had 52, or ten and 1 in "
        "20.",
        "the station is off, busy or at another address; or the answer was lost on the line",
        "whether it answers other requests; damaged frames at the same time",
    ),
    Rule(
        "MS302",
        Severity.WARNING,
        "late answer",
        "An answer came later than 250 ms (Treply_delay) after the request; the asker gives up at 255 … 300 ms. "
        "A single one, or fewer than 1 in 100 and not surely over two a minute, is only noted.",
        "the station should send Reply Postponed; its late answer collides with the next token",
        "load and firmware of the station",
    ),
    Rule(
        "MS303",
        Severity.NOTE,
        "many postponed replies",
        "More than one request in 10 was answered with Reply Postponed.",
        "the station does not answer at once, or passes requests on behind a router; its answers wait until it has the "
        "token, however soon they are ready",
        "how long the real answers take: well below 250 ms (Treply_delay) it could have answered at once; its firmware "
        "and load; polling rate of the clients",
    ),
    Rule(
        "MS304",
        Severity.NOTE,
        "broadcast that asks for a reply",
        "A Data Expecting Reply to address 255: nobody may answer it.",
        "an error in the sending station's software",
        "its firmware",
    ),
    Rule(
        "MS305",
        Severity.WARNING,
        "error answer",
        "A station answers a request with Error, Reject or Abort (ASHRAE 135, clause 18), counted "
        "by service, error class and code. A single one is only noted; so is what a station says it has not where each "
        "thing is asked for once, and, once for all, where each of several stations says so: somebody looks what there "
        "is.",
        "the station heard the request well and refuses it; class and code say why",
        "object, property and service asked for, against what the device has; take what it has not out of the client",
    ),
    Rule(
        "MS306",
        Severity.WARNING,
        "answers what others are asked",
        "An answer with the invoke id and the service of a request to another station on this bus, sent while that one "
        "was to answer or directly behind its answer. The client gives each request an id of its own. Fewer than three "
        "times it is only noted; what comes from behind routers does not count.",
        "a program that takes every request for its own, whoever it is addressed to; its answers run into those of the "
        "station that was asked",
        "firmware of the station named: it must look at the destination of what it hears",
        explains=("MS104", "MS301", "MS401", "MS402", "MS403", "MS406", "LN101", "LN103", "LN2"),
    ),
    Rule(
        "MS307",
        Severity.WARNING,
        "does not wait for answers",
        "A station that asked went on after the same short wait again and again; three answers and more came behind "
        "that, or whoever was asked hardly ever answers so soon. Who asks must wait for at least 255 ms "
        "(Treply_timeout); the answer may take up to 250 ms.",
        "the timeout for replies is set too short in the station named; the answers come when another may send, and "
        "run into its frames",
        "that station's timeout for replies (255 to 300 ms) and its firmware; those who answer are in time",
        explains=("MS101", "MS301", "MS401", "MS402", "MS403", "LN101", "LN103", "LN2"),
    ),
    Rule(
        "MS308",
        Severity.WARNING,
        "answers into what comes next",
        "Damage within 250 ms after the answer of a station should have come (250 ms, Treply_delay), far more often "
        "than chance brings (under 1 in 500), where half of the damaged frames and more stand so: three times of a "
        "station that is heard to answer late, five times of one that is not, where it is hardly ever behind requests "
        "to others. Where that is so of several, alone or together, one finding names the bus and says who they are.",
        "the station answers when another one has the token, and its answers run into the frames of others, who are "
        "not to blame",
        "load and firmware of the station named: it must answer within 250 ms or send Reply Postponed (ASHRAE 135, "
        "9.5.3); nobody else's cable",
        explains=(
            *("MS101", "MS102", "MS301", "MS302", "MS401", "MS402", "MS403", "MS405", "MS407"),
            *("LN101", "LN103", "LN2", "LN305"),
        ),
    ),
    *ROUTER_RULES,
    Rule(
        "MS311",
        Severity.WARNING,
        "postponed and never answered",
        "A station sent Reply Postponed, and no answer within 10 s. A single one, or fewer than 1 in 20 of what it "
        "postponed, is only noted; what a router postpones for stations behind it is not judged.",
        "a program that is too slow or loses what it has to answer; who asked waits until its own timeout",
        "firmware and load of the station; how many requests it gets at once",
        explains=("MS303",),
    ),
    Rule(
        "MS312",
        Severity.WARNING,
        "answers to another address",
        "The station that was asked sent the answer, known by invoke id and service, at once, but to another address "
        "than the request came from. Fewer than three times it is only noted; what routers pass on does not count.",
        "an error in the station's program; who asked waits in vain, or lets go of its token, as it must when it hears "
        "what is not for it (ASHRAE 135, 9.5.6, WAIT_FOR_REPLY)",
        "firmware of the station named: an answer goes to the source of the request",
        explains=("MS101", "MS105", "MS106", "MS301"),
    ),
    Rule(
        "MS313",
        Severity.WARNING,
        "answers with another number",
        "A station answers a request at once, but with an invoke id that none of the requests to it has that are open: "
        "at least three times, and clearly more often than frames were not heard. What routers pass on does not count.",
        "a program that mixes up its answers, or keeps the number of an older request (ASHRAE 135, 20.1): who asked "
        "drops them, asks again, and takes the station for dead",
        "firmware of the station named, or of the gateway that answers for it; the timeout and the repeats of who asks",
    ),
)
